"""The command line's texts → Choices, with their units."""

from collections.abc import Mapping, Sequence
from typing import Any

from afo_sim.common.errors import InputError
from afo_sim.common.units import parse_quantity
from afo_sim.gait.readers.choices import Choices

QUANTITIES = {
    "mass": "kg",
    "belt_speed": "m/s",
    "cutoff": "Hz",
    "thigh": "m",
    "shank": "m",
    "ankle_height": "m",
}
PLAIN = ("side", "stride", "forward", "up", "source", "licence")


def read_options(given: Mapping[str, Any]) -> Choices:
    """Choices from options as a person types them.

    Parameters
    ----------
    given : option names with "_" for "-": texts such as "72 kg", None where the option was not given;
        "marker" a list of "ROLE=NAME" or "ROLE=NAME,NAME", "plate" a list of names, "hip" two lengths,
        "angles" "deg" or "rad", "ankle_zero" "flat" or "file"

    Raises
    ------
    InputError
        An option is no quantity, no choice, or out of range.
    """
    values: dict[str, Any] = {name: given[name] for name in PLAIN if given.get(name) is not None}
    for name, unit in QUANTITIES.items():
        if given.get(name) is not None:
            values[name] = _quantity(name, given[name], unit)
    if given.get("hip") is not None:
        values["hip"] = tuple(_quantity("hip", text, "m") for text in given["hip"])
    if given.get("angles") is not None:
        values["degrees"] = _choice("angles", given["angles"], {"deg": True, "rad": False})
    zero = given.get("ankle_zero", "flat")
    values["keep_zero"] = _choice("ankle_zero", zero, {"flat": False, "file": True})
    values["markers"] = _markers(given.get("marker") or ())
    return Choices(plates=tuple(given.get("plate") or ()), **values)


def _quantity(name: str, text: str, unit: str) -> float:
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(str(error), field=name, value=text) from None


def _choice(name: str, text: str, choices: Mapping[str, bool]) -> bool:
    if text not in choices:
        raise InputError("is no choice", field=name, value=text, allowed=", ".join(choices))
    return choices[text]


def _markers(texts: Sequence[str]) -> dict[str, tuple[str, ...]]:
    found = {}
    for text in texts:
        role, equals, names = text.partition("=")
        if not equals or not names.strip():
            raise InputError("is not ROLE=NAME", field="marker", value=text, allowed="ankle=R.Ankle.Lat")
        found[role.strip()] = tuple(name.strip() for name in names.split(","))
    return found

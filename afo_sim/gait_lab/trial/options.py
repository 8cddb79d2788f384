"""The command line's texts → Choices, with their units."""

from collections.abc import Mapping, Sequence
from typing import Any

from afo_sim.common.errors import InputError, unknown
from afo_sim.common.units import parse_quantity
from afo_sim.gait_lab.trial.choices import SIDES, Choices

QUANTITIES = {  # option: (SI unit, how a person writes it)
    "mass": ("kg", "72 kg"),
    "height": ("m", "1.72 m"),
    "sole": ("m", "25 mm"),
    "belt_speed": ("m/s", "1.2 m/s"),
    "cutoff": ("Hz", "6 Hz"),
    "thigh": ("m", "43 cm"),
    "shank": ("m", "43 cm"),
    "hip": ("m", "-6.3 cm"),
    "ankle_height": ("m", "7 cm"),
}
HIGHEST_CUTOFF = 50.0  # above it a low-pass leaves walking as noisy as it is; 6 Hz is usual, assumed [Hz]
PLAIN = ("forward", "up", "source", "licence", "map", "model", "static")


def read_options(given: Mapping[str, Any]) -> Choices:
    """Choices from options as a person types them.

    Parameters
    ----------
    given : option names with "_" for "-": texts such as "72 kg", None where the option was not given;
        "side" "right", "left" or "both", "stride" a number or "mean", "map", "model" and "static" paths,
        "marker" a list of "ROLE=NAME" or "ROLE=NAME,NAME", "plate" a list of names, "hip" two lengths,
        "angles" "deg" or "rad", "ankle_zero" "flat" or "file"

    Raises
    ------
    InputError
        An option is no quantity, no choice, or out of range.
    """
    values: dict[str, Any] = {name: given[name] for name in PLAIN if given.get(name) is not None}
    for name in QUANTITIES:
        text = given.get(name)
        if text is not None:
            values[name] = (
                tuple(_quantity(name, each) for each in text) if name == "hip" else _quantity(name, text)
            )
    if values.get("cutoff", 0.0) > HIGHEST_CUTOFF:
        usual = "6 Hz, as is usual for walking; 0 Hz leaves the data alone"
        raise InputError(
            f"is above {HIGHEST_CUTOFF:g} Hz", field="cutoff", value=given["cutoff"], allowed=usual
        )
    if given.get("angles") is not None:
        values["degrees"] = _choice("angles", given["angles"], {"deg": True, "rad": False})
    zero = given.get("ankle_zero", "flat")
    values["keep_zero"] = _choice("ankle_zero", zero, {"flat": False, "file": True})
    values["markers"] = _markers(given.get("marker") or ())
    values |= _sides(given.get("side")) | _strides(given.get("stride"))
    return Choices(plates=tuple(given.get("plate") or ()), **values)


def _sides(text: str | None) -> dict[str, Any]:
    """The side, or both: the right leg's strides and the left one's mirrored, as one mean."""
    if text not in (None, "both", *SIDES):
        raise unknown(text, (*SIDES, "both"), field="side")
    return {"both": True} if text == "both" else {} if text is None else {"side": text}


def _strides(text: str | None) -> dict[str, Any]:
    if text is None:
        return {}
    if text == "mean":
        return {"mean": True}
    try:
        return {"stride": int(text)}
    except ValueError:
        raise InputError("is no stride", field="stride", value=text, allowed="1, 2, …, mean") from None


def _quantity(name: str, text: str) -> float:
    """A quantity in SI; a refusal shows how this option is written."""
    unit, example = QUANTITIES[name]
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        problem, likened, _ = str(error).partition('write it like "')
        problem += f'{likened}{example}"' if likened else ""
        raise InputError(problem, field=name, value=text) from None


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

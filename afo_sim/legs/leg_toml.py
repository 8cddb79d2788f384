"""Texts beside an imported leg: its description with the source of each number, and its README."""

from collections.abc import Iterator
from typing import Any

from afo_sim.common.units import format_quantity
from afo_sim.description.portable import toml_text
from afo_sim.legs.cutting import ANKLE, FOOT, SHANK, TOE, TOES
from afo_sim.legs.finding import Found
from afo_sim.legs.leg_numbers import LegNumbers
from afo_sim.legs.tree import Joint, Tree

SHANK_SHARE, FOOT_SHARE = 0.0465, 0.0145  # of the body's mass (Winter 2009, after Dempster)
SHANK_LENGTH = 0.246  # of the body's height (Winter 2009, after Drillis & Contini)
BODY_MASS, BODY_HEIGHT = 75.0, 1.75  # of the description, where nothing is told
APART = 0.15  # relative: more than people of one mass differ in
DAMPING = 0.5  # [N·m·s/rad] of a relaxed ankle
RELAXED = 8.0, 40.0  # stiffness at zero of the tissue below, knee bent by 90 deg and straight [N·m/rad]
RIENER = "Riener & Edrich 1999, healthy mean (n = 10)"
PREDSIM = "as in the walking models of PredSim (Falisse et al. 2022)"


def leg_toml(
    name: str, leg: Tree, found: Found, source: str, body_mass: float | None, body_height: float | None
) -> str:
    """A leg's description as TOML, each number with its source.

    Units: body_mass, body_height [kg].
    """
    ankle = leg.joints()[ANKLE][1]
    table: dict[str, Any] = {
        "name": name,
        "description": f"{found.side} leg of {source}",
        "file": "leg.xml",
        "shank": SHANK,
        "foot": FOOT,
        "ankle": ANKLE,
        "side": found.side,
        "damping": _damping(ankle, source),
        "body_mass": _person(body_mass, BODY_MASS, "kg"),
        "body_height": _person(body_height, BODY_HEIGHT, "m"),
    }
    for key, length in (("shank_length", found.shank_length), ("foot_length", found.foot_length)):
        if length is not None and 0.0 < length <= (1.0 if key == "shank_length" else 0.6):
            how = "from the ankle to the knee" if key == "shank_length" else "from end to end of the shapes"
            table[key] = _number(length, "m", "derived", f"{how}, in {source}")
    table["passive"] = _passive(ankle, source)
    if TOES in leg.parts:
        table["toes"] = _toes(leg.joints()[TOE][1], source)
    return "\n".join(_lines(table)) + "\n"


def _lines(table: dict[str, Any]) -> Iterator[str]:
    """A table as TOML, a line for each number with its source."""
    for key, value in table.items():
        if key in ("passive", "toes"):
            yield from ("", f"[{key}]", *_lines(value))
        elif isinstance(value, dict):
            inner = ", ".join(f"{name} = {_text(item)}" for name, item in value.items())
            yield f"{key} = {{ {inner} }}"
        else:
            yield f"{key} = {_text(value)}"


def _text(value: str | float) -> str:
    return toml_text({"x": value}).partition("=")[2].strip()


def _number(value: float, unit: str, kind: str, source: str) -> dict[str, Any]:
    text = format_quantity(value, unit) if unit else value
    return {"value": text, "kind": kind, "source": source}


def _damping(ankle: Joint, source: str) -> dict[str, Any]:
    unit = "N*m*s/rad"
    if ankle.damping > 0.0:
        return _number(ankle.damping, unit, "user", f"the ankle's damping in {source}")
    why = f"relaxed ankle 0.2 to 1.0; middle of that range; {source} has none"
    return _number(DAMPING, unit, "assumed", why)


def _person(given: float | None, default: float, unit: str) -> dict[str, Any]:
    if given is not None:
        return _number(given, unit, "user", "told at the import")
    return _number(default, unit, "assumed", "nobody told it at the import")


def _passive(ankle: Joint, source: str) -> dict[str, Any]:
    if ankle.stiffness > 0.0:
        why = (
            f"{source} has a spring of {ankle.stiffness:g} N*m/rad in the ankle, which stays: tissue on top "
        )
        return {"scale": _number(0.0, "", "derived", why + "would count twice")}
    return {
        "scale": _number(1.0, "", "published", RIENER),
        "offset": {
            "value": "0 deg",
            "kind": "assumed",
            "source": "the zero of the ankle angle differs by 5 to 8 deg between laboratories",
        },
    }


def _toes(joint: Joint, source: str) -> dict[str, Any]:
    stiff = (
        _number(joint.stiffness, "N*m/rad", "user", f"the toes' spring in {source}")
        if 1.0 <= joint.stiffness <= 1e3
        else _number(25.0, "N*m/rad", "assumed", PREDSIM)
    )
    damped = (
        _number(joint.damping, "N*m*s/rad", "user", f"the toes' damping in {source}")
        if 0.0 < joint.damping <= 100.0
        else _number(0.2, "N*m*s/rad", "assumed", "about critical for the shipped leg's toes")
    )
    return {"body": TOES, "joint": TOE, "stiffness": stiff, "damping": damped}


def person_notes(
    numbers: LegNumbers, found: Found, body_mass: float | None, body_height: float | None
) -> list[str]:
    """What masses and lengths tell of the person, where that differs from what is told or assumed."""
    said = []
    of_shank, of_foot = numbers.shank.mass / SHANK_SHARE, numbers.foot.mass / FOOT_SHARE
    mass = BODY_MASS if body_mass is None else body_mass
    if max(abs(of_shank / mass - 1.0), abs(of_foot / mass - 1.0)) > APART:
        said.append(
            f"a shank of {numbers.shank.mass:.3g} kg is that of a person of {of_shank:.0f} kg, a foot of "
            f"{numbers.foot.mass:.3g} kg of one of {of_foot:.0f} kg (0.0465 and 0.0145 of the body, Winter); "
            f"{'assumed' if body_mass is None else 'told'} are {mass:g} kg"
        )
    height = BODY_HEIGHT if body_height is None else body_height
    if found.shank_length is not None:
        tall = found.shank_length / SHANK_LENGTH
        if abs(tall / height - 1.0) > APART:
            said.append(
                f"a shank of {found.shank_length:.3f} m is that of a person of {tall:.2f} m (0.246 of the "
                f"height, Winter); {'assumed' if body_height is None else 'told'} are {height:g} m"
            )
    return said


def tissue_notes(leg: Tree) -> list[str]:
    """What to know of a file's own spring, in whose place no tissue is added."""
    ankle = leg.joints()[ANKLE][1]
    if not ankle.stiffness > 0.0:
        return []
    return [
        f"the file's ankle has a spring of {ankle.stiffness:.3g} N*m/rad, and so no passive tissue is added; "
        f"a healthy ankle's has {RELAXED[0]:g} N*m/rad at zero with the knee bent, {RELAXED[1]:g} with it "
        "straight: is the spring a person's tissue, or there for a solver or a robot? "
        "--set leg.passive.scale=1 adds the tissue"
    ]


def leg_readme(
    name: str, rows: list[tuple[str, str, str]], notes: tuple[str, ...], source: str, picture: bool
) -> str:
    """README of an imported leg: where it is from, its table, what is to be known."""
    lines = [f"# {name}", "", f"Cut out of `{source}` by `afo-sim leg import`.", ""]
    if picture:
        lines += ["![The leg from the side and from ahead](leg.png)", ""]
    lines += ["| | | how it was found |", "|---|---|---|"]
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    if notes:
        lines += ["", *(f"- {note}" for note in notes)]
    lines += [
        "",
        "Origin of shank and foot: the ankle joint; x forward, y left, z up. Dorsiflexion is positive.",
        "`leg.toml` holds the joint's damping; the number in `leg.xml` is the same and is not added to it.",
        "",
    ]
    return "\n".join(lines)

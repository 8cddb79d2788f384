"""Texts beside an imported leg: its table, its TOML with the source of each number, its README."""

from collections.abc import Iterator

import numpy as np

from afo_sim.common import JsonDict, Notice, format_quantity
from afo_sim.description import MASS_SHARES, toml_text
from afo_sim.legs.cutting import ANKLE, FOOT, SHANK, SOLE_SHARES, TOE, TOES
from afo_sim.legs.finding import Found
from afo_sim.legs.leg_numbers import LegNumbers, Segment
from afo_sim.legs.tree import Joint, Tree, listed

SHANK_LENGTH = 0.246  # of the body's height (Winter 2009, after Drillis & Contini)
BODY_MASS, BODY_HEIGHT = 75.0, 1.75  # of the description, where nothing is given
APART = 0.15  # relative: more than people of one mass differ in
DAMPING = 0.5  # [N·m·s/rad] of a relaxed ankle
RELAXED = 8.0, 40.0  # stiffness at zero of the tissue below, knee bent by 90 deg and straight [N·m/rad]
RIENER = "Riener & Edrich 1999, healthy mean (n = 10)"
PREDSIM = "as in the walking models of PredSim (Falisse et al. 2022)"
Row = tuple[str, str, str]


def table(
    leg: Tree, found: Found, numbers: LegNumbers, sole: str, toes: str | None,
    left: dict[str, tuple[str, ...]],
) -> list[Row]:  # fmt: skip
    """Rows of what, how much, and how it was found."""
    how = found.how
    turned = "as in the file" if found.sign > 0.0 else "turned round: the file's is plantarflexion positive"
    sole_at_zero = "unknown" if found.sole is None else f"{np.degrees(found.sole):+.1f} deg"
    toe_up = "toe up against the perpendicular to the shank, from the foot's shapes"
    rows = [
        ("shank", found.shank, how["shank"]),
        ("foot", found.foot, how["foot"]),
        ("ankle", found.ankle, how["ankle"]),
        ("side", found.side, how["side"]),
        ("up", _vector(found.axes[:, 2]), how["up"]),
        ("forward", _vector(found.axes[:, 0]), how["forward"]),
        ("ankle's axis in the file", _vector(-found.sign * found.axes[:, 1]), turned),
        ("ankle's axis here", "(0, −1, 0)", "dorsiflexion positive"),
        ("its tilt", f"{np.degrees(found.tilt):.2f} deg", "against the perpendicular to the shank"),
        ("zero", f"{np.degrees(found.zero):.4g} deg of the file's", "where both have parallel axes"),
        ("sole at zero", sole_at_zero, toe_up),
        *_segment("shank", numbers.shank),
        *_segment("foot", numbers.foot),
        (
            "inertia of the foot about the ankle",
            f"{numbers.about_ankle:.4g} kg·m²",
            "with all that hangs on it",
        ),
        *_ankle(leg, numbers),
    ]
    if found.shank_length is not None:
        rows.append(("length of the shank", f"{found.shank_length:.4g} m", "from the ankle to the knee"))
    if found.foot_length is not None:
        rows.append(("length of the foot", f"{found.foot_length:.4g} m", "of its shapes, along forward"))
    points = [name for part in leg.parts.values() for name in part.points if name in SOLE_SHARES]
    rows.append(("points of the sole", ", ".join(points) or "none", sole))
    kept = [name for name in found.welded if name != toes]
    if kept:
        rows.append(("welded", listed(kept, 6), "joints beside the ankle"))
    if toes:
        rows.append(("toes", toes, "kept as the hinge of the toes, its axis taken as transverse"))
    for kind, names in left.items():
        rows.append((f"left behind: {kind}", f"{len(names)}", listed(names, 6)))
    return rows


def _segment(name: str, segment: Segment) -> list[Row]:
    return [
        (f"mass of the {name}", f"{segment.mass:.4g} kg", "with all that is fixed to it"),
        ("its centre of mass", f"{_vector(1e3 * segment.centre, 1)} mm", "from the ankle: forward, left, up"),
    ]


def _ankle(leg: Tree, numbers: LegNumbers) -> list[Row]:
    joint = leg.joints()[ANKLE][1]
    low, high = np.degrees(numbers.range)
    rows = [("range", f"{low:.4g} to {high:.4g} deg", "plantarflexion negative")]
    for word, value, unit in (
        ("damping", joint.damping, "N·m·s/rad"),
        ("friction", joint.friction, "N·m"),
        ("armature", joint.armature, "kg·m²"),
        ("spring", joint.stiffness, "N·m/rad"),
    ):
        if value:
            rows.append((word, f"{value:.4g} {unit}", "of the file's ankle"))
    if not joint.damping:
        rows.append(("damping", "0.5 N·m·s/rad", "assumed: the file has none"))
    if joint.stiffness:
        rows.append(("passive tissue", "none", "the file's spring stays, and tissue would count twice"))
    return rows


def _vector(vector: np.ndarray, digits: int = 3) -> str:
    return "(" + ", ".join(f"{value + 0.0:.{digits}f}" for value in np.round(vector, digits)) + ")"


def leg_toml(
    name: str, leg: Tree, found: Found, source: str, body_mass: float | None, body_height: float | None
) -> str:
    """A leg's description as TOML, each number with its source."""
    ankle, unit = leg.joints()[ANKLE][1], "N*m*s/rad"
    if ankle.damping > 0.0:
        damping = _number(ankle.damping, unit, "user", f"the ankle's damping in {source}")
    else:
        why = f"relaxed ankle 0.2 to 1.0; middle of that range; {source} has none"
        damping = _number(DAMPING, unit, "assumed", why)
    table: JsonDict = {
        "name": name,
        "description": f"{found.side} leg of {source}",
        "file": "leg.xml",
        "shank": SHANK,
        "foot": FOOT,
        "ankle": ANKLE,
        "side": found.side,
        "damping": damping,
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


def _lines(table: JsonDict) -> Iterator[str]:
    for key, value in table.items():
        if key in ("passive", "toes"):
            yield from ("", f"[{key}]", *_lines(value))
        elif isinstance(value, dict):
            inner = ", ".join(f"{name} = {_text(item)}" for name, item in value.items())
            yield f"{key} = {{ {inner} }}"
        else:
            yield f"{key} = {_text(value)}"


def _text(value: str | float) -> str:
    return toml_text({"x": value}, exact=False).partition("=")[2].strip()


def _number(value: float, unit: str, kind: str, source: str) -> JsonDict:
    text = format_quantity(value, unit) if unit else value
    return {"value": text, "kind": kind, "source": source}


def _person(given: float | None, default: float, unit: str) -> JsonDict:
    if given is not None:
        return _number(given, unit, "user", "given at the import")
    return _number(default, unit, "assumed", "not given at the import")


def _passive(ankle: Joint, source: str) -> JsonDict:
    if ankle.stiffness > 0.0:
        why = f"{source} has a spring of {ankle.stiffness:g} N*m/rad in the ankle, which stays: tissue on "
        return {"scale": _number(0.0, "", "derived", why + "top would count twice")}
    differs = "the zero of the ankle angle differs by 5 to 8 deg between laboratories"
    offset = {"value": "0 deg", "kind": "assumed", "source": differs}
    return {"scale": _number(1.0, "", "published", RIENER), "offset": offset}


def _toes(joint: Joint, source: str) -> JsonDict:
    stiff = _number(25.0, "N*m/rad", "assumed", PREDSIM)
    if 1.0 <= joint.stiffness <= 1e3:
        stiff = _number(joint.stiffness, "N*m/rad", "user", f"the toes' spring in {source}")
    damped = _number(0.2, "N*m*s/rad", "assumed", "about critical for the shipped leg's toes")
    if 0.0 < joint.damping <= 100.0:
        damped = _number(joint.damping, "N*m*s/rad", "user", f"the toes' damping in {source}")
    return {"body": TOES, "joint": TOE, "stiffness": stiff, "damping": damped}


def person_notes(
    numbers: LegNumbers, found: Found, body_mass: float | None, body_height: float | None
) -> list[Notice]:
    """The person that masses and lengths belong to, where it differs from the given or assumed one."""
    said = []
    of_shank, of_foot = numbers.shank.mass / MASS_SHARES["shank"], numbers.foot.mass / MASS_SHARES["foot"]
    mass = BODY_MASS if body_mass is None else body_mass
    if max(abs(of_shank / mass - 1.0), abs(of_foot / mass - 1.0)) > APART:
        words = f"a shank of {numbers.shank.mass:.3g} kg is that of a person of {of_shank:.0f} kg, a foot of "
        words += f"{numbers.foot.mass:.3g} kg of one of {of_foot:.0f} kg (0.0465 and 0.0145 of the body, "
        words += f"Winter); {'assumed' if body_mass is None else 'given'} are {mass:g} kg"
        said.append(
            Notice("mass-unlike", words, subject="body_mass", shank=of_shank, foot=of_foot, mass=mass)
        )
    height = BODY_HEIGHT if body_height is None else body_height
    if found.shank_length is not None:
        tall = found.shank_length / SHANK_LENGTH
        if abs(tall / height - 1.0) > APART:
            words = f"a shank of {found.shank_length:.3f} m is that of a person of {tall:.2f} m (0.246 of "
            words += f"the height, Winter); {'assumed' if body_height is None else 'given'} are {height:g} m"
            said.append(Notice("height-unlike", words, subject="body_height", shank=tall, height=height))
    return said


def tissue_notes(leg: Tree) -> list[Notice]:
    """A notice on a file's own spring, beside which no tissue is added."""
    ankle = leg.joints()[ANKLE][1]
    if not ankle.stiffness > 0.0:
        return []
    words = "the file's ankle has a spring of {stiffness:.3g} N*m/rad, and so no passive tissue is added; a "
    words += f"healthy ankle's has {RELAXED[0]:g} N*m/rad at zero with the knee bent, {RELAXED[1]:g} with it "
    words += "straight: is the spring a person's tissue, or there for a solver or a robot? --set "
    words += "leg.passive.scale=1 adds the tissue"
    return [Notice("ankle-spring", words, subject="leg.passive", stiffness=ankle.stiffness)]


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

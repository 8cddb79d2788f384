"""What was found and cut out, as rows of a table."""

import numpy as np

from afo_sim.legs.cutting import ANKLE
from afo_sim.legs.finding import Found
from afo_sim.legs.leg_numbers import LegNumbers, Segment
from afo_sim.legs.names import listed
from afo_sim.legs.tree import Tree

Row = tuple[str, str, str]


def table(
    leg: Tree,
    found: Found,
    numbers: LegNumbers,
    sole: str,
    toes: str | None,
    left: dict[str, tuple[str, ...]],
    opinion: tuple[str, ...] | None,
) -> list[Row]:
    """Rows of what, how much, and how it was found."""
    how = found.how
    rows = [
        ("shank", found.shank, how["shank"]),
        ("foot", found.foot, how["foot"]),
        ("ankle", found.ankle, how["ankle"]),
        ("side", found.side, how["side"]),
        ("up", _vector(found.axes[:, 2]), how["up"]),
        ("forward", _vector(found.axes[:, 0]), how["forward"]),
        *_axis(found),
        *_segment("shank", numbers.shank),
        *_segment("foot", numbers.foot),
        (
            "inertia of the foot about the ankle",
            f"{numbers.about_ankle:.4g} kg·m²",
            "with all that hangs on it",
        ),
        *_ankle(leg, found, numbers),
        *_lengths(found),
        ("points of the sole", ", ".join(_points(leg)) or "none", sole),
    ]
    kept = [name for name in found.welded if name != toes]
    if kept:
        rows.append(("welded", listed(kept, 6), "joints beside the ankle"))
    if toes:
        rows.append(("toes", toes, "kept as the hinge of the toes, its axis taken as transverse"))
    for kind, names in left.items():
        rows.append((f"left behind: {kind}", f"{len(names)}", listed(names, 6)))
    if opinion is not None:
        told = "; ".join(opinion[:3]) + (f"; and {len(opinion) - 3} more" if len(opinion) > 3 else "")
        rows.append(("MuJoCo's own URDF reader", "differs" if opinion else "agrees", told or "to 1e-6"))
    return rows


def _axis(found: Found) -> list[Row]:
    turned = "as in the file" if found.sign > 0.0 else "turned round: the file's is plantarflexion positive"
    before = -found.sign * found.axes[:, 1]
    return [
        ("ankle's axis in the file", _vector(before), turned),
        ("ankle's axis here", "(0, −1, 0)", "dorsiflexion positive"),
        ("its tilt", f"{np.degrees(found.tilt):.2f} deg", "against the perpendicular to the shank"),
        (
            "zero",
            f"{np.degrees(found.zero):.4g} deg of the file's",
            "where both have parallel axes",
        ),
        (
            "sole at zero",
            "unknown" if found.sole is None else f"{np.degrees(found.sole):+.1f} deg",
            "toe up against the perpendicular to the shank, from the foot's shapes",
        ),
    ]


def _segment(name: str, segment: Segment) -> list[Row]:
    return [
        (f"mass of the {name}", f"{segment.mass:.4g} kg", "with all that is fixed to it"),
        ("its centre of mass", f"{_vector(1e3 * segment.centre, 1)} mm", "from the ankle: forward, left, up"),
    ]


def _ankle(leg: Tree, found: Found, numbers: LegNumbers) -> list[Row]:
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


def _lengths(found: Found) -> list[Row]:
    rows = []
    if found.shank_length is not None:
        rows.append(("length of the shank", f"{found.shank_length:.4g} m", "from the ankle to the knee"))
    if found.foot_length is not None:
        rows.append(("length of the foot", f"{found.foot_length:.4g} m", "of its shapes, along forward"))
    return rows


def _points(leg: Tree) -> list[str]:
    return [
        name for part in leg.parts.values() for name in part.points if name in ("heel", "ball", "pulp", "tip")
    ]


def _vector(vector: np.ndarray, digits: int = 3) -> str:
    return "(" + ", ".join(f"{value + 0.0:.{digits}f}" for value in np.round(vector, digits)) + ")"

"""The leg alone, cut out of a tree, with the sole's points; x forward, y left, z up from the ankle."""

import dataclasses
import re

import numpy as np

from afo_sim.common import InputError
from afo_sim.legs.extent import lower_edge, outline
from afo_sim.legs.finding import KNEE, STEEPEST, Found, knee_of
from afo_sim.legs.tree import (
    LEAST_INERTIA,
    Joint,
    Part,
    Tree,
    free_name,
    listed,
    moved,
    pose_of,
    turned_about,
)
from afo_sim.model import OLD_TOE, POINTS

SHANK, FOOT, ANKLE = "shank", "foot", "ankle"
TOES, TOE = "toes", "toe"
HEIGHT = 0.30  # [m] of the ankle above the floor, as the shipped leg hangs
NARROWEST = np.radians(2.0)  # of an ankle's range; less is radians that were read as degrees
ROUNDED = 2e-5  # relative: CAD programs write six digits, which a thin plate's moments break the rule by
RIGHTWARD = np.array([0.0, -1.0, 0.0])
# Names that the model gives to its own bodies, joints and sites, or puts before those of cuff and plate.
TAKEN = {SHANK, FOOT, ANKLE, TOES, TOE, "world", "sink", "ground", "shank_x", "shank_z", "shank_angle"}
# Beginnings of names of cuff, plate, sole and shoe, and numbers of muscles: dorsiflexor_1_origin.
LIKE_OURS = re.compile(r"^(cuff|plate|sole|shoe|pad|floor|drive)|_\d+(_|$)")
# Share of the foot's length from its hindmost to its foremost point, as of the shipped adult leg.
SOLE_SHARES = {"heel": 0.06, "ball": 0.737, "pulp": 0.944, "tip": 1.0}
TAKEN |= {f"{segment}_anchors" for segment in (SHANK, FOOT)}


def cut(
    tree: Tree, found: Found, *, range: tuple[float, float] | None = None, toes: str | None = None
) -> Tree:
    """The leg alone, in its own axes with the origin of shank and foot at the ankle."""
    check_masses(tree, found)
    tree = _seen(tree)
    hinge = tree.joints()[found.ankle][1]
    stops = _stops(hinge, found.sign, found.zero, range, tree.file)
    ankle = _turned(hinge, ANKLE, found.sign, found.zero, stops)
    into = _inverse(pose_of(found.centre, found.axes))
    turn = turned_about(*tree.line(found.ankle), found.zero - hinge.zero)
    of_foot = {part.name for part in tree.below(found.foot)}
    names = _names(tree, found)

    def placed(
        old: str, into: np.ndarray, name: str, parent: str | None, pose: np.ndarray, *joints: Joint
    ) -> Part:
        return _moved_part(tree.parts[old], into @ tree.world_pose(old), name, parent, pose, joints)

    parts = {
        SHANK: placed(found.shank, into, SHANK, None, pose_of(np.array([0.0, 0.0, HEIGHT]))),
        FOOT: placed(found.foot, into @ turn, FOOT, SHANK, np.eye(4), ankle),
    }
    for part in tree.below(found.shank):
        if part.name in (found.shank, found.foot):
            continue
        pose = part.pose
        if part.parent in (found.shank, found.foot):
            carried = into @ turn if part.name in of_foot else into
            pose = carried @ tree.world_pose(part.name)
        assert part.parent is not None
        parts[names[part.name]] = dataclasses.replace(
            part, name=names[part.name], parent=names[part.parent], pose=pose, joints=()
        )
    parts = _with_points({name: _renamed(part) for name, part in parts.items()})
    knee = knee_of(tree, found.shank, found.foot)
    if knee is not None:
        points = parts[SHANK].points | {KNEE: moved(into, knee[0])}
        parts[SHANK] = dataclasses.replace(parts[SHANK], points=points)
    leg = Tree(tree.file, parts, notes=tree.notes)
    return leg if toes is None else _with_toes(tree, found, leg, names, into @ turn, toes)


def _seen(tree: Tree) -> Tree:
    """A tree without the shapes that are there for contact, where a part shows others."""
    parts = {}
    for name, part in tree.parts.items():
        shown = [shape for shape in part.shapes if not shape.touches] or part.shapes
        shapes = tuple(dataclasses.replace(shape, touches=False) for shape in shown)
        parts[name] = dataclasses.replace(part, shapes=shapes)
    return dataclasses.replace(tree, parts=parts)


def left_behind(tree: Tree, found: Found) -> dict[str, tuple[str, ...]]:
    """What a leg leaves behind of a file: parts, joints, and all that is not a part."""
    own = {part.name for part in tree.below(found.shank)}
    others = [part for part in tree.parts.values() if part.name not in own]
    of_shank = tuple(joint.name for joint in tree.parts[found.shank].joints)
    joints = of_shank + tuple(joint.name for part in others for joint in part.joints)
    found_here = {"parts": tuple(part.name for part in others), "joints": joints, **tree.beside}
    return {kind: names for kind, names in found_here.items() if names}


def _inverse(pose: np.ndarray) -> np.ndarray:
    turn = pose[:3, :3].T
    return pose_of(-turn @ pose[:3, 3], turn)


def _names(tree: Tree, found: Found) -> dict[str, str]:
    """New names of the parts of a leg: none that the model gives to something of its own."""
    names = {found.shank: SHANK, found.foot: FOOT}
    taken = set(TAKEN)
    for part in tree.below(found.shank):
        if part.name not in names:
            names[part.name] = free_name(_own_name(part.name), taken)
            taken.add(names[part.name])
    return names


def _own_name(name: str) -> str:
    """A name of the file's that the model gives to nothing of its own."""
    return f"file_{name}" if LIKE_OURS.search(name) else name


def _renamed(part: Part) -> Part:
    shapes = tuple(dataclasses.replace(shape, name=_own_name(shape.name)) for shape in part.shapes)
    points = {_own_name(name): at for name, at in part.points.items()}
    return dataclasses.replace(part, shapes=shapes, points=points)


def _with_points(parts: dict[str, Part]) -> dict[str, Part]:
    """Parts, of which those without mass and shapes are points of what they hang on."""
    found = dict(parts)
    taken = {name for part in parts.values() for name in part.points}
    for name, part in reversed(list(parts.items())):
        now = found[name]
        hung = any(other.parent == name for other in found.values())
        if hung or part.mass > 0.0 or part.shapes or name in (SHANK, FOOT) or part.parent is None:
            continue
        above = found[part.parent]
        points = {point: moved(now.pose, at) for point, at in now.points.items()}
        own = free_name(_own_name(name.removeprefix("file_").removesuffix("_point")), taken)
        taken.add(own)
        points[own] = now.pose[:3, 3]
        found[part.parent] = dataclasses.replace(above, points=above.points | points)
        del found[name]
    return found


def _moved_part(
    part: Part, by: np.ndarray, name: str, parent: str | None, pose: np.ndarray,
    joints: tuple[Joint, ...] = (),
) -> Part:  # fmt: skip
    inertia = by[:3, :3] @ part.inertia @ by[:3, :3].T
    inertia, centre = 0.5 * (inertia + inertia.T), moved(by, part.centre)
    shapes = tuple(dataclasses.replace(shape, pose=by @ shape.pose) for shape in part.shapes)
    points = {point: moved(by, at) for point, at in part.points.items()}
    return Part(name, parent, pose, part.mass, centre, inertia, joints, shapes, points)


def _turned(hinge: Joint, name: str, sign: float, zero: float, stops: tuple[float, float]) -> Joint:
    """The hinge about (0, −1, 0): its angle is sign × (the file's coordinate − zero)."""
    return dataclasses.replace(
        hinge,
        name=name,
        axis=RIGHTWARD,
        position=np.zeros(3),
        range=stops,
        spring_reference=sign * (hinge.spring_reference - zero),
        zero=0.0,
    )


def _stops(
    joint: Joint, sign: float, zero: float, given: tuple[float, float] | None, file: object
) -> tuple[float, float]:
    """Stops at the new angles; the order turns round with the sign."""
    if given is not None:
        if not -np.pi <= given[0] < given[1] <= np.pi:
            text, allowed = "{:g} to {:g} deg".format(*np.degrees(given)), "from low to high, within a turn"
            raise InputError("is not a valid range", field="range", value=text, allowed=allowed)
        return given
    low, high = joint.range or (-np.inf, np.inf)
    if not (np.isfinite([low, high]).all() and low < high):
        problem = f"the hinge {joint.name!r} of {file or 'the model'} has no stops, and an ankle needs them"
        raise InputError(problem, field="range", allowed='such as `range="-50 deg" "30 deg"`')
    ends = sorted((sign * (low - zero), sign * (high - zero)))
    text = f"{np.degrees(ends[0]):.4g} to {np.degrees(ends[1]):.4g} deg"
    if high - low < NARROWEST or high - low > 2.0 * np.pi:
        problem = f"the hinge {joint.name!r} moves from {text}, which is not an ankle's range: "
        problem += "degrees or radians?"
        raise InputError(problem, field="range", allowed='such as `range="-50 deg" "30 deg"`')
    if not ends[0] <= 0.0 <= ends[1]:
        problem = f"the hinge {joint.name!r} moves from {text}, and the zero lies outside"
        allowed = "the file's coordinate in the neutral posture, or `range`"
        raise InputError(problem, field="zero", allowed=allowed)
    return float(ends[0]), float(ends[1])


def check_masses(tree: Tree, found: Found) -> None:
    """Refuse a leg without usable masses; other parts are not checked."""
    shank, foot = tree.split(found.shank, found.foot)
    for field, parts in (("shank", shank), ("foot", foot)):
        for part in parts:
            _check_inertia(part, field, tree.file)
        if not sum(part.mass for part in parts) > 0.0:
            value = getattr(found, field)
            problem = f"has no mass in {tree.file or 'the model'}, nor has anything fixed to it"
            raise InputError(problem, field=field, value=value, allowed="more than 0 kg")
    if not any(np.linalg.eigvalsh(part.inertia)[0] > 0.0 for part in foot):
        raise InputError("has no inertia", field="foot", value=found.foot, allowed="more than 0 kg m2")


def _check_inertia(part: Part, field: str, file: object) -> None:
    if not np.isfinite([part.mass, *part.centre, *part.inertia.ravel()]).all():
        problem = f"a mass or inertia in {file or 'the model'} is not a number"
        raise InputError(problem, field=field, value=part.name, allowed="numbers")
    least, middle, most = np.linalg.eigvalsh(part.inertia)
    slack = 1e-9 * abs(most) + LEAST_INERTIA
    if part.mass < 0.0 or least < -slack or least + middle < most * (1.0 - ROUNDED) - slack:
        moments = ", ".join(f"{moment:.3g}" for moment in (least, middle, most))
        problem = f"no body has the mass {part.mass:g} kg with the principal moments of inertia {moments} kg "
        problem += "m2 about its centre of mass"
        allowed = "positive ones, none above the sum of the others"
        raise InputError(problem, file=file, field=field, value=part.name, allowed=allowed)


def _with_toes(
    tree: Tree, found: Found, leg: Tree, names: dict[str, str], into: np.ndarray, hinge: str
) -> Tree:
    """The leg with the toes on their hinge, taken as transverse, extension positive."""
    below = tree.below(found.foot)[1:]
    hinges = [joint.name for part in below for joint in part.joints if joint.kind == "hinge"]
    if hinge not in hinges:
        problem = "is not a hinge below the foot"
        raise InputError(problem, field="toes", value=hinge, allowed=listed(hinges, 24))
    part, joint = tree.joints()[hinge]
    axis, centre = tree.line(hinge)
    axis, centre = into[:3, :3] @ axis, moved(into, centre)
    if np.arcsin(np.clip(np.hypot(axis[0], axis[2]), 0.0, 1.0)) > STEEPEST:
        problem = "its axis is more than 35 deg from the ankle's: no hinge of the toes"
        raise InputError(problem, field="toes", value=hinge)
    sign = float(np.sign(-axis[1]))
    try:
        stops = _stops(joint, sign, joint.zero, None, tree.file)
    except InputError:
        problem = f"has no stops in {tree.file or 'the model'}"
        raise InputError(problem, field="toes", value=hinge, allowed="a hinge with a range") from None
    toe = _turned(joint, TOE, sign, joint.zero, stops)
    inner = _inverse(pose_of(centre)) @ into
    old = names[part.name]
    if old not in leg.parts:
        raise InputError("moves nothing that has mass or shape", field="toes", value=hinge)
    placed = inner @ tree.world_pose(part.name)
    segment = _renamed(_moved_part(part, placed, TOES, FOOT, pose_of(centre), (toe,)))
    found_parts: dict[str, Part] = {}
    for name, each in leg.parts.items():
        if name == old:
            found_parts[TOES] = segment
        elif each.parent == old:
            pose = inner @ tree.world_pose(next(o for o, n in names.items() if n == name))
            found_parts[name] = dataclasses.replace(each, parent=TOES, pose=pose)
        else:
            found_parts[name] = each
    return dataclasses.replace(leg, parts=found_parts)


def with_sole(leg: Tree) -> tuple[Tree, str]:
    """A leg with the sole's points on foot and toes, and where they come from, in words."""
    own = {  # from the ankle [m]
        name: moved(from_ankle(leg, part), at)
        for part in leg.below(FOOT)
        for name, at in part.points.items()
        if name in (*POINTS, OLD_TOE)
    }
    if all(name in own or (OLD_TOE in own and name in POINTS[2:]) for name in POINTS):
        return _placed(leg, own), "the file's own points"
    derived = _derived(leg)
    if not derived:
        return leg, "none: the foot has no shapes, and cannot be walked on"
    return _placed(leg, derived), "derived from the lower edge of the foot's shapes"


def from_ankle(leg: Tree, part: Part) -> np.ndarray:
    """Pose of a part from the ankle, in the axes of the leg (4, 4)."""
    found = leg.world_pose(part.name).copy()
    found[:3, 3] -= leg.parts[SHANK].pose[:3, 3]
    return found


def _derived(leg: Tree) -> dict[str, np.ndarray]:
    points = outline(leg, leg.below(FOOT), points=False) - leg.parts[SHANK].pose[:3, 3]
    if len(points) < 3 or np.ptp(points[:, 0]) < 0.02:
        return {}
    ahead, above = lower_edge(points[:, 0], points[:, 2])
    middle = 0.5 * float(points[:, 1].min() + points[:, 1].max())
    at = {name: ahead[0] + share * (ahead[-1] - ahead[0]) for name, share in SOLE_SHARES.items()}
    return {name: np.array([x, middle, np.interp(x, ahead, above)]) for name, x in at.items()}


def _placed(leg: Tree, points: dict[str, np.ndarray]) -> Tree:
    """The leg with these points on foot and toes; others of their names are renamed."""
    parts = {}
    for name, part in leg.parts.items():
        kept = {
            f"file_{point}" if point in (*POINTS, OLD_TOE) else point: at
            for point, at in part.points.items()
            if not (point in points and part in leg.below(FOOT))
        }
        parts[name] = dataclasses.replace(part, points=kept)
    for point, at in points.items():
        segment = TOES if TOES in parts and point not in ("heel", "ball") else FOOT
        parts[segment].points[point] = at - from_ankle(leg, leg.parts[segment])[:3, 3]
    return dataclasses.replace(leg, parts=parts)

"""Shank, foot and ankle in a tree: which parts are meant, and which way is up and forward."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, Keywords, Notice, unknown
from afo_sim.description import Side
from afo_sim.legs.ankles import check_foot, check_name
from afo_sim.legs.candidates import SIDES, Candidate, candidates, named_shanks, side_of
from afo_sim.legs.extent import outline, sole_slope
from afo_sim.legs.flexing import body_left, fold
from afo_sim.legs.tree import Joint, Tree, centre_of, listed, moved, turned_about

STEEPEST = np.radians(35.0)  # of an ankle's axis; oblique ones of OpenSim's models have 10 to 20 deg
NOTED_TILT = np.radians(5.0)  # of an axis from which on a note says so
NEAR_AXIS = np.radians(5.0)  # of a shank's own axis beside the line to its centre of mass
KNEE = "knee"  # point of a shank
Direction = str | Sequence[float]
Known = np.ndarray | None  # where something shows it
# {name: direction of the file's axes}
DIRECTIONS = {
    f"{sign}{name}": float(f"{sign}1") * np.eye(3)[k]
    for k, name in enumerate("xyz")
    for sign in ("", "+", "-")
}
LONGEST_SEGMENT = 1.0  # [m] of a shank or a foot; above it lengths are no metres
ASIDE = 0.02  # [m] of an ankle's centre beside the foot's, of a foot beside the midline


@dataclass(frozen=True, eq=False)
class Found:
    """A leg within a tree."""

    shank: str
    foot: str  # what the ankle turns, whatever part below it was named
    ankle: str  # name of the hinge between them
    side: Side  # of the body that it stands on
    centre: np.ndarray  # of the ankle on its axis, in the world [m] (3,)
    axes: np.ndarray  # forward, left, up of shank and foot at angle zero, in the world (3, 3)
    sign: float  # +1 where the file's hinge is dorsiflexion positive, else −1
    zero: float  # the file's coordinate where the ankle's angle is zero [rad]
    tilt: float  # of the hinge's axis against the perpendicular to the shank [rad]
    how: dict[str, str]  # each was found, in words
    welded: tuple[str, ...] = ()  # joints between shank and foot, or below the foot, taken as stiff
    shank_length: float | None = None  # [m]; None where nothing shows
    foot_length: float | None = None
    sole: float | None = None  # against forward at angle zero, toe up [rad]; None where nothing shows
    notes: tuple[str, ...] = ()


def find(
    tree: Tree, *, shank: str | None = None, foot: str | None = None, ankle: str | None = None,
    side: Side | None = None, zero: float | None = None, forward: Direction | None = None,
) -> Found:  # fmt: skip
    """Find a leg in a tree; what is given by name is taken, the rest is sought."""
    if zero is not None and not (isinstance(zero, (int, float, np.number)) and abs(zero) <= 2.0 * np.pi):
        allowed = "a number [rad], within a turn"
        raise InputError("is not a valid angle", field="zero", value=zero, allowed=allowed)
    if side not in (None, *SIDES):
        raise unknown(str(side), SIDES, field="side")
    given = None if forward is None else _direction(forward)
    legs = candidates(tree, shank, foot, ankle)
    if len(legs) > 1:
        legs = _of_side(tree, legs, side, given)
    if not legs:
        problem = f"no leg is found in {tree.file or 'the model'}: {_why_none(tree)}"
        allowed = f"name shank and foot; its bodies are {listed(tree.parts, 40)}"
        raise InputError(problem, field="shank", allowed=allowed)
    named = side_of(legs[0].shank, legs[0].foot, legs[0].ankle)
    if side is not None and shank is foot is ankle is None and named not in (None, side):
        problem = f"the one leg found, {legs[0].shank} and {legs[0].foot}, is the {named} one by its name"
        allowed = f"{named}, or name the shank of the {side} one"
        raise InputError(problem, field="side", value=side, allowed=allowed)
    check_name(legs[0], tree.file)
    zero_angle = zero_of(tree.joints()[legs[0].ankle][1], zero)
    found = _measured(tree, legs[0], side, zero_angle, given)
    for field, name, length in (
        ("shank", found.shank, found.shank_length),
        ("foot", found.foot, found.foot_length),
    ):
        if length is not None and length > LONGEST_SEGMENT:
            problem = f"is {length:.4g} m long: the file's lengths look like millimetres or centimetres"
            allowed = f'at most {LONGEST_SEGMENT:g} m; of meshes, scale="0.001 0.001 0.001" in the file'
            raise InputError(problem, file=tree.file, field=field, value=name, allowed=allowed)
    sole = found.sole if zero is None else None
    check_foot(tree, legs[0], found.centre, found.axes, sole, found.sign)
    return found


def _direction(given: Direction) -> np.ndarray:
    """A direction of the file's axes, of length one (3,)."""
    words: Sequence[object] = DIRECTIONS.get(given, given.split()) if isinstance(given, str) else given
    try:
        found = np.array(words, float)
    except (TypeError, ValueError):
        found = np.zeros(3)
    if found.shape != (3,) or not 1e-6 < np.linalg.norm(found) < 1e6:
        allowed = "x, -x, y, -y, z, -z of the file's axes, or three numbers, as 1 0 0"
        raise InputError("is not a valid direction", field="forward", value=str(given), allowed=allowed)
    return np.asarray(found / np.linalg.norm(found))


def zero_of(hinge: Joint, given: float | None) -> float:
    """The coordinate of the angle zero [rad]: the given one, else 0, if the hinge reaches it."""
    if given is not None:
        return given
    low, high = hinge.range or (-np.inf, np.inf)
    if low <= 0.0 <= high:
        return 0.0
    problem = f"the hinge {hinge.name!r} does not reach its coordinate 0, which would be the angle zero: it "
    problem += f"goes from {np.degrees(low):.4g} to {np.degrees(high):.4g} deg, and stands at "
    problem += f"{np.degrees(hinge.zero):.4g} deg"
    allowed = "its coordinate in the neutral posture, of an ankle with the sole square to the shank; 0 where "
    allowed += "that is meant; a number is in rad"
    raise InputError(problem, field="zero", allowed=allowed)


def _why_none(tree: Tree) -> str:
    kinds = {name: joint.kind for name, (_, joint) in tree.joints().items()}
    if "hinge" in kinds.values():
        shanks = listed(named_shanks(tree))
        return (
            f"no hinge hangs below {shanks}" if shanks else "its names do not identify shank, foot and ankle"
        )
    if not kinds:
        return "it has no joint"
    return f"an ankle is a hinge, and its joints are {listed([f'{n} ({k})' for n, k in kinds.items()])}"


def _of_side(tree: Tree, legs: list[Candidate], side: Side | None, forward: Known) -> list[Candidate]:
    """The one leg of a side, out of several."""
    other: dict[Side | None, Side | None] = {"right": "left", "left": "right", None: None}
    sides = [_side(tree, leg, forward=forward)[0] for leg in legs]
    if len(legs) == 2 and sides.count(None) == 1:
        sides = [known or other[sides[1 - k]] for k, known in enumerate(sides)]
    if len(legs) == 2 and sides[0] == sides[1]:  # as of leg_r0 and leg_r1
        sides = [_side(tree, leg, forward=forward, named=False)[0] for leg in legs]
    both = "; ".join(
        f"{leg.shank} and {leg.foot}" + (f" ({s})" if s else "") for leg, s in zip(legs, sides, strict=True)
    )
    chosen = [leg for leg, s in zip(legs, sides, strict=True) if side is not None and s == side]
    if len(chosen) == 1:
        return chosen
    if side is None and sorted(map(str, sides)) == ["left", "right"]:
        raise InputError(f"there are two legs: {both}", field="side", allowed="right or left")
    field = "shank" if side is None or len(chosen) > 1 else "side"
    value = side if field == "side" else None
    problem = f"there are several legs: {both}"
    raise InputError(problem, field=field, value=value, allowed="name the shank, or the foot")


def _measured(tree: Tree, leg: Candidate, side: Side | None, zero: float, forward: Known) -> Found:
    """Axes, lengths and side of a leg."""
    joint = tree.joints()[leg.ankle][1]
    axis, centre = tree.line(leg.ankle)
    turn = turned_about(axis, centre, zero - joint.zero)
    foot = tree.below(leg.foot)
    surface = outline(tree, foot, points=False)
    points = moved(turn, surface if len(surface) > 1 else outline(tree, foot))
    along, length, how_up = _along_shank(tree, leg, centre, axis)
    up, tilt = upright(axis, along)
    if tilt > STEEPEST:
        lean = f"{np.degrees(tilt):.0f} deg from the perpendicular to the shank"
        problem = f"its axis {_shown(joint.axis)} leans by {lean}"
        allowed = "a hinge across the shank, up to 35 deg"
        raise InputError(problem, field="ankle", value=leg.ankle, allowed=allowed)
    weight = centre_of(tree, foot)
    weight = None if weight is None else moved(turn, weight)
    behind = _backward(tree, leg, up)
    ahead, how_forward, notes = _forward(np.cross(axis, up), centre, points, weight, behind, forward)
    sign = float(np.sign(np.cross(axis, ahead) @ up))
    left = -sign * axis
    axes = np.stack([np.cross(left, up), left, up], axis=1)
    local = (points - centre) @ axes
    sole = sole_slope(local[:, 0], local[:, 2])
    found_side, how_side = _side(tree, leg, axes)
    if side is not None:
        if found_side not in (None, side):
            words = "it seems to be the {seen} leg ({how}), and {given} is given"
            data: Keywords = {"seen": found_side, "how": how_side, "given": side}
            notes.append(Notice("side-contradicted", words, subject=leg.shank, **data))
        found_side, how_side = side, "given"
    if found_side is None:
        found_side, how_side = "right", "assumed"
        notes.append(
            Notice("side-assumed", "nothing indicates the side: right is assumed", subject=leg.shank)
        )
    beside = 0.0 if weight is None else float((weight - centre) @ left)
    notes += _doubts(leg.ankle, tilt, float(along @ left), local, beside)
    below = [joint.name for part in tree.below(leg.shank)[1:] for joint in part.joints]
    welded = tuple(joint for joint in below if joint != leg.ankle)
    how = leg.how | {"up": how_up, "forward": how_forward, "side": how_side}
    foot_length = float(np.ptp(local[:, 0])) if len(local) > 1 else None
    place = leg.shank, leg.foot, leg.ankle, found_side, centre, axes, sign, zero, tilt, how
    return Found(*place, welded, shank_length=length, foot_length=foot_length, sole=sole, notes=tuple(notes))


def upright(axis: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, float]:
    """Of a segment's direction what is square to a hinge's axis (3,), and how far that axis leans [rad]."""
    up = along - (along @ axis) * axis
    return up / (np.linalg.norm(up) or 1.0), float(np.arcsin(np.clip(abs(axis @ along), 0.0, 1.0)))


def _along_shank(
    tree: Tree, leg: Candidate, centre: np.ndarray, axis: np.ndarray
) -> tuple[np.ndarray, float | None, str]:
    """Direction from ankle to knee (3,), the shank's length [m] if a knee tells it, and how it was found."""
    knee = knee_of(tree, leg.shank, leg.foot)
    if knee is not None and np.linalg.norm(knee[0] - centre) > 0.02:
        along = knee[0] - centre
        length = float(np.linalg.norm(along))
        return along / length, length, f"from the ankle to {knee[1]}"
    stiff, _ = tree.split(leg.shank, leg.foot)
    weight = centre_of(tree, stiff)
    if weight is not None:
        along = weight - centre
        if np.linalg.norm(along) > 1e-3 and abs(axis @ along) < 0.9 * np.linalg.norm(along):
            return _own_axis(tree.world_pose(leg.shank)[:3, :3], along / np.linalg.norm(along))
    points = outline(tree, stiff)
    if len(points) > 2:
        middle = points.mean(axis=0)
        _, _, main = np.linalg.svd(points - middle, full_matrices=False)
        aside = (middle - centre) @ main[0]
        return main[0] * (1.0 if aside >= 0.0 else -1.0), None, "along the shank's longest axis"
    problem = "nothing indicates where the shank points: it has no joint above it, no mass and no shapes"
    raise InputError(problem, field="shank", value=leg.shank, allowed="a body with mass, shapes or a knee")


def _own_axis(turn: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, None, str]:
    """The shank's own axis that points to its centre of mass, if one about does; else the line there."""
    towards = turn.T @ along
    k = int(np.argmax(np.abs(towards)))
    if abs(towards[k]) < np.cos(NEAR_AXIS):
        return along, None, "from the ankle to the shank's centre of mass"
    sense = np.sign(towards[k])
    name = f"{'−' if sense < 0.0 else ''}{'xyz'[k]}"
    return sense * turn[:, k], None, f"the shank's own {name} axis, on which its centre of mass about lies"


def knee_of(tree: Tree, shank: str, foot: str) -> tuple[np.ndarray, str] | None:
    """Place of the knee [m], in the world, and what it is; None where nothing shows."""
    above = next((part for part in tree.upward(shank) if part.joints), None)
    joints = () if above is None else above.joints
    if above is not None and above.parent is None and any(j.kind in ("slide", "free") for j in joints):
        joints = ()  # they place it in the world
    for joint in joints:
        if joint.kind in ("hinge", "ball"):
            return tree.line(joint.name)[1], f"the joint {joint.name!r}"
    for part in tree.split(shank, foot)[0]:
        pose = tree.world_pose(part.name)
        if KNEE in part.points:
            return moved(pose, part.points[KNEE]), f"the point {KNEE!r}"
        if part.name in (KNEE, f"{KNEE}_point") and part.mass == 0.0 and not part.shapes:
            return pose[:3, 3], f"the point {KNEE!r}"
    return None


def _forward(
    along: np.ndarray, centre: np.ndarray, points: np.ndarray, weight: Known, behind: np.ndarray, given: Known
) -> tuple[np.ndarray, str, list[Notice]]:
    """The sense of forward along a line (3,), how it was found, and notes."""
    ahead = along / np.linalg.norm(along)
    reach = (points - centre) @ ahead if len(points) else np.zeros(1)
    front, back = float(reach.max()), float(0.0 - reach.min())
    farther = (front - back) / max(front + back, 0.01)
    if given is not None:
        if abs(given @ ahead) < 0.5:
            problem = f"is more than 60 deg off {_shown(ahead)}, along which the foot points or away from it"
            raise InputError(problem, field="forward", value=_shown(given), allowed="a direction near it")
        words = "the foot reaches {front:.0f} mm the given way and {back:.0f} the other: where are its toes?"
        shorter, longer = 1000.0 * min(front, back), 1000.0 * max(front, back)
        turned = abs(farther) > 0.1 and farther * (given @ ahead) < 0.0
        note = Notice("forward-contradicted", words, subject="foot", front=shorter, back=longer)
        return np.sign(given @ ahead) * ahead, "given", [note] if turned else []
    heavier = 0.0 if weight is None else float((weight - centre) @ ahead)
    spans = f"{1000 * front:.0f} mm to one side of the ankle's axis and {1000 * back:.0f} mm to the other"
    if abs(farther) > 0.1:
        words = "the foot reaches {spans}, where its centre of mass lies: forward is where it reaches farther"
        against = farther * heavier < 0.0 and abs(heavier) > 2e-3
        notes = [Notice("forward-contradicted", words, subject="foot", spans=spans)] if against else []
        return np.sign(farther) * ahead, "where the foot's shapes reach farther", notes
    if abs(behind @ ahead) > 0.5:
        return -np.sign(behind @ ahead) * ahead, "by left and right of the body, or the fold of the knee", []
    if abs(farther) > 0.05:
        words = "the foot reaches {spans}: forward is taken where it reaches farther"
        close = Notice("forward-close", words, subject="foot", spans=spans)
        return np.sign(farther) * ahead, "where the foot's shapes reach a little farther", [close]
    if front + back < 0.01 and abs(heavier) > 2e-3:
        return np.sign(heavier) * ahead, "where the foot's centre of mass lies", []
    problem = f"nothing indicates where it points: along {_shown(ahead)} it reaches {spans}"
    allowed = '`--forward x`, in Python `forward="x"`: a direction of the file\'s axes'
    raise InputError(problem, field="foot", allowed=allowed)


def _backward(tree: Tree, leg: Candidate, up: np.ndarray) -> np.ndarray:
    """Where a leg's back is, by left and right of its body, else by the fold of its knee (3,); else zeros."""
    joints = next((part.joints for part in tree.upward(leg.shank) if part.joints), ())
    left = body_left(tree, leg.ankle)
    if left is None and [joint.kind for joint in joints] == ["hinge"]:
        left = fold(tree, joints[0].name, "knee")[0] * tree.line(joints[0].name)[0]
    return np.zeros(3) if left is None else np.cross(up, left)


def _side(
    tree: Tree, leg: Candidate, axes: Known = None, *, forward: Known = None, named: bool = True
) -> tuple[Side | None, str]:
    """Side of a leg by names, else by where it stands against the body; None where nothing shows."""
    word = side_of(leg.shank, leg.foot, leg.ankle, *(part.name for part in tree.below(leg.foot)))
    if word is not None and named:
        return word, "by its name"
    if tree.parts[leg.shank].parent is None:
        return None, ""
    if axes is None:
        try:
            axes = _measured(tree, leg, "right", 0.0, forward).axes
        except InputError:
            return None, ""
    stands, aside = standing(tree, leg.ankle, axes[:, 1])
    if stands is None:
        return None, ""
    return stands, f"it stands {1000 * abs(aside):.0f} mm to the {stands} of the body's centre of mass"


def standing(tree: Tree, joint: str, left: np.ndarray) -> tuple[Side | None, float]:
    """Side of a joint beside the body's centre of mass, and how far left of it the joint lies [m]."""
    middle = centre_of(tree, list(tree.parts.values()))
    aside = 0.0 if middle is None else float((tree.line(joint)[1] - middle) @ left)
    return None if abs(aside) < ASIDE else "left" if aside > 0.0 else "right", aside


def _doubts(ankle: str, tilt: float, leans: float, foot: np.ndarray, aside: float) -> Iterator[Notice]:
    """An oblique axis, the shank to the left; a foot's points (n, 3) wider than long; an ankle beside [m]."""
    if tilt > NOTED_TILT:
        lean, way = np.tan(tilt), "left" if leans > 0.0 else "right"
        words = f"the ankle's axis is oblique by {np.degrees(tilt):.0f} deg: in the leg's axes the shank "
        words += f"leans to the {way} by {100.0 * lean:.0f} mm in every 100 mm, and so must the attachment "
        words += f"points of a cuff: 30 cm up its middle has y = {np.sign(leans) * 300.0 * lean:.0f} mm, not "
        words += "0 as on a straight axis"
        yield Notice("axis-oblique", words, subject=ankle, tilt=tilt)
    length, width, _ = np.ptp(foot, axis=0).tolist() if len(foot) > 1 else (0.0, 0.0, 0.0)
    if width > 1.2 * length:
        words = f"the foot's shapes are {1000 * width:.0f} mm wide along the axis of {{subject!r}} and "
        words += f"{1000 * length:.0f} mm long across it: is it the roll, or is the zero another?"
        yield Notice("foot-wide", words, subject=ankle, width=width, length=length)
    if abs(aside) > ASIDE:
        way = "right" if aside > 0 else "left"
        words = f"the joint {{subject!r}} sits {1000 * abs(aside):.0f} mm to the {way} of the foot's centre "
        words += "of mass: what is placed from the ankle is placed from there"
        yield Notice("ankle-aside", words, subject=ankle, aside=aside)


def _shown(vector: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in vector) + ")"

"""Hinges at one place as one joint, and which way it flexes: by its fold, its limb, left and right."""

import itertools
import re
from collections.abc import Iterator

import numpy as np

from afo_sim.common import InputError, Notice
from afo_sim.description import JOINTS, JointName, Side
from afo_sim.legs.candidates import SIDES, has, plain, side_of
from afo_sim.legs.extent import outline
from afo_sim.legs.tree import Part, Tree, centre_of

OFF = 0.002  # [m] from a hinge's axis; a joint or mass so near shows no direction
# [m], of one joint's hinges; OpenSim's subtalar axis begins 6.4 cm from the ankle's
REACH = {"hip": 0.15, "shoulder": 0.1, "ankle": 0.08, "finger": 0.015, "thumb": 0.015, "hinge": -1.0}
TOGETHER = 0.06  # [m], of another one's hinges
BALLS = ("hip", "shoulder")  # have also a hinge along their limb, which may lie farther up or down
PARALLEL, APART = 0.87, 0.01  # cosine, [m]: parallel hinges that lie apart are of two joints
BENT, FARTHER = 20.0, 2.0  # [deg] that a fold reaches from straight, and times as far as the other way
NEAR = 0.5  # cosine; of an axis to left, from which on left shows its sign
OPPOSED = re.compile(r"thumb|pollex|(?<![a-z])thj|gripper|claw|jaw")  # to fingers, or no fingers
BODY, FOLD = "left and right of the body", "the fold of the {} below it"
# {joint: the next one of its limb, which folds}
NEXT: dict[str, JointName] = {"hip": "knee", "knee": "ankle", "shoulder": "elbow", "wrist": "finger"}
NEXT |= {"finger": "finger", "thumb": "thumb"}


def branches(tree: Tree, name: str) -> list[Part]:
    """The first part below one that moves on it, of each branch; a kneecap beside the shank is none."""
    children = tree.children(name)
    found = [each for part in children for each in ([part] if part.joints else branches(tree, part.name))]
    return [part for part in found if "patella" not in plain(part.name)] or found


def _away(place: np.ndarray, axis: np.ndarray, centre: np.ndarray) -> float:
    """Distance of a place from an axis [m]."""
    return float(np.linalg.norm(np.cross(place - centre, axis)))


def cluster_of(tree: Tree, name: str, kind: str) -> list[Part]:
    """The parts on the hinges of one joint, from above: close by, about other axes, without a branch."""
    found, (axis, centre) = [tree.joints()[name][0]], tree.line(name)

    def joins(other: Part) -> bool:
        lines = [tree.line(joint.name) for joint in other.joints]
        known = [tree.line(joint.name) for part in found for joint in part.joints]
        for (turn, at), (one, place) in itertools.product(lines, known):
            away = min(_away(at, axis, centre), _away(centre, turn, at) if kind in BALLS else np.inf)
            beside = abs(one @ turn) > PARALLEL and _away(at, one, place) > APART
            if beside or away > REACH.get(kind, TOGETHER):
                return False
        return {joint.kind for joint in other.joints} == {"hinge"}

    while above := next((part for part in tree.upward(found[0].parent) if part.joints), None):
        if above.parent is None or len(branches(tree, above.name)) > 1 or not joins(above):
            break
        found.insert(0, above)
    while len(below := branches(tree, found[-1].name)) == 1 and joins(below[0]):
        found.append(below[0])
    return found


def _places(tree: Tree, start: str) -> Iterator[tuple[np.ndarray, str]]:
    """Where a part leads, in the world [m] (3,): joints below, the middle of mass, of shapes; in words."""
    parts, below = branches(tree, start), tree.below(start)
    while len(parts) == 1:  # of a hand with fingers none leads on
        turns = [joint.name for joint in parts[0].joints if joint.kind in ("hinge", "ball")]
        yield from ((tree.line(name)[1], f"from the joint {name!r} up to it") for name in turns)
        parts = branches(tree, parts[0].name)
    if (mass := centre_of(tree, below)) is not None:
        yield mass, f"from the centre of mass of {start!r} up to it"
    if len(points := outline(tree, below)):
        yield points.mean(axis=0), f"from the middle of {start!r}'s shapes up to it"


def beyond(tree: Tree, start: str, axis: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray | None, str]:
    """The first place off an axis to which a part leads [m] (3,), and which it is; else None."""
    shown = (each for each in _places(tree, start) if _away(each[0], axis, centre) > OFF)
    return next(shown, (None, ""))


def fold(tree: Tree, name: str, kind: str) -> tuple[float, str, float]:
    """The sign in which a coordinate leads away from straight, else 0; why; how bent it stands [rad]."""
    hinge, (axis, centre), parts = tree.joints()[name][1], tree.line(name), cluster_of(tree, name, kind)
    chain = list(tree.upward(parts[0].parent))
    places = [[tree.line(j.name)[1] for j in part.joints if j.kind in ("hinge", "ball")] for part in chain]
    places.insert(1, [mass for mass in [centre_of(tree, chain[:1])] if mass is not None])
    up = next((each for each in itertools.chain(*places) if _away(each, axis, centre) > OFF), centre)
    down = beyond(tree, parts[-1].name, axis, centre)[0]
    up, down = up - centre, (centre if down is None else down) - centre
    if any(np.linalg.norm(np.cross(way, axis)) <= NEAR * np.linalg.norm(way) for way in (up, down)):
        return 0.0, "nothing shows when it is straight", 0.0
    stands = np.arctan2(axis @ np.cross(-up, down), (up @ axis) * (down @ axis) - up @ down)
    ends = np.subtract(hinge.range or (hinge.zero, hinge.zero), hinge.zero)
    ways = [stands + ends + turn for turn in (0.0, 2.0 * np.pi, -2.0 * np.pi)]
    low, high = min(ways, key=lambda way: float(np.abs(way).max()))
    far, near = np.degrees([max(high, -low), max(min(high, -low), 0.0)])
    words = f"from straight it goes {far:.0f} deg one way and {near:.0f} deg the other"
    return float(np.sign(high + low)) if far > max(BENT, FARTHER * near) else 0.0, words, float(stands)


def _sum(ways: list[np.ndarray]) -> np.ndarray | None:
    """The direction of vectors that about agree (3,)."""
    length, total = sum(float(np.linalg.norm(way)) for way in ways), np.sum(ways, axis=0)
    return total / np.linalg.norm(total) if np.linalg.norm(total) > max(NEAR * length, OFF) else None


def body_left(tree: Tree, joint: str) -> np.ndarray | None:
    """Left of a body (3,) by a limb's own joints and their namesakes, as hands may be crossed, else None."""
    keys = {name: SIDES[side].sub("*", plain(name)) for name in tree.joints() if (side := side_of(name))}
    places: dict[str, dict[Side | None, np.ndarray]] = {}
    for name, key in keys.items():
        places.setdefault(key, {})[side_of(name)] = tree.line(name)[1]
    limb = {keys.get(each.name) for part in tree.upward(tree.joints()[joint][0].name) for each in part.joints}
    return _sum([at["left"] - at["right"] for key, at in places.items() if len(at) == 2 and key in limb])


def _left_of_next(tree: Tree, part: Part, kind: JointName) -> np.ndarray | None:
    """Left of what folds next on a limb (3,): a hip's knee, a wrist's fingers without the thumb."""
    firsts = [x for x in branches(tree, part.name) if kind == "thumb" or not has(OPPOSED, x.joints[0].name)]
    parts = [each for x in firsts for each in (tree.below(x.name) if NEXT.get(kind) == kind else [x])]
    names = [joint.name for each in parts for joint in each.joints if joint.kind == "hinge"]
    return _sum([-JOINTS[kind].turn * fold(tree, name, kind)[0] * tree.line(name)[0] for name in names])


def sign_of(
    tree: Tree, name: str, kind: JointName, parts: list[Part], given: float | None
) -> tuple[float, str, list[Notice]]:
    """+1 where a hinge's own coordinate rises with the device's angle, else −1; why; notices."""
    if given not in (None, 1, -1):
        raise InputError("is not a valid choice", field="sign", value=given, allowed="1 or -1")
    if kind == "hinge":
        return given or 1.0, "given" if given else "the hinge's own", []
    axis, after, turn = tree.line(name)[0], NEXT.get(kind), JOINTS[kind].turn
    shown = {} if kind in ("wrist", "finger", "thumb") else {BODY: body_left(tree, name)}
    if after and (kind == "hip" or shown.get(BODY) is None):  # an arm may be turned beside the body
        shown[FOLD.format(after)] = _left_of_next(tree, parts[-1], after)
    folds, why, _ = fold(tree, name, kind) if kind not in (*BALLS, "wrist") else (0.0, "", 0.0)
    cosines = {what: float(axis @ left) for what, left in shown.items() if left is not None}
    votes = {what: float(np.sign(-turn * x)) for what, x in cosines.items() if abs(x) >= NEAR}
    if after == kind and not votes and sum(len(part.joints) for part in parts) > 1:
        folds, why = 0.0, "another hinge of it lies there too, and which of them flexes is open"
    votes |= {"its own fold": folds} if folds else {}
    if given is not None:
        against = " and ".join(what for what, sign in votes.items() if sign != given)
        text = "the sign {sign:g} is given, and {against} says the other way"
        notes = [Notice("sign-contradicted", text, subject=name, sign=given, against=against)]
        return float(given), "given", notes if against else []
    lean = {what: np.degrees(np.arccos(abs(x))) for what, x in cosines.items() if what not in votes}
    if len({*votes.values()}) != 1 or (after and lean):
        said = [f"{what} says {sign:g}" for what, sign in votes.items()]
        said += [why] if why and not folds else []
        said += [f"its axis leans by {angle:.0f} deg from {what}" for what, angle in lean.items()]
        said += [f"nothing shows {what}" for what, left in shown.items() if left is None]
        problem = f"is needed: it is not clear which way the hinge {name!r} flexes: {', '.join(said)}"
        allowed = "1 where its own coordinate rises in flexion, else -1; or another hinge"
        raise InputError(problem, field="sign", allowed=allowed)
    return next(iter(votes.values())), ", ".join(votes), []

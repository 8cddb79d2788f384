"""Another joint than the ankle in a tree: segments from the hinge itself, axes, and which way it flexes."""

import re
from collections.abc import Mapping

import numpy as np

from afo_sim.common import InputError, Notice, unknown
from afo_sim.description import JOINTS, JointName, Orthosis, Side, a_joint
from afo_sim.legs.attached import number_of
from afo_sim.legs.candidates import side_of
from afo_sim.legs.finding import STEEPEST, Direction, Found, centre_of, find, standing, upright, zero_of
from afo_sim.legs.tree import Joint, Part, Tree, listed, moved, turned_about

NAMED: Mapping[JointName, re.Pattern[str]] = {
    "ankle": re.compile(r"ankle|talocrural|_ak[xyz]$", re.IGNORECASE),
    **{name: re.compile(name, re.IGNORECASE) for name in JOINTS if name not in ("ankle", "hinge")},
}
FARTHER = 1.5  # times, by which stops reach farther in flexion than in extension to tell which is which
NEAR = 0.02  # [m] from the hinge's axis; a joint or mass so near shows no direction


def find_worn(
    tree: Tree,
    device: Orthosis,
    joint: str | None,
    proximal: str | None,
    distal: str | None,
    *,
    side: Side | None,
    zero: float | None,
    sign: float | None,
    forward: Direction | None,
) -> Found:
    """The joint that a device is for: an ankle is sought, another one is about the hinge that is named."""
    named = [] if joint is None else [kind for kind, words in NAMED.items() if words.search(joint)]
    if named and device.joint != "hinge" and device.joint not in named:
        problem = (
            f"is for {a_joint(device.joint)}, and the hinge {joint!r} is {a_joint(named[0])} by its name"
        )
        allowed = f'an orthosis with joint = "{named[0]}"'
        raise InputError(problem, field="orthosis", value=device.name or None, allowed=allowed)
    if device.joint == "ankle":
        if sign is not None:
            raise InputError("follows from the foot of an ankle", field="sign", value=sign, allowed="nothing")
        names = {"shank": proximal, "foot": distal, "ankle": joint}
        return find(tree, **names, side=side, zero=zero, forward=forward)
    if forward is not None:
        problem = "is of an ankle's foot; the axes of another joint follow from its hinge"
        raise InputError(problem, field="forward", value=forward, allowed="nothing")
    if zero is not None:
        zero = number_of(zero, "zero", "rad", (-2.0 * np.pi, 2.0 * np.pi), "a number [rad], within a turn")
    part, hinge = _hinge(tree, device.joint, joint, side)
    above = _above(tree, part, hinge, proximal)
    known = [each.name for each in tree.below(part.name)]
    if distal is not None and distal not in known:
        raise unknown(distal, known, field="distal", problem=f"does not hang on {part.name!r}")
    return _measured(tree, device, part, hinge, above, side, zero_of(tree, hinge, zero), sign)


def _hinge(tree: Tree, kind: JointName, joint: str | None, side: Side | None) -> tuple[Part, Joint]:
    """The hinge of a name; without one the only one that is called so, of the side if one is given."""
    hinges = {name: each for name, each in tree.joints().items() if each[1].kind == "hinge"}
    if joint is None:
        called = [name for name in hinges if kind in NAMED and NAMED[kind].search(name)]
        called = [name for name in called if side in (None, side_of(name, hinges[name][0].name))]
        if len(called) != 1:
            problem = f"is needed: the orthosis is for {a_joint(kind)}"
            others = [words for other, words in NAMED.items() if other != kind]
            free = [name for name in hinges if not any(words.search(name) for words in others)]
            allowed = (
                listed(called or free, 24) if called or free else f"a model with the hinge of {a_joint(kind)}"
            )
            raise InputError(problem, file=tree.file, field="joint", allowed=allowed)
        joint = called[0]
    if joint not in hinges:
        raise unknown(joint, hinges, file=tree.file, field="joint", problem="there is no such hinge")
    return hinges[joint]


def _above(tree: Tree, part: Part, hinge: Joint, proximal: str | None) -> str:
    """The body above a hinge: its parent, or the named one over it."""
    chain = [each.name for each in tree.upward(part.parent)]
    if not chain:
        problem = f"moves {part.name!r} against the world: there is no body above it"
        raise InputError(problem, file=tree.file, field="joint", value=hinge.name)
    if proximal is not None and proximal not in chain:
        raise unknown(proximal, chain, field="proximal", problem=f"is not above the hinge {hinge.name!r}")
    return proximal or chain[0]


def _sign(tree: Tree, kind: JointName, hinge: Joint, zero: float, given: float | None) -> tuple[float, str]:
    """+1 where the hinge's own coordinate rises with the device's angle, else −1, and why."""
    if given is not None:
        if given not in (1, -1):
            raise InputError("is not a valid choice", field="sign", value=given, allowed="1 or -1")
        return float(given), "given"
    if kind == "hinge":
        return 1.0, "the hinge's own"
    low, high = (0.0, 0.0) if hinge.range is None else (zero - hinge.range[0], hinge.range[1] - zero)
    if not max(low, high) > FARTHER * max(min(low, high), 0.0):
        problem = f"is needed: its stops do not show which way the hinge {hinge.name!r} flexes"
        allowed = "1 where its own coordinate rises in flexion, else -1"
        raise InputError(problem, file=tree.file, field="sign", allowed=allowed)
    return (1.0 if high > low else -1.0), "the way in which its stops reach farther"


def _measured(
    tree: Tree,
    device: Orthosis,
    part: Part,
    hinge: Joint,
    above: str,
    side: Side | None,
    zero: float,
    given: float | None,
) -> Found:
    """Axes, sign and side; the left axis is the hinge's, up goes along the distal segment at angle zero."""
    axis, centre = tree.line(hinge.name)
    towards, how_up = _below(tree, part, centre, axis)
    along = centre - moved(turned_about(axis, centre, zero - hinge.zero), towards)
    up, tilt = upright(axis, along / np.linalg.norm(along))
    if tilt > STEEPEST:
        problem = f"its axis leans by {np.degrees(tilt):.0f} deg from the perpendicular to {part.name!r}"
        allowed = "a hinge across its segments, up to 35 deg"
        raise InputError(problem, field="joint", value=hinge.name, allowed=allowed)
    sign, how_sign = _sign(tree, device.joint, hinge, zero, given)
    left = -device.words.turn * sign * axis
    seen, how_side, notes = _side(tree, part, hinge, above, left, side)
    return Found(
        shank=above,
        foot=part.name,
        ankle=hinge.name,
        side=side or seen,
        centre=centre,
        axes=np.stack([np.cross(left, up), left, up], axis=1),
        sign=sign,
        zero=zero,
        tilt=tilt,
        welded=(),
        shank_length=None,
        foot_length=None,
        how={"up": how_up, "sign": how_sign, "side": how_side},
        notes=notes,
    )


def _below(tree: Tree, part: Part, centre: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, str]:
    """The next joint below, off the hinge's axis, in the world [m] (3,); else the centre of mass below."""
    below = tree.below(part.name)
    places: list[tuple[np.ndarray | None, str]] = [
        (tree.line(joint.name)[1], f"from the joint {joint.name!r} up to it")
        for each in below[1:]
        for joint in each.joints
        if joint.kind in ("hinge", "ball")
    ]
    places.append((centre_of(tree, below), f"from the centre of mass of {part.name!r} up to it"))
    for place, how in places:
        if place is not None and np.linalg.norm(np.cross(place - centre, axis)) > NEAR:
            return place, how
    problem = "nothing shows which way it points: no joint and no mass lies off the hinge's axis"
    raise InputError(problem, field="distal", value=part.name, allowed="a body with mass")


def _side(
    tree: Tree, part: Part, hinge: Joint, above: str, left: np.ndarray, given: Side | None
) -> tuple[Side, str, tuple[str, ...]]:
    """Side by names, else by the place beside the body's centre of mass, else right; notices."""
    stands, _ = standing(tree, hinge.name, left)
    named = given or side_of(hinge.name, part.name, above)
    if named is None and stands is None:
        return "right", "assumed", (Notice("side-assumed", "nothing shows the side: right is assumed"),)
    if named is not None and stands not in (None, named):
        words = "{subject!r} is on the {named} side, and lies on the {stands} if it flexes as `sign` says"
        note = Notice("side-contradicted", words, subject=hinge.name, named=named, stands=stands)
        return named, "given" if given else "by its name", (note,)
    how = "given" if given else "by its name" if named else "by its place beside the centre of mass"
    return named or stands or "right", how, ()

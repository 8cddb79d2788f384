"""Another joint than the ankle in a tree: segments and axes from the hinges themselves, side and sign."""

import re

import numpy as np

from afo_sim.common import InputError, Notice, unknown
from afo_sim.description import JOINTS, JointName, Orthosis, Side, a_joint
from afo_sim.legs.attached import number_of
from afo_sim.legs.candidates import SIDES, has, side_of
from afo_sim.legs.finding import STEEPEST, Direction, Found, find, standing, upright, zero_of
from afo_sim.legs.flexing import OFF, beyond, cluster_of, fold, sign_of
from afo_sim.legs.tree import Tree, listed, moved, turned_about

FINGERS = r"finger|index|pinky|(?<![a-z])((middle|ring|little)(?![a-z])|mcp|pip|dip|[fmrl]fj|pm\d|md\d)"
HANDS = {
    "wrist": r"wrist|_wr[xyz]$|(?<![a-z])wrj",
    "thumb": r"thumb|pollex|(?<![a-z])thj",
    "finger": rf"^(?!.*(thumb|spin|cervic|thora|lumbar)).*({FINGERS})",
}
MUCH = np.radians(30.0)  # that a joint is bent at the angle zero, from which on a note says so
# {joint: its hinges' names}
NAMED = {name: re.compile(HANDS.get(name, name)) for name in JOINTS if name != "hinge"}
NAMED["ankle"] = re.compile(r"ankle|talocrural|_ak[xyz]$")
FLEXES = re.compile(r"pitch|flex|_p$")  # of several hinges of a joint


def find_worn(
    tree: Tree, device: Orthosis, names: tuple[str | None, str | None, str | None], side: Side | None,
    zero: float | None, sign: float | None, forward: Direction | None,
) -> Found:  # fmt: skip
    """The joint that a device is for, by names of a hinge, a body above and one below; an ankle is sought."""
    joint, proximal, distal = names
    named = [] if joint is None else [kind for kind, words in NAMED.items() if has(words, joint)]
    if named and device.joint != "hinge" and device.joint not in named:
        own, allowed = a_joint(device.joint), f'an orthosis with joint = "{named[0]}"'
        problem = f"is for {own}, and the hinge {joint!r} is {a_joint(named[0])} by its name"
        raise InputError(problem, field="orthosis", value=device.name or None, allowed=allowed)
    if device.joint == "ankle":
        if sign is not None:
            raise InputError("follows from the foot of an ankle", field="sign", value=sign, allowed="nothing")
        return find(tree, shank=proximal, foot=distal, ankle=joint, side=side, zero=zero, forward=forward)
    if forward is not None:
        problem = "is of an ankle's foot; the axes of another joint follow from its hinge"
        raise InputError(problem, field="forward", value=forward, allowed="nothing")
    if zero is not None:
        zero = number_of(zero, "zero", "rad", (-2.0 * np.pi, 2.0 * np.pi), "a number [rad], within a turn")
    if side not in (None, *SIDES):
        raise unknown(str(side), SIDES, field="side")
    name = _hinge(tree, device.joint, joint, side)
    (part, hinge), (axis, centre) = tree.joints()[name], tree.line(name)
    parts = cluster_of(tree, name, device.joint)
    chain, known = ([each.name for each in way] for way in (tree.upward(part.parent), tree.below(part.name)))
    if not chain:
        problem = f"moves {part.name!r} against the world: there is no body above it"
        raise InputError(problem, field="joint", value=name)
    if proximal is not None and proximal not in chain:
        raise unknown(proximal, chain, field="proximal", problem=f"is not above the hinge {name!r}")
    if distal is not None and distal not in known:
        raise unknown(distal, known, field="distal", problem=f"does not hang on {part.name!r}")
    above, below, last = proximal or str(parts[0].parent), distal or parts[-1].name, parts[-1].name
    zero = zero_of(hinge, zero)
    end, how_up = beyond(tree, below if tree.way(last, below) else last, axis, centre)
    if end is None:
        problem = f"has no direction: no joint, mass or shape lies {1000 * OFF:g} mm off "
        problem += f"the axis of {name!r}"
        raise InputError(problem, field="distal", value=below, allowed="a body with mass or shapes")
    along = centre - moved(turned_about(axis, centre, zero - hinge.zero), end)
    up, tilt = upright(axis, along / np.linalg.norm(along))
    if tilt > STEEPEST:
        problem = f"its axis leans by {np.degrees(tilt):.0f} deg from the perpendicular to {below!r}"
        allowed = "a hinge across its segments, up to 35 deg"
        raise InputError(problem, field="joint", value=name, allowed=allowed)
    sign, how_sign, notes = sign_of(tree, name, device.joint, parts, sign)
    bent = 0.0 if device.joint in ("hip", "shoulder", "wrist") else fold(tree, name, device.joint)[2]
    bent = abs((bent + zero - hinge.zero + np.pi) % (2.0 * np.pi) - np.pi)
    if device.joint != "hinge" and bent > MUCH:
        words = "at the angle zero {subject!r} is bent by {bent:.0f} deg, and points on {above!r} count "
        words += "along {below!r}: `zero` is the coordinate of the straight joint"
        notes.append(
            Notice("limb-bent", words, subject=name, bent=np.degrees(bent), above=above, below=below)
        )
    left = -device.words.turn * sign * axis
    seen = side_of(name, part.name, *(each.name for each in tree.upward(above)))
    # left of an elbow or a hand may be another way than the body's
    stands = None if device.joint in (*HANDS, "elbow") else standing(tree, name, left)[0]
    how_side = "given" if side else "by its name" if seen else "by its place" if stands else "assumed"
    if side and seen not in (None, side):
        words = "{subject!r} is on the {named} side by its name, and {given} is given"
        notes.append(Notice("side-contradicted", words, subject=name, named=seen, given=side))
    if not (side or seen or stands):
        notes.append(Notice("side-assumed", "nothing indicates the side: right is assumed"))
    axes, side = np.stack([np.cross(left, up), left, up], axis=1), side or seen or stands or "right"
    how = {"up": how_up, "sign": how_sign, "side": how_side}
    return Found(above, below, name, side, centre, axes, sign, zero, tilt, how, notes=tuple(notes))


def _hinge(tree: Tree, kind: JointName, joint: str | None, side: Side | None) -> str:
    """The hinge of a name; without one the only one that is called so, of the side if one is given."""
    hinges = {name: each for name, each in tree.joints().items() if each[1].kind == "hinge"}
    if joint is None:
        called = [name for name in hinges if kind in NAMED and has(NAMED[kind], name)]
        called = [name for name in called if side in (None, side_of(name, hinges[name][0].name))]
        called = [name for name in called if has(FLEXES, name)] or called
        if len(called) != 1:
            problem = f"is needed: the orthosis is for {a_joint(kind)}"
            others = [words for other, words in NAMED.items() if other != kind]
            free = [name for name in hinges if not any(has(words, name) for words in others)]
            allowed = listed(called or free, 24) or f"a model with the hinge of {a_joint(kind)}"
            raise InputError(problem, field="joint", allowed=allowed)
        joint = called[0]
    if joint not in hinges:
        raise unknown(joint, hinges, field="joint", problem="there is no such hinge")
    return joint

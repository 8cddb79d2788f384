"""Tests whether a hinge is an ankle, and not of another limb, a wheel, or an animal on its toes."""

import re

import numpy as np

from afo_sim.common import InputError
from afo_sim.legs.candidates import ANKLE_WORDS, FOOT_WORDS, Candidate, has, plain
from afo_sim.legs.extent import outline
from afo_sim.legs.tree import Tree

OTHERS = re.compile(
    r"(?<![a-z])[rl]?(elbow|wrist|shoulder|humerus|ulna|hand|finger|hip|knee|wheel|tarsus|hock|paw|hoof|wing)"
)
ROUND = 0.9  # least over greatest reach about the hinge: of a box foot at most 0.7
DEEPEST = 1.5  # reach below the hinge over the length: of 60 human and robot feet at most 0.5
STEEPEST_SOLE = np.radians(20.0)  # at zero; of the same feet at most 14 deg, of dogs 37, of rodents 56
ALONG = 0.8  # cosine from which on a further hinge turns as the ankle does


def check_name(leg: Candidate, file: object) -> None:
    """Refuse a hinge or foot that is named after another joint or limb."""
    for field, name in (("ankle", leg.ankle), ("foot", leg.foot)):
        word = OTHERS.search(plain(name))
        if word and not has(ANKLE_WORDS, name) and not has(FOOT_WORDS, name):
            problem = f"is no human ankle: its name says {word.group(1)!r}"
            raise InputError(problem, file=file, field=field, value=name, allowed="another hinge")


def check_foot(
    tree: Tree, leg: Candidate, centre: np.ndarray, axes: np.ndarray, sole: float | None, sign: float
) -> None:
    """Refuse what is not a human foot: a wheel, a limb, or an animal's toes."""
    reason = _other_limb(tree, leg.foot, centre, axes)
    if not reason and sole is not None and abs(sole) > STEEPEST_SOLE:
        slope = f"{abs(np.degrees(sole)):.0f} deg toe {'up' if sole > 0.0 else 'down'}"
        reason = f"at 0 deg {leg.foot!r} stands {slope}, as of an animal; of a human foot "
        reason += f"{np.degrees(-sign * sole):.0f} deg would be the `zero`"
    if reason:
        problem = f"is no human ankle: {reason}"
        raise InputError(problem, file=tree.file, field="ankle", value=leg.ankle, allowed="another hinge")


def _other_limb(tree: Tree, foot: str, centre: np.ndarray, axes: np.ndarray) -> str:
    """Why a foot is a limb or a wheel, by its further hinges and its reach."""
    parts = tree.below(foot)
    total = sum(part.mass for part in parts)
    for part in parts[1:]:
        turn = tree.world_pose(part.name)[:3, :3]
        share = sum(each.mass for each in tree.below(part.name)) / (total or 1.0)
        for joint in part.joints:
            if joint.kind == "hinge" and share > 0.5 and abs(turn @ joint.axis @ axes[:, 1]) > ALONG:
                return f"{joint.name!r}, which turns as it does, carries {100 * share:.0f} % of {foot!r}"
    points = (outline(tree, parts, points=False) - centre) @ axes
    if len(points) < 3:
        return ""
    (back, _, below), (front, _, above) = -points.min(axis=0), points.max(axis=0)
    reaches = [front, back, above, below]
    if min(reaches) > ROUND * max(reaches):
        return f"{foot!r} is round about it, {1000 * min(reaches):.0f} to {1000 * max(reaches):.0f} mm"
    if below > DEEPEST * (front + back):
        return f"{foot!r} reaches {1000 * below:.0f} mm down and is {1000 * (front + back):.0f} mm long"
    return ""

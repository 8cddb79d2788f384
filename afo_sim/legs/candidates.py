"""Which parts and which hinge of a tree can be a shank, a foot and the ankle, by names and structure."""

import dataclasses
import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, nearest_name
from afo_sim.description import Side
from afo_sim.legs.extent import outline
from afo_sim.legs.tree import Joint, Part, Tree, listed

SHANK_WORDS = re.compile(
    r"shank|shin|calf|tibia|lower[ _-]?leg|leg[ _-]?lower|(?<![a-z])[rl][ _-]?lleg|crus|knee"
)
FOOT_WORDS = re.compile(r"foot|ankle|(?<![a-z])ank(?![a-z])|talus|calcn|calcaneus|hindfoot")
ANKLE_WORDS = re.compile(r"ankle|(?<![a-z])ank(?![a-z])|talocrural|foot|_ak[xyz]$")
THIGH_WORDS = re.compile(r"thigh|femur|upper[ _-]?leg|hip")
# Joints and parts of a foot that are not the ankle.
BEYOND_WORDS = re.compile(r"subtalar|roll|invers|evers|mtp|toe|forefoot|hallux|phalan")
PART_WORDS = r"foot|ankle|talus|calcn|calcaneus|shank|shin|calf|tibia|knee|leg|toe|thigh|femur|hip|"
PART_WORDS += "clavicle|shoulder|arm|humerus|elbow|radius|ulna|wrist|hand|finger|thumb"
LETTERS: dict[Side, str] = {"right": "r", "left": "l"}
SIDES: dict[Side, re.Pattern[str]] = {
    side: re.compile(
        rf"{side}|(?<![a-z]){x}(t?(?![a-z])|(?=[ _-]?({PART_WORDS})))|(leg|arm|hand){x}(?![a-z])"
    )
    for side, x in LETTERS.items()
}
LONG_CHAIN = 5  # hinges of a leg that has an ankle: hip, knee and ankle; an animal's robot has three
TOGETHER = 0.06  # [m] within which the hinges of one ankle lie
LATERAL_COSINE = 0.5  # cosine; a hinge that is called an ankle is one if its axis is this near to lateral


@dataclass(frozen=True)
class Candidate:
    """Names of parts and hinge; `how` they were found, in words."""

    shank: str
    foot: str
    ankle: str
    how: dict[str, str]


def candidates(tree: Tree, shank: str | None, foot: str | None, ankle: str | None) -> list[Candidate]:
    """All legs that names and structure allow; what is given is taken."""
    for field, name in (("shank", shank), ("foot", foot)):
        if name is not None and name not in tree.parts:
            raise _no_such("body", field, name, list(tree.parts), tree.file)
    if ankle is not None:
        return [_about(tree, shank, foot, ankle)]
    if shank is not None and foot is not None:
        _check_order(tree, shank, foot)
        return [_between(tree, shank, foot, {"shank": "given", "foot": "given"})]
    if foot is not None:
        return [_above(tree, foot)]
    shanks = [shank] if shank is not None else named_shanks(tree)
    said = "given" if shank is not None else "by its name"
    legs = [leg for name in shanks if (leg := _below(tree, name, said))]
    found = [leg for leg in legs if not any(tree.way(leg.shank, other.shank) for other in legs)]
    if shank is not None and not found:
        problem = f"no hinge hangs below the body {shank!r}"
        allowed = listed(part.name for part in tree.below(shank)[1:])
        raise InputError(problem, field="foot", allowed=allowed)
    return found or _by_joints(tree) or _without_a_hinge(tree, shanks) or _by_chains(tree)


def _check_order(tree: Tree, shank: str, foot: str) -> None:
    if shank == foot:
        raise InputError("is also given as the foot", field="shank", value=shank, allowed="another body")
    if tree.way(shank, foot):
        return
    if tree.way(foot, shank):
        problem = f"is attached to {foot!r}: shank and foot are swapped"
        raise InputError(problem, field="shank", value=shank, allowed=f"shank {foot!r} and foot {shank!r}")
    below = listed(part.name for part in tree.below(shank)[1:])
    raise InputError(f"does not hang on {shank!r}", field="foot", value=foot, allowed=f"below it: {below}")


def _about(tree: Tree, shank: str | None, foot: str | None, ankle: str) -> Candidate:
    """The leg about an ankle that is given."""
    joints = tree.joints()
    hinges = [name for name, _ in _hinges(tree.parts.values())]
    if ankle not in joints:
        raise _no_such("joint", "ankle", ankle, hinges, tree.file)
    part, joint = joints[ankle]
    if joint.kind != "hinge":
        problem = f"is a {joint.kind} joint, and an ankle is a hinge"
        raise InputError(problem, field="ankle", value=ankle, allowed=listed(hinges))
    if part.parent is None and shank is None:
        problem = f"moves {part.name!r} against the world: there is no shank"
        raise InputError(problem, field="ankle", value=ankle)
    upper = shank if shank is not None else _shank_over(tree, part)
    how = {"shank": "given" if shank else f"the body above {part.name!r}", "ankle": "given"}
    if foot is not None:
        _check_order(tree, upper, foot)
    if not tree.way(upper, part.name) or (foot is not None and part not in tree.way(upper, foot)):
        between = f"{upper!r} and {foot or part.name!r}"
        allowed = listed([name for name, _ in _hinges(tree.way(upper, foot or part.name))])
        raise InputError(f"does not lie between {between}", field="ankle", value=ankle, allowed=allowed)
    how["foot"] = "given" if foot == part.name else f"the body that {ankle!r} moves"
    return Candidate(upper, part.name, ankle, how)


def _between(tree: Tree, shank: str, foot: str, how: dict[str, str]) -> Candidate:
    """The leg of two parts that hang together: its ankle is a hinge between them."""
    chain = tree.way(shank, foot)
    hinges = _hinges(chain)
    if not hinges:
        others = [f"{joint.name} ({joint.kind})" for part in chain for joint in part.joints]
        there = listed(others) if others else "they are fixed to each other"
        problem = f"no hinge lies between {shank!r} and {foot!r}: {there}"
        raise InputError(problem, field="ankle", allowed="two bodies with a hinge between them")
    ankle, why = _ankle_of(tree, shank, chain, hinges)
    carrier = tree.joints()[ankle][0].name
    said = how["foot"] if carrier == foot else f"the body that {ankle!r} moves; {foot!r} is attached to it"
    return Candidate(shank, carrier, ankle, how | {"foot": said, "ankle": why})


def _hinges(chain: Iterable[Part]) -> list[tuple[str, Joint]]:
    return [(joint.name, joint) for part in chain for joint in part.joints if joint.kind == "hinge"]


def _ankle_of(tree: Tree, shank: str, chain: list[Part], hinges: list[tuple[str, Joint]]) -> tuple[str, str]:
    """The hinge of a chain whose axis is most lateral, of those called an ankle; and why."""
    if len(hinges) == 1:
        return hinges[0][0], "the only hinge between shank and foot"
    lateral = _lateral(tree, shank, chain)
    lies = {name: abs(float(tree.line(name)[0] @ lateral)) for name, _ in hinges}
    pool = [name for name, _ in hinges if not has(BEYOND_WORDS, name)] or list(lies)
    pool = [name for name in pool if has(ANKLE_WORDS, name) and lies[name] >= LATERAL_COSINE] or pool
    best = max(pool, key=lies.__getitem__)
    others = ", ".join(name for name in lies if name != best)
    called = "called so, and " if has(ANKLE_WORDS, best) else ""
    return best, f"{called}its axis is the most lateral one, beside {others}"


def _lateral(tree: Tree, shank: str, chain: list[Part]) -> np.ndarray:
    """About perpendicular to the shank and the foot's length (3,)."""
    up = tree.world_pose(shank)[:3, 3] - tree.world_pose(chain[0].name)[:3, 3]
    if np.linalg.norm(up) < 1e-6:
        up = tree.world_pose(shank)[:3, :3] @ tree.parts[shank].centre
    points = outline(tree, tree.below(chain[0].name))
    if len(points) < 2 or np.linalg.norm(up) < 1e-9:
        return np.array([0.0, 1.0, 0.0])
    up = up / np.linalg.norm(up)
    flat = points - points.mean(axis=0)
    flat = flat - np.outer(flat @ up, up)
    _, _, main = np.linalg.svd(flat, full_matrices=False)
    return np.cross(up, main[0])


def _above(tree: Tree, foot: str) -> Candidate:
    """The leg of a foot: the ankle is the hinge that it hangs on, or one above it."""
    part = next((part for part in tree.upward(foot) if _hinges([part])), None)
    if part is None or part.parent is None:
        feet = listed([name for name in tree.parts if has(FOOT_WORDS, name)])
        raise InputError("is attached to no hinge", field="foot", value=foot, allowed=feet)
    shank = _shank_over(tree, part)
    said = "by its name" if has(SHANK_WORDS, shank) else f"the body above {part.name!r}"
    return _between(tree, shank, foot, {"shank": said, "foot": "given"})


def _shank_over(tree: Tree, part: Part) -> str:
    """The nearest body above that is called a shank; else the one next above."""
    assert part.parent is not None
    for above in tree.upward(part.parent):
        if has(THIGH_WORDS, above.name):
            break
        if has(SHANK_WORDS, above.name) and not has(FOOT_WORDS, above.name):
            return above.name
    return part.parent


def named_shanks(tree: Tree) -> list[str]:
    """Bodies called a shank."""
    return [name for name in tree.parts if has(SHANK_WORDS, name) and not has(FOOT_WORDS, name)]


def _without_a_hinge(tree: Tree, shanks: list[str]) -> list[Candidate]:
    """No leg; refuses feet that are called so but are fixed, or hang on another joint than a hinge."""
    for shank in shanks:
        feet = [part.name for part in tree.below(shank)[1:] if has(FOOT_WORDS, part.name)]
        if feet:
            _between(tree, shank, feet[0], {"shank": "by its name", "foot": "by its name"})
    return []


def _below(tree: Tree, shank: str, said: str) -> Candidate | None:
    """The leg below a shank; None where no foot hangs there."""
    below = tree.below(shank)[1:]
    feet = [part for part in below if has(FOOT_WORDS, part.name) and not has(BEYOND_WORDS, part.name)]
    feet = feet or [part for part in below if has(FOOT_WORDS, part.name)]
    reached = [part for part in feet if _hinges(tree.way(shank, part.name))]
    if reached:
        deepest = max(reached, key=lambda part: len(tree.way(shank, part.name)))
        rolled = [part for part in below if has(FOOT_WORDS, part.name) and tree.way(deepest.name, part.name)]
        how = {"shank": said, "foot": "by its name"}
        return _between(tree, shank, rolled[-1].name if rolled else deepest.name, how)
    hinged = [part for part in below if _hinges([part])]
    first = [part for part in hinged if not _hinges(tree.way(shank, part.name)[:-1])]
    if len(first) == 1:
        how = {"shank": said, "foot": "the one body on a hinge below the shank"}
        return _between(tree, shank, first[0].name, how)
    return None


def _by_joints(tree: Tree) -> list[Candidate]:
    """Legs by joints that are called ankles, or by the only hinge that there is."""
    hinges = {
        name: part
        for name, (part, joint) in tree.joints().items()
        if joint.kind == "hinge" and part.parent is not None
    }
    named = [name for name in hinges if has(ANKLE_WORDS, name) and not has(BEYOND_WORDS, name)]
    said = "by its name" if named else "the only hinge"
    only = [name for name, part in hinges.items() if not has(SHANK_WORDS, part.name)]  # which would be a knee
    names = named or (only if len(hinges) == 1 else [])
    found = []
    for foot in dict.fromkeys(hinges[name].name for name in names):
        how = {"shank": f"the body above {foot!r}", "foot": "the body that the ankle moves"}
        leg = _between(tree, _shank_over(tree, tree.parts[foot]), foot, how)
        found.append(dataclasses.replace(leg, how=leg.how | {"ankle": said}))
    unlike = {(leg.shank, leg.foot): leg for leg in found}  # pitch and roll of one ankle lead to one leg
    feet_found = {leg.foot for leg in found}
    return [leg for leg in unlike.values() if leg.shank not in feet_found]


def _by_chains(tree: Tree) -> list[Candidate]:
    """The legs of a body that numbers its links: two long chains of hinges, with the ankle at their ends."""
    found = []
    for name in tree.parts:
        if "leg" not in name.lower() or _hinges(tree.below(name)[1:]) or not _hinges([tree.parts[name]]):
            continue
        chain = [part for part in tree.upward(name) if _hinges([part])]
        places = [tree.line(_hinges([part])[0][0])[1] for part in chain]
        far = [k for k, place in enumerate(places) if np.linalg.norm(place - places[0]) > TOGETHER]
        if len(chain) >= LONG_CHAIN and far:
            how = {"shank": "the link above the last hinges of the leg", "foot": "the last link of the leg"}
            found.append(_between(tree, chain[far[0]].name, name, how))
    return found if len(found) == 2 else []


def _no_such(kind: str, field: str, name: str, names: list[str], file: object) -> InputError:
    """An error for a name that a file lacks: the names that it has, and the nearest one."""
    problem, near = f"there is no such {kind} in {file or 'the model'}", nearest_name(name, names)
    return InputError(problem, field=field, value=name, allowed=listed(sorted(names), 24), nearest=near)


def has(words: re.Pattern[str], name: str) -> bool:
    """Whether a name holds one of the words."""
    return words.search(plain(name)) is not None


def side_of(*names: str) -> Side | None:
    """The side in the first name that holds one; None where none does, or where a name holds both."""
    for name in names:
        named: list[Side] = [side for side, words in SIDES.items() if has(words, name)]
        if len(named) == 1:
            return named[0]
    return None


def plain(name: str) -> str:
    """A name in small letters, with camelCase broken up: RightFoot → right_foot."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()

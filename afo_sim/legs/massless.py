"""Chains of massless parts, as URDF has them for a hip, as one part with several joints."""

import dataclasses

import numpy as np

from afo_sim.legs.tree import Joint, Part, Tree, listed

SCALAR = ("hinge", "slide")


def merged(tree: Tree) -> Tree:
    """The same tree with fewer massless parts: their joints stand on the part below, as MJCF has them.

    MuJoCo moves no body without mass. A massless part M that nothing but one other part C hangs on moves it
    by T_M J_M T_C J_C = (T_M T_C) (T_C⁻¹ J_M T_C) J_C: its joints, in the axes of C, before those of C.
    A part with points or with a second child stays; shapes of a part that goes are left out, and told.
    """
    parts = dict(tree.parts)
    gone: list[str] = []
    for name in list(parts):
        below = [part for part in parts.values() if part.parent == name]
        if len(below) == 1 and _bare(parts[name]) and all(joint.kind in SCALAR for joint in below[0].joints):
            parts[below[0].name] = _joined(parts[name], below[0])
            gone.append(name)
            del parts[name]
    notes = [f"massless links are taken together with the one below: {listed(gone)}"] if gone else []
    return dataclasses.replace(tree, parts=parts, notes=(*tree.notes, *notes))


def _bare(part: Part) -> bool:
    """Whether a part moves, and has no mass and no points."""
    moves = part.joints and all(joint.kind in SCALAR for joint in part.joints)
    return bool(moves) and not (part.mass or part.inertia.any() or part.points)


def _joined(above: Part, part: Part) -> Part:
    back = np.linalg.inv(part.pose)
    joints = (*(_seen(joint, back) for joint in above.joints), *part.joints)
    return dataclasses.replace(part, parent=above.parent, pose=above.pose @ part.pose, joints=joints)


def _seen(joint: Joint, back: np.ndarray) -> Joint:
    """A joint in other axes; `back` is the pose in them of the axes that it stands in (4, 4)."""
    place = back[:3, :3] @ joint.position + back[:3, 3]
    return dataclasses.replace(joint, axis=back[:3, :3] @ joint.axis, position=place)

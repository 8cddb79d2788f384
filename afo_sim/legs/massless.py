"""A tree that MuJoCo can move: no part without mass or inertia hangs on a joint."""

import dataclasses

import numpy as np

from afo_sim.legs.tree import Joint, Part, Tree, moved, reading_note

# Of a part on a joint [kg], [kg·m²]: MuJoCo takes less than 1e-15 for none, and these move nothing else.
LEAST_MASS, LEAST_INERTIA = 1e-12, 1e-14
IDLE = 1e-10  # [kg] or [kg·m²] of all that a joint moves


def movable(tree: Tree) -> Tree:
    """The same tree, where parts on joints have at least a trifle of mass and inertia."""
    poses = {name: tree.world_pose(name) for name in tree.parts}
    still = [
        joint.name
        for part in tree.parts.values()
        for joint in part.joints
        if joint.kind in ("hinge", "slide") and _inertia_about(tree, poses, part, joint) < IDLE
    ]
    parts = {name: _with_inertia(part, still) for name, part in tree.parts.items()}
    raised = [name for name, part in tree.parts.items() if parts[name].inertia is not part.inertia]
    idle = "joints that move no mass are taken as stiff: {names}"
    odd = "parts that have no inertia of a body are given the nearest: {names}"
    kinds = (("joints-idle", idle, still), ("inertias-raised", odd, raised))
    notes = [reading_note(code, text, names) for code, text, names in kinds if names]
    moving = {joint.name for part in parts.values() for joint in part.joints}
    couplings = tuple(each for each in tree.couplings if moving.issuperset(each[:2]))
    return dataclasses.replace(tree, parts=parts, notes=(*tree.notes, *notes), couplings=couplings)


def _with_inertia(part: Part, still: list[str]) -> Part:
    joints = tuple(joint for joint in part.joints if joint.name not in still)
    moments, axes = np.linalg.eigh(part.inertia)
    if not joints or (part.mass >= LEAST_MASS and moments[0] >= LEAST_INERTIA):
        return dataclasses.replace(part, joints=joints)
    inertia = axes * np.maximum(moments, LEAST_INERTIA) @ axes.T
    return dataclasses.replace(part, joints=joints, mass=max(part.mass, LEAST_MASS), inertia=inertia)


def _inertia_about(tree: Tree, poses: dict[str, np.ndarray], carried: Part, joint: Joint) -> float:
    """Inertia of a joint's part, and of all that hangs on it, about a hinge [kg·m²]; of a slide its mass."""
    (axis, place), total = tree.line(joint.name), 0.0
    for part in tree.below(carried.name):
        pose = poses[part.name]
        across = np.cross(axis, moved(pose, part.centre) - place)
        own = pose[:3, :3].T @ axis
        total += (
            part.mass if joint.kind == "slide" else own @ part.inertia @ own + part.mass * across @ across
        )
    return float(total)

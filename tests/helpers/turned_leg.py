"""The shipped leg told otherwise: in other axes, its ankle turned round and shifted, in a whole body."""

import dataclasses
from collections.abc import Callable, Iterable
from typing import Any

import mujoco
import numpy as np

import afo_sim as afo
from afo_sim.common import GRAVITY
from afo_sim.common import find as asset
from afo_sim.legs import Attached, Part, Tree
from afo_sim.legs.mjcf import read_mjcf
from afo_sim.legs.tree import Joint
from afo_sim.model.supply_and_timer import controls
from afo_sim.simulation import Recording

KNEE = 0.43  # [m] above the ankle


def shipped() -> Tree:
    return read_mjcf(asset("leg", "adult_75kg").parent / "leg.xml")


def seated() -> mujoco.MjSpec:
    """The shipped leg without its toes' hinge, as a seated scenario has it."""
    spec = mujoco.MjSpec.from_file(str(asset("leg", "adult_75kg").parent / "leg.xml"))
    spec.delete(spec.joint("toe"))
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    return spec


DAMPING = 0.5  # [N·m·s/rad] of the ankle in `beside_its_scenario`


def beside_its_scenario(
    orthosis: Any,
    sets: dict[str, Any],
    read: Callable[[Attached, mujoco.MjData], Iterable[float]],
    worn: Callable[[Attached], Attached] = lambda leg: leg,
) -> tuple[Recording, np.ndarray]:
    """A run, and the same orthosis attached, stepped by its inputs: angle before, `read` after each step."""
    sets = sets | {"leg.passive.scale": 0.0, "leg.damping": f"{DAMPING} N*m*s/rad"}
    scenario = afo.load("scenario", "seated", sets)
    run, built = afo.run(scenario), afo.build(scenario)
    spec = seated()
    spec.joint("ankle").damping = [0.5 * DAMPING, 0.0, 0.0]
    names = {"shank": "shank", "foot": "foot", "ankle": "ankle", "side": "right"}
    leg = worn(afo.attach(spec, orthosis, **names, timestep="2 ms"))
    inputs = {**leg.valves, **leg.chambers}
    theirs = {**built.index.valves, **built.index.chambers}
    data, rows = leg.data(run["ankle/angle"][:1]), []
    with leg.callbacks():
        for row in controls(built):
            data.ctrl[list(inputs.values())] = row[[theirs[name] for name in inputs]]
            data.qfrc_applied[:] = -0.5 * DAMPING * data.qvel  # the half that the passive ankle takes
            angle = leg.angle(data)
            mujoco.mj_step(leg.model, data)
            rows.append([angle, *read(leg, data)])
    return run, np.array(rows).T


def rotation(random: np.random.Generator) -> np.ndarray:
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


def placed(random: np.random.Generator) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation(random), random.normal(size=3)
    return pose


def in_axes(part: Part, own: np.ndarray, parent: np.ndarray) -> Part:
    """A part told in other axes, whose pose in its old ones is `own`; its parent's are `parent`."""
    back = np.linalg.inv(own)
    turn = back[:3, :3]
    point = lambda at: turn @ at + back[:3, 3]  # noqa: E731
    return dataclasses.replace(
        part,
        pose=np.linalg.inv(parent) @ part.pose @ own,
        centre=point(part.centre),
        inertia=turn @ part.inertia @ turn.T,
        joints=tuple(
            dataclasses.replace(j, axis=turn @ j.axis, position=point(j.position)) for j in part.joints
        ),
        shapes=tuple(dataclasses.replace(s, pose=back @ s.pose) for s in part.shapes),
        points={name: point(at) for name, at in part.points.items()},
    )


def told_otherwise(tree: Tree, random: np.random.Generator) -> Tree:
    """Every part in axes of its own, the whole somewhere else in the world."""
    axes: dict[str | None, np.ndarray] = {None: placed(random)}
    axes |= {name: placed(random) for name in tree.parts}
    parts = {name: in_axes(part, axes[name], axes[part.parent]) for name, part in tree.parts.items()}
    return dataclasses.replace(tree, parts=parts)


def with_ankle(tree: Tree, change: "dict[str, object]") -> Tree:
    foot = tree.parts["foot"]
    ankle = dataclasses.replace(foot.joints[0], **change)  # type: ignore[arg-type]
    return dataclasses.replace(tree, parts=tree.parts | {"foot": dataclasses.replace(foot, joints=(ankle,))})


def turned_round(tree: Tree, shift: float) -> Tree:
    """The ankle's coordinate is shift − angle: plantarflexion positive, its zero elsewhere [rad]."""
    joint = tree.parts["foot"].joints[0]
    assert joint.range is not None
    low, high = joint.range
    change = {"axis": -joint.axis, "range": (shift - high, shift - low), "zero": shift}
    return with_ankle(tree, change)


def hinge(name: str, axis: tuple[float, float, float], at: tuple[float, float, float] = (0, 0, 0)) -> Joint:
    return Joint(name, "hinge", np.array(axis, float), np.array(at, float), range=(-1.0, 1.0))


def in_a_body(tree: Tree) -> Tree:
    """A pelvis on a free joint, a thigh, and the leg below it on a knee."""

    def block(name: str, parent: str | None, at: tuple[float, float, float], *joints: Joint) -> Part:
        pose = np.eye(4)
        pose[:3, 3] = at
        return Part(name, parent, pose, 8.0, np.zeros(3), 0.1 * np.eye(3), joints)

    free = Joint("root", "free", np.array([0.0, 0.0, 1.0]), np.zeros(3))
    shank = tree.parts["shank"]
    pose = np.eye(4)
    pose[2, 3] = -0.8
    hung = dataclasses.replace(
        shank, parent="thigh", pose=pose, joints=(hinge("knee", (0, 1, 0), (0, 0, KNEE)),)
    )
    parts = {
        "pelvis": block("pelvis", None, (0, 0, 1.2), free),
        "thigh": block("thigh", "pelvis", (0, -0.1, 0), hinge("hip", (0, 1, 0))),
        **(tree.parts | {"shank": hung}),
    }
    return Tree(None, parts, beside={"actuators": ("soleus",)})

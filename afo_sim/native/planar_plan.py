"""What a walker's compiled model is to the planar steps; None where those cannot take it."""

import itertools
from collections.abc import Iterator

import mujoco
import numpy as np

from afo_sim.native.planar import DOFS, SEGMENTS, Head, OtherPlan, PathPlan, PointPlan, SegmentPlan, before
from afo_sim.native.slots import KIND, MUSCLE_ROW, Kind

SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
# what a leg's file may ask of MuJoCo's steps that these do not know
ELSE = (
    "body_gravcomp", "jnt_limited", "jnt_stiffnesspoly", "jnt_actfrclimited", "dof_dampingpoly",
    "dof_frictionloss", "tendon_stiffness", "tendon_damping", "tendon_frictionloss",
)  # fmt: skip


def plan_of(model: mujoco.MjModel, pads: np.ndarray, trunk: int, feet: tuple[int, ...]) -> np.ndarray | None:
    """The plan of a model with the joints of a walker, its pads in the soles' order; None if not planar."""
    if not _planar(model):
        return None
    data = mujoco.MjData(model)  # all angles zero
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    segments, hinges = _segments(model), data.xanchor[2:]
    rows = [*_bodies(model, data, segments, hinges), *_points(model, data, pads, segments, hinges)]
    pieces = [
        each for tendon in range(model.ntendon) for each in _path(model, data, tendon, segments, hinges)
    ]
    others = list(_others(model))
    centres = [
        (segments[body], *(data.xipos[body] - hinges[segments[body]])[[0, 2]]) for body in (trunk, *feet)
    ]
    counts = (len(pieces), len(others), model.na, model.nu)
    head = Head._make((*-model.opt.gravity[[0, 2]], 0.0, *counts))
    return np.concatenate([np.array(each, dtype=float) for each in (head, *centres, *rows, *pieces, *others)])


def _planar(model: mujoco.MjModel) -> bool:
    """Whether all joints and paths are such as the steps know."""
    slides, hinges = np.split(model.jnt_axis, [2])
    muscles = model.actuator_user[model.actuator_user[:, KIND] == Kind.MUSCLE]
    kinds = [mujoco.mjtJoint.mjJNT_SLIDE] * 2 + [mujoco.mjtJoint.mjJNT_HINGE] * SEGMENTS
    return bool(
        model.nv == DOFS
        and (model.jnt_type == kinds).all()
        and np.allclose(slides, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        and np.allclose(hinges, [0.0, -1.0, 0.0])
        and not any(getattr(model, each).any() for each in ELSE)
        and (model.wrap_type == SITE).all()
        and not muscles[:, MUSCLE_ROW.wrap_friction].any()
    )


def _segments(model: mujoco.MjModel) -> np.ndarray:
    """The segment that each body belongs to; −1 for the world."""
    found = np.full(model.nbody, -1)
    for body in range(1, model.nbody):
        joint = model.body_jntadr[body] + model.body_jntnum[body] - 1  # the trunk's last
        found[body] = joint - 2 if model.body_jntnum[body] else found[model.body_parentid[body]]
    return found


def _bodies(
    model: mujoco.MjModel, data: mujoco.MjData, segments: np.ndarray, hinges: np.ndarray
) -> Iterator[SegmentPlan]:
    for k in range(SEGMENTS):
        own = np.flatnonzero(segments == k)
        mass = model.body_mass[own]
        centre = mass @ data.xipos[own] / mass.sum()
        axes = data.ximat[own].reshape(-1, 3, 3)
        inertia = np.einsum("bi,bi->b", axes[:, 1, :] ** 2, model.body_inertia[own])
        far = data.xipos[own] - centre
        inertia = inertia + mass * (far[:, 0] ** 2 + far[:, 2] ** 2)
        hinge, joint = hinges[k] - hinges[before(k)], 2 + k
        yield SegmentPlan(
            hinge_x=hinge[0], hinge_z=hinge[2], mass=mass.sum(), x=(centre - hinges[k])[0],
            z=(centre - hinges[k])[2], inertia=inertia.sum(), stiffness=model.jnt_stiffness[joint],
            rest=model.qpos_spring[joint], damping=model.dof_damping[joint],
            armature=model.dof_armature[joint],
        )  # fmt: skip


def _points(
    model: mujoco.MjModel, data: mujoco.MjData, pads: np.ndarray, segments: np.ndarray, hinges: np.ndarray
) -> Iterator[PointPlan]:
    for pad in pads.ravel():
        site = model.actuator_trnid[pad, 0]
        k = segments[model.site_bodyid[site]]
        x, _, z = data.site_xpos[site] - hinges[k]
        alike = np.flatnonzero(model.actuator_trnid[:, 0] == site)
        (grip,) = (i for i in alike if model.actuator_user[i, KIND] == Kind.GRIP)
        yield PointPlan._make((k, x, z, pad, grip))


def _path(
    model: mujoco.MjModel, data: mujoco.MjData, tendon: int, segments: np.ndarray, hinges: np.ndarray
) -> list[PathPlan]:
    """The pieces of a path that move."""
    first = model.tendon_adr[tendon]
    sites = model.wrap_objid[first : first + model.tendon_num[tendon]]
    of_tendon = model.actuator_trntype == mujoco.mjtTrn.mjTRN_TENDON
    (actuator,) = np.flatnonzero(of_tendon & (model.actuator_trnid[:, 0] == tendon))
    moving, fixed = [], 0.0
    for site, following in itertools.pairwise(sites):
        ends = [(segments[model.site_bodyid[each]], data.site_xpos[each]) for each in (site, following)]
        (near, a), (far, b) = sorted(ends, key=lambda end: int(end[0]))
        if near == far:
            fixed += float(np.linalg.norm(b - a))
        else:
            places = (a - hinges[near])[[0, 2]], (b - hinges[far])[[0, 2]]
            moving.append((near, *places[0], far, *places[1], (b - a)[1] ** 2))
    top, bottom = min(each[0] for each in moving), max(each[3] for each in moving)
    last = len(moving) - 1
    whole = (fixed, top, bottom)
    return [PathPlan._make((actuator, *each, *whole, k == 0, k == last)) for k, each in enumerate(moving)]


def _others(model: mujoco.MjModel) -> Iterator[OtherPlan]:
    """What acts at a joint, in the order of the actuators, but the reflexes, which come first."""
    early = model.actuator_actearly
    for i in np.flatnonzero(model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT):
        if model.actuator_user[i, KIND] != Kind.REFLEX:
            state = model.actuator_actadr[i] if model.actuator_actnum[i] == 1 else -1
            gear = model.actuator_gear[i, 0]
            yield OtherPlan._make((i, model.actuator_trnid[i, 0], gear, state, early[i]))

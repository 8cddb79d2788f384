"""Inversion and eversion: the subtalar hinge, and the muscles' lever arms about that and the inversion axis.

The subtalar hinge is the foot's second joint, after the ankle. MuJoCo turns a body by its joints in their
order. So the ankle's axis stays in the shank, and the subtalar axis is carried by the ankle, as it is by the
talus. The inversion axis runs forward in the talus, through the ankle joint. It turns with the ankle, and not
with the subtalar hinge.

A muscle's lever arm about an axis is −dL/dφ, φ a turn of the foot about it. No such turn happens in the
model that is stepped. So a second model has a hinge for it, which stays at zero. MuJoCo gives its Jacobian,
whatever points and surfaces the path runs along.
"""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import InputError, in_unit
from afo_sim.description import JOINTS, MuscleGroup, Scenario, Side, Subtalar
from afo_sim.model.mounting import ANKLE, SUBTALAR
from afo_sim.physics import root

INVERSION = "inversion"
SPACING = np.radians(0.1)  # of the ankle angles between which arms are interpolated: to 2e-8 m
BEYOND = 0.5  # the stops, by which the ankle may swing through them [rad]
STOP = [0.99, 0.999, 0.001, 0.5, 2.0]  # by MuJoCo's own stops 5 N·m would turn so light a foot 2° further
SPRING_LIMIT = 0.5  # of (rate × time step)² at most; MuJoCo takes a joint's spring explicitly


def axis_of(subtalar: Subtalar, side: Side) -> np.ndarray:
    """Direction about which inversion is positive; forward, left, up in the foot's axes (3,)."""
    rise, aside = subtalar.inclination, subtalar.deviation
    right = np.array(
        [math.cos(rise) * math.cos(aside), math.cos(rise) * math.sin(aside), math.sin(rise)], dtype=float
    )
    return right if side == "right" else right * [-1.0, 1.0, -1.0]


def free(scenario: Scenario) -> bool:
    """Whether the foot turns about the subtalar axis: not in recorded walking, which has nothing of it."""
    return scenario.leg.subtalar is not None and not scenario.walking


def check_subtalar(scenario: Scenario) -> None:
    """Refuse a subtalar hinge where there is no ankle above it, or muscles that have no place beside it."""
    leg, field = scenario.leg, "leg.subtalar"
    if leg.subtalar is None:
        return
    for name, group in scenario.orthosis.muscle.items():
        if group.pulley is not None:
            problem = f"does not go with a pulley: the muscle {name} has no line about another axis"
            raise InputError(problem, allowed="muscles with origin and insertion", field=field)


def add_subtalar(spec: mujoco.MjSpec, scenario: Scenario, taller: float) -> mujoco.MjsJoint | None:
    """Give the foot its subtalar hinge, if the leg has one, whether it is free or not."""
    leg, subtalar = scenario.leg, scenario.leg.subtalar
    if subtalar is None:
        return None
    if any(joint.name == SUBTALAR for joint in spec.joints):
        problem = f"there is a joint {SUBTALAR!r} in the leg's file already"
        allowed = "a file without it; leg.subtalar makes the hinge"
        raise InputError(problem, file=leg.file, field="leg.subtalar", allowed=allowed)
    unit = 180.0 / math.pi if spec.compiler.degree else 1.0  # as the file states its angles
    below = np.array([0.0, 0.0, -taller * subtalar.below_ankle])
    rest = [0.0, 0.0]  # of MuJoCo's polynomials
    return spec.body(leg.foot).add_joint(
        name=SUBTALAR,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=axis_of(subtalar, scenario.simulated_side),
        pos=np.array(spec.joint(ANKLE).pos) + below,
        limited=mujoco.mjtLimited.mjLIMITED_TRUE,
        range=np.array(subtalar.range) * unit,
        stiffness=[subtalar.stiffness, *rest],
        damping=[subtalar.damping, *rest],
        solimp_limit=STOP,
    )


def check_stiffness(model: mujoco.MjModel, scenario: Scenario) -> None:
    """Refuse a spring that would ring at the time step; InputError with the step that would do."""
    if not free(scenario):
        return
    joint, step = model.joint(SUBTALAR), scenario.timestep
    inertia = float(model.dof_M0[int(joint.dofadr[0])])
    stiffness = float(model.jnt_stiffness[joint.id])
    if stiffness * step**2 > SPRING_LIMIT * inertia:
        enough = in_unit(math.sqrt(SPRING_LIMIT * inertia / stiffness), "s", "ms")
        raise InputError(
            f"leg.subtalar.stiffness of {stiffness:g} N·m/rad is too stiff for this time step",
            field="timestep",
            value=f"{in_unit(step, 's', 'ms'):g} ms",
            allowed=f"at most {0.99 * enough:.2g} ms",
        )


def find_rest(model: mujoco.MjModel, data: mujoco.MjData, forward: Callable[[], None]) -> None:
    """Turn the foot about its free subtalar hinge to where it rests, or to the stop that it rests on."""
    joint = model.joint(SUBTALAR)
    place, dof = int(joint.qposadr[0]), int(joint.dofadr[0])

    def moment(angle: float) -> float:
        data.qpos[place] = angle
        forward()
        return float(data.qfrc_smooth[dof])

    at_zero = moment(0.0)
    if at_zero == 0.0:
        return
    stop = float(joint.range[int(at_zero > 0.0)])
    if at_zero * moment(stop) >= 0.0:
        return
    moment(root(moment, min(stop, 0.0), max(stop, 0.0), 1e-14))


@dataclass(frozen=True, eq=False)
class SideArms:
    """Lever arms of the muscles about the inversion axis and, where there is one, the subtalar axis."""

    model: mujoco.MjModel
    names: tuple[str, ...]
    axes: tuple[str, ...]
    free: bool

    @classmethod
    def of(
        cls, spec: mujoco.MjSpec, scenario: Scenario, muscles: dict[str, int], taller: float
    ) -> Self | None:
        """Of what is put together; None where no muscle can have such a moment."""
        if not _has_side_moment(scenario):
            return None
        foot, ankle = spec.body(scenario.leg.foot), spec.joint(ANKLE)
        turns = free(scenario)
        if turns:
            spec.delete(spec.joint(SUBTALAR))  # joints act in their order: inversion is the talus'
        inside = 1.0 if scenario.simulated_side == "right" else -1.0
        hinge = mujoco.mjtJoint.mjJNT_HINGE
        foot.add_joint(name=INVERSION, type=hinge, axis=[inside, 0.0, 0.0], pos=ankle.pos)
        axes = [INVERSION]
        if add_subtalar(spec, scenario, taller) is not None:
            axes.append(SUBTALAR)
        return cls(spec.compile(), tuple(muscles), tuple(axes), turns)

    def at(self, ankle: np.ndarray, subtalar: np.ndarray | None = None) -> np.ndarray:
        """Lever arms [m] (axes, n, muscles) at ankle and subtalar angles [rad] (n,); inversion positive."""
        if not self.free:
            of_each = [[np.interp(ankle, self._grid, arm) for arm in arms.T] for arms in self._arms]
            return np.array(of_each).transpose(0, 2, 1)
        assert subtalar is not None
        return self._exactly(ankle, subtalar)

    @functools.cached_property
    def _grid(self) -> np.ndarray:
        """Ankle angles of the table [rad]."""
        lower, upper = self.model.joint(ANKLE).range
        count = int((upper - lower + 2.0 * BEYOND) / SPACING) + 2
        return np.linspace(lower - BEYOND, upper + BEYOND, count)

    @functools.cached_property
    def _arms(self) -> np.ndarray:
        """Lever arms over the table's angles [m] (axes, n, muscles)."""
        return self._exactly(self._grid, np.zeros(len(self._grid)))

    def _exactly(self, ankle: np.ndarray, subtalar: np.ndarray) -> np.ndarray:
        model, data = self.model, native.scratch(self.model)
        tendons = [model.tendon(name).id for name in self.names]
        dofs = [int(model.joint(name).dofadr[0]) for name in self.axes]
        places = [_place_of(model, tendons, dof) for dof in dofs]
        at = int(model.joint(ANKLE).qposadr[0])
        turn = int(model.joint(SUBTALAR).qposadr[0]) if self.free else None
        found = np.empty((len(ankle), len(dofs), len(tendons)))
        for k in range(len(ankle)):
            data.qpos[at] = ankle[k]
            if turn is not None:
                data.qpos[turn] = subtalar[k]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_tendon(model, data)
            for axis, place in enumerate(places):
                found[k, axis] = data.ten_J[place]
        return 0.0 - found.transpose(1, 0, 2)


def _place_of(model: mujoco.MjModel, tendons: list[int], dof: int) -> list[int]:
    """Where in `ten_J` the tendons' derivatives by a degree of freedom stand."""
    found = []
    for tendon in tendons:
        start = int(model.ten_J_rowadr[tendon])
        row = list(model.ten_J_colind[start : start + model.ten_J_rownnz[tendon]])
        found.append(start + row.index(dof))
    return found


def _has_side_moment(scenario: Scenario) -> bool:
    """Whether muscles may turn the foot to its sides."""
    leg, groups = scenario.leg, scenario.orthosis.muscle.values()
    if leg.directions != JOINTS["ankle"].directions or not groups:
        return False
    return leg.subtalar is not None or any(map(_off_the_midline, groups))


def _off_the_midline(group: MuscleGroup) -> bool:
    if group.origin is None or group.insertion is None:
        return False
    oblique = [p.surface for p in group.path if p.surface is not None and p.surface.shape == "cylinder"]
    ends = group.origin.from_joint[1], group.insertion.from_joint[1]
    aside = [*ends, *(point.from_joint[1] for point in group.path)]
    return any(aside) or any(s.axis[0] or s.axis[2] for s in oblique)

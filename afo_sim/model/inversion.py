"""Lever arms of the muscles by which they turn the foot to its sides: about the inversion and subtalar axes.

A muscle's lever arm about an axis is −dL/dφ, φ a turn of the foot about it. No such turn happens in the
model that is stepped. So a second model has a hinge for it, which stays at zero. MuJoCo gives its Jacobian,
whatever points and surfaces the path runs along.

The inversion axis runs forward in the talus, through the ankle joint. It turns with the ankle, and not with
the subtalar hinge.
"""

import functools
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.description.orthosis import MuscleGroup
from afo_sim.description.scenario import Scenario
from afo_sim.model.mounting import ANKLE, SUBTALAR
from afo_sim.model.subtalar import ANKLE_WORDS, add_subtalar, free

INVERSION = "inversion"
SPACING = np.radians(0.1)  # of the ankle angles between which arms are interpolated: to 2e-8 m
BEYOND = 0.5  # the stops, by which the ankle may swing through them [rad]


@dataclass(frozen=True, eq=False)
class SideArms:
    """Lever arms of the muscles about the inversion axis and, where there is one, the subtalar axis.

    model : with a hinge about each axis
    names : of the muscles, in the columns' order
    axes : names of the hinges
    free : whether the foot turns about the subtalar axis
    """

    model: mujoco.MjModel
    names: tuple[str, ...]
    axes: tuple[str, ...]
    free: bool

    @classmethod
    def of(
        cls, spec: mujoco.MjSpec, scenario: Scenario, muscles: dict[str, int], taller: float
    ) -> Self | None:
        """Of what is put together; None where no muscle can have such a moment."""
        if not has_side_moment(scenario):
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


def has_side_moment(scenario: Scenario) -> bool:
    """Whether muscles may turn the foot to its sides.

    Not those of groups whose middle runs in the plane of the leg: alike muscles on either side pull alike.
    With a subtalar hinge all may, since its axis is oblique.
    """
    leg, groups = scenario.leg, scenario.orthosis.muscle.values()
    if leg.directions != ANKLE_WORDS or not groups:
        return False
    return leg.subtalar is not None or any(map(_off_the_midline, groups))


def _off_the_midline(group: MuscleGroup) -> bool:
    if group.origin is None or group.insertion is None:
        return False
    oblique = [p.surface for p in group.path if p.surface is not None and p.surface.shape == "cylinder"]
    ends = group.origin.from_ankle[1], group.insertion.from_ankle[1]
    aside = [*ends, *(point.from_ankle[1] for point in group.path)]
    return any(aside) or any(s.axis[0] or s.axis[2] for s in oblique)

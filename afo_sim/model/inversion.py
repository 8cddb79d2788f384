"""Inversion and eversion: the muscles' lever arms about the talus' forward axis through the ankle joint.

A muscle's lever arm about an axis is −dL/dφ, φ a turn of the foot about it. No such turn happens in the
model that is stepped. So a second model has a hinge for it, which stays at zero and turns with the ankle.
MuJoCo gives its Jacobian, whatever points and surfaces the path runs along.
"""

import functools
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.description import JOINTS, MuscleGroup, Scenario
from afo_sim.model.mounting import ANKLE

INVERSION = "inversion"
SPACING = np.radians(0.1)  # of the ankle angles between which arms are interpolated: to 2e-8 m
BEYOND = 0.5  # the stops, by which the ankle may swing through them [rad]


@dataclass(frozen=True, eq=False)
class SideArms:
    """Lever arms of the muscles about the inversion axis, which runs forward in the talus."""

    model: mujoco.MjModel
    names: tuple[str, ...]

    @classmethod
    def of(cls, spec: mujoco.MjSpec, scenario: Scenario, muscles: dict[str, int]) -> Self | None:
        """Of what is put together; None where no muscle can have such a moment."""
        leg, groups = scenario.leg, scenario.orthosis.muscle.values()
        if leg.directions != JOINTS["ankle"].directions or not any(map(_off_the_midline, groups)):
            return None
        inside = 1.0 if scenario.simulated_side == "right" else -1.0
        hinge = mujoco.mjtJoint.mjJNT_HINGE
        spec.body(leg.foot).add_joint(
            name=INVERSION, type=hinge, axis=[inside, 0.0, 0.0], pos=spec.joint(ANKLE).pos
        )
        return cls(spec.compile(), tuple(muscles))

    def at(self, ankle: np.ndarray) -> np.ndarray:
        """Lever arms [m] (n, muscles) at ankle angles [rad] (n,); inversion positive."""
        return np.array([np.interp(ankle, self._grid, arm) for arm in self._arms.T]).T

    @functools.cached_property
    def _grid(self) -> np.ndarray:
        """Ankle angles of the table [rad]."""
        lower, upper = self.model.joint(ANKLE).range
        count = int((upper - lower + 2.0 * BEYOND) / SPACING) + 2
        return np.linspace(lower - BEYOND, upper + BEYOND, count)

    @functools.cached_property
    def _arms(self) -> np.ndarray:
        """Lever arms over the table's angles [m] (n, muscles)."""
        model, data = self.model, native.scratch(self.model)
        dof = int(model.joint(INVERSION).dofadr[0])
        place = []  # in `ten_J`, of each tendon's derivative by the inversion
        for tendon in (model.tendon(name).id for name in self.names):
            start = int(model.ten_J_rowadr[tendon])
            columns = model.ten_J_colind[start : start + model.ten_J_rownnz[tendon]]
            place.append(start + list(columns).index(dof))
        at = int(model.joint(ANKLE).qposadr[0])
        found = np.empty((len(self._grid), len(place)))
        for k, angle in enumerate(self._grid):
            data.qpos[at] = angle
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_tendon(model, data)
            found[k] = data.ten_J[place]
        return 0.0 - found


def _off_the_midline(group: MuscleGroup) -> bool:
    if group.origin is None or group.insertion is None:
        return False
    oblique = [p.surface for p in group.path if p.surface is not None and p.surface.shape == "cylinder"]
    ends = group.origin.from_joint[1], group.insertion.from_joint[1]
    aside = [*ends, *(point.from_joint[1] for point in group.path)]
    return any(aside) or any(s.axis[0] or s.axis[2] for s in oblique)

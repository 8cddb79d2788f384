"""The toes' hinge in the model: a spring about its rest angle over the gait phase.

    moment = −K (q − ρ) − c (q̇ − ρ̇),   K = k_toes + k_outsole,   ρ = k_toes r / K

r is the extension at which the toes' own spring rests (`gait/toe_extension.py`); the outsole's rests in its
own shape. Where nobody walks, the toes do not bend.
"""

from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError, unknown
from afo_sim.description.leg import Toes
from afo_sim.description.scenario import Scenario
from afo_sim.gait.fourier import Wave
from afo_sim.gait.toe_extension import toe_extension
from afo_sim.model.outsole import worn
from afo_sim.model.person import Size

REST = "toe_rest"  # the actuator that moves the spring's rest angle
STIFF = 0.5  # of (rate × time step)² of the hinge at most; MuJoCo takes its spring explicitly


def toe_spring(scenario: Scenario, size: Size) -> tuple[float, float]:
    """Stiffness of the hinge with the outsole's [N·m/rad], and the share of it that is the toes' own [-].

    A shoe is as stiff as it is big; an orthosis' outsole is of its own size.
    """
    toes, outsole = scenario.leg.toes, worn(scenario)
    assert toes is not None
    own, sole = toes.stiffness * size.springy, 0.0
    if outsole is not None:
        sole = outsole.toe_stiffness * (1.0 if scenario.orthosis.outsole else size.springy)
    return own + sole, own / (own + sole)


@dataclass(frozen=True)
class Resting:
    """Where the hinge rests: the toes' share of its stiffness [-], their rest extension in swing [rad]."""

    share: float
    swing: float

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Of a scenario of walking whose leg has toes."""
        toes = scenario.leg.toes
        assert toes is not None
        return cls(toe_spring(scenario, Size.of(scenario))[1], toes.swing_extension)

    def at(self, wave: Wave) -> np.ndarray:
        """Rest extension ρ at gait phases [rad] (n,)."""
        return self.share * toe_extension(self.swing)(wave)


def hinge_toes(spec: mujoco.MjSpec, scenario: Scenario, size: Size) -> None:
    """Give the toes' hinge its damper; weld it where nobody walks."""
    toes, file = scenario.leg.toes, scenario.leg.file
    if toes is None:
        return
    for kind, name, existing in (("body", toes.body, spec.bodies), ("joint", toes.joint, spec.joints)):
        names = [element.name for element in existing if element.name]
        if name not in names:
            problem = "the leg has no such body or joint"
            raise unknown(name, names, file=file, field=f"leg.toes.{kind}", problem=problem)
    joint = spec.joint(toes.joint)
    if joint.type != mujoco.mjtJoint.mjJNT_HINGE or joint.parent.name != toes.body:
        raise InputError(
            f"is not the hinge of the body {toes.body!r}", file=file, field="leg.toes.joint", value=toes.joint
        )
    if not scenario.walking:
        spec.delete(joint)
        return
    rest = [0.0, 0.0]  # of MuJoCo's polynomials
    joint.damping = [size.damped * toes.damping, *rest]
    joint.armature += _armature(spec, toes, toe_spring(scenario, size)[0], scenario.timestep)


def spring_toes(spec: mujoco.MjSpec, scenario: Scenario, size: Size) -> None:
    """Give the toes' hinge its spring; an orthosis' part of it is the same for all persons."""
    if scenario.leg.toes is not None and scenario.walking:
        stiffness, _ = toe_spring(scenario, size)
        spec.joint(scenario.leg.toes.joint).stiffness = [stiffness, 0.0, 0.0]


def fill_hinge(model: mujoco.MjModel, scenario: Scenario, size: Size) -> None:
    """The same spring into a compiled model that persons share."""
    if scenario.leg.toes is not None and scenario.walking:
        joint = model.joint(scenario.leg.toes.joint).id
        model.jnt_stiffness[joint] = toe_spring(scenario, size)[0]


def _armature(spec: mujoco.MjSpec, toes: Toes, stiffness: float, timestep: float) -> float:
    """Inertia that a stiff hinge needs so as not to ring at the time step [kg·m²]; 0 for soft ones.

    Its rate stays above 0.7 in a step, which no gait has.
    """
    body = spec.body(toes.body)
    inertia = float(np.max(body.inertia)) + body.mass * float(np.sum(np.square(body.ipos)))
    return max(stiffness * timestep**2 / STIFF - inertia, 0.0)


def add_rest(spec: mujoco.MjSpec, scenario: Scenario) -> None:
    """The actuator that moves the hinge's rest angle: its input is a moment."""
    if scenario.leg.toes is None:
        return
    spec.add_actuator(
        name=REST,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=scenario.leg.toes.joint,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[1.0] + [0.0] * 9,
        userdata=[0.0] * native.N_USER,
    )


def rest_moment(
    model: mujoco.MjModel, scenario: Scenario, resting: np.ndarray, timestep: float
) -> np.ndarray:
    """Input of the rest's actuator: K ρ + c ρ̇ [N·m] (n,).

    Units: resting [rad] (n + 2,), timestep [s].
    """
    assert scenario.leg.toes is not None
    joint = model.joint(scenario.leg.toes.joint)
    stiffness, damping = model.jnt_stiffness[joint.id], model.dof_damping[int(joint.dofadr[0])]
    found: np.ndarray = stiffness * resting[1:-1] + damping * (resting[2:] - resting[:-2]) / (2.0 * timestep)
    return found

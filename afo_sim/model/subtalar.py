"""The subtalar hinge in the model: the foot's second joint, after the ankle.

MuJoCo turns a body by its joints in their order. The ankle's axis therefore stays in the shank, and the
subtalar axis is carried by the ankle, as it is by the talus.
"""

import math
from collections.abc import Callable

import mujoco
import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.units import in_unit
from afo_sim.description.attachment import Side
from afo_sim.description.leg import Leg, Subtalar
from afo_sim.description.scenario import Scenario
from afo_sim.model.mounting import ANKLE, SUBTALAR

ANKLE_WORDS = Leg.model_fields["directions"].default
STOP = [0.99, 0.999, 0.001, 0.5, 2.0]  # by MuJoCo's own stops 5 N·m would turn so light a foot 2° further
STIFF = 0.5  # of (rate × time step)² at most; MuJoCo takes a joint's spring explicitly


def axis_of(subtalar: Subtalar, side: Side) -> np.ndarray:
    """Direction about which inversion is positive; forward, left, up in the foot's axes (3,).

    On the right leg it points ahead, inside (left) and up; the left leg's is its mirror image as a hinge's
    axis, (−x, y, −z).
    """
    rise, aside = subtalar.inclination, subtalar.deviation
    right = np.array(
        [math.cos(rise) * math.cos(aside), math.cos(rise) * math.sin(aside), math.sin(rise)], dtype=float
    )
    return right if side == "right" else right * [-1.0, 1.0, -1.0]


def free(scenario: Scenario) -> bool:
    """Whether the foot turns about the subtalar axis: not in recorded walking, which tells nothing of it."""
    return scenario.leg.subtalar is not None and not scenario.walking


def check_subtalar(scenario: Scenario) -> None:
    """Refuse a subtalar hinge where there is no ankle above it, or muscles that have no place beside it."""
    leg, field = scenario.leg, "leg.subtalar"
    if leg.subtalar is None:
        return
    if leg.directions != ANKLE_WORDS:
        problem = "belongs under an ankle, and this leg's joint is none"
        allowed = "a leg whose directions are dorsiflexion and plantarflexion"
        raise InputError(problem, allowed=allowed, field=field)
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
    unit = 180.0 / math.pi if spec.compiler.degree else 1.0  # as the file tells its angles
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
    if stiffness * step**2 > STIFF * inertia:
        enough = in_unit(math.sqrt(STIFF * inertia / stiffness), "s", "ms")
        raise InputError(
            f"leg.subtalar.stiffness of {stiffness:g} N·m/rad is too stiff for this time step",
            field="timestep",
            value=f"{in_unit(step, 's', 'ms'):g} ms",
            allowed=f"at most {0.99 * enough:.2g} ms",
        )


def find_rest(model: mujoco.MjModel, data: mujoco.MjData, forward: Callable[[], None]) -> None:
    """Turn the foot about its free subtalar hinge to where it rests, or to the stop that it rests on.

    Where nothing turns it from zero it stays there exactly.
    """
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
    from scipy.optimize import brentq  # large; who only walks does without

    moment(brentq(moment, min(stop, 0.0), max(stop, 0.0), xtol=1e-14))

"""The patient's own ankle: what a healthy one does in the recorded walking, scaled by what is left of it."""

import functools
from dataclasses import dataclass

import numpy as np

from afo_sim.common.units import GRAVITY
from afo_sim.description.scenario import Leg, PassiveAnkle, Scenario
from afo_sim.model.activation import activated, one_stride, switching
from afo_sim.model.foot import Foot
from afo_sim.model.walk import Walk
from afo_sim.physics.passive_ankle import passive_moments

# Quasi-stiffness of the active ankle about its recorded angle, by gait phase [N·m/(rad·kg)]: stance after
# Ficanha et al. 2018 (1.14 at 7 %, 5.43 at 31 % of the stride); its fall to toe-off and the low value in
# swing are assumed.
STIFFNESS = ((0.0, 0.9), (0.07, 1.14), (0.31, 5.43), (0.50, 4.0), (0.62, 0.35), (0.95, 0.35), (1.0, 0.9))


@dataclass(frozen=True, eq=False)
class Active:
    """The patient's active ankle over the steps (n,).

    moment [N·m] and stiffness [N·m/rad] are what drives it; recorded [N·m] is the whole internal moment of
    the recorded walking; needed [N·m] is what a healthy ankle would give actively in that walking, less
    what this patient gives in the same motion. Dorsiflexion positive.
    """

    moment: np.ndarray
    stiffness: np.ndarray
    recorded: np.ndarray
    needed: np.ndarray


def ground_moment(walk: Walk, body_mass: float) -> np.ndarray:
    """Moment of the recorded ground force about the ankle at every step, dorsiflexion positive [N·m] (n,)."""
    return body_mass * GRAVITY * walk.ground_lever


def needed_moment(walk: Walk, foot: Foot, body_mass: float) -> np.ndarray:
    """Internal ankle moment that the recorded motion needs of a foot, by inverse dynamics.

    I ψ̈ + m (c_x a_z − c_z a_x) − weight − ground, with ψ = θ − φ the sole's pitch.

    Parameters
    ----------
    walk : recorded walking
    foot : without orthosis
    body_mass : that the recorded ground force is scaled with [kg]

    Returns
    -------
    (n_step,) dorsiflexion positive [N·m]
    """
    a = walk.acceleration
    inertial = foot.inertia * walk.ankle_acceleration - foot.frame_moment(walk.turn, a[:, :2], a[:, 2])
    return inertial - foot.gravity_moment(walk.turn) - ground_moment(walk, body_mass)


def active(walk: Walk, foot: Foot, scenario: Scenario, body_mass: float) -> Active:
    """The moment and stiffness that this patient's own muscles put in.

    The healthy active moment is what the recorded motion needs, less the passive ankle and the joint's
    damping. Its dorsiflexor and plantarflexor parts are scaled by the strength left of each. The
    stiffness acts about the recorded angle and is scaled by the strength of the side that is active in a
    stride of mean duration, which it follows as `activated`: a foot far from the recorded angle is not seized
    at once.

    Parameters
    ----------
    walk, foot : as in `needed_moment`
    scenario : with a patient
    body_mass : [kg]
    """
    patient, leg = scenario.patient, scenario.leg
    assert patient is not None
    angle, velocity = walk.ankle[1:-1], walk.velocity
    recorded = needed_moment(walk, foot, body_mass)
    healthy = _actively(walk, recorded, leg)
    left = np.where(healthy > 0.0, patient.dorsiflexor_strength, patient.plantarflexor_strength)
    stiffness = _healthy_stiffness(walk) * body_mass * patient.stiffness
    stiffness *= _strength(walk, foot, scenario, body_mass)
    reflex = -patient.spasticity * np.maximum(velocity, 0.0)  # as passive_ankle.spastic_moment
    needed = healthy - left * healthy - reflex
    return Active(left * healthy + stiffness * angle, stiffness, recorded, needed)


def _actively(walk: Walk, needed: np.ndarray, leg: Leg) -> np.ndarray:
    """What a healthy ankle gives of a needed moment beside its tissue and damping [N·m] (n_step,)."""
    return needed + leg.damping * walk.velocity - _passive_along(walk, leg.passive)


def _strength(walk: Walk, foot: Foot, scenario: Scenario, body_mass: float) -> np.ndarray:
    """Strength of the active side as the stiffness follows it [-] (n_step,)."""
    patient, gait = scenario.patient, scenario.gait
    assert patient is not None and gait is not None
    sides = np.array([patient.plantarflexor_strength, patient.dorsiflexor_strength])
    time = walk.time[1:-1]
    if np.ptp(sides) == 0.0:
        return np.full(len(time), sides[0])
    stride = one_stride(walk.cycle, gait.stride_time or walk.cycle.stride_time, gait.ankle_offset)
    moment = _healthy_stride(stride, foot.mass, foot.centre, foot.inertia, scenario.leg, body_mass)
    switches, dorsal = switching(walk, moment)
    return activated(time, switches, sides[(np.arange(len(switches) + 1) + dorsal) % 2])


@functools.lru_cache(maxsize=8)  # cases of a sweep share it
def _healthy_stride(
    stride: Walk, mass: float, centre: tuple[float, float], inertia: float, leg: Leg, body_mass: float
) -> np.ndarray:
    """Active moment of a healthy ankle over one stride; mass, centre and inertia are of the foot [N·m]."""
    foot = Foot(mass, centre, inertia, {})
    moment = _actively(stride, needed_moment(stride, foot, body_mass), leg)
    moment.flags.writeable = False
    return moment


@functools.lru_cache(maxsize=2)
def _healthy_stiffness(walk: Walk) -> np.ndarray:
    """`STIFFNESS` along a walk (n_step,)."""
    phase, value = np.array(STIFFNESS).T
    stiffness = np.interp(walk.phase[1:-1] % 1.0, phase, value)
    stiffness.flags.writeable = False
    return stiffness


@functools.lru_cache(maxsize=4)  # cases of a sweep share it
def _passive_along(walk: Walk, ankle: PassiveAnkle) -> np.ndarray:
    moment = passive_moments(walk.ankle[1:-1], walk.knee[1:-1], ankle.scale, ankle.offset)
    moment.flags.writeable = False
    return moment

"""Weakness of the patient's own ankle: what a healthy one does in recorded walking, scaled by what is left.

In a patient's own walk it is what that patient's muscles did, and nothing is scaled (`own_active`).

The recorded walking shows which side's muscles are active; the stiffness follows that side's strength with
lags. The instants at which the sides change belong to the gait cycle, and between them the lags have a closed
form. So the activation at an instant does not depend on the time step.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np

from afo_sim.common import GRAVITY, Doubles
from afo_sim.description import Patient, Scenario
from afo_sim.gait import GaitCycle, Wave
from afo_sim.model.foot import Foot, carried
from afo_sim.model.person import Size, Tissue, healthy_tissue, own_tissue, reflex_gain
from afo_sim.model.walk import PLACE, Walk
from afo_sim.physics import kernels, passive_moments, register_jitable

# Quasi-stiffness of the active ankle about its recorded angle, by gait phase, of a person of the leg's height
# [N·m/(rad·kg)]; it goes with mass × length: stance after
# Ficanha et al. 2018 (1.14 at 7 %, 5.43 at 31 % of the stride); its fall to toe-off and the low value in
# swing are assumed.
STIFFNESS = ((0.0, 0.9), (0.07, 1.14), (0.31, 5.43), (0.50, 4.0), (0.62, 0.35), (0.95, 0.35), (1.0, 0.9))
# Lags of the stiffness behind the active side [s]: two equal ones in series, as a twitch rises (critically
# damped: Milner-Brown, Stein & Yemm 1973; the triceps surae's twitch peaks after about 0.1 s). Half of it is
# there after 84 ms. The lag of its fall only avoids a jump: `STIFFNESS` already holds the fall before
# toe-off, and a stiffness that lingers would hold a hanging foot up. Both times are assumed.
RISE, FALL = 0.05, 0.005
SAMPLES = 4096  # of a stride in which the change of sides is looked for


@dataclass(frozen=True, eq=False)
class Active:
    """The patient's active ankle over the steps (n,); dorsiflexion positive."""

    moment: np.ndarray  # drives it [N·m]
    stiffness: np.ndarray  # drives it [N·m/rad]
    recorded: np.ndarray  # whole internal moment of the recorded walking [N·m]
    # what a healthy ankle would give in that walking, less what this patient's muscles and tissue give in the
    # same motion [N·m]; None of a patient's own walk, which no healthy ankle is known of
    needed: np.ndarray | None


def ground_moment(walk: Walk, body_mass: float) -> np.ndarray:
    """Moment of the recorded ground force about the ankle at every step, dorsiflexion positive [N·m] (n,)."""
    return body_mass * GRAVITY * walk.ground_lever


def needed_moment(walk: Walk, foot: Foot, body_mass: float, toe: np.ndarray | None = None) -> np.ndarray:
    """Internal ankle moment that a foot's recorded motion needs; `toe` instead of the walk's."""
    borne = carried(foot.centre, walk.turn, walk.acceleration[:, :2] + (0.0, GRAVITY))
    moment = foot.inertia * walk.turning + foot.mass * borne
    if (toes := foot.toes) is not None:
        # Ankle moment that the recorded motion needs since the toes are bent, beyond that of straight toes
        toe = walk.toe if toe is None else toe
        assert toe is not None
        own = toes.inertia - toes.mass * (toes.centre[0] ** 2 + toes.centre[1] ** 2)
        numbers = np.array([*toes.hinge, *toes.centre, own, toes.mass, walk.timestep**2])
        bent, turn = np.empty(len(moment)), walk.sole
        arrays = bent, turn.cosine, turn.sine, toe, walk.acceleration, numbers
        _bend()[0](*[array.ctypes.data for array in arrays], len(bent))
        moment += bent
    return moment - ground_moment(walk, body_mass)


def _bent_toes(
    out: Doubles, cosine: Doubles, sine: Doubles, bent: Doubles, acceleration: Doubles, p: Doubles, size: int
) -> float:
    """What toes need since they are bent, into `out` (size,); all else has one sample before and after."""
    x0 = z0 = x1 = z1 = flat_x0 = flat_z0 = flat_x1 = flat_z1 = 0.0
    for k in range(size + 2):
        c, s, more, square = cosine[k], sine[k], bent[k], p[6]
        along, across = math.cos(more), math.sin(more)
        bent_c, bent_s = c * along - s * across, s * along + c * across
        at_x, at_z = p[0] * c - p[1] * s, p[0] * s + p[1] * c
        x, z = at_x + p[2] * bent_c - p[3] * bent_s, at_z + p[2] * bent_s + p[3] * bent_c
        flat_x, flat_z = at_x + p[2] * c - p[3] * s, at_z + p[2] * s + p[3] * c
        if k > 1:
            forward, up = acceleration[3 * k - 6], acceleration[3 * k - 5] + GRAVITY
            moved = x1 * (up + (z - 2.0 * z1 + z0) / square)
            moved -= z1 * (forward + (x - 2.0 * x1 + x0) / square)
            moved -= flat_x1 * (up + (flat_z - 2.0 * flat_z1 + flat_z0) / square)
            moved += flat_z1 * (forward + (flat_x - 2.0 * flat_x1 + flat_x0) / square)
            out[k - 2] = p[4] * (more - 2.0 * bent[k - 1] + bent[k - 2]) / square + p[5] * moved
        x0, z0, flat_x0, flat_z0 = x1, z1, flat_x1, flat_z1
        x1, z1, flat_x1, flat_z1 = x, z, flat_x, flat_z
    return 0.0


def active(walk: Walk, foot: Foot, scenario: Scenario, body_mass: float) -> Active:
    """The moment and stiffness that this patient's own muscles put in."""
    patient, gait = scenario.patient, scenario.gait
    assert patient is not None and gait is not None
    stride_time, taller = gait.stride_time or walk.cycle.stride_time, Size.of(scenario).taller
    tissues = healthy_tissue(scenario), own_tissue(scenario)
    return _active(walk, foot, patient, tissues, reflex_gain(scenario), stride_time, body_mass, taller)


@functools.lru_cache(maxsize=4)  # cases of a sweep share it
def own_active(walk: Walk, foot: Foot, tissue: Tissue, body_mass: float) -> Active:
    """What a patient's own muscles gave in the recorded walk, and give in every other that is simulated."""
    recorded = needed_moment(walk, foot, body_mass)
    return _kept(Active(_actively(walk, recorded, tissue), np.zeros_like(recorded), recorded, None))


def _kept(found: Active) -> Active:
    """The same with arrays that later runs share, made read-only."""
    for array in vars(found).values():
        if array is not None:
            array.flags.writeable = False
    return found


@functools.lru_cache(maxsize=4)  # cases of a sweep share it
def _active(
    walk: Walk, foot: Foot, patient: Patient, tissues: tuple[Tissue, Tissue], reflex_gain: float,
    stride_time: float, body_mass: float, taller: float,
) -> Active:  # fmt: skip
    """As `active`, of a healthy person's tissue and the patient's own, and a mean stride [s]."""
    tissue, own = tissues
    angle, velocity = walk.ankle[1:-1], walk.velocity
    recorded = needed_moment(walk, foot, body_mass)
    healthy = _actively(walk, recorded, tissue)
    left = np.where(healthy > 0.0, patient.dorsiflexor_strength, patient.plantarflexor_strength)
    typical = np.interp((walk.level or walk).phase[1:-1] % 1.0, *np.array(STIFFNESS).T)
    stiffness = typical * body_mass * taller * patient.stiffness
    stiffness *= _strength(walk, foot, patient, tissue, stride_time, body_mass)
    reflex = -reflex_gain * np.maximum(velocity, 0.0)  # as passive_ankle.spastic_moment
    tighter = passive_along(walk, own) - passive_along(walk, tissue)
    needed = healthy - left * healthy - reflex - tighter
    return _kept(Active(left * healthy + stiffness * angle, stiffness, recorded, needed))


def _actively(walk: Walk, needed: np.ndarray, tissue: Tissue) -> np.ndarray:
    """What an ankle's muscles give of a needed moment beside its tissue and damping [N·m] (n_step,)."""
    return needed + tissue.damping * walk.velocity - passive_along(walk, tissue)


def _strength(
    walk: Walk, foot: Foot, patient: Patient, tissue: Tissue, stride_time: float, body_mass: float
) -> np.ndarray:
    """Strength of the active side as the stiffness follows it [-] (n_step,)."""
    sides = np.array([patient.plantarflexor_strength, patient.dorsiflexor_strength])
    time = walk.time[1:-1]
    if np.ptp(sides) == 0.0:
        return np.full(len(time), sides[0])
    stride = _one_stride(walk.off_floor, stride_time, walk.offset)
    toe = None if walk.resting is None else walk.resting.at(stride.wave)
    moment = _actively(stride, needed_moment(stride, foot, body_mass, toe), tissue)
    # Instants of a walk at which the active side changes, and the side that it starts with
    edges = crossings(moment)
    start, end = walk.phase[1], walk.phase[-1]
    every = (np.arange(math.floor(start), math.ceil(end) + 1)[:, np.newaxis] + edges).ravel()
    passed = int(np.searchsorted(edges, start % 1.0, side="right"))
    dorsal = bool(moment[0] > 0.0) != bool(passed % 2)
    switches = np.interp(every[(every > start) & (every <= end)], walk.phase, walk.time)
    return activated(time, switches, sides[(np.arange(len(switches) + 1) + dorsal) % 2])


def passive_along(walk: Walk, tissue: Tissue) -> np.ndarray:
    """Passive moment of the tissue at the recorded angles, dorsiflexion positive [N·m] (n_step,)."""
    return tissue.scale * _healthy_mean_along(walk.level or walk, tissue.offset)


@functools.lru_cache(maxsize=8)  # cases of a sweep share it
def _healthy_mean_along(walk: Walk, offset: float) -> np.ndarray:
    moment = passive_moments(walk.ankle[1:-1], walk.knee[1:-1], 1.0, offset)
    moment.flags.writeable = False
    return moment


@functools.lru_cache(maxsize=8)  # cases of a sweep share it
def _one_stride(cycle: GaitCycle, stride_time: float, offset: float) -> Walk:
    """One stride of a gait cycle, from heel strike to heel strike, at `SAMPLES` instants, of a rigid foot."""
    phase = (np.arange(SAMPLES + 2) - 1.0) / SAMPLES
    wave = Wave.at(phase)
    pose = np.stack([cycle.signal(name, wave) for name in PLACE], axis=1)
    ankle = cycle.signal("ankle_angle", wave) + offset
    knee = cycle.signal("knee_angle", wave)
    return Walk(cycle, (0.0, 0.0), stride_time / SAMPLES, phase, pose, ankle, knee, offset, wave, cycle)


def crossings(moment: np.ndarray) -> np.ndarray:
    """Gait phases at which a periodic moment changes its sign."""
    following = np.roll(moment, -1)
    before = np.flatnonzero((moment > 0.0) != (following > 0.0))
    share = moment[before] / (moment[before] - following[before])
    return (before + share) / len(moment)


def activated(time: np.ndarray, switches: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Activation of a muscle: the excitation after two equal first-order lags in series."""
    if np.ptp(levels) == 0.0:
        return np.full(len(time), levels[0])
    given = np.empty(len(time))
    arrays = [np.ascontiguousarray(each, dtype=float) for each in (time, switches, levels)]
    numbers = np.array([RISE, FALL])
    _follow()[0](*[each.ctypes.data for each in (given, *arrays, numbers)], len(time), len(switches))
    return given


def _followed(
    given: Doubles, time: Doubles, switches: Doubles, levels: Doubles, lags: Doubles, size: int, count: int
) -> float:
    """Both lags from event to event: a switch, or the first lag meeting the second, which turns round."""
    known, passed, begun = 0, 0, 0.0
    first = second = target = levels[0]
    while known < size:
        switch = switches[passed] if passed < count else math.inf
        meeting = begun + _meeting(first, second, target, lags)
        event = min(switch, meeting)
        while known < size and time[known] < event:
            given[known] = _settled(first, second, target, lags, time[known] - begun)[1]
            known += 1
        if event < math.inf:
            left, right = _settled(first, second, target, lags, event - begun)
            first, second = left, left if meeting <= switch else right
        if switch < meeting:
            target, passed = levels[passed + 1], passed + 1
        begun = event
    return 0.0


@register_jitable
def _lags(first: float, second: float, target: float, lags: Doubles) -> tuple[float, float]:
    """Time constants of both lags [s], of its rise and its fall; a second one at the first follows it."""
    rises = target > first
    second_rises = rises if first == second else first > second
    return lags[0 if rises else 1], lags[0 if second_rises else 1]


@register_jitable
def _settled(first: float, second: float, target: float, lags: Doubles, time: float) -> tuple[float, float]:
    """Both lags after a time in which neither turns round."""
    lag, second_lag = _lags(first, second, target, lags)
    gap, left = first - target, math.exp(-time / lag)
    if lag == second_lag:
        return target + gap * left, target + (second - target + gap * time / lag) * left
    share = gap * lag / (lag - second_lag)
    rest = (second - target - share) * math.exp(-time / second_lag)
    return target + gap * left, target + share * left + rest


@register_jitable
def _meeting(first: float, second: float, target: float, lags: Doubles) -> float:
    """Time until the first lag, coming towards the second one, meets it [s]; infinite where it does not."""
    if (target - first) * (first - second) >= 0.0:
        return math.inf
    lag, second_lag = _lags(first, second, target, lags)
    share = (first - target) * lag / (lag - second_lag)
    ratio = (second - target - share) / (first - target - share)
    return max(0.0, math.log(ratio) / (1.0 / second_lag - 1.0 / lag))


_bend = kernels("bent_toes", _bent_toes, rooms=("gait", "model"))
_follow = kernels("activation", _followed, rooms=("gait", "model"))

"""Recorded walking laid out over the steps of a run: gait phase, cadence, the shank's pose, what drives it.

The shank's ankle point and angle are joints with an armature so large that nothing moves them but their own
motors. The motors apply the second difference of the sampled pose, which the integrator sums to that pose:
the foot feels the true acceleration, and the pose is kept to rounding.

The cadence is the walker's own times a factor. A factor that jumped would jerk the shank. So it passes from
one value f to the next g along a cubic, f + (g − f)(3 s² − 2 s³) with s from 0 to 1 over `change`. The
phase φ, its rate and its second derivative are continuous, and so is the shank's acceleration
φ̈ q′(φ) + φ̇² q″(φ).
"""

import copy
import functools
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np

from afo_sim.description import Gait, Scenario
from afo_sim.gait import GaitCycle, Placed, Wave, fit_to_leg, lay_on_floor
from afo_sim.model.foot import TOE_POINTS, Foot, Resting, Turn, turned_all
from afo_sim.model.outsole import Point, grown, worn
from afo_sim.model.person import Size, in_contact, persons_stride, taller_than_recorded

ARMATURE = 1e12  # of the shank's joints [kg, kg·m²]
JOINTS = ("shank_x", "shank_z", "shank_angle")
PLACE = ("ankle_x", "ankle_z", "shank_angle")  # the shank's, of a pose
LEAST_STEP = 1e-9  # of a stride, below which a step goes nowhere: its share would be rounding [-]
Intervals = tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class Clock:
    """The start and end of each step, as (whole periods, what is beyond them), and its duration (n,)."""

    start: tuple[np.ndarray, np.ndarray]
    end: tuple[np.ndarray, np.ndarray]
    step: float | np.ndarray

    @classmethod
    def of(cls, time: np.ndarray, step: float | np.ndarray, period: float) -> Self:
        """Of steps that start at times (n,)."""
        return cls(np.divmod(time, period), np.divmod(time + step, period), step)

    def share(self, intervals: Intervals) -> np.ndarray:
        """The share of each step for which a valve is switched on."""
        # Overlapping events as one
        merged: list[tuple[float, float]] = []
        for start, end in sorted(intervals):
            if merged and start <= merged[-1][1]:
                merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
            else:
                merged.append((start, end))
        if not merged:
            return np.zeros(len(self.start[0]))
        moved = np.asarray(self.step) > LEAST_STEP
        if not moved.all():  # who stands at a phase has a valve on there or not
            beyond = self.start[1]
            still = np.any([(start <= beyond) & (beyond < end) for start, end in merged], axis=0)
            return np.where(moved, self._moving(merged, np.where(moved, self.step, 1.0)), still)
        return self._moving(merged, self.step)

    def _moving(self, merged: list[tuple[float, float]], step: float | np.ndarray) -> np.ndarray:
        share = (_until(merged, *self.end) - _until(merged, *self.start)) / step
        # to a billionth, so that an event on a step's edge is one
        return np.round(np.minimum(np.maximum(share, 0.0), 1.0), 9)


def _until(merged: list[tuple[float, float]], periods: np.ndarray, beyond: np.ndarray) -> np.ndarray:
    """How long a valve has been switched on since time 0."""
    inside = [np.minimum(np.maximum(beyond - start, 0.0), end - start) for start, end in merged]
    total = sum(end - start for start, end in merged)
    return periods * total + (inside[0] if len(inside) == 1 else np.sum(inside, axis=0))


@dataclass(frozen=True)
class Pace:
    """Factors on the cadence."""

    times: tuple[float, ...]  # [s]
    factors: tuple[float, ...]  # `factors[0]` first, from `times[k]` on `factors[k + 1]`
    change: float  # that each takes [s]

    @classmethod
    def of(cls, gait: Gait) -> Self:
        """What a gait describes; the walker's own cadence before the first described time."""
        described = gait.pace
        if not described or described[0][0] > 0.0:
            described = ((0.0, 1.0), *described)
        times, factors = zip(*described, strict=True)
        return cls(times[1:], factors, gait.pace_change)

    def walked(self, time: np.ndarray) -> np.ndarray:
        """Time that the walk takes at the walker's own cadence to come as far: the integral of the factor."""
        walked = self.factors[0] * np.minimum(time, self.times[0] if self.times else np.inf)
        for k, (old, new) in enumerate(pairwise(self.factors)):
            since = np.maximum(time - self.times[k], 0.0)
            share = np.minimum(since / self.change, 1.0)
            # ∫ (3 s² − 2 s³) ds = s³ − s⁴/2
            walked += self.change * (old * share + (new - old) * (share**3 - 0.5 * share**4))
            until = self.times[k + 1] if k + 1 < len(self.times) else np.inf
            walked += new * np.maximum(np.minimum(time, until) - self.times[k] - self.change, 0.0)
        return walked

    @property
    def stands(self) -> tuple[tuple[float, float], ...]:
        """Intervals in which the walker stands: [from, to] [s]; the last may have no end."""
        begun = (0.0, *(at + self.change for at in self.times))
        ended = (*self.times, np.inf)
        spans = zip(begun, ended, self.factors, strict=True)
        return tuple((start, end) for start, end, factor in spans if factor == 0.0)


@dataclass(frozen=True, eq=False)
class Walk:
    """A gait cycle over the steps of a run; arrays hold one sample more before (at −h) and after the run."""

    cycle: GaitCycle
    shift: tuple[float, float]  # of the recorded ankle, along the shank and upward [m]
    timestep: float
    phase: np.ndarray  # strides [-] (n_step + 2,)
    pose: np.ndarray  # ankle x, ankle z [m], shank angle [rad] (n_step + 2, 3)
    ankle: np.ndarray  # recorded, as this outsole has it [rad] (n_step + 2,)
    knee: np.ndarray  # recorded [rad] (n_step + 2,)
    offset: float  # what was added to the recorded ankle angle [rad]
    wave: Wave  # of the phase
    off_floor: GaitCycle  # the cycle before its sole was laid on the floor in stance
    laid: float = 0.0  # how far at most [m]
    toe: np.ndarray | None = None  # the toes' rest extension [rad] (n_step + 2,); None of a rigid foot
    resting: Resting | None = None  # the toes' rest extension at any phase
    level: "Walk | None" = None  # of the same angles, with straight toes, its sole not laid; None of itself

    # what every case of a sweep needs of it, computed once

    @functools.cached_property
    def time(self) -> np.ndarray:
        """Of the samples [s] (n_step + 2,)."""
        return _kept((np.arange(len(self.phase)) - 1.0) * self.timestep)

    @functools.cached_property
    def acceleration(self) -> np.ndarray:
        """Of the pose, as second differences (n_step, 3)."""
        return _kept((self.pose[2:] - 2.0 * self.pose[1:-1] + self.pose[:-2]) / self.timestep**2)

    @functools.cached_property
    def velocity(self) -> np.ndarray:
        """Of the recorded ankle [rad/s] (n_step,)."""
        return _kept((self.ankle[2:] - self.ankle[:-2]) / (2.0 * self.timestep))

    @functools.cached_property
    def turning(self) -> np.ndarray:
        """Angular acceleration of the recorded foot [rad/s²] (n_step,)."""
        return _kept(np.diff(self.ankle, 2) / self.timestep**2 - self.acceleration[:, 2])

    @functools.cached_property
    def turn(self) -> Turn:
        """Of the recorded sole (n_step,)."""
        return Turn.by((self.ankle - self.pose[:, 2])[1:-1])

    @functools.cached_property
    def sole(self) -> Turn:
        """The same at every sample (n_step + 2,)."""
        return Turn.by(self.ankle - self.pose[:, 2])

    @functools.cached_property
    def shank(self) -> Turn:
        """Of the shank at every sample, as of a sole on it (n_step + 2,)."""
        return Turn.by(-self.pose[:, 2])

    @functools.cached_property
    def toes(self) -> Turn:
        """Of toes at their rest extension, at every sample (n_step + 2,)."""
        return self.sole if self.toe is None else self.sole.further(self.toe)

    @functools.cached_property
    def ground(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As `GaitCycle.ground` gives it, at all samples (n_step + 2,)."""
        if self.level is not None:  # where the sole stands changes where the force acts alone
            return *self.level.ground[:2], _kept(self.cycle.pressed(self.phase))
        forward, upward, place = map(_kept, self.cycle.ground(self.phase))
        return forward, upward, place

    @functools.cached_property
    def ground_lever(self) -> np.ndarray:
        """Moment of the recorded ground force about the ankle over the body's weight [m] (n_step,)."""
        forward, upward, place = self.ground
        return _kept((place * upward + self.pose[:, 1] * forward)[1:-1])

    @property
    def steps_of_stride(self) -> int:
        """Of a steady walk."""
        return round(1.0 / float(self.phase[2] - self.phase[1]))

    @functools.cached_property
    def clock(self) -> Clock:
        """The steps in strides."""
        phase = self.phase[1:-1]
        # over a step the phase advances evenly: its share is the time's
        return Clock.of(phase, self.phase[2:] - phase, 1.0)

    def start(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Start of the run: pose and ankle (4,), the pose's velocity half a step before (3,), the ankle's."""
        ankle_velocity = (self.ankle[2] - self.ankle[0]) / (2.0 * self.timestep)
        velocity = (self.pose[1] - self.pose[0]) / self.timestep
        return np.append(self.pose[1], self.ankle[1]), velocity, float(ankle_velocity)


COMPUTED = tuple(name for name, each in vars(Walk).items() if isinstance(each, functools.cached_property))


def _changed(walk: Walk, *without: str, **values: object) -> Walk:
    """A copy with other values, and with what is computed of a walk but for some of it."""
    for name in COMPUTED:
        if name not in without:
            getattr(walk, name)  # for the next copy, too
    found = copy.copy(walk)
    vars(found).update(values)
    for name in without:
        vars(found).pop(name, None)
    return found


# Where an orthosis has the outsole, toes rest as heavy a walker's bend it: all else is the same for all.
@functools.lru_cache(maxsize=4)
def bent(walk: Walk, resting: Resting) -> Walk:
    """A walk of a rigid foot with toes that rest bent."""
    toe = _kept(resting.at(walk.wave))
    return _changed(walk, "toes", toe=toe, resting=resting, level=walk.level or walk)


def lay_out(scenario: Scenario, foot: Foot) -> Walk:
    """Read the scenario's gait cycle, fit it to the leg, and sample it at every step."""
    assert scenario.gait is not None
    gait, offset = scenario.gait, scenario.gait.ankle_offset + foot.level
    stride, stands = persons_stride(scenario), _Stands.of(scenario, foot, offset)
    walk = _walked(stride, gait, offset, stands, scenario.timestep, scenario.n_step)
    resting = None if scenario.leg.toes is None else Resting.of(scenario)
    if in_contact(scenario):
        walk = _laid_out(walk, _fitted(stride, stands), foot.shape, resting)
    return walk if resting is None else bent(walk, resting)


@dataclass(frozen=True)
class _Stands:
    """What the recorded ankle is fitted to."""

    outsole: tuple[Point, ...]  # points at a recorded pitch of 0 [m]
    stack: float  # thickness of what is worn under the ankle [m]
    sole_thickness: float | None  # of the recorded walker's, at the person's size [m]; None: as recorded

    @classmethod
    def of(cls, scenario: Scenario, foot: Foot, offset: float) -> "_Stands":
        """Points that are rigid, unlike toes; `offset` is added to the recorded ankle angle [rad]."""
        assert scenario.gait is not None
        names = [name for name in foot.points if foot.toes is None or name not in TOE_POINTS]
        points = turned_all([foot.points[name] for name in names], Turn.by(np.array(offset)))
        outsole = worn(scenario)
        (back, _), (front, _) = foot.points["heel"], foot.points["ball"]
        share = -back / (front - back)  # of the way from heel to ball, where the ankle stands
        stack = 0.0
        if outsole is not None:
            taller = grown(scenario, Size.of(scenario).taller)
            stack = taller * (outsole.heel_stack + share * (outsole.ball_stack - outsole.heel_stack))
        sole = scenario.gait.sole_thickness
        sole = None if sole is None else sole * taller_than_recorded(scenario)
        return cls(tuple((float(x), float(z)) for x, z in points), stack, sole)


def stride_time_of(scenario: Scenario) -> float:
    """Mean duration of a stride [s]: the scenario's own, or that of the recording at the person's size."""
    assert scenario.gait is not None
    return scenario.gait.stride_time or persons_stride(scenario).stride_time


# Cases of a sweep share most of this.
@functools.lru_cache(maxsize=8)
def _fitted(stride: GaitCycle, stands: _Stands) -> Placed:
    placed = fit_to_leg(stride, stands.outsole, sole_thickness=stands.sole_thickness, stack=stands.stack)
    for value in vars(placed.cycle).values():
        if isinstance(value, np.ndarray):
            _kept(value)
    return placed


@functools.lru_cache(maxsize=4)  # a design has a coarse, a fine and a first walk
def _walked(
    stride: GaitCycle, gait: Gait, offset: float, stands: _Stands, timestep: float, n_step: int
) -> Walk:
    """A sampled walk whose sole is where it was recorded."""
    placed = _fitted(stride, stands)
    cycle = placed.cycle
    phase = _kept(phase_at(gait, stride.stride_time, (np.arange(n_step + 2) - 1.0) * timestep))
    wave = Wave.at(phase)
    pose = _kept(np.stack([cycle.signal(name, wave) for name in PLACE], axis=1))
    ankle, knee = _kept(stride.signal("ankle_angle", wave) + offset), _kept(stride.signal("knee_angle", wave))
    shift = placed.along, placed.vertical
    return Walk(cycle, shift, timestep, phase, pose, ankle, knee, offset, wave, cycle)


@functools.lru_cache(maxsize=4)
def _laid_out(walk: Walk, placed: Placed, foot: Foot, resting: Resting | None) -> Walk:
    """A sampled walk whose sole is laid on the floor, of that foot whose toes rest there."""
    turn, at = _pitch(placed.cycle, walk.offset)
    sole = foot.outsole(turn, 0.0 if resting is None else resting.at(at))
    low = np.minimum.reduce([z for _, z in sole.values()])
    raised, lift = lay_on_floor(placed, placed.cycle.signal("ankle_z", at) + low)
    pose = walk.pose.copy()
    if lift is not None:
        pose[:, 1] += lift(walk.wave)
    values = {"cycle": raised.cycle, "pose": _kept(pose), "laid": raised.laid, "level": walk}
    return _changed(walk, "acceleration", "ground", "ground_lever", **values)


@functools.lru_cache(maxsize=8)
def _pitch(cycle: GaitCycle, offset: float) -> tuple[Turn, Wave]:
    """The sole's at a cycle's samples, with an angle added to the ankle's [rad], and where these are."""
    at = Wave.at(cycle.phase)
    return Turn.by(cycle.signal("ankle_angle", at) + offset - cycle.signal("shank_angle", at)), at


def _kept(array: np.ndarray) -> np.ndarray:
    """An array that later runs share, made read-only."""
    array.flags.writeable = False
    return array


def phase_at(gait: Gait, recorded: float, time: np.ndarray) -> np.ndarray:
    """Gait phase, counting strides, at times."""
    if gait.pace:
        steady = gait.model_copy(update={"pace": ()})
        # rounding must not walk backwards
        return np.maximum.accumulate(phase_at(steady, recorded, Pace.of(gait).walked(time)))
    mean = gait.stride_time or recorded
    if gait.variability == 0.0:
        return gait.start_phase + time / mean
    from scipy.interpolate import CubicSpline  # large, and seldom needed

    count = int(np.ceil(time[-1] / (0.4 * mean))) + 6
    drawn = np.random.default_rng(gait.seed).standard_normal(count).clip(-3.0, 3.0)
    strikes = np.concatenate([[0.0], np.cumsum(mean * (1.0 + gait.variability * drawn))])
    phase = CubicSpline(strikes, np.arange(count + 1.0), bc_type="natural")
    start = CubicSpline(np.arange(count + 1.0), strikes, bc_type="natural")(2.0 + gait.start_phase)
    return phase(start + time) - 2.0

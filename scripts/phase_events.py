"""People who walk through turns, stops, ramps and stairs, and their gait phase: nothing here estimates it.

A stride is a curve of the shank over the phase, a duration and an amplitude. The true phase is linear between
the walker's own heel strikes, and undefined (NaN) where he stands or begins to walk.
"""

import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from afo_sim.control.phase_estimate import HARMONICS, after_swing

RATE = 100.0  # of samples [1/s]
NOISE, VARIED = 0.5, 0.02  # of the angle [deg], of the stride's time and amplitude [-]; standard deviations
DRIFT = 0.05  # of the sensor, most [deg/s]; it turns back at 4°
BEFORE, AFTER = 8, 8  # strides of steady walking before the first event and after each
SWING = 0.6  # phase from which on a stride goes over into the next one's amplitude
TURNS = (0.5, 0.6, 0.75, 0.8, 0.85, 1.2)  # amplitudes of their three strides
# Of drawn people: stride time [s] with its least and most, relative range, mean [deg], each harmonic [deg],
# and place of the heel strike in the curve [-]; means and standard deviations. With the last, phase 0 of the
# population's curve is off by 2.2 %, as it was found to be of 70 people. All else is assumed.
TIME, FASTEST, SLOWEST = (1.12, 0.13), 0.85, 1.6
RANGE, MEAN, PLACE = 0.08, 4.0, 0.021
OWN = np.array([1.2, 0.8, 0.5, 0.3, 0.25, 0.2])
# What a heel strike does: the shank's rate falls by so much [deg/s] (median, and deviation of its log), at a
# frequency [1/s] that dies out in a time [s], after a delay [s]. Assumed, so that fall and dip are about as
# in four recorded legs.
FALL, RINGS, DIES, DELAY = (70.0, 0.5), (8.0, 13.0), (0.03, 0.06), (0.01, 0.007)
Curve = Callable[[np.ndarray], np.ndarray]  # of the phase [-] or the time [s]: shank [deg]


@dataclass(frozen=True)
class Person:
    """A walker: shank over the phase [deg], stride time [s], and what the strike adds over the time since."""

    curve: Curve
    stride_time: float
    strike: Curve = np.zeros_like


def drawn(seed: int) -> Person:
    """A person of the population, other than the shipped walkers."""
    random = np.random.default_rng([7, seed])
    time = float(np.clip(random.normal(*TIME), FASTEST, SLOWEST))
    template = min(
        (after_swing(t) for t in np.arange(0.15, 0.8, 0.01)), key=lambda t: abs(t.stride_time - time)
    )
    series = np.degrees(template.series)
    wave = (series[1::2] - 1j * series[2::2]) * random.normal(1.0, RANGE)
    mean = float(series[0]) + random.normal(0.0, MEAN)
    wave = wave + OWN * (random.standard_normal(HARMONICS) + 1j * random.standard_normal(HARMONICS))
    order = 2j * np.pi * np.arange(1, HARMONICS + 1)
    wave = wave * np.exp(-order * random.normal(0.0, PLACE))
    fall = float(np.exp(random.normal(np.log(FALL[0]), FALL[1])))
    ring, die, delay = random.uniform(*RINGS), random.uniform(*DIES), random.normal(*DELAY)

    def shape(since: np.ndarray) -> np.ndarray:
        since = np.maximum(since, 0.0)
        return -(1.0 - np.cos(2.0 * np.pi * ring * since)) * np.exp(-since / die)

    fine = np.linspace(0.0, 0.1, 400)
    size = fall / -float(np.gradient(shape(fine), fine).min())
    return Person(
        lambda phase: mean + (np.exp(np.multiply.outer(phase, order)) @ wave).real,
        time,
        lambda since: size * shape(since - delay),
    )


@dataclass(frozen=True)
class Stride:
    """A stride of an event.

    duration, amplitude : of the walker's own
    about : angle that the amplitude leaves as it is, in shares of the curve's mean: 0 is the vertical
    stairs : share of the shape that stairs add
    stands : (phase, time [s], phase from which he goes on; NaN: the same); () walks through
    """

    duration: float = 1.0
    amplitude: float = 1.0
    about: float = 1.0
    stairs: float = 0.0
    stands: tuple[float, float, float] | tuple[()] = ()


def _ramp(to: float) -> list[Stride]:
    cadences = (*np.linspace(1.0, to, 6), *np.linspace(to, 1.0, 6))
    return [Stride(duration=1.0 / cadence) for cadence in cadences]


def _turn(amplitude: float, random: np.random.Generator) -> list[Stride]:
    return [Stride(amplitude=amplitude, about=float(random.integers(2)))] * 3


def _steps(
    count: int, amplitude: tuple[float, float], duration: tuple[float, float], about: float
) -> Callable[[np.random.Generator], list[Stride]]:
    """Strides that are drawn one by one."""
    return lambda random: [
        Stride(random.uniform(*duration), random.uniform(*amplitude), about) for _ in range(count)
    ]


EVENTS: dict[str, Callable[[np.random.Generator], list[Stride]]] = {
    **{f"turn × {amplitude:g}": functools.partial(_turn, amplitude) for amplitude in TURNS},
    "U-turn, long strides": _steps(4, (0.5, 0.8), (1.0, 1.4), 0.0),
    "U-turn, small strides": _steps(6, (0.3, 0.6), (0.75, 1.1), 0.0),
    "short steps": lambda random: [Stride(duration=0.85, amplitude=0.75)] * 4,
    "quick steps": _steps(6, (0.55, 0.75), (0.6, 0.75), 0.5),
    "stop": lambda random: [Stride(stands=(random.uniform(0.05, 0.95), random.uniform(1.0, 5.0), np.nan))],
    "stop, new start": lambda random: [
        Stride(stands=(random.uniform(0.1, 0.4), random.uniform(1.0, 5.0), 0.5))
    ],
    "ramp × 1.3": lambda random: _ramp(1.3),
    "ramp × 0.7": lambda random: _ramp(0.7),
    "cadence × 1.3": lambda random: [Stride(duration=1.0 / 1.3)] * 5,
    "cadence × 0.7": lambda random: [Stride(duration=1.0 / 0.7)] * 5,
    "stairs": lambda random: [Stride(stairs=0.5)] + [Stride(stairs=1.0)] * 4 + [Stride(stairs=0.5)],
}


@dataclass(frozen=True, eq=False)
class Walk:
    """Samples at a rate [1/s].

    angle : [rad] (n,)
    phase : true, counting strides; NaN where it is undefined (n,)
    struck : whether the heel has struck since the sample before (n,)
    event : number of the event, from its beginning until two strides after its end; −1 in steady walking (n,)
    names : of the events, in turn
    """

    angle: np.ndarray
    phase: np.ndarray
    struck: np.ndarray
    event: np.ndarray
    names: tuple[str, ...]
    rate: float


def apart(phase: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Estimated less true phase, from −½ to ½ of the cycle (n,)."""
    return (phase - true + 0.5) % 1.0 - 0.5


def stairs(phase: np.ndarray) -> np.ndarray:
    """What climbing adds to the shank's angle [deg]: leant forward in stance, more bent in the swing."""
    return 8.0 + 6.0 * np.cos(2.0 * np.pi * (phase - 0.8)) + 4.0 * np.cos(4.0 * np.pi * (phase - 0.75))


def walk(
    person: Person, names: tuple[str, ...], seed: int, *, rate: float = RATE, noise: float = NOISE
) -> Walk:
    """Events in turn, with steady walking between them."""
    random = np.random.default_rng(seed)
    plan: list[tuple[Stride, int]] = [(Stride(), -1)] * BEFORE
    for of, name in enumerate(names):
        plan += [(stride, of) for stride in EVENTS[name](random)]
        plan += [(Stride(), of)] * 2 + [(Stride(), -1)] * (AFTER - 2)
    mean = float(np.mean(person.curve(np.arange(100) / 100)))
    varied = 1.0 + VARIED * random.standard_normal((2, len(plan)))
    durations = varied[0] * [person.stride_time * stride.duration for stride, _ in plan]
    # amplitude, the angle that it leaves as it is, and share of stairs; each goes over into the next in swing
    kinds = np.array([[stride.amplitude, mean * stride.about, stride.stairs] for stride, _ in plan])
    kinds[:, 0] *= varied[1]
    following = np.vstack([kinds[1:], kinds[-1:]])

    def shank(k: int, phase: np.ndarray) -> np.ndarray:
        over = np.clip((phase - SWING) / (1.0 - SWING), 0.0, 1.0)[..., None]
        over = over**2 * (3.0 - 2.0 * over)
        size, about, climbed = np.moveaxis((1.0 - over) * kinds[k] + over * following[k], -1, 0)
        return about + size * (person.curve(phase) - about) + climbed * stairs(phase)

    pieces = [_piece(functools.partial(shank, k), stride, durations[k]) for k, (stride, _) in enumerate(plan)]
    ends = np.cumsum([piece.time[-1] for piece in pieces])
    time = np.arange(0.0, ends[-1], 1.0 / rate)
    number = np.minimum(np.searchsorted(ends, time, side="right"), len(plan) - 1)
    angle, phase = np.empty(len(time)), np.empty(len(time))
    for k, piece in enumerate(pieces):
        inside, begins = number == k, ends[k - 1] if k else 0.0
        since = time[inside] - begins
        moved = np.interp(since, piece.time, piece.moved)
        angle[inside] = np.interp(since, piece.time, piece.stood) + shank(k, moved)
        phase[inside] = k + np.where(np.interp(since, piece.time, piece.known) < 1.0, np.nan, moved)
    for k, begins in enumerate(ends[:-1], 1):
        near = slice(*np.searchsorted(time, (begins - 0.05, begins + 0.3)))
        angle[near] += kinds[k, 0] * person.strike(time[near] - begins)
    drift = DRIFT * random.uniform(-1.0, 1.0) * time
    angle = angle + 4.0 - np.abs(drift % 16.0 - 8.0) + noise * random.standard_normal(len(time))
    events = np.array([of for _, of in plan])
    over = (phase % 1.0 > SWING) & (events[number] < 0)  # a stride that goes over into an event is of it
    event = events[np.minimum(number + over, len(plan) - 1)]
    return Walk(np.radians(angle), phase, np.diff(number, prepend=0) > 0, event, names, rate)


@dataclass(frozen=True, eq=False)
class _Piece:
    """A stride over its time: phase of the curve, angle added to it [deg], whether it is defined."""

    time: np.ndarray
    moved: np.ndarray
    stood: np.ndarray
    known: np.ndarray


def _piece(shank: Curve, stride: Stride, duration: float) -> _Piece:
    if not stride.stands:
        ends = np.array([0.0, duration])
        return _Piece(ends, ends / duration, 0.0 * ends, 1.0 + 0.0 * ends)
    at, stood, onward = stride.stands
    stop, instant = at * duration, 1e-6
    if np.isnan(onward):  # as if a film stood still
        steps = [0.0, stop, instant, stood, instant, (1.0 - at) * duration]
        moved = [0.0, at, at, at, at, 1.0]
        added, known = [0.0] * 6, [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]
    else:  # he puts his shank upright within 0.4 s, and begins as slowly, with the heel's rise
        steps = [0.0, stop, 0.4, stood, instant, 0.4, (1.0 - onward) * duration]
        moved = [0.0, at, at, at, onward, onward, 1.0]
        upright = [-float(shank(np.array(phase))) for phase in (at, onward)]
        added, known = [0.0, 0.0, upright[0], *upright, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    return _Piece(np.cumsum(steps), np.array(moved), np.array(added), np.array(known))


@dataclass(frozen=True)
class Judged:
    """An estimate of a walk against its true phase.

    lies : time with `ready` and an error over a tenth of a stride, of each event; last, of steady walking [s]
    late : largest error from two strides after each event until the next one [% of a stride]
    steady, defined : share of steady walking, and of all time with a defined phase, with `ready` [-]
    bias : mean error of steady walking behind the first event [% of a stride]
    """

    lies: tuple[float, ...]
    late: tuple[float, ...]
    steady: float
    defined: float
    bias: float


def judged(walk: Walk, phase: np.ndarray, ready: np.ndarray) -> Judged:
    """Judge an estimate at every sample of a walk."""
    off = apart(phase, walk.phase)
    error, known = np.abs(off), np.isfinite(walk.phase)
    lying = known & ready & (error > 0.1)
    numbers = range(len(walk.names))
    lies = [np.sum(lying & (walk.event == k)) / walk.rate for k in numbers]
    steady = known & (walk.event < 0) & (walk.phase > 3.0)
    first = [np.flatnonzero(walk.event == k)[-1] + 1 for k in numbers]
    begin = np.flatnonzero(walk.phase > 3.0)[0]
    spans = itertools.pairwise([begin, *first, len(error)])
    settled = np.where(known & (walk.event < 0), error, 0.0)
    late = [100.0 * float(settled[a:b].max(initial=0.0)) for a, b in spans]
    lies.append(np.sum(lying & (walk.event < 0)) / walk.rate)
    bias = 100.0 * float(np.mean(off[steady & ready])) if np.any(steady & ready) else np.nan
    return Judged(
        tuple(lies), tuple(late[1:]), float(np.mean(ready[steady])), float(np.mean(ready[known])), bias
    )

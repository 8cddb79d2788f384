"""Walks with turns, stops, ramps and stairs, and the gait phase in them: nothing here estimates it.

A stride is a curve of the shank over the phase, a duration and an amplitude. The true phase is linear between
the walker's own heel strikes, and undefined (NaN) where he stands or begins to walk.
"""

import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

RATE = 100.0  # of samples [1/s]
NOISE, VARIED = 0.5, 0.02  # of the angle [deg], of the stride time [-]; standard deviations
DRIFT = 0.05  # of the sensor, most [deg/s]; it turns back at 4°
BEFORE, AFTER = 8, 8  # strides of steady walking before the first event and after each
TURNS = (0.5, 0.6, 0.75, 0.8, 0.85, 1.2)  # amplitudes of their three strides
Curve = Callable[[np.ndarray], np.ndarray]  # shank [deg] over the phase [-]


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
    return [Stride(duration=1.0 / cadence) for cadence in np.linspace(1.0, to, 6)] + [
        Stride(duration=1.0 / cadence) for cadence in np.linspace(to, 1.0, 6)
    ]


def _turn(amplitude: float, random: np.random.Generator) -> list[Stride]:
    return [Stride(amplitude=amplitude, about=float(random.integers(2)))] * 3


EVENTS: dict[str, Callable[[np.random.Generator], list[Stride]]] = {
    **{f"turn × {amplitude:g}": functools.partial(_turn, amplitude) for amplitude in TURNS},
    "short steps": lambda random: [Stride(duration=0.85, amplitude=0.75)] * 4,
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
    """Samples every 1 / RATE.

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


def apart(phase: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Estimated less true phase, from −½ to ½ of the cycle (n,)."""
    return (phase - true + 0.5) % 1.0 - 0.5


def stairs(phase: np.ndarray) -> np.ndarray:
    """What climbing adds to the shank's angle [deg]: leant forward in stance, more bent in the swing."""
    return 8.0 + 6.0 * np.cos(2.0 * np.pi * (phase - 0.8)) + 4.0 * np.cos(4.0 * np.pi * (phase - 0.75))


def walk(curve: Curve, stride_time: float, names: tuple[str, ...], seed: int) -> Walk:
    """Events in turn, with steady walking between them."""
    random = np.random.default_rng(seed)
    plan: list[tuple[Stride, int]] = [(Stride(), -1)] * BEFORE
    for of, name in enumerate(names):
        plan += [(stride, of) for stride in EVENTS[name](random)]
        plan += [(Stride(), of)] * 2 + [(Stride(), -1)] * (AFTER - 2)
    mean = float(np.mean(curve(np.arange(100) / 100)))
    pieces = [_piece(curve, mean, stride, stride_time, random) for stride, _ in plan]
    ends = np.cumsum([piece.time[-1] for piece in pieces])
    time = np.arange(0.0, ends[-1], 1.0 / RATE)
    number = np.minimum(np.searchsorted(ends, time, side="right"), len(plan) - 1)
    angle, phase = np.empty(len(time)), np.empty(len(time))
    for k, piece in enumerate(pieces):
        inside = number == k
        since = time[inside] - (ends[k - 1] if k else 0.0)
        moved = np.interp(since, piece.time, piece.moved)
        angle[inside] = np.interp(since, piece.time, piece.stood) + piece.shank(moved)
        phase[inside] = k + np.where(np.interp(since, piece.time, piece.known) < 1.0, np.nan, moved)
    drift = DRIFT * random.uniform(-1.0, 1.0) * time
    angle = angle + 4.0 - np.abs(drift % 16.0 - 8.0) + NOISE * random.standard_normal(len(time))
    struck = np.diff(number, prepend=0) > 0
    event = np.array([of for _, of in plan])[number]
    return Walk(np.radians(angle), phase, struck, event, names)


@dataclass(frozen=True, eq=False)
class _Piece:
    """A stride over its time: phase of the curve, angle added to it [deg], whether it is defined."""

    time: np.ndarray
    moved: np.ndarray
    stood: np.ndarray
    known: np.ndarray
    shank: Curve


def _piece(
    curve: Curve, mean: float, stride: Stride, stride_time: float, random: np.random.Generator
) -> _Piece:
    duration = stride_time * stride.duration * (1.0 + VARIED * random.standard_normal())

    def shank(phase: np.ndarray) -> np.ndarray:
        base = stride.about * mean
        return base + stride.amplitude * (curve(phase) - base) + stride.stairs * stairs(phase)

    if not stride.stands:
        ends = np.array([0.0, duration])
        return _Piece(ends, ends / duration, 0.0 * ends, 1.0 + 0.0 * ends, shank)
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
    return _Piece(np.cumsum(steps), np.array(moved), np.array(added), np.array(known), shank)


@dataclass(frozen=True)
class Judged:
    """An estimate of a walk against its true phase.

    lies : time with `ready` and an error over a tenth of a stride, of each event; last, of steady walking [s]
    late : largest error from two strides after each event until the next one [% of a stride]
    steady, defined : share of steady walking, and of all time with a defined phase, with `ready` [-]
    """

    lies: tuple[float, ...]
    late: tuple[float, ...]
    steady: float
    defined: float


def judged(walk: Walk, phase: np.ndarray, ready: np.ndarray) -> Judged:
    """Judge an estimate at every sample of a walk."""
    error = np.abs(apart(phase, walk.phase))
    known = np.isfinite(walk.phase)
    lying = known & ready & (error > 0.1)
    numbers = range(len(walk.names))
    lies = [np.sum(lying & (walk.event == k)) / RATE for k in numbers]
    steady = known & (walk.event < 0) & (walk.phase > 3.0)
    first = [np.flatnonzero(walk.event == k)[-1] + 1 for k in numbers]
    begin = np.flatnonzero(walk.phase > 3.0)[0]
    spans = itertools.pairwise([begin, *first, len(error)])
    settled = np.where(known & (walk.event < 0), error, 0.0)
    late = [100.0 * float(settled[a:b].max(initial=0.0)) for a, b in spans]
    lies.append(np.sum(lying & (walk.event < 0)) / RATE)
    return Judged(tuple(lies), tuple(late[1:]), float(np.mean(ready[steady])), float(np.mean(ready[known])))

"""Timers as clocks of a board."""

import math
from collections.abc import Mapping, Sequence

from afo_sim.common.errors import InputError
from afo_sim.control.timer import SLIGHTLY
from afo_sim.description.control.switching import ClockTimer, Phases, Timer, in_si
from afo_sim.export.electronics.board import (
    MICROSECOND,
    Clock,
    Restart,
    counted,
    is_whole,
    tick_of,
    whole,
)

Intervals = Sequence[tuple[float, float]]  # [s]
Valves = Mapping[tuple[int, str], Intervals]  # by (number of the chamber, "inlet" or "outlet")
SIDES = ("inlet", "outlet")


def timer_clock(timer: Timer, chambers: Sequence[str]) -> tuple[Clock, int]:
    """The clock of a scenario's timer, and its tick [us]; places are rounded to the nearest tick."""
    return _exact(_valves(timer.chambers, chambers), timer.period, 0.0, "timer")


def phases_clock(
    phases: Phases, stride_time: float, start_phase: float, chambers: Sequence[str]
) -> tuple[Clock, int]:
    """The clock of valves by gait phase, of a walker whose strides all take the same time [s]."""
    told = {}
    for key, intervals in _valves(phases.chambers, chambers).items():
        parts = [p for a, b in intervals for p in ([(a, b)] if a < b else [(a, 1.0), (0.0, b)])]
        told[key] = [(a * stride_time, b * stride_time) for a, b in parts if a < b]
    return _exact(told, stride_time, start_phase * stride_time, "phases")


def controller_clock(timer: ClockTimer, rate: float, chambers: Sequence[str]) -> tuple[Clock, int, int]:
    """The clock of a timer that a loop looks at, its tick [us], and the loop's step [ticks].

    An event holds from the first look on that does not come before it.
    """
    field = "controller.timer"
    period = timer.period
    tick = next((t for t in (1000, 1) if is_whole(period, t) and is_whole(1.0 / rate, t)), 1)
    step = whole(1.0 / rate, tick, "controller.rate: the time between two commands")
    restart = None
    if timer.restart is not None:
        restart = Restart(in_si(timer.restart.above), max(_reached(timer.restart.after, tick), 0))
    ticks = whole(period, tick, f"{field}.period")
    valves = {
        key: [(_reached(a, tick), _reached(b, tick)) for a, b in intervals]
        for key, intervals in _valves(timer.chambers, chambers).items()
    }
    return Clock(ticks, 0, _changes(valves, ticks), restart), tick, step


def _reached(time: float, tick: int) -> int:
    """The first tick that counts as not before a time [s], as the simulated controller compares."""
    return math.ceil((time - SLIGHTLY) / (tick * MICROSECOND))


def _valves(told: Mapping[str, object], chambers: Sequence[str]) -> dict[tuple[int, str], Intervals]:
    return {
        (chambers.index(name), side): getattr(times, side) for name, times in told.items() for side in SIDES
    }


def _exact(valves: Valves, period: float, place: float, field: str) -> tuple[Clock, int]:
    """A clock whose events fall at any time, rounded to ticks."""
    times = [time for intervals in valves.values() for event in intervals for time in event]
    tick = tick_of([period, place, *times])
    ticks = counted(period, tick, f"{field}: the period")
    rounded = {}
    for key, intervals in valves.items():
        rounded[key] = [(_nearest(a, tick), min(_nearest(b, tick), ticks)) for a, b in intervals]
        for (start, end), (a, b) in zip(rounded[key], intervals, strict=True):
            if start >= end:
                problem = f"the event [{a:g} s, {b:g} s] is shorter than the board can count"
                raise InputError(problem, field=field, allowed="a microsecond and more")
    seconds = tick * MICROSECOND
    clock = Clock(
        period=ticks,
        place=_nearest(place, tick) % ticks,
        changes=_changes(rounded, ticks),
        rounding=max((abs(time - _nearest(time, tick) * seconds) for time in times), default=0.0),
        drift=ticks * seconds - period,
    )
    return clock, tick


def _nearest(time: float, tick: int) -> int:
    return round(time / (tick * MICROSECOND))


def _changes(
    valves: Mapping[tuple[int, str], Sequence[tuple[int, int]]], period: int
) -> tuple[tuple[int, int], ...]:
    """(place, coils from there on) wherever a coil changes; the coils at place 0 first."""
    places = {time for intervals in valves.values() for event in intervals for time in event}
    found: list[tuple[int, int]] = []
    for place in sorted(place for place in places | {0} if place < period):
        coils = sum(
            1 << (2 * chamber + SIDES.index(side))
            for (chamber, side), intervals in valves.items()
            if any(start <= place < end for start, end in intervals)
        )
        if not found or coils != found[-1][1]:
            found.append((place, coils))
    return tuple(found)

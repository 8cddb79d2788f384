"""A board's tables: a timer as a clock, a state machine in whole control periods."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from afo_sim.common import InputError
from afo_sim.control import DIGITS, SLIGHTLY, Machine, Transition
from afo_sim.description import STATE_TIME, ClockTimer, Phases, Timer, in_si

MICROSECOND = 1e-6  # [s]
_TICKS = (1000, 1)  # of the board's clock, millis() and micros() [us]; the longest that fits is taken
_MOST_TICKS = 2**31 - 1  # of a period: a 32-bit clock must not come round within it
_WHOLE = 1e-6  # of a tick, to which a time counts as whole ticks
MOST_CHAMBERS = 16  # two bits each in 32
MOST_NAMES = 254  # states or inputs: 255 marks the end of a table
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,40}")
Intervals = Sequence[tuple[float, float]]  # [s]
_Valves = Mapping[tuple[int, str], Intervals]  # by (number of the chamber, "inlet" or "outlet")
_SIDES = ("inlet", "outlet")
_FIELD = "controller.state_machine"
_ALLOWED = "inlet, outlet, both or shut"


@dataclass(frozen=True)
class Input:
    """A quantity that the board reads: value = scale · volts + offset."""

    column: str
    unit: str
    scale: float | None = None
    offset: float | None = None


@dataclass(frozen=True)
class Restart:
    """A foot switch that restarts the clock when input 0 reaches the threshold."""

    threshold: float
    after: int


@dataclass(frozen=True)
class Clock:
    """A repeating clock in ticks."""

    period: int
    place: int
    changes: tuple[tuple[int, int], ...]
    restart: Restart | None = None
    rounding: float = 0.0
    drift: float = 0.0


@dataclass(frozen=True)
class Rule:
    """A transition of a state machine in control periods."""

    source: int
    to: int
    input: int | None
    above: bool
    threshold: float
    after: int


@dataclass(frozen=True)
class States:
    """A state machine in control periods."""

    names: tuple[str, ...]
    start: int
    named: tuple[int, ...]
    coils: tuple[int, ...]
    rules: tuple[Rule, ...]


@dataclass(frozen=True)
class Board:
    """What is exported."""

    name: str
    chambers: tuple[str, ...]
    tick: int
    step: int
    logic: Clock | States
    inputs: tuple[Input, ...] = ()


def tick_of(times: Iterable[float]) -> int:
    """The longest tick [us] of which all times [s] are whole multiples; 1 where none is."""
    listed = list(times)
    return next((tick for tick in _TICKS if all(_is_whole(time, tick) for time in listed)), _TICKS[-1])


def _is_whole(time: float, tick: int) -> bool:
    """Whether a time [s] is whole ticks [us]."""
    ticks = time / (tick * MICROSECOND)
    return abs(ticks - round(ticks)) <= _WHOLE


def whole(time: float, tick: int, field: str) -> int:
    """A time [s] in ticks [us]; InputError where it is not whole or too long."""
    if not _is_whole(time, tick):
        problem = f"is not a whole number of {'milli' if tick == 1000 else 'micro'}seconds, as a board counts"
        raise InputError(problem, field=field, value=f"{time!r} s", allowed=f"{round(time, 6):g} s")
    return _counted(time, tick, field)


def _counted(time: float, tick: int, field: str) -> int:
    """A time [s] rounded to ticks [us]; InputError where it is too long for a 32-bit clock."""
    ticks = round(time / (tick * MICROSECOND))
    if not 1 <= ticks <= _MOST_TICKS:
        longest = _MOST_TICKS * tick * MICROSECOND
        hint = "" if tick == 1000 else "; whole milliseconds of all times allow 2147483 s"
        allowed = f"{tick * MICROSECOND:g} s to {longest:.0f} s{hint}"
        raise InputError("does not fit a 32-bit clock", field=field, value=f"{time!r} s", allowed=allowed)
    return ticks


def check_names(names: Iterable[str], what: str, most: int) -> tuple[str, ...]:
    """Names that C takes; InputError otherwise."""
    found = tuple(names)
    if len(found) > most:
        raise InputError(f"are too many {what}s for a board", field=what, value=len(found), allowed=f"{most}")
    for name in found:
        if not _IDENTIFIER.fullmatch(name):
            nearest = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_0123456789") or None
            problem = f"is not a name that C takes, and the {what} is to have one"
            allowed = "a letter, then letters, digits and _, 41 at most"
            raise InputError(problem, field=what, value=name, allowed=allowed, nearest=nearest)
    return found


def timer_clock(timer: Timer, chambers: Sequence[str]) -> tuple[Clock, int]:
    """The clock of a scenario's timer, and its tick [us]; places are rounded to the nearest tick."""
    return _exact(_valves(timer.chambers, chambers), timer.period, 0.0, "timer")


def phases_clock(
    phases: Phases, stride_time: float, start_phase: float, chambers: Sequence[str]
) -> tuple[Clock, int]:
    """The clock of valves by gait phase, of a walker whose strides all take the same time [s]."""
    stated = {}
    for key, intervals in _valves(phases.chambers, chambers).items():
        parts = [p for a, b in intervals for p in ([(a, b)] if a < b else [(a, 1.0), (0.0, b)])]
        stated[key] = [(a * stride_time, b * stride_time) for a, b in parts if a < b]
    return _exact(stated, stride_time, start_phase * stride_time, "phases")


def controller_clock(timer: ClockTimer, rate: float, chambers: Sequence[str]) -> tuple[Clock, int, int]:
    """The clock of a timer that a loop looks at, its tick [us], and the loop's step [ticks]."""
    tick = tick_of([timer.period, 1.0 / rate])
    step = whole(1.0 / rate, tick, "controller.rate: the time between two commands")
    restart = None
    if timer.restart is not None:
        restart = Restart(in_si(timer.restart.above), max(_reached(timer.restart.after, tick), 0))
    ticks = whole(timer.period, tick, "controller.timer.period")
    valves = {
        key: [(_reached(a, tick), _reached(b, tick)) for a, b in intervals]
        for key, intervals in _valves(timer.chambers, chambers).items()
    }
    return Clock(ticks, 0, _changes(valves, ticks), restart), tick, step


def _reached(time: float, tick: int) -> int:
    """The first tick that counts as not before a time [s], as the simulated controller compares."""
    return math.ceil((time - SLIGHTLY) / (tick * MICROSECOND))


def _valves(by_chamber: Mapping[str, object], chambers: Sequence[str]) -> dict[tuple[int, str], Intervals]:
    return {
        (chambers.index(name), side): getattr(times, side)
        for name, times in by_chamber.items()
        for side in _SIDES
    }


def _exact(valves: _Valves, period: float, place: float, field: str) -> tuple[Clock, int]:
    """A clock whose events fall at any time, rounded to ticks."""
    times = [time for intervals in valves.values() for event in intervals for time in event]
    tick = tick_of([period, place, *times])
    ticks = _counted(period, tick, f"{field}: the period")
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
            1 << (2 * chamber + _SIDES.index(side))
            for (chamber, side), intervals in valves.items()
            if any(start <= place < end for start, end in intervals)
        )
        if not found or coils != found[-1][1]:
            found.append((place, coils))
    return tuple(found)


def states_of(machine: Machine, period: float, chambers: Sequence[str]) -> States:
    """The machine's tables."""
    names = check_names(machine.states, "state", MOST_NAMES)
    masks = [
        _masks(commands, chambers, f"{_FIELD}.state.{name}")
        for name, commands in zip(names, machine.commands, strict=True)
    ]
    columns = machine.columns()
    return States(
        names=names,
        start=machine.start,
        named=tuple(named for named, _ in masks),
        coils=tuple(coils for _, coils in masks),
        rules=tuple(_rule(transition, period, columns) for transition in machine.transitions),
    )


def _masks(
    commands: Mapping[str, tuple[float, float] | float], chambers: Sequence[str], field: str
) -> tuple[int, int]:
    """Bits of the coils that a state commands, and of those that have current."""
    named = coils = 0
    for chamber, command in commands.items():
        place = 2 * chambers.index(chamber)
        if isinstance(command, float):
            problem = "is a pressure, and the export switches coils on and off"
            raise InputError(problem, field=f"{field}.{chamber}", value=f"{command:g} Pa", allowed=_ALLOWED)
        if not all(coil in (0.0, 1.0) for coil in command):
            problem = "is a share of a coil's current, and the export switches coils on and off"
            raise InputError(problem, field=f"{field}.{chamber}", value=list(command), allowed=_ALLOWED)
        named |= 3 << place
        coils |= (int(command[0]) | int(command[1]) << 1) << place
    return named, coils


def _rule(transition: Transition, period: float, columns: Sequence[str]) -> Rule:
    timed = transition.column == STATE_TIME
    return Rule(
        source=transition.source,
        to=transition.to,
        input=None if timed else columns.index(transition.column),
        above=transition.above,
        threshold=float(_periods(transition.threshold, period)) if timed else transition.threshold,
        after=_periods(transition.after, period),
    )


def _periods(time: float, period: float) -> int:
    """The fewest control periods after which the time in a state is not below a time [s]."""
    if time > _MOST_TICKS * period:
        problem, allowed = "does not fit a 32-bit count of periods", f"at most {_MOST_TICKS * period:.0f} s"
        raise InputError(problem, field=_FIELD, value=f"{time:g} s", allowed=allowed)
    count = max(math.floor(time / period) - 1, 0)
    while round(count * period, DIGITS) < time:
        count += 1
    return count

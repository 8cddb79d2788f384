"""What a board needs in order to switch the valves as the simulation does: whole ticks, no floats."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from afo_sim.common.errors import InputError

MICROSECOND = 1e-6  # [s]
TICKS = (1000, 1)  # of the board's clock, millis() and micros() [us]; the longest that fits is taken
MOST_TICKS = 2**31 - 1  # of a period: a 32-bit clock must not come round within it
WHOLE = 1e-6  # of a tick, to which a time counts as whole ticks
MOST_CHAMBERS = 16  # two bits each in 32
MOST_NAMES = 254  # states or inputs: 255 marks the end of a table
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,40}")


@dataclass(frozen=True)
class Input:
    """A quantity that the board reads: value = scale · volts + offset.

    column : of the run, or "sensor/<name>"
    unit : of the value [SI]
    scale, offset : calibration line; None where the scenario tells none
    """

    column: str
    unit: str
    scale: float | None = None
    offset: float | None = None


@dataclass(frozen=True)
class Restart:
    """A foot switch that starts the clock anew where input 0 reaches the threshold.

    after : least ticks from one restart to the next
    """

    threshold: float
    after: int


@dataclass(frozen=True)
class Clock:
    """A repeating clock in ticks.

    place : on the clock at time 0
    changes : (place, coils from there on), the first at place 0; bit 2k is chamber k's inlet,
        2k + 1 its outlet
    rounding : longest time by which a place differs from the scenario's [s]
    drift : by which the period differs from the scenario's [s]
    """

    period: int
    place: int
    changes: tuple[tuple[int, int], ...]
    restart: Restart | None = None
    rounding: float = 0.0
    drift: float = 0.0


@dataclass(frozen=True)
class Rule:
    """A transition of a state machine in control periods.

    input : number of the input that is compared; None for the time in the state
    above : whether it fires at the threshold and above it; else below it
    threshold : [SI], or control periods where the time in the state is compared
    after : least control periods in the state
    """

    source: int
    to: int
    input: int | None
    above: bool
    threshold: float
    after: int


@dataclass(frozen=True)
class States:
    """A state machine in control periods.

    named, coils : of each state, the coils that it commands, and those of them that have current
    """

    names: tuple[str, ...]
    start: int
    named: tuple[int, ...]
    coils: tuple[int, ...]
    rules: tuple[Rule, ...]


@dataclass(frozen=True)
class Board:
    """What is exported.

    tick : of the board's clock [us]
    step : ticks from one look at inputs and clock to the next; 0 is as often as the loop comes round
    """

    name: str
    chambers: tuple[str, ...]
    tick: int
    step: int
    logic: Clock | States
    inputs: tuple[Input, ...] = ()


def tick_of(times: Iterable[float]) -> int:
    """The longest tick [us] of which all times [s] are whole multiples; 1 where none is."""
    told = list(times)
    return next((tick for tick in TICKS if all(is_whole(time, tick) for time in told)), TICKS[-1])


def is_whole(time: float, tick: int) -> bool:
    """Whether a time [s] is whole ticks [us]."""
    ticks = time / (tick * MICROSECOND)
    return abs(ticks - round(ticks)) <= WHOLE


def whole(time: float, tick: int, field: str) -> int:
    """A time [s] in ticks [us]; InputError where it is not whole or too long."""
    if not is_whole(time, tick):
        problem = f"is not a whole number of {'milli' if tick == 1000 else 'micro'}seconds, as a board counts"
        raise InputError(problem, field=field, value=f"{time!r} s", allowed=f"{round(time, 6):g} s")
    return counted(time, tick, field)


def counted(time: float, tick: int, field: str) -> int:
    """A time [s] rounded to ticks [us]; InputError where it is too long for a 32-bit clock."""
    ticks = round(time / (tick * MICROSECOND))
    if not 1 <= ticks <= MOST_TICKS:
        longest = MOST_TICKS * tick * MICROSECOND
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
            raise InputError(
                f"is no name that C takes, and the {what} is to have one",
                field=what,
                value=name,
                allowed="a letter, then letters, digits and _, 41 at most",
                nearest=nearest,
            )
    return found

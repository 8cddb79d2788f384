"""What switches valves as it is described: by a clock, by gait phase, by the states of a machine.

A timer and phases are of a scenario; `ClockTimer`, `GaitPhase` and `StateMachine` are controllers.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from afo_sim.common import Foreign, Given, format_quantity, parse_quantity, read_any_quantity
from afo_sim.description.law_set import GaugePressure
from afo_sim.description.quantity import Described, OfChambers, Part, Quantity, refusal, refused_name
from afo_sim.description.walking import Phase


@dataclass(frozen=True)
class _Threshold:
    """Marks a text such as "20 N", or a bare number of a column without unit; the column decides which."""

    def read(self, value: object) -> str:
        """The text, if it is a quantity."""
        if isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value):
            return repr(float(value))
        if not isinstance(value, str):
            raise refusal("is not a valid threshold", 'a text in the column\'s unit, such as "20 N"')
        try:
            found = in_si(value)
        except ValueError as error:
            raise refusal(str(error), "a quantity in the column's unit") from None
        if not math.isfinite(found):
            raise refusal("is not finite", "a quantity in the column's unit")
        return value

    def __get_pydantic_core_schema__(self, source: Foreign, handler: Foreign) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)


def in_si(text: str) -> float:
    """A threshold in SI; ValueError where it is no quantity."""
    try:
        return float(text)
    except ValueError:
        return read_any_quantity(text)[0]


Threshold = Annotated[str, _Threshold()]

_COIL_WORDS = ("inlet", "outlet", "both", "shut")  # whose valve's coil has current
_HIGHEST_PRESSURE = 2e6  # pressure that may be asked for, gauge [Pa]
_COMMANDS = (
    f'{", ".join(_COIL_WORDS)}, two coils such as [1.0, 0.0], or a pressure such as "3 bar" for a drive'
)


@dataclass(frozen=True)
class _Command:
    """Marks a field that holds a word, two coils (inlet, outlet) from 0 to 1, or a gauge pressure [Pa]."""

    def read(self, value: object, info: ValidationInfo) -> str | tuple[float, float] | float:
        """Text, or a list of two coils; SI itself from `with_values`."""
        if isinstance(value, str) and value in _COIL_WORDS:
            return value
        if isinstance(value, Sequence) and not isinstance(value, str):
            numbers = [float(x) for x in value if isinstance(x, Real) and not isinstance(x, bool)]
            if not len(value) == len(numbers) == 2 or not all(0.0 <= x <= 1.0 for x in numbers):
                raise refusal("is not a valid command", _COMMANDS)
            return numbers[0], numbers[1]
        plain = (
            f"{float(value)!r} Pa" if isinstance(value, Real) and (info.context or {}).get("si") else value
        )
        try:
            pressure = parse_quantity(plain, "Pa")
        except ValueError:
            raise refusal("is not a valid command", _COMMANDS) from None
        if not 0.0 <= pressure <= _HIGHEST_PRESSURE:
            raise refusal("is out of range", f"a gauge pressure from 0 to {1e-5 * _HIGHEST_PRESSURE:g} bar")
        return pressure

    def write(self, value: Given) -> Given:
        """As written in a file."""
        if isinstance(value, float):
            return format_quantity(value, "Pa")
        return value if isinstance(value, str) else list(value)

    def __get_pydantic_core_schema__(self, source: Foreign, handler: Foreign) -> CoreSchema:
        writer = core_schema.plain_serializer_function_ser_schema(self.write)
        return core_schema.with_info_plain_validator_function(self.read, serialization=writer)


_ChamberCommand = Annotated[str | tuple[float, float] | float, _Command()]

_Time = Annotated[float, Quantity("s", at_least=0.0, at_most=1e5)]
PositiveTime = Annotated[float, Quantity("s", above=0.0, at_most=1e5)]


class ValveTimes(Described):
    """Intervals in which a chamber's two valves are open, [from, to] within the timer's period."""

    inlet: tuple[tuple[_Time, _Time], ...] = ()
    """Intervals [from, to] in which the inlet valve's coil has current."""
    outlet: tuple[tuple[_Time, _Time], ...] = ()
    """Intervals [from, to] in which the outlet valve's coil has current."""


class SwitchTimes(ValveTimes):
    """The same, or those of a valve between other nodes."""

    open: tuple[tuple[_Time, _Time], ...] = ()
    """Intervals [from, to] in which the coil of a valve between other nodes has current."""


class Clock(OfChambers[Part]):
    """Intervals of valves that repeat."""

    period: PositiveTime
    """Time after which the valves' intervals repeat."""

    def _must_fit_events(self) -> None:
        for name, times in self.chambers.items():
            for valve in ("inlet", "outlet", "open"):
                for start, end in getattr(times, valve, ()):
                    if not 0.0 <= start < end <= self.period * (1.0 + 1e-12):
                        problem = f"the event [{start:g} s, {end:g} s] is not within the period"
                        raise refusal(problem, f"0 s ≤ from < to ≤ {self.period:g} s", f"{name}.{valve}")


class Timer(Clock[SwitchTimes]):
    """A repeating timer; every key but `period` is a chamber, or a valve between other nodes."""


class Restart(Described):
    """A foot switch that restarts the clock at each heel strike."""

    column: str = "foot/heel_load"
    """What the foot switch sees: a column, or "sensor/<name>"."""
    above: Threshold = "50 N"
    """Value from which on the foot switch is closed; it is a heel strike where it closes."""
    after: Annotated[float, Quantity("s", at_least=0.0, at_most=10.0)] = 0.4
    """Least time from one restart to the next: a switch bounces."""


class ClockTimer(Clock[ValveTimes]):
    """A repeating clock; every key but `period` and `restart` is a chamber."""

    restart: Restart | None = None
    """Foot switch that starts the clock anew; it then stops at its period and waits. Else it repeats."""

    @property
    def cycle(self) -> float | None:
        """Period of a clock that repeats [s]; None of one that a foot switch starts."""
        return self.period if self.restart is None else None

    def _must_switch_something(self) -> None:
        if not self.chambers:
            raise refusal("names no chamber", "a table for each chamber, such as [dorsiflexor]")


class ValvePhases(Described):
    """Intervals of gait phase in which a chamber's two valves are open; from > to runs over heel strike."""

    inlet: tuple[tuple[Phase, Phase], ...] = ()
    """Intervals [from, to] of gait phase in which the inlet valve's coil has current."""
    outlet: tuple[tuple[Phase, Phase], ...] = ()
    """Intervals [from, to] of gait phase in which the outlet valve's coil has current."""

    def _must_be_intervals(self) -> None:
        for valve in ("inlet", "outlet", "open"):
            for start, end in getattr(self, valve, ()):
                if start == end:
                    problem = f"the event [{start:g}, {end:g}] is empty"
                    raise refusal(problem, "two different gait phases from 0 to 1", valve)


class SwitchPhases(ValvePhases):
    """The same, or those of a valve between other nodes."""

    open: tuple[tuple[Phase, Phase], ...] = ()
    """Intervals [from, to] of gait phase in which the coil of a valve between other nodes has current."""


class Phases(OfChambers[SwitchPhases]):
    """Valves switched by gait phase; every key is a chamber, or a valve between other nodes."""


class ChamberPhases(ValvePhases):
    """What a chamber is commanded over the estimated gait phase: intervals of its valves, or pressures."""

    pressure: tuple[tuple[Phase, GaugePressure], ...] = ()
    """Points [phase, pressure] that its drive is asked for, linear between them and over heel strike."""

    def _must_be_one(self) -> None:
        if self.pressure and (self.inlet or self.outlet):
            problem = "conflicts with intervals of the valves"
            raise refusal(problem, "pressure, or inlet and outlet", "pressure")
        phases = [phase for phase, _ in self.pressure]
        if any(after <= before for before, after in itertools.pairwise(phases)):
            raise refusal("its phases do not rise", "points in the order of their phases", "pressure")


class GaitPhase(OfChambers[ChamberPhases]):
    """Commands by a gait phase that is estimated from a sensor; every other key is a chamber."""

    estimator: Literal["oscillator", "foot_switch"] = "oscillator"
    """An oscillator on the shank's angle, or time since heel strike over the mean of the last strides."""
    column: str | None = None
    """Column or "sensor/<name>" of an oscillator; "shank/angle" by default."""
    switch: str | None = None
    """Column or "sensor/<name>" of a foot switch; "foot/heel_load" by default, beside an oscillator none."""
    heel_strike: Annotated[float, Quantity("N", above=0.0, at_most=1e4)] = 50.0
    """Load from which on the foot switch is closed; it opens below half of it."""
    strides: Annotated[int, Field(ge=1, le=20)] = 3
    """Strides whose mean duration a foot switch counts with."""
    waiting: Literal["shut", "outlet"] = "shut"
    """Command of all its chambers while the phase is not known: at first, and where the walker stands."""

    @property
    def pressed(self) -> dict[str, str]:
        """Those of them with a pressure command for their drive."""
        return {chamber: chamber for chamber, phases in self.chambers.items() if phases.pressure}

    @property
    def angle(self) -> str:
        """Column of the shank's angle, "" where no oscillator sees one."""
        return (self.column or "shank/angle") if self.estimator == "oscillator" else ""

    @property
    def load(self) -> str:
        """Column of the foot switch, "" where there is none."""
        return self.switch or ("foot/heel_load" if self.estimator == "foot_switch" else "")

    def _must_switch_something(self) -> None:
        if not self.chambers:
            raise refusal("names no chamber", "a table for each chamber, such as [dorsiflexor]")
        if self.estimator == "foot_switch" and self.column is not None:
            raise refusal("is for an oscillator; a foot switch has its own key", "switch", "column")


STATE_TIME = "state_time"  # column of a transition: time since the state was entered


class MachineState(OfChambers[_ChamberCommand]):
    """Commands of a state; every key is a chamber, and one that is not named keeps its command."""


class MachineTransition(Described):
    """A condition on a column that leads from one state to another."""

    state: str
    """State in which the condition is looked at."""
    to: str
    """State that it leads to."""
    column: str
    """What is compared: a column, "sensor/<name>", or "state_time", the time in the state."""
    above: Threshold | None = None
    """The condition holds at this value and above it."""
    below: Threshold | None = None
    """The condition holds below this value."""
    after: Annotated[float, Quantity("s", at_least=0.0, at_most=1e3)] = 0.0
    """Least time in the state before the condition is looked at."""

    def _must_be_one(self) -> None:
        if (self.above is None) == (self.below is None):
            raise refusal("needs one of the two", "above or below", "above")
        if self.state == self.to:
            raise refusal("leads to the state that it leaves", "another state", "to")


class StateMachine(Described):
    """States with commands, and conditions on columns that lead from one to another."""

    start: str
    """State in which it begins."""
    state: dict[str, MachineState] = Field(min_length=1)
    """The states by name."""
    transition: tuple[MachineTransition, ...] = ()
    """Transitions; in each control period the first that holds is taken, and no second one."""

    @property
    def named(self) -> dict[str, str]:
        """Chambers by the key that names them."""
        return {
            f"state.{name}.{chamber}": chamber
            for name, state in self.state.items()
            for chamber in state.chambers
        }

    @property
    def pressed(self) -> dict[str, str]:
        """Those of them with a pressure command for their drive."""
        return {
            f"state.{name}.{chamber}": chamber
            for name, state in self.state.items()
            for chamber, command in state.chambers.items()
            if isinstance(command, float)
        }

    def _must_be_connected(self) -> None:
        named = {"start": self.start}
        for number, transition in enumerate(self.transition):
            named |= {f"transition.{number}.{end}": getattr(transition, end) for end in ("state", "to")}
        for key, name in named.items():
            if name not in self.state:
                raise refused_name("there is no such state", name, self.state, key)
        reached = {self.start}
        for _ in self.state:
            reached |= {transition.to for transition in self.transition if transition.state in reached}
        for name in self.state:
            if name not in reached:
                allowed = f"states that transitions lead to from {self.start!r}"
                raise refusal("is never reached", allowed, f"state.{name}")

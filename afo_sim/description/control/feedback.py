"""Feedback control as it is described: what is followed over time, a PID."""

import itertools
from typing import Annotated, Generic, Literal, TypeVar

from afo_sim.common import Mixed
from afo_sim.description.quantity import Described, Quantity, refusal

_Angle = Annotated[float, Quantity("rad", at_least=-1.6, at_most=1.6)]
_Moment = Annotated[float, Quantity("N*m", at_least=-1e3, at_most=1e3)]
_Pressure = Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)]
_Frequency = Annotated[float, Quantity("Hz", above=0.0, at_most=100.0)]
_Time = Annotated[float, Quantity("s", at_least=0.0, at_most=1e5)]
_PositiveTime = Annotated[float, Quantity("s", above=0.0, at_most=1e5)]


Value = TypeVar("Value", bound=float)
Size = TypeVar("Size", bound=float)
_ZERO: Mixed = 0.0  # in whatever unit


class Signal(Described, Generic[Value, Size]):
    """A signal over time: a mean and a sine about it; or a table; or a column of the run."""

    frequency: _Frequency = 0.5
    """Frequency of the sine; of a chirp the first one."""
    end_frequency: _Frequency | None = None
    """Last frequency of a chirp; a sine of one frequency by default."""
    sweep_time: _PositiveTime | None = None
    """Time over which a chirp goes from frequency to end_frequency."""
    between: Literal["hold", "line"] = "hold"
    """Between the rows of a table: the last value is held, or a straight line."""
    column: str | None = None
    """Column that is followed, such as "gait/ankle_angle" (as recorded), or "sensor/<name>"."""
    mean: Value = _ZERO
    """Mean of the signal."""
    amplitude: Size = _ZERO
    """Amplitude of the sine, half of its peak to peak."""
    table: tuple[tuple[_Time, Value], ...] = ()
    """Rows [time, value], instead of a sine; before the first its value holds, after the last that one."""

    @property
    def cycle(self) -> float | None:
        """Period of a sine of one frequency [s]; None of what does not repeat."""
        repeats = self.amplitude > 0.0 and self.end_frequency is None
        return 1.0 / self.frequency if repeats else None

    def _must_be_one_signal(self) -> None:
        sine = self.mean or self.amplitude
        if self.column is not None and (sine or self.table):
            raise refusal("conflicts with a sine or a table", "a column, a sine or a table", "column")
        if self.table and sine:
            raise refusal("conflicts with a sine", "a table, or mean and amplitude", "table")
        if (self.end_frequency is None) != (self.sweep_time is None):
            missing = "sweep_time" if self.sweep_time is None else "end_frequency"
            raise refusal("is missing: a chirp has both", "end_frequency and sweep_time", missing)
        if any(after[0] <= before[0] for before, after in itertools.pairwise(self.table)):
            raise refusal("has times that do not rise", "[[time, value], …], each time later", "table")


class Reference(Signal[_Angle, Annotated[float, Quantity("rad", at_least=0.0, at_most=1.6)]]):
    """An angle over time, dorsiflexion positive."""


class MomentReference(Signal[_Moment, Annotated[float, Quantity("N*m", at_least=0.0, at_most=1e3)]]):
    """A moment over time, dorsiflexion positive."""


class PressureReference(Signal[_Pressure, _Pressure]):
    """A gauge pressure over time."""


QUANTITIES = {"angle": "rad", "moment": "N*m", "pressure": "Pa"}  # table → unit of the column that it is of
_GainTime = Annotated[float, Quantity("s", above=0.0, at_most=1e3)]
_Share = Annotated[float, Quantity("", at_least=0.0, at_most=1.0)]


class AngleLoop(Described):
    """The angle that is controlled."""

    column: str = "ankle/angle"
    """What is measured: a column of angles, or "sensor/<name>"."""
    proportional_band: Annotated[float, Quantity("rad", above=0.0, at_most=100.0)]
    """Error at which the proportional part alone asks for the whole output."""
    dead_band: Annotated[float, Quantity("rad", at_least=0.0, at_most=1.6)] = 0.0
    """Error that counts as none, to either side; beyond it what exceeds it counts."""
    reference: Reference = Reference()
    """What is followed."""


class MomentLoop(Described):
    """The moment that is controlled."""

    column: str = "ankle/moment/orthosis"
    """What is measured: a column of moments, or "sensor/<name>"."""
    proportional_band: Annotated[float, Quantity("N*m", above=0.0, at_most=1e5)]
    """Error at which the proportional part alone asks for the whole output."""
    dead_band: Annotated[float, Quantity("N*m", at_least=0.0, at_most=1e3)] = 0.0
    """Error that counts as none, to either side; beyond it what exceeds it counts."""
    reference: MomentReference = MomentReference()
    """What is followed."""


class PressureLoop(Described):
    """The pressure that is controlled."""

    column: str
    """What is measured: a column of gauge pressures such as "chamber/dorsiflexor/pressure", or
    "sensor/<name>"."""
    proportional_band: Annotated[float, Quantity("Pa", above=0.0, at_most=1e8)]
    """Error at which the proportional part alone asks for the whole output."""
    dead_band: Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)] = 0.0
    """Error that counts as none, to either side; beyond it what exceeds it counts."""
    reference: PressureReference = PressureReference()
    """What is followed."""


class PairPressures(Described):
    """Pressures of a pair: mean + output · half_range, mean − output · half_range; none is below ambient."""

    mean: Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)]
    """Gauge pressure of both chambers at output 0."""
    half_range: Annotated[float, Quantity("Pa", above=0.0, at_most=2e6)]
    """Pressure by which the chambers depart from the mean at output 1."""


class Pid(Described):
    """PID on an angle, a moment or a pressure, given to a chamber or to a pair of them."""

    angle: AngleLoop | None = None
    """An angle is controlled; or a moment, or a pressure."""
    moment: MomentLoop | None = None
    """A moment is controlled; or an angle, or a pressure."""
    pressure: PressureLoop | None = None
    """A pressure is controlled; or an angle, or a moment."""
    raises: str = "dorsiflexor"
    """Chamber that is filled for a positive output and vented for a negative one."""
    lowers: str | None = None
    """Chamber that is vented for a positive output and filled for a negative one; none by default."""
    integral_time: _GainTime | None = None
    """Time in which the integral of a constant error grows by as much as the proportional part; no integral
    by default."""
    derivative_time: Annotated[float, Quantity("s", at_least=0.0, at_most=1e3)] = 0.0
    """Time by which the derivative looks ahead."""
    derivative_filter: Annotated[float, Quantity("s", at_least=0.0, at_most=1e3)] | None = None
    """Time constant of the derivative's first-order low-pass; a tenth of derivative_time by default."""
    output_limit: Annotated[float, Quantity("", above=0.0, at_most=1.0)] = 1.0
    """Greatest output, to either side; there the integral waits."""
    least_output: _Share = 0.0
    """Output below which the valves stay shut; of no effect on pressures."""
    pressures: PairPressures | None = None
    """Pressures that the chambers' drives are asked for; without it the valves are switched directly."""

    @property
    def quantity(self) -> str:
        """What is controlled: "angle", "moment" or "pressure"."""
        return next(name for name in QUANTITIES if getattr(self, name) is not None)

    @property
    def loop(self) -> AngleLoop | MomentLoop | PressureLoop:
        """The table of what is controlled."""
        return getattr(self, self.quantity)

    @property
    def named(self) -> dict[str, str]:
        """Chambers by the key that names them."""
        return {key: getattr(self, key) for key in ("raises", "lowers") if getattr(self, key) is not None}

    @property
    def pressed(self) -> dict[str, str]:
        """Chambers with a pressure command, by the key that names them."""
        return self.named if self.pressures is not None else {}

    @property
    def cycle(self) -> float | None:
        """Period of what is followed [s]; None where it does not repeat."""
        return self.loop.reference.cycle

    def _must_fit_together(self) -> None:
        there = [name for name in QUANTITIES if getattr(self, name) is not None]
        if len(there) != 1:
            said = "is missing: nothing is controlled" if not there else f"conflicts with {there[0]}"
            raise refusal(said, "one of the tables angle, moment, pressure", there[-1] if there else "angle")
        if self.raises == self.lowers:
            raise refusal("is the chamber that raises too", "another chamber, or none", "lowers")
        if self.pressures is not None and self.least_output > 0.0:
            raise refusal("goes with valves, and pressures are asked for", "0", "least_output")

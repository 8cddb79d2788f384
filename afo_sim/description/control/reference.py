"""What a controller is asked to follow, over time: an angle, a moment or a pressure."""

import itertools
from typing import Annotated, Literal, Self

from pydantic import model_validator

from afo_sim.description.quantity import Described, Quantity, refusal

ANGLE = Quantity("rad", at_least=-1.6, at_most=1.6)
MOMENT = Quantity("N*m", at_least=-1e3, at_most=1e3)
PRESSURE = Quantity("Pa", at_least=0.0, at_most=2e6)
Angle = Annotated[float, ANGLE]
Moment = Annotated[float, MOMENT]
Pressure = Annotated[float, PRESSURE]
Frequency = Annotated[float, Quantity("Hz", above=0.0, at_most=100.0)]
Time = Annotated[float, Quantity("s", at_least=0.0, at_most=1e5)]
PositiveTime = Annotated[float, Quantity("s", above=0.0, at_most=1e5)]


class Signal(Described):
    """A signal over time: a mean and a sine about it; or a table; or a column of the run.

    r(t) = mean + amplitude · sin(2π f t); with `end_frequency` the frequency rises from `frequency` to it,
    as a geometric chirp over `sweep_time`, and stays there.
    """

    frequency: Frequency = 0.5
    """Frequency of the sine; of a chirp the first one."""
    end_frequency: Frequency | None = None
    """Last frequency of a chirp; a sine of one frequency by default."""
    sweep_time: PositiveTime | None = None
    """Time over which a chirp goes from frequency to end_frequency."""
    between: Literal["hold", "line"] = "hold"
    """Between the rows of a table: the last value is held, or a straight line."""
    column: str | None = None
    """Column that is followed, such as "gait/ankle_angle" (as recorded), or "sensor/<name>"."""

    @property
    def cycle(self) -> float | None:
        """Period of a sine of one frequency [s]; None of what does not repeat."""
        repeats = getattr(self, "amplitude", 0.0) > 0.0 and self.end_frequency is None
        return 1.0 / self.frequency if repeats else None

    @model_validator(mode="after")
    def _is_one_signal(self) -> Self:
        table = getattr(self, "table", ())
        sine = [key for key in ("mean", "amplitude") if getattr(self, key, 0.0)]
        if self.column is not None and (sine or table):
            raise refusal("stands beside a sine or a table", "a column, a sine or a table", "column")
        if table and sine:
            raise refusal("stands beside a sine", "a table, or mean and amplitude", "table")
        if (self.end_frequency is None) != (self.sweep_time is None):
            missing = "sweep_time" if self.sweep_time is None else "end_frequency"
            raise refusal("is missing: a chirp has both", "end_frequency and sweep_time", missing)
        if any(after[0] <= before[0] for before, after in itertools.pairwise(table)):
            raise refusal("has times that do not rise", "[[time, value], …], each time later", "table")
        return self


class Reference(Signal):
    """An angle over time, dorsiflexion positive."""

    mean: Angle = 0.0
    """Mean angle."""
    amplitude: Annotated[float, Quantity("rad", at_least=0.0, at_most=1.6)] = 0.0
    """Amplitude of the sine, half of its peak to peak."""
    table: tuple[tuple[Time, Angle], ...] = ()
    """Rows [time, angle], instead of a sine; before the first its angle holds, after the last that one."""


class MomentReference(Signal):
    """A moment over time, dorsiflexion positive."""

    mean: Moment = 0.0
    """Mean moment."""
    amplitude: Annotated[float, Quantity("N*m", at_least=0.0, at_most=1e3)] = 0.0
    """Amplitude of the sine, half of its peak to peak."""
    table: tuple[tuple[Time, Moment], ...] = ()
    """Rows [time, moment], instead of a sine; before the first its moment holds, after the last that one."""


class PressureReference(Signal):
    """A gauge pressure over time."""

    mean: Pressure = 0.0
    """Mean gauge pressure."""
    amplitude: Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)] = 0.0
    """Amplitude of the sine, half of its peak to peak."""
    table: tuple[tuple[Time, Pressure], ...] = ()
    """Rows [time, pressure], instead of a sine; before the first its pressure holds, after the last that
    one."""

"""PID control of an angle, a moment or a pressure."""

import math
from dataclasses import dataclass

from afo_sim.control.command import Command
from afo_sim.control.controller import Observation, Told
from afo_sim.control.required_inputs import RequiredInput
from afo_sim.control.tracking import OpenPeriods, apart, target
from afo_sim.description import QUANTITIES, Pid, Scenario

FILTER = 0.1  # of the derivative's time, where no filter is described
TELLS = {"angle": "reference", "moment": "reference_moment", "pressure": "reference_pressure"}


@dataclass(eq=False)
class Law:
    """The PID law itself, on numbers of whatever unit: error and measurement → output."""

    band: float
    integral_time: float | None
    derivative_time: float
    derivative_filter: float
    limit: float

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all."""
        self.integral = self.derivative = 0.0
        self.before: float | None = None

    def __call__(self, error: float, measured: float, period: float) -> float:
        """Output [-] of the next period."""
        change = 0.0 if self.before is None else measured - self.before
        self.before = measured
        filtered = self.derivative_filter * self.derivative + self.derivative_time * change
        self.derivative = filtered / (self.derivative_filter + period)
        added = 0.0 if self.integral_time is None else error * period / self.integral_time
        wanted = (error + self.integral + added - self.derivative) / self.band
        if abs(wanted) <= self.limit or wanted * error < 0.0:
            self.integral += added
        return min(max(wanted, -self.limit), self.limit)


class PidController:
    """PID on a column, its output given to valves directly or to drives as pressures."""

    def __init__(self, described: Pid, scenario: Scenario):
        self.described, self.loop = described, described.loop
        table, unit = f"controller.pid.{described.quantity}", QUANTITIES[described.quantity]
        self.asks = [RequiredInput(self.loop.column, table, "column", unit=unit)]
        if self.loop.reference.column is not None:
            asked = self.loop.reference.column
            self.asks.append(RequiredInput(asked, f"{table}.reference", "column", unit=unit))
        lag = described.derivative_filter
        self.law = Law(
            self.loop.proportional_band,
            described.integral_time,
            described.derivative_time,
            FILTER * described.derivative_time if lag is None else lag,
            described.output_limit,
        )
        self.valves = OpenPeriods(described.raises, described.lowers, described.least_output)
        self.reset()

    def reset(self) -> None:
        """Forget the last run."""
        self.law.reset()
        self.valves.reset()
        self.reported: dict[str, float] = {}

    def __call__(self, seen: Observation) -> dict[str, Command]:
        """Commands of the next period."""
        reference, measured = target(self.loop.reference, seen), seen[self.loop.column]
        error = reference - measured
        beyond = math.copysign(max(abs(error) - self.loop.dead_band, 0.0), error)
        output = self.law(beyond, measured, seen.period)
        self.reported = {TELLS[self.described.quantity]: reference, "output": output}
        if self.described.quantity == "angle":
            self.reported["error"] = error
        pressures = self.described.pressures
        if pressures is None:
            return self.valves(output)
        pair = self.described.raises, self.described.lowers
        return apart(*pair, pressures.mean, output * pressures.half_range)

    def tell(self) -> Told:
        """Setpoint, error of an angle, and output."""
        return self.reported


CONTROLLER = PidController

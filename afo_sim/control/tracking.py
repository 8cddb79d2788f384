"""The reference of a control loop, and its output → commands of one chamber or a pair."""

import bisect
import math

from afo_sim.control.command import Command
from afo_sim.control.controller import Observation
from afo_sim.description import MomentReference, PressureReference, Reference

AnyReference = Reference | MomentReference | PressureReference


def value_at(reference: AnyReference, time: float) -> float:
    """What a reference without a column asks for at a time, in its own SI unit."""
    if reference.table:
        rows = reference.table
        after = bisect.bisect_right([row[0] for row in rows], time)
        if after in (0, len(rows)):
            return rows[max(after - 1, 0)][1]
        (start, value), (end, following) = rows[after - 1], rows[after]
        if reference.between == "hold":
            return value
        return value + (following - value) * (time - start) / (end - start)
    return reference.mean + reference.amplitude * math.sin(2.0 * math.pi * cycles(reference, time))


def cycles(reference: AnyReference, time: float) -> float:
    """Cycles that the sine has made since the start."""
    first, last, duration = reference.frequency, reference.end_frequency, reference.sweep_time
    if last is None or duration is None or last == first:
        return first * time
    growth = math.log(last / first)
    swept = first * duration / growth * math.expm1(growth * min(time, duration) / duration)
    return swept + last * max(time - duration, 0.0)


def target(reference: AnyReference, seen: Observation) -> float:
    """The current reference; for a column its last sample, which is a step old."""
    return value_at(reference, seen.time) if reference.column is None else seen[reference.column]


WHOLE = 1.0 - 1e-9  # of a period in which valves are due to be open


class OpenPeriods:
    """Valves that are open for a share of the control periods: each period they are open or shut."""

    def __init__(self, raises: str, lowers: str | None, least: float):
        self.raises, self.lowers, self.least = raises, lowers, least
        self.reset()

    def reset(self) -> None:
        """Owe nothing."""
        self.due = 0.0  # periods of open valves; negative: towards lowering

    def __call__(self, output: float) -> dict[str, Command]:
        """Commands of the next period for an output from −1 to 1."""
        if abs(output) <= self.least:
            self.due = 0.0
            return self._both("shut", "shut")
        if self.due * output < 0.0:  # what is owed to the other side is not worth a pulse any more
            self.due = 0.0
        self.due += output
        if self.due >= WHOLE:
            self.due -= 1.0
            return self._both("inlet", "outlet")
        if self.due <= -WHOLE:
            self.due += 1.0
            return self._both("outlet", "inlet")
        return self._both("shut", "shut")

    def _both(self, raises: str, lowers: str) -> dict[str, Command]:
        return {self.raises: raises} if self.lowers is None else {self.raises: raises, self.lowers: lowers}


def apart(raises: str, lowers: str | None, mean: float, difference: float) -> dict[str, Command]:
    """Gauge pressures mean + difference and mean − difference [Pa], none below ambient."""
    commands: dict[str, Command] = {raises: max(mean + difference, 0.0)}
    return commands if lowers is None else commands | {lowers: max(mean - difference, 0.0)}

"""A fixed clock, looked at once in each control period, as a microcontroller's loop does it.

The scenario's own `[timer]` is exact: it switches within a step, costs nothing, and lets settled strides be
solved for. This one switches only when the loop comes round, and a foot switch can start it anew.
"""

from collections.abc import Mapping

from afo_sim.control.command import Command
from afo_sim.control.controller import Observation
from afo_sim.control.required_inputs import RequiredInput
from afo_sim.description import ClockTimer, Scenario, in_si

SLIGHTLY = 1e-9  # by which a tick may come early on an event [s]: rounding of times


class TimerController:
    """A controller: coils by the time on its clock."""

    def __init__(self, description: ClockTimer, scenario: Scenario):
        self.description = description
        restart = description.restart
        self.threshold = 0.0 if restart is None else in_si(restart.above)
        self.asks: list[RequiredInput] = []
        if restart is not None:
            self.asks = [RequiredInput(restart.column, "controller.timer.restart", "above", restart.above)]
        self.reset()

    def reset(self) -> None:
        """Set the clock to 0, the foot switch unseen."""
        self.started = self.place = 0.0  # when the clock was started; time on it [s]
        self.struck = -1e9  # when it was restarted last [s]
        self.closed = True  # a switch that is closed at first was not seen to close

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        """The coils at the time on its clock."""
        restart = self.description.restart
        if restart is not None:  # the clock starts anew where the foot switch closes
            closed = seen[restart.column] >= self.threshold
            if closed and not self.closed and seen.time - self.struck >= restart.after - SLIGHTLY:
                self.started = self.struck = seen.time
            self.closed = closed
        period, running = self.description.period, seen.time - self.started + SLIGHTLY
        self.place = running % period if restart is None else min(running, period)
        return {
            chamber: (self._coil(times.inlet), self._coil(times.outlet))
            for chamber, times in self.description.chambers.items()
        }

    def _coil(self, intervals: tuple[tuple[float, float], ...]) -> float:
        return float(any(start <= self.place < end for start, end in intervals))

    def tell(self) -> dict[str, float]:
        """Time on its clock, as a share of the period."""
        return {"phase": self.place / self.description.period}


CONTROLLER = TimerController

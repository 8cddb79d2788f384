"""Outputs from −1 to 1 → commands of a chamber, or of two that work against each other."""

from afo_sim.control.command import Command

WHOLE = 1.0 - 1e-9  # of a period in which valves are due to be open


class OpenPeriods:
    """Valves that are open for a share of the control periods: each period they are open or shut.

    What a period gives too much or too little is carried to the next: of N periods at a constant output u,
    N |u| are open, to less than one.
    """

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
    asked: dict[str, Command] = {raises: max(mean + difference, 0.0)}
    return asked if lowers is None else asked | {lowers: max(mean - difference, 0.0)}

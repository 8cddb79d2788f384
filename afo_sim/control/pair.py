"""Outputs from −1 to 1 → commands of a chamber, or of two that work against each other."""

from afo_sim.common.errors import InputError, unknown
from afo_sim.control.command import Command
from afo_sim.description.scenario import Scenario

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


def check_chambers(kind: str, raises: str, lowers: str | None, scenario: Scenario, *, driven: bool) -> None:
    """Refuse chambers that the orthosis has not, and those without a drive where pressures are asked for.

    Raises
    ------
    InputError
        With the controller's field, what is allowed, and the nearest chamber or the missing table.
    """
    for key, chamber in (("raises", raises), ("lowers", lowers)):
        if chamber is None:
            continue
        field = f"controller.{kind}.{key}"
        if chamber not in scenario.orthosis.chamber:
            problem = "the orthosis has no such chamber"
            if not scenario.orthosis.chamber:
                raise InputError(problem, field=field, value=chamber, allowed="an orthosis with chambers")
            raise unknown(chamber, scenario.orthosis.chamber, field=field, problem=problem)
        if driven and chamber not in scenario.drive:
            problem = "is asked for a pressure, and the chamber has no drive"
            raise InputError(problem, field=field, value=chamber, allowed=f"a table [drive.{chamber}]")

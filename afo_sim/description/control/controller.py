"""The controller of a scenario: its rate, and one of several kinds."""

from collections.abc import Collection
from typing import Annotated, Self

from pydantic import model_validator

from afo_sim.common.errors import nearest_name
from afo_sim.description.control.emg import Emg
from afo_sim.description.control.gait_phase import GaitPhase
from afo_sim.description.control.impedance import Impedance
from afo_sim.description.control.pid import Pid
from afo_sim.description.control.state_machine import StateMachine
from afo_sim.description.control.timer import ClockTimer
from afo_sim.description.control.toe_load import ToeLoad
from afo_sim.description.quantity import Described, Quantity, refusal

KINDS = ("timer", "gait_phase", "state_machine", "pid", "impedance", "toe_load", "emg")


class ControllerDescription(Described):
    """Electronics that close the loop: one kind of controller, called at a control rate."""

    rate: Annotated[float, Quantity("Hz", at_least=1.0, at_most=1e5)] = 100.0
    """Commands a second; the period is a whole number of time steps."""
    timer: ClockTimer | None = None
    """Valves by the controller's own clock."""
    gait_phase: GaitPhase | None = None
    """Valves by estimated gait phase."""
    state_machine: StateMachine | None = None
    """Valves by a state machine."""
    pid: Pid | None = None
    """PID on an angle, a torque or a pressure."""
    impedance: Impedance | None = None
    """A spring and a damper about a reference angle."""
    toe_load: ToeLoad | None = None
    """Pressure by the load under the toes."""
    emg: Emg | None = None
    """Pressure by muscle activation."""

    @property
    def kind(self) -> str:
        """The kind that is described."""
        return next(kind for kind in KINDS if getattr(self, kind) is not None)

    @property
    def cycle(self) -> float | None:
        """Time after which it repeats what it does, of itself [s]; None where it does not."""
        found: float | None = getattr(getattr(self, self.kind), "cycle", None)
        return found

    def check_chambers(self, chambers: Collection[str], drives: Collection[str]) -> None:
        """Refuse chambers that the orthosis does not have, and pressures that no drive makes.

        A kind may have `named`, the chambers that it commands by the key that names them, and `pressed`,
        those of them that it asks for a pressure.
        """
        described = getattr(self, self.kind)
        for key, chamber in getattr(described, "named", {}).items():
            if chamber not in chambers:
                nearest = nearest_name(chamber, chambers) or ""
                problem = f"the orthosis has no chamber {chamber!r}"
                raise refusal(
                    problem,
                    ", ".join(chambers) or "an orthosis with chambers",
                    f"controller.{self.kind}.{key}",
                    nearest,
                )
        for key, chamber in getattr(described, "pressed", {}).items():
            if chamber not in drives:
                problem = f"asks for a pressure, and the chamber {chamber!r} has no drive"
                raise refusal(problem, f"a table [drive.{chamber}]", f"controller.{self.kind}.{key}")

    @model_validator(mode="after")
    def _is_one_kind(self) -> Self:
        there = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(there) != 1:
            said = "has no kind" if not there else f"has several kinds: {', '.join(there)}"
            tables = ", ".join(f"[controller.{kind}]" for kind in KINDS)
            raise refusal(said, f"one of the tables {tables}", there[-1] if there else "")
        return self

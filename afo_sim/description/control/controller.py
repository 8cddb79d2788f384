"""The controller of a scenario: its rate, and one of several kinds.

A new kind is a class and a field of `ControllerDescription`. Its class may have `named`, the chambers that it
commands by the key that names them, `pressed`, those of them that it asks for a pressure, and `cycle`, the
time after which it repeats [s].
"""

from collections.abc import Collection
from typing import Annotated, Literal

from pydantic import Field

from afo_sim.common import Mixed, nearest_name
from afo_sim.description.control.feedback import Pid
from afo_sim.description.control.switching import ClockTimer, GaitPhase, StateMachine, Threshold, in_si
from afo_sim.description.muscle import Pressure
from afo_sim.description.quantity import Described, Quantity, refusal
from afo_sim.description.walking import Share


class ToeLoad(Described):
    """Push-off in proportion to the load under the toes, and a lifted foot while they bear little.

    Source: Proportional joint-moment control: Gasparri, Luque, Lerner 2019, IEEE Trans. Neural Syst.
    Rehabil. Eng. 27(4), 751-759. They assist plantarflexion; thresholds, pressures and lifting here are
    assumed.
    """

    column: str = "foot/toe_load"
    """What is measured: a column, or "sensor/<name>"."""
    lifts: str | None = "dorsiflexor"
    """Chamber that is filled while the toes bear little, and vented while they bear much."""
    lift_pressure: Pressure | None = None
    """Pressure that its drive is asked for then; its inlet stays open by default."""
    unloaded: Share = 0.55
    """Share of the peak below which the lifting chamber is filled."""
    loaded: Share = 0.7
    """Share of the peak from which on it is vented, until the load falls below `unloaded`."""
    pushes: str | None = None
    """Chamber that pushes off; none by default."""
    peak: Annotated[float, Quantity("N", at_least=1.0, at_most=1e4)] = 700.0
    """Calibrated peak of the load, such as of the first minute of walking."""
    push_pressure: Pressure | None = None
    """Pressure that the drive of `pushes` is asked for at the peak; by default its valves are switched."""
    fill_above: Share = 0.5
    """Share of the peak from which on its inlet is open, where its valves are switched."""
    vent_below: Share = 0.3
    """Share of the peak below which its outlet is open."""

    @property
    def named(self) -> dict[str, str]:
        """Chambers by the key that names them."""
        return {key: getattr(self, key) for key in ("lifts", "pushes") if getattr(self, key) is not None}

    @property
    def pressed(self) -> dict[str, str]:
        """Those of them with a pressure command for their drive."""
        pressures = {"lifts": self.lift_pressure, "pushes": self.push_pressure}
        return {key: chamber for key, chamber in self.named.items() if pressures[key] is not None}

    def _must_fit_together(self) -> None:
        if not self.named:
            raise refusal("commands no chamber", "lifts, pushes, or both", "lifts")
        if self.lifts == self.pushes:
            raise refusal("lifts and pushes with the same chamber", "two chambers", "pushes")
        for low, high in (("unloaded", "loaded"), ("vent_below", "fill_above")):
            if getattr(self, low) > getattr(self, high):
                raise refusal(f"is above {high}", f"at most {getattr(self, high):g}", low)
        for chamber, pressure in (("lifts", "lift_pressure"), ("pushes", "push_pressure")):
            if getattr(self, chamber) is None and getattr(self, pressure) is not None:
                raise refusal(f"has no effect without {chamber}", f"a chamber for {chamber}", pressure)


_LagTime = Annotated[float, Quantity("s", at_least=0.0, at_most=10.0)]


class Emg(Described):
    """Pressure in proportion to an activation, delayed and low-passed as an electromyogram's envelope is.

    Source: activation_time, deactivation_time: Thelen 2003, J. Biomech. Eng. 125, 70-77. The rest is
    assumed.
    """

    column: str = "ankle/moment/biological"
    """What stands for the activation: a column, or "sensor/<name>"."""
    side: Literal["dorsiflexor", "plantarflexor"] = "dorsiflexor"
    """Muscles that it is of: those of positive values of the column, or of negative ones."""
    full: Threshold = "10 N*m"
    """Value of the column at full activation."""
    delay: _LagTime = 0.0
    """Time from the column to the activation, to whole control periods."""
    activation_time: _LagTime = 0.015
    """Time constant with which the activation rises."""
    deactivation_time: _LagTime = 0.05
    """Time constant with which it falls."""
    chamber: str = "dorsiflexor"
    """Chamber that is commanded."""
    pressure: Pressure | None = None
    """Pressure that its drive is asked for at full activation; by default its valves are switched."""
    fill_above: Share = 0.3
    """Activation from which on its inlet is open, where its valves are switched."""
    vent_below: Share = 0.15
    """Activation below which its outlet is open."""

    @property
    def named(self) -> dict[str, str]:
        """The chamber by the key that names it."""
        return {"chamber": self.chamber}

    @property
    def pressed(self) -> dict[str, str]:
        """The same where its drive is asked for a pressure."""
        return self.named if self.pressure is not None else {}

    def _must_fit_together(self) -> None:
        if in_si(self.full) <= 0.0:
            raise refusal("is not positive", "a value above 0; side gives the sign", "full")
        if self.vent_below > self.fill_above:
            raise refusal("is above fill_above", f"at most {self.fill_above:g}", "vent_below")


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
    toe_load: ToeLoad | None = None
    """Pressure by the load under the toes."""
    emg: Emg | None = None
    """Pressure by muscle activation."""
    function: str | None = None
    """Name of a controller of your own, which is registered."""
    parameters: dict[str, Annotated[float, Quantity("")]] = Field(default_factory=dict)
    """Numbers that it is called with, by name."""

    @classmethod
    def kinds(cls) -> list[str]:
        """Every kind of controller: each is a field."""
        return [name for name in cls.model_fields if name not in ("rate", "provenance", "parameters")]

    @property
    def kind(self) -> str:
        """The kind that is described."""
        return self._there[0]

    @property
    def described(self) -> Mixed:
        """The description of its kind."""
        return getattr(self, self.kind)

    @property
    def cycle(self) -> float | None:
        """Time after which it repeats what it does, of itself [s]; None where it does not."""
        return getattr(self.described, "cycle", None)

    @property
    def _there(self) -> list[str]:
        return [kind for kind in self.kinds() if getattr(self, kind) is not None]

    def check_chambers(self, chambers: Collection[str], drives: Collection[str]) -> None:
        """Refuse chambers that the orthosis does not have, and pressures that no drive makes."""
        described = self.described
        for key, chamber in getattr(described, "named", {}).items():
            if chamber not in chambers:
                problem = f"the orthosis has no chamber {chamber!r}"
                known = ", ".join(chambers) or "an orthosis with chambers"
                nearest = nearest_name(chamber, chambers) or ""
                raise refusal(problem, known, f"controller.{self.kind}.{key}", nearest)
        for key, chamber in getattr(described, "pressed", {}).items():
            if chamber not in drives:
                problem = f"asks for a pressure, and the chamber {chamber!r} has no drive"
                raise refusal(problem, f"a table [drive.{chamber}]", f"controller.{self.kind}.{key}")

    def _must_be_one_kind(self) -> None:
        there = self._there
        if len(there) != 1:
            said = "has no kind" if not there else f"has several kinds: {', '.join(there)}"
            tables = ", ".join(f"[controller.{kind}]" for kind in self.kinds() if kind != "function")
            raise refusal(said, f'function = "…", or one of the tables {tables}', there[-1] if there else "")
        if self.parameters and self.function is None:
            raise refusal(f"are not those of {there[0]}", "with function alone", "parameters")

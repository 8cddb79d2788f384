"""A valve as it is described: flow paths, switching times or bandwidth, and what its maker rates it for."""

from typing import Annotated, Any, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from afo_sim.description.air.rated import Rated
from afo_sim.description.quantity import Described, Quantity, refusal

Delay = Annotated[float, Quantity("s", at_least=0.0, at_most=1.0)]
WorkingPressure = Annotated[float, Quantity("Pa", at_least=-101_325.0, at_most=5e6)]


class Named(Described):
    """A description with a name and a line about it."""

    name: str = ""
    """Name; the folder's by default."""
    description: str = ""
    """One line that says what it is."""


class Exhaust(Rated):
    """The second flow path of a 3/2 valve, from its outlet A to its exhaust R, open without current."""


class Valve(Rated, Named):
    """A valve: sonic conductance C, critical ratio b (ISO 6358), and its two delays or its bandwidth.

    It is a 2/2 valve; with an `exhaust` a 3/2 valve, whose first path is P to A. With a `bandwidth` it is a
    proportional valve.
    """

    exhaust: Exhaust | None = None
    """Path from A to R of a 3/2 valve; without it the valve has two ports."""
    bandwidth: Annotated[float, Quantity("Hz", above=0.0, at_most=1e4)] | None = None
    """Frequency at which a proportional valve's opening has fallen by 3 dB; none of a solenoid valve."""
    dead_band: Annotated[float, Quantity("", at_least=0.0, at_most=0.9)] | None = None
    """Share of a proportional valve's command below which it stays shut."""
    opening_delay: Delay = Field(default=None, validate_default=True)
    """On-delay, from the coil's current to the open valve; needed of a solenoid valve."""
    closing_delay: Delay = Field(default=None, validate_default=True)
    """Off-delay, from the end of the current to the shut valve; needed of a solenoid valve."""
    minimum_on_time: Delay | None = None
    """Shortest pulse that its maker answers for."""
    rated_switches: Annotated[float, Quantity("", above=0.0, at_most=1e12)] | None = None
    """Switchings that its maker rates it for; without it no life is told."""
    working_pressure: tuple[WorkingPressure, WorkingPressure] | None = None
    """Lowest and highest gauge pressure that its maker allows."""
    mass: Annotated[float, Quantity("kg", above=0.0, at_most=20.0)] | None = None
    """Mass of the valve."""
    power: Annotated[float, Quantity("W", above=0.0, at_most=1e3)] | None = None
    """Electric power while the coil is on."""

    @field_validator("opening_delay", "closing_delay", mode="before")
    @classmethod
    def _is_needed_of_a_solenoid(cls, value: Any, info: ValidationInfo) -> Any:
        if value is not None:
            return value
        if info.data.get("bandwidth", 0.0) is None:
            facts = {"problem": "is missing", "allowed": "0 to 1 s; none of a valve with a bandwidth"}
            raise PydanticCustomError("missing", "{problem}", facts)
        return "0 s"

    @model_validator(mode="after")
    def _is_one_kind_of_valve(self) -> Self:
        if self.bandwidth is None and self.dead_band is not None:
            raise refusal("is a proportional valve's, which has a bandwidth", "a bandwidth", "dead_band")
        for key in ("opening_delay", "closing_delay") if self.bandwidth is not None else ():
            if getattr(self, key) > 0.0:
                problem = "has no effect: a proportional valve follows with its bandwidth"
                raise refusal(problem, "0 s, or no bandwidth", key)
        if self.working_pressure is not None and not self.working_pressure[0] < self.working_pressure[1]:
            raise refusal("the first value is not below the second", "", "working_pressure")
        return self

    @property
    def three_way(self) -> bool:
        """Whether it is a 3/2 valve: it lets air out by itself."""
        return self.exhaust is not None

    @property
    def proportional(self) -> bool:
        """Whether its opening follows a command, instead of a coil's switching."""
        return self.bandwidth is not None

    @property
    def row(self) -> dict[str, float]:
        """The parameters of its compiled counterpart, SI; of a 3/2 valve its path from P to A."""
        row = {
            "conductance": self.conductance,
            "critical_ratio": self.critical_ratio,
            "opening_delay": self.opening_delay,
            "closing_delay": self.closing_delay,
        }
        if self.bandwidth is None:
            return row
        return row | {"bandwidth": self.bandwidth, "dead_band": self.dead_band or 0.0}

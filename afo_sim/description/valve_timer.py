"""A repeating timer that switches valves, as it is described."""

from typing import Annotated, Self

from pydantic import ConfigDict, Field, model_validator

from afo_sim.description.quantity import Described, Quantity, refusal

Time = Annotated[float, Quantity("s", at_least=0.0, at_most=1e5)]
PositiveTime = Annotated[float, Quantity("s", above=0.0, at_most=1e5)]


class ValveTimes(Described):
    """Intervals in which a chamber's two valves are open, [from, to] within the timer's period."""

    inlet: tuple[tuple[Time, Time], ...] = ()
    """Intervals [from, to] in which the inlet valve's coil has current."""
    outlet: tuple[tuple[Time, Time], ...] = ()
    """Intervals [from, to] in which the outlet valve's coil has current."""


class SwitchTimes(ValveTimes):
    """The same, or those of a valve between other nodes."""

    open: tuple[tuple[Time, Time], ...] = ()
    """Intervals [from, to] in which the coil of a valve between other nodes has current."""


class Timer(Described):
    """A repeating timer; every key but `period` is a chamber, or a valve between other nodes."""

    model_config = ConfigDict(frozen=True, extra="allow")
    __pydantic_extra__: dict[str, SwitchTimes] = Field(init=False)

    period: PositiveTime
    """Time after which the valves' intervals repeat."""

    @property
    def chambers(self) -> dict[str, SwitchTimes]:
        """The valves' intervals by chamber."""
        return dict(self.__pydantic_extra__ or {})

    @model_validator(mode="after")
    def _events_fit(self) -> Self:
        for name, times in self.chambers.items():
            for valve in ("inlet", "outlet", "open"):
                for start, end in getattr(times, valve, ()):
                    if not 0.0 <= start < end <= self.period * (1.0 + 1e-12):
                        raise refusal(
                            f"the event [{start:g} s, {end:g} s] is not within the period",
                            f"0 s ≤ from < to ≤ {self.period:g} s",
                            f"{name}.{valve}",
                        )
        return self

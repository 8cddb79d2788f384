"""A pressure drive: turns a pressure command into currents of a chamber's two valves."""

from typing import Annotated, Literal

from afo_sim.description.quantity import Described, Quantity, refusal

_DriveTime = Annotated[float, Quantity("s", at_least=0.0, at_most=10.0)]
_DrivePressure = Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)]

_RELEASE = 0.75  # of the dead band: 15 of 20 mbar in the controller of the robot Lucy (VUB)
WITHOUT = {
    "bang_bang": ("period", "full_at", "integral_time", "derivative_time", "bandwidth"),
    "pwm": ("release", "bandwidth"),
    "regulator": ("release", "period", "least_on", "least_off"),
}  # fields that change nothing, by kind


class Drive(Described):
    """A chamber's pressure drive; it runs natively in every step, on the chamber's own pressure."""

    kind: Literal["bang_bang", "pwm", "regulator"]
    """Switching about a dead band, pulse-width modulation of a PID, or a proportional regulator."""
    dead_band: _DrivePressure = 2e3
    """Pressure error within which both valves stay shut; by default Lucy's 20 mbar."""
    release: _DrivePressure | None = None
    """Pressure error at which bang_bang shuts an open valve again; 3/4 of the dead band by default."""
    period: Annotated[float, Quantity("s", above=0.0, at_most=1.0)] = 0.02
    """Period of the pulse-width modulation."""
    least_on: _DriveTime | None = None
    """Least time for which a coil is switched on; shorter pulses are not given. By default for pwm the
    longest of the valves' opening delays and minimum on-times, below which air may not move; none for the
    others."""
    least_off: _DriveTime = 0.0
    """Least time for which both coils are off between; gaps of a pulse train that are shorter are none."""
    full_at: Annotated[float, Quantity("Pa", above=0.0, at_most=2e6)] = 5e4
    """Pressure error at which the PID asks for full current."""
    integral_time: Annotated[float, Quantity("s", above=0.0, at_most=1e3)] | None = None
    """Integral time of the PID; no integral by default."""
    derivative_time: _DriveTime = 0.0
    """Derivative time of the PID."""
    bandwidth: Annotated[float, Quantity("Hz", above=0.0, at_most=1e4)] = 20.0
    """Bandwidth (-3 dB) of a regulator's proportional valves, instead of their delays."""
    filter_time: _DriveTime = 0.0
    """Time constant of the drive's own pressure transducer."""

    @property
    def releases_at(self) -> float:
        """Pressure error at which bang_bang shuts an open valve again [Pa]."""
        return _RELEASE * self.dead_band if self.release is None else self.release

    def shortest_pulse(self, answered: float) -> float:
        """Least time for which a coil is switched on [s]; the valves answer no pulse below `answered` [s]."""
        if self.least_on is not None:
            return self.least_on
        return min(answered, self.period) if self.kind == "pwm" else 0.0

    @property
    def idle(self) -> tuple[str, ...]:
        """Fields that are set and change nothing in a drive of this kind."""
        fields = type(self).model_fields
        return tuple(name for name in WITHOUT[self.kind] if getattr(self, name) != fields[name].default)

    def _must_have_a_hysteresis(self) -> None:
        if self.release is not None and self.release > self.dead_band:
            most = f"at most the dead band's {1e-5 * self.dead_band:g} bar"
            raise refusal("is above the dead band: an open valve would shut immediately", most, "release")
        if self.kind == "pwm" and (self.least_on or 0.0) > self.period:
            most = f"at most the period's {1e3 * self.period:g} ms"
            raise refusal("is longer than the period: no pulse would ever occur", most, "least_on")

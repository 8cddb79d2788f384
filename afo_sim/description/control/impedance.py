"""Impedance control, as it is described."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from afo_sim.description.control.reference import Angle, Moment, Reference
from afo_sim.description.quantity import Described, Quantity, refusal

Difference = Annotated[float, Quantity("Pa", at_least=-2e6, at_most=2e6)]


class Impedance(Described):
    """A spring and a damper about a reference angle, given as pressures to a pair of chambers.

    moment = stiffness · (reference − angle) − damping · velocity + feed_forward, dorsiflexion positive. The
    chambers get mean_pressure + d and mean_pressure − d, with d from torque_map at the present angle.
    """

    angle: str = "ankle/angle"
    """What tells the angle: a column, or "sensor/<name>"."""
    velocity: str = "ankle/velocity"
    """What tells the velocity: a column, or "sensor/<name>"."""
    raises: str = "dorsiflexor"
    """Chamber that is filled for a positive moment."""
    lowers: str | None = None
    """Chamber that is filled for a negative moment; none by default."""
    stiffness: Annotated[float, Quantity("N*m/rad", at_least=0.0, at_most=1e4)]
    """Moment by the angle's distance from the reference."""
    damping: Annotated[float, Quantity("N*m*s/rad", at_least=0.0, at_most=1e4)] = 0.0
    """Moment against the velocity."""
    feed_forward: Moment = 0.0
    """Moment that is added, for example what holds the foot's weight."""
    reference: Reference = Reference()
    """Angle about which spring and damper act."""
    mean_pressure: Annotated[float, Quantity("Pa", at_least=0.0, at_most=2e6)]
    """Gauge pressure about which the two chambers are moved apart."""
    half_range: Annotated[float, Quantity("Pa", above=0.0, at_most=2e6)]
    """Greatest departure from the mean, to either side."""
    torque_map: tuple[tuple[Angle, Difference, Moment], ...] = Field(min_length=2)
    """Rows [angle, d, moment]: the orthosis' moment with mean_pressure + d and mean_pressure − d, at the same
    several d at every angle. afo_sim.pressure_map computes them."""

    @property
    def named(self) -> dict[str, str]:
        """Chambers by the key that names them."""
        pair = {"raises": self.raises, "lowers": self.lowers}
        return {key: chamber for key, chamber in pair.items() if chamber is not None}

    @property
    def pressed(self) -> dict[str, str]:
        """Chambers that are asked for a pressure: all."""
        return self.named

    @property
    def cycle(self) -> float | None:
        """Period of what is followed [s]; None where it does not repeat."""
        return self.reference.cycle

    @model_validator(mode="after")
    def _has_two_chambers(self) -> Self:
        if self.raises == self.lowers:
            raise refusal("is the chamber that raises too", "another chamber, or none", "lowers")
        rows = self.torque_map
        angles, differences = (sorted({row[k] for row in rows}) for k in (0, 1))
        grid = [(angle, difference) for angle in angles for difference in differences]
        if len(differences) < 2 or sorted(row[:2] for row in rows) != grid:
            allowed = "[[angle, d, moment], …]: two d at least, and the same ones at every angle, each once"
            raise refusal("is no whole grid of angles and pressures", allowed, "torque_map")
        moments = {row[:2]: row[2] for row in rows}
        if any(moments[a, differences[-1]] <= moments[a, differences[0]] for a in angles):
            problem = "has an angle at which the moment does not rise with d"
            raise refusal(problem, "angles at which the chambers can do something", "torque_map")
        return self

"""The subtalar joint as it is described: a hinge under the ankle about which the foot inverts."""

from typing import Annotated, Self

from pydantic import model_validator

from afo_sim.description.quantity import Described, Quantity, refusal

Tilt = Annotated[float, Quantity("rad", at_least=0.0, at_most=1.4)]


class Subtalar(Described):
    """The subtalar hinge: its oblique axis through the foot, its stops, spring and damping.

    The axis runs from behind, outside and below to ahead, inside and above. `inclination` is its angle above
    the sole, `deviation` its angle to the inside of the foot's long axis. Inversion, which turns the sole to
    the inside, is positive. It is free where the shank is fixed. In recorded walking, which tells nothing of
    it, it is welded, and the moment about it is told.

    Source
    ------
    inclination 42° (20 to 68), deviation 23° (4 to 47): Inman 1976, The joints of the ankle, from memory.
    OpenSim's Gait2392 has 37° and 9°. below_ankle and range are assumed.
    """

    inclination: Tilt = 0.733
    """Angle of the axis above the sole."""
    deviation: Tilt = 0.401
    """Angle of the axis to the inside of the foot's long axis, seen from above."""
    below_ankle: Annotated[float, Quantity("m", at_least=0.0, at_most=0.1)] = 0.012
    """Distance of the axis below the ankle joint."""
    range: tuple[
        Annotated[float, Quantity("rad", at_least=-1.0, at_most=0.0)],
        Annotated[float, Quantity("rad", at_least=0.0, at_most=1.0)],
    ] = (-0.175, 0.349)
    """Stops in eversion (negative) and inversion."""
    stiffness: Annotated[float, Quantity("N*m/rad", at_least=0.0, at_most=1e3)]
    """Stiffness about the neutral position."""
    damping: Annotated[float, Quantity("N*m*s/rad", at_least=0.0, at_most=100.0)]
    """Viscous damping."""

    @model_validator(mode="after")
    def _turns(self) -> Self:
        if not self.range[0] < self.range[1]:
            raise refusal("leaves no angle to turn", 'such as ["-10 deg", "20 deg"]', "range")
        return self

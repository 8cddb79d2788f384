"""A shoe, and the outsole that the foot stands on."""

from typing import Annotated

from afo_sim.description.quantity import Described, Quantity

Stack = Annotated[float, Quantity("m", at_least=0.0, at_most=0.15)]
Ahead = Annotated[float, Quantity("m", at_least=-0.05, at_most=0.1)]


class Outsole(Described):
    """What the foot stands on: how thick it is, how far it reaches, how its toe rises, how it bends.

    Lengths are for a leg of the leg's own size, and go with the patient's, as the leg does.
    """

    heel_stack: Stack
    """Thickness under the heel."""
    ball_stack: Stack
    """Thickness under the ball of the foot; less than under the heel by the drop."""
    toe_spring: Stack = 0.0
    """Height of the outsole's tip above the floor on which it stands flat."""
    tip_ahead: Ahead = 0.0
    """Distance of the outsole's tip ahead of the toes' tip."""
    heel_behind: Ahead = 0.0
    """Distance of the outsole's rearmost standing point behind the heel's."""
    toe_stiffness: Annotated[float, Quantity("N*m/rad", at_least=0.0, at_most=1e4)] = 0.0
    """Stiffness that it adds to the toes' hinge, about its own shape."""


class Shoe(Outsole):
    """A shoe: its outsole and its mass."""

    name: str = ""
    """Name; the folder's by default."""
    description: str = ""
    """One line that says what it is."""
    mass: Annotated[float, Quantity("kg", at_least=0.0, at_most=5.0)]
    """Mass of one shoe of a person as heavy as the leg's; a heavier one wears a heavier shoe."""
    centre: tuple[
        Annotated[float, Quantity("m", at_least=-0.3, at_most=0.3)],
        Annotated[float, Quantity("m", at_least=-0.3, at_most=0.3)],
    ]
    """Its centre of mass from the ankle, forward and up, with the foot flat."""
    inertia: Annotated[float, Quantity("kg*m^2", at_least=0.0, at_most=1.0)]
    """Inertia about its own centre of mass, in the sagittal plane."""

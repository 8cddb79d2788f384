"""The limits that a walk's verdict and safety margins are held against, each with its source."""

from typing import Annotated, Self

from pydantic import model_validator

from afo_sim.description.quantity import Described, Quantity, refusal

Clearance = Annotated[float, Quantity("m", at_least=-0.1, at_most=0.2)]
Pitch = Annotated[float, Quantity("rad", at_least=-0.8, at_most=0.8)]
Torque = Annotated[float, Quantity("N*m/kg", at_least=0.0, at_most=10.0)]
Work = Annotated[float, Quantity("J/kg", at_least=0.0, at_most=10.0)]
SkinPressure = Annotated[float, Quantity("Pa", above=0.0, at_most=1e6)]
Life = Annotated[float, Quantity("", above=0.0, at_most=1e12)]
Share = Annotated[float, Quantity("", at_least=0.0, at_most=1.0)]
Count = Annotated[float, Quantity("", at_least=0.0, at_most=1e9)]

PAIRS = (
    "drawn_trips",
    "torque_against_push_off",
    "work_against_push_off",
    "skin_pressure",
)  # good up to, bad beyond
FALLING = ("toe_clearance", "contact_pitch", "strides_per_bottle")  # good from, bad below


class Limits(Described):
    """What a walk and a device are held against; of a pair the first is what is wanted, beyond the second it
    is bad.

    `load("limits", "usual")` are the shipped ones. A scenario without `limits` is held against these.
    """

    name: str = ""
    """Name; the folder's by default."""
    description: str = ""
    """One line that says what it is."""
    toe_clearance: tuple[Clearance, Clearance]
    """Toe clearance of every stride: wanted at least, and the height below which the toe trips."""
    drawn_trips: tuple[Share, Share]
    """Share of strides, drawn over what is not known, that touch the floor: wanted at most, bad beyond the
    second."""
    contact_pitch: tuple[Pitch, Pitch]
    """Pitch of the sole at initial contact, toes up: the heel comes first from the first on, the forefoot
    below the second."""
    torque_against_push_off: tuple[Torque, Torque]
    """Dorsiflexion torque of the orthosis in push-off by body mass: hardly felt up to the first, too much
    beyond the second."""
    work_against_push_off: tuple[Work, Work]
    """Work that it takes from push-off by body mass: hardly felt up to the first, too much beyond the
    second."""
    strides_per_bottle: tuple[Count, Count]
    """Strides of one bottle of air: wanted at least, too few below the second."""
    bottle_volume: Annotated[float, Quantity("m^3", above=0.0, at_most=0.1)]
    """Volume of the bottle."""
    bottle_pressure: Annotated[float, Quantity("Pa", above=0.0, at_most=1e8)]
    """Gauge pressure of the full bottle."""
    skin_pressure: tuple[SkinPressure, SkinPressure]
    """Pressure on the skin under cuff or strap: discomfort from the first on, pain beyond the second."""
    blood_flow_pressure: SkinPressure
    """Pressure that a wide cuff may keep up all the time without hindering the flow of blood."""
    strides_per_day: Annotated[float, Quantity("", above=0.0, at_most=1e6)]
    """Strides of one leg on a day, by which a life in strides is told in days."""
    muscle_life: Life
    """Cycles of filling and venting that a muscle is to last."""

    @model_validator(mode="after")
    def _are_in_order(self) -> Self:
        for key in (*PAIRS, *FALLING):
            first, second = getattr(self, key)
            if (second < first) is (key in PAIRS) and first != second:
                order = "not below the first" if key in PAIRS else "not above the first"
                raise refusal("the second value is on the wrong side of the first", f"one {order}", key)
        return self

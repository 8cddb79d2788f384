"""The toes as they are described: a hinge in the foot, and how far they are extended in swing."""

from typing import Annotated, Self

from pydantic import model_validator

from afo_sim.description.quantity import Described, Quantity, refusal

Extension = Annotated[float, Quantity("rad", at_least=-0.35, at_most=0.79)]


class Toes(Described):
    """The metatarsophalangeal hinge: the toes' body and joint in the leg's file, their spring and rest angle.

    The spring rests at the extension that healthy toes have over the gait cycle (`gait/toe_extension.py`),
    which is shifted in swing to `swing_extension`. `damping` is of the departure from it. All of it is told
    for the leg's own body, and goes with the patient's size.

    Source
    ------
    stiffness: 25 N·m/rad as in walking models (PredSim; Falisse et al. 2022), assumed. swing_extension at the
    least toe clearance, relative to the flat foot: 9 ±5° (mean curve of the Oxford foot model), 13 to 16°
    (one adult's inverse kinematics), 4 to 15° (Winter's walker): derived, never fitted to a clearance.
    """

    body: str = "toes"
    """Name of the toes' body in the leg's file."""
    joint: str = "toe"
    """Name of the toes' hinge in the leg's file, extension positive."""
    stiffness: Annotated[float, Quantity("N*m/rad", at_least=1.0, at_most=1e3)] = 25.0
    """Stiffness about the rest angle."""
    damping: Annotated[float, Quantity("N*m*s/rad", at_least=0.0, at_most=100.0)] = 0.2
    """Damping of the departure from the rest angle."""
    swing_extension: Extension = 0.192
    """Rest angle at the least toe clearance in swing, relative to the flat foot."""
    swing_extension_range: tuple[Extension, Extension] = (0.105, 0.279)
    """Least and greatest rest angle in swing that clearance is told for, beside the one that is walked."""

    @model_validator(mode="after")
    def _is_a_range(self) -> Self:
        low, high = self.swing_extension_range
        if not low <= high:
            raise refusal("the first angle is above the second", "", "swing_extension_range")
        return self

"""A leg and what it wears, as they are described: relaxed ankle, toes, outsole, shoe."""

import pathlib
from typing import Annotated

from pydantic import Field

from afo_sim.description.attachment import Side
from afo_sim.description.joint import JOINTS, JointName, a_joint
from afo_sim.description.quantity import Described, Named, Quantity, refusal

_Extension = Annotated[float, Quantity("rad", at_least=-0.35, at_most=0.79)]


class Toes(Described):
    """The metatarsophalangeal hinge: the toes' body and joint in the leg's file, their spring and rest angle.

    Source: stiffness: 25 N·m/rad as in walking models (PredSim; Falisse et al. 2022), assumed.
    swing_extension at the least toe clearance, relative to the flat foot: 9 ±5° (mean curve of the Oxford
    foot model), 13 to 16° (one adult's inverse kinematics), 4 to 15° (Winter's walker): derived, never
    fitted to a clearance.
    """

    body: str = "toes"
    """Name of the toes' body in the leg's file."""
    joint: str = "toe"
    """Name of the toes' hinge in the leg's file, extension positive."""
    stiffness: Annotated[float, Quantity("N*m/rad", at_least=1.0, at_most=1e3)] = 25.0
    """Stiffness about the rest angle."""
    damping: Annotated[float, Quantity("N*m*s/rad", at_least=0.0, at_most=100.0)] = 0.2
    """Damping of the departure from the rest angle."""
    swing_extension: _Extension = 0.192
    """Rest angle at the least toe clearance in swing, relative to the flat foot."""
    swing_extension_range: tuple[_Extension, _Extension] = (0.105, 0.279)
    """Least and greatest rest angle in swing for which clearance is reported, beside the walked one."""

    def _must_be_a_range(self) -> None:
        low, high = self.swing_extension_range
        if not low <= high:
            raise refusal("the first angle is above the second", "", "swing_extension_range")


_Word = Annotated[str, Field(pattern=r"^[a-z]+$")]
MASS_SHARES = {"foot": 0.0145, "shank": 0.0465, "thigh": 0.100}  # of the body's (Winter 2009, after Dempster)


class PassiveAnkle(Described):
    """The relaxed ankle, as a factor and a shift of Riener & Edrich's healthy mean."""

    scale: Annotated[float, Quantity("", at_least=0.0, at_most=20.0)] = 1.0
    """Factor on the healthy mean's moment; 0 is no tissue."""
    offset: Annotated[float, Quantity("rad", at_least=-0.35, at_most=0.35)] = 0.0
    """Shift of the angle at which the tissue is slack."""


class Leg(Named):
    """A leg: its MJCF or URDF, which bodies and joint are meant, and its passive ankle.

    `friction` (Coulomb's, about the ankle) and `inertia` (about the ankle; what else turns with the foot)
    come on top of what the file has.
    Any two bodies with one hinge will do, such as thigh and shank, or an arm on a stand: they may be named
    as `proximal`, `distal` and `hinge`. Stops and spring of the joint are those of the file.
    """

    file: pathlib.Path
    """MJCF or URDF file of the leg."""
    joint: JointName = "ankle"
    """Joint that it is about: it gives the words, and which way is positive. A "hinge" is any other."""
    shank: str = "shank"
    """Name of the body above the joint, the shank's, in the file."""
    foot: str = "foot"
    """Name of the body below the joint, the foot's, in the file."""
    ankle: str = "ankle"
    """Name of the joint's hinge in the file."""
    side: Side = "right"
    """Leg that the file is; on the other side it is mirrored."""
    shank_length: Annotated[float, Quantity("m", above=0.0, at_most=1.0)] | None = None
    """Length from knee to ankle; 0.246 of the body's height by default (Winter)."""
    foot_length: Annotated[float, Quantity("m", above=0.0, at_most=0.6)] | None = None
    """Length from heel to toe; 0.152 of the body's height by default (Winter)."""
    directions: tuple[_Word, _Word] = Field(
        default_factory=lambda of: JOINTS[of.get("joint", "hinge")].directions
    )
    """Names of turning the joint to positive and to negative angles; those of the joint by default."""
    damping: Annotated[float, Quantity("N*m*s/rad", at_least=0.0, at_most=1e3)]
    """Viscous damping of the joint."""
    body_mass: Annotated[float, Quantity("kg", at_least=10.0, at_most=300.0)] = 75.0
    """Mass of the whole body that the leg belongs to."""
    body_height: Annotated[float, Quantity("m", at_least=0.5, at_most=2.5)] = 1.75
    """Height of the body that the leg belongs to."""
    friction: Annotated[float, Quantity("N*m", at_least=0.0, at_most=100.0)] = 0.0
    """Coulomb friction about the joint, on top of the file's."""
    inertia: Annotated[float, Quantity("kg*m^2", at_least=0.0, at_most=10.0)] = 0.0
    """Inertia about the joint of what else turns with the foot, on top of the file's."""
    # another joint has the spring of its file alone
    passive: PassiveAnkle = Field(
        default_factory=lambda of: PassiveAnkle(scale=1.0 if of.get("joint") == "ankle" else 0.0)
    )
    """Moment of the relaxed ankle's tissue; none about another joint."""
    toes: Toes | None = None
    """Hinge of the toes; a rigid foot without it."""

    def _must_have_an_ankle(self) -> None:
        if self.joint == "ankle":
            return
        if self.passive.scale != 0.0:
            allowed = "0, and stiffness and springref of the hinge in the file"
            problem = f"is the tissue of an ankle, and this is {a_joint(self.joint)}"
            raise refusal(problem, allowed, "passive.scale")
        if self.toes is not None:
            problem = f"belongs under an ankle, and this is {a_joint(self.joint)}"
            raise refusal(problem, "no such table", "toes")


_Stack = Annotated[float, Quantity("m", at_least=0.0, at_most=0.15)]
_Ahead = Annotated[float, Quantity("m", at_least=-0.05, at_most=0.1)]


class Outsole(Described):
    """The outsole under the foot: thickness, length, toe spring, bending stiffness.

    Lengths are for a leg of the leg's own size, and go with the patient's, as the leg does.
    """

    heel_stack: _Stack
    """Thickness under the heel."""
    ball_stack: _Stack
    """Thickness under the ball of the foot; less than under the heel by the drop."""
    toe_spring: _Stack = 0.0
    """Height of the outsole's tip above the floor on which it stands flat."""
    tip_ahead: _Ahead = 0.0
    """Distance of the outsole's tip ahead of the toes' tip."""
    heel_behind: _Ahead = 0.0
    """Distance of the outsole's rearmost standing point behind the heel's."""
    toe_stiffness: Annotated[float, Quantity("N*m/rad", at_least=0.0, at_most=1e4)] = 0.0
    """Stiffness that it adds to the toes' hinge, about its own shape."""


class Shoe(Named, Outsole):
    """A shoe: its outsole and its mass."""

    mass: Annotated[float, Quantity("kg", at_least=0.0, at_most=5.0)]
    """Mass of one shoe of a person as heavy as the leg's; a heavier one wears a heavier shoe."""
    centre: tuple[
        Annotated[float, Quantity("m", at_least=-0.3, at_most=0.3)],
        Annotated[float, Quantity("m", at_least=-0.3, at_most=0.3)],
    ]
    """Its centre of mass from the ankle, forward and up, with the foot flat."""
    inertia: Annotated[float, Quantity("kg*m^2", at_least=0.0, at_most=1.0)]
    """Inertia about its own centre of mass, in the sagittal plane."""

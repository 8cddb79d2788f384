"""Walking as it is described: the recorded gait, the patient, the ground, and the limits of a verdict."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field

from afo_sim.description.muscle import Pressure
from afo_sim.description.quantity import Described, Named, OfChambers, Quantity, refusal

Share = Annotated[float, Quantity("", at_least=0.0, at_most=1.0)]
Phase = Annotated[float, Quantity("", at_least=0.0, at_most=1.0)]
_PaceTime = Annotated[float, Quantity("s", at_least=0.0, at_most=1e5)]
_PaceFactor = Annotated[float, Quantity("", at_least=0.0, at_most=3.0)]


class Gait(Described):
    """Recorded walking that drives the shank, stride after stride."""

    cycle: str
    """Recorded stride: a shipped gait, or the path of a gait CSV."""
    walker: Literal["healthy", "patient"] | None = None
    """Whose walk the recording is: a healthy walker's, who carries the described patient, or the patient's
    own without the device; the file's by default."""
    stride_time: Annotated[float, Quantity("s", above=0.2, at_most=10.0)] | None = None
    """Duration of a stride; the recording's by default."""
    variability: Annotated[float, Quantity("", at_least=0.0, at_most=0.2)] = 0.0
    """Standard deviation of the stride time, as a share of it."""
    seed: int = Field(default=0, ge=0, le=2**32 - 1)
    """Seed of the stride times, where they vary."""
    pace: tuple[tuple[_PaceTime, _PaceFactor], ...] = ()
    """Changes of the cadence: [time from which on, factor on it]; 0 is a stop, 1 the walker's own cadence."""
    pace_change: Annotated[float, Quantity("s", at_least=0.1, at_most=10.0)] = 0.5
    """Time that each change of the cadence takes; the half second is assumed."""
    start_phase: Phase = 0.0
    """Gait phase at which the run begins; 0 is heel strike."""
    ankle_offset: Annotated[float, Quantity("rad", at_least=-0.35, at_most=0.35)] = 0.0
    """Angle added to the recorded ankle angle."""
    speed: Annotated[float, Quantity("m/s", at_least=0.1, at_most=5.0)] | None = None
    """Walking speed, between those of the cycle's family of mean curves; the cycle's own by default."""
    steppage_hip: Annotated[float, Quantity("rad", at_least=0.0, at_most=0.7)] = 0.0
    """Hip flexion that is added in mid-swing, as people do whose foot hangs."""
    steppage_knee: Annotated[float, Quantity("rad", at_least=0.0, at_most=0.7)] = 0.0
    """Knee flexion that is added in mid-swing."""
    compensation: Literal["kept", "removed"] = "kept"
    """Whether hip, knee and path are the recorded ones, or those of healthy people of the person's size and
    speed under the recorded ankle: what the toe clears if nothing makes up for the foot."""
    sole_thickness: Annotated[float, Quantity("m", at_least=0.0, at_most=0.15)] | None = None
    """Thickness of the sole that the recorded walker wore under the ankle; the recording's by default, or
    none."""
    settled: Literal["solved", "walked"] = "solved"
    """The settled stride is solved for, or walked to from the start; walked where strides do not repeat."""

    def _must_have_one_pace_at_a_time(self) -> None:
        if self.speed is not None and self.stride_time is not None:
            raise refusal("conflicts with gait.speed, which sets the pace", "one of the two", "stride_time")
        for (before, _), (after, _) in pairwise(self.pace):
            # from 0 s on the first factor holds without a change
            earliest = before + (self.pace_change if before > 0.0 else 0.0)
            if after <= before or after < earliest * (1.0 - 1e-12):
                raise refusal(
                    f"the change at {after:g} s begins before the one at {before:g} s is over",
                    f"from {earliest:g} s on, a shorter gait.pace_change, or times that rise",
                    "pace",
                )


class Patient(Named):
    """A patient: strength of the ankle muscles, spasticity, body size.

    Strengths are shares of the moment that the healthy walk asks of each side; the stiffness about the
    recorded angle goes with the strength of the side that is active.
    """

    description: str = ""
    """One line that says who it is."""
    dorsiflexor_strength: Share
    """Strength that the dorsiflexors have left, as a share of the healthy moment."""
    plantarflexor_strength: Share
    """Strength that the plantarflexors have left, as a share of the healthy moment; in contact the toes'
    flexors have as much."""
    stiffness: Annotated[float, Quantity("", at_least=0.0, at_most=10.0)] = 1.0
    """Factor on the stiffness about the recorded angle."""
    spasticity: Annotated[float, Quantity("N*m*s/rad", at_least=0.0, at_most=100.0)] = 0.0
    """Moment of the plantarflexors by the velocity of their stretch, in a person of the leg's own size."""
    passive_scale: Annotated[float, Quantity("", at_least=0.0, at_most=20.0)] = 1.0
    """Factor on the leg's passive moment: stiffer or slacker tissue."""
    passive_offset: Annotated[float, Quantity("rad", at_least=-0.79, at_most=0.79)] = 0.0
    """Shift of the angle at which the tissue is slack; a contracture's is negative."""
    body_mass: Annotated[float, Quantity("kg", at_least=10.0, at_most=300.0)] | None = None
    """Mass of the body; the recorded walker's by default."""
    body_height: Annotated[float, Quantity("m", at_least=0.5, at_most=2.5)] | None = None
    """Height of the body; the recorded walker's by default, or the leg's where that is not known."""


class Ground(Described):
    """Ground under the foot: contact with a floor, or the recorded force, whatever the foot does.

    Source: toe_stiffness: PredSim's metatarsophalangeal joint (its 2 N·m·s/rad are not taken over). The
    others are assumed: a heel pad in its shoe has some 40 to 150 kN/m, a leg in walking some 20 kN/m,
    damped here to two thirds of critical with the mass of shank and foot.
    """

    mode: Literal["contact", "recorded"] = "contact"
    """Contact of this foot with a floor, or the recorded force whatever the foot does: for a comparison with
    inverse dynamics, where no foot may press otherwise than recorded."""
    stiffness: Annotated[float, Quantity("N/m", at_least=1e3, at_most=1e6)] = 5e4
    """Stiffness of the pads under the sole."""
    damping: Annotated[float, Quantity("s/m", at_least=0.0, at_most=2.0)] = 1.0
    """Share of a pad's force by its velocity."""
    toe_stiffness: Annotated[float, Quantity("N*m/rad", at_least=1.0, at_most=1e3)] | None = None
    """Stiffness of the toe joint of a leg that has no toes, in its pad; 25 N·m/rad by default."""
    body_stiffness: Annotated[float, Quantity("N/m", at_least=1e3, at_most=1e6)] = 2e4
    """Stiffness of the leg under the load of the ground."""
    body_damping: Annotated[float, Quantity("N*s/m", at_least=0.0, at_most=1e4)] = 400.0
    """Damping of the leg under the load of the ground."""
    slope: Annotated[float, Quantity("rad", at_least=-0.14, at_most=0.14)] = 0.0
    """Slope of the floor, up positive. Of the responding walker alone."""
    uneven: Annotated[float, Quantity("m", at_least=0.0, at_most=0.05)] = 0.0
    """Height up to which an uneven floor rises; drawn each metre, level up to 2 m. Of the responding walker
    alone."""
    seed: int = Field(default=0, ge=0, le=2**32 - 1)
    """Seed of an uneven floor."""


class ChamberStart(Described):
    """Air in one chamber before the first step: filled to a pressure, or for a time."""

    pressure: Pressure | None = None
    """Gauge pressure that the wearer waits for, standing."""
    fill_time: Annotated[float, Quantity("s", at_least=0.0, at_most=60.0)] | None = None
    """Time for which the inlet valve is open before the first step, standing."""

    def _must_be_one(self) -> None:
        if (self.pressure is None) == (self.fill_time is None):
            raise refusal("needs one of the two", "pressure or fill_time", "pressure")


class Start(OfChambers[ChamberStart]):
    """Air before the first step; every key is a chamber, and one that is not named is empty."""


_Clearance = Annotated[float, Quantity("m", at_least=-0.1, at_most=0.2)]
_Pitch = Annotated[float, Quantity("rad", at_least=-0.8, at_most=0.8)]
_Torque = Annotated[float, Quantity("N*m/kg", at_least=0.0, at_most=10.0)]
_Work = Annotated[float, Quantity("J/kg", at_least=0.0, at_most=10.0)]
_SkinPressure = Annotated[float, Quantity("Pa", above=0.0, at_most=1e6)]
_Life = Annotated[float, Quantity("", above=0.0, at_most=1e12)]
_Count = Annotated[float, Quantity("", at_least=0.0, at_most=1e9)]

_FALLING = ("toe_clearance", "contact_pitch", "strides_per_bottle")  # good from, bad below


class Limits(Named):
    """Limits of a walk and a device; of a pair the first is what is wanted, beyond the second it
    is bad.

    `load("limits", "usual")` are the shipped ones. A scenario without `limits` is judged by these.
    """

    toe_clearance: tuple[_Clearance, _Clearance]
    """Toe clearance of every stride: wanted at least, and the height below which the toe trips."""
    drawn_trips: tuple[Share, Share]
    """Share of strides, drawn over what is not known, that touch the floor: wanted at most, bad beyond the
    second."""
    contact_pitch: tuple[_Pitch, _Pitch]
    """Pitch of the sole at initial contact, toes up: the heel comes first from the first on, the forefoot
    below the second."""
    torque_against_push_off: tuple[_Torque, _Torque]
    """Dorsiflexion torque of the orthosis in push-off by body mass: hardly felt up to the first, too much
    beyond the second."""
    work_against_push_off: tuple[_Work, _Work]
    """Work that it takes from push-off by body mass: hardly felt up to the first, too much beyond the
    second."""
    strides_per_bottle: tuple[_Count, _Count]
    """Strides of one bottle of air: wanted at least, too few below the second."""
    bottle_volume: Annotated[float, Quantity("m^3", above=0.0, at_most=0.1)]
    """Volume of the bottle."""
    bottle_pressure: Annotated[float, Quantity("Pa", above=0.0, at_most=1e8)]
    """Gauge pressure of the full bottle."""
    skin_pressure: tuple[_SkinPressure, _SkinPressure]
    """Pressure on the skin under cuff or strap: discomfort from the first on, pain beyond the second."""
    blood_flow_pressure: _SkinPressure
    """Pressure that a wide cuff may keep up all the time without hindering the flow of blood."""
    strides_per_day: Annotated[float, Quantity("", above=0.0, at_most=1e6)]
    """Strides of one leg on a day, by which a life in strides is given in days."""
    muscle_life: _Life
    """Cycles of filling and venting that a muscle is to last."""

    def _must_be_in_order(self) -> None:
        for key, pair in self:
            falls = key in _FALLING
            if isinstance(pair, tuple) and (pair[1] > pair[0] if falls else pair[1] < pair[0]):
                order = f"one not {'above' if falls else 'below'} the first"
                raise refusal("the second value is on the wrong side of the first", order, key)

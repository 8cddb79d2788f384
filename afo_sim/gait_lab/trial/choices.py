"""Choices of a person where the files themselves do not decide."""

import math
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from afo_sim.common.errors import InputError
from afo_sim.gait.checks import BODY_HEIGHT, SOLE_THICKNESS

ROLES = ("hip", "knee", "ankle", "heel", "toe")
SIDES = ("right", "left")
AXES = ("x", "y", "z", "-x", "-y", "-z")


@dataclass(frozen=True)
class Choices:
    """Choices for reading a trial; SI. A choice of None is found in the files, or refused."""

    side: str = "right"
    mass: float | None = None  # of the body [kg]; by default the model's, or what the plates carry
    height: float | None = None  # of the body [m]; nothing in the files tells it
    sole: float | None = None  # thickness of the sole that was worn, under the ankle [m]; likewise
    stride: int | None = None  # which of the side's strides, from 1; the first by default
    mean: bool = False  # of all the side's strides, instead of one of them
    both: bool = False  # the mean of both legs' strides, the left ones mirrored
    markers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # role: names, their midpoint counts
    map: pathlib.Path | None = None  # file that says which marker has which role
    model: pathlib.Path | None = None  # the person's scaled OpenSim model
    static: pathlib.Path | None = None  # standing trial with the trial's markers and more
    plates: tuple[str, ...] = ()  # to look at; all by default
    forward: str | None = None  # laboratory axis in which the person walks, "x" or "-y"
    up: str | None = None
    degrees: bool | None = None  # the joint angles' unit, where a header is silent or wrong
    belt_speed: float | None = None  # of the treadmill [m/s]; by default from the standing foot's way back
    cutoff: float = 6.0  # of the low-pass, over both of its passes [Hz]; 0 leaves the data as they are
    thigh: float | None = None  # hip to knee [m]
    shank: float | None = None  # knee to ankle [m]
    hip: tuple[float, float] | None = None  # hip centre from the pelvis' origin, forward and up [m]
    ankle_height: float | None = None  # above the floor with the foot flat [m]
    keep_zero: bool = False  # of the ankle angle, instead of the flat foot's
    rows: int = 201  # of the cycle
    source: str = ""
    licence: str = "not stated"

    def __post_init__(self) -> None:
        for name, value, allowed in (
            ("side", self.side, SIDES),
            ("forward", self.forward, (None, *AXES)),
            ("up", self.up, (None, *AXES)),
        ):
            if value not in allowed:
                words = ", ".join(a for a in allowed if a)
                raise InputError("is no choice", field=name, value=value, allowed=words)
        if self.forward and self.up and self.forward[-1] == self.up[-1]:
            raise InputError("is the same axis as up", field="forward", value=self.forward)
        for role in self.markers:
            if role not in ROLES:
                raise InputError("is no role", field="marker", value=role, allowed=", ".join(ROLES))
        if self.stride is not None and self.stride < 1:
            raise InputError("is no stride", field="stride", value=self.stride, allowed="1, 2, …, mean")
        if self.stride is not None and (self.mean or self.both):
            raise InputError("is one stride, and a mean is asked for", field="stride", value=self.stride)
        for name, number, low, high in (
            ("mass", self.mass, 5.0, 300.0),
            ("height", self.height, *BODY_HEIGHT),
            ("sole", self.sole, *SOLE_THICKNESS),
            ("cutoff", self.cutoff, 0.0, math.inf),
            ("belt_speed", self.belt_speed, 0.0, 10.0),
            ("thigh", self.thigh, 0.1, 0.8),
            ("shank", self.shank, 0.1, 0.8),
            ("ankle_height", self.ankle_height, 0.02, 0.2),
        ):
            if number is not None and not low <= number <= high:
                allowed_range = f"{low:g} to {high:g}" if high < math.inf else "0 or more"
                raise InputError("is out of range", field=name, value=number, allowed=f"{allowed_range} (SI)")

    @property
    def letter(self) -> str:
        """The side's letter, as marker and coordinate names have it."""
        return self.side[0]

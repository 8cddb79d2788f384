"""Choices of a person where the files do not decide, and their texts as the command line takes them."""

import math
import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from afo_sim.common import InputError, JsonMapping, Keywords, parse_quantity, unknown
from afo_sim.gait import BODY_HEIGHT, SOLE_THICKNESS, Walker

ROLES = ("hip", "knee", "ankle", "heel", "toe")
SIDES = ("right", "left")
AXES = ("x", "y", "z", "-x", "-y", "-z")

_QUANTITIES = {  # option: (SI unit, how a person writes it)
    "mass": ("kg", "72 kg"),
    "height": ("m", "1.72 m"),
    "sole": ("m", "25 mm"),
    "belt_speed": ("m/s", "1.2 m/s"),
    "cutoff": ("Hz", "10 Hz"),
    "thigh": ("m", "43 cm"),
    "shank": ("m", "43 cm"),
    "hip": ("m", "-6.3 cm"),
    "ankle_height": ("m", "7 cm"),
}
_LOWEST_CUTOFF = 0.01  # far below a stride's own frequency; nearer to 0 a filter has no solution [Hz]
_HIGHEST_CUTOFF = 50.0  # above it a low-pass leaves walking as noisy as it is; assumed [Hz]
PLAIN = ("walker", "forward", "up", "source", "licence", "map", "model", "static")


@dataclass(frozen=True)
class Choices:
    """Choices for reading a trial; SI. A choice of None is found in the files, or refused."""

    side: str = "right"
    either: bool = False  # the other side where that one has no stride to take; never of a patient
    mass: float | None = None  # of the body [kg]; by default the file's, the model's, or the plates'
    height: float | None = None  # of the body [m]; by default the file's
    sole: float | None = None  # of what was worn, its thickness under the ankle [m]; no file states it
    stride: int | None = None  # which of the side's strides, from 1; the first by default
    mean: bool = False  # of all the side's strides, instead of one of them
    both: bool = False  # the mean of both legs' strides, the left ones mirrored
    each: bool = False  # a stride of either side, as `import_sides` cuts them
    markers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # role: names, their midpoint counts
    map: pathlib.Path | None = None  # file that says which marker has which role
    model: pathlib.Path | None = None  # the person's scaled OpenSim model
    static: pathlib.Path | None = None  # standing trial with the trial's markers and more
    plates: tuple[str, ...] = ()  # to look at; all by default
    forward: str | None = None  # laboratory axis in which the person walks, "x" or "-y"
    up: str | None = None
    degrees: bool | None = None  # the joint angles' unit, where a header is silent or wrong
    belt_speed: float | None = None  # of the treadmill [m/s]; by default from the standing foot's way back
    cutoff: float = 10.0  # of the low-pass, over both of its passes [Hz]; 0 leaves the data as they are. Of
    # 4 to 20 Hz the moment's error is near its least, in recorded walks and a known one with 0 to 5 mm noise
    thigh: float | None = None  # hip to knee [m]
    shank: float | None = None  # knee to ankle [m]
    hip: tuple[float, float] | None = None  # hip centre from the pelvis' origin, forward and up [m]
    ankle_height: float | None = None  # above the floor with the foot flat [m]
    keep_zero: bool = False  # of the ankle angle, instead of the flat foot's
    rows: int = 201  # of the cycle
    walker: Walker | None = None  # whose walk it is; nothing in the files states it, and nothing is guessed
    source: str = ""
    licence: str = "not stated"

    def __post_init__(self) -> None:
        for name, value, allowed in (
            ("side", self.side, SIDES),
            ("walker", self.walker, (None, *get_args(Walker))),
            ("forward", self.forward, (None, *AXES)),
            ("up", self.up, (None, *AXES)),
        ):
            if value not in allowed:
                words = ", ".join(a for a in allowed if a)
                raise InputError("is not a valid choice", field=name, value=value, allowed=words)
        if self.forward and self.up and self.forward[-1] == self.up[-1]:
            raise InputError("is the same axis as up", field="forward", value=self.forward)
        if self.both and self.walker == "patient":
            problem = "is the mean of both legs, but a patient's legs differ"
            instead = "each, or right or left, the one that is to wear the device"
            raise InputError(problem, field="side", value="both", allowed=instead)
        for role in self.markers:
            if role not in ROLES:
                raise InputError("is not a valid role", field="marker", value=role, allowed=", ".join(ROLES))
        if self.stride is not None and self.stride < 1:
            problem = "is not a valid stride"
            raise InputError(problem, field="stride", value=self.stride, allowed="1, 2, …, mean")
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
                span = f"{low:g} to {high:g} (SI)" if high < math.inf else "0 or more (SI)"
                raise InputError("is out of range", field=name, value=number, allowed=span)
        if 0.0 < self.cutoff < _LOWEST_CUTOFF:
            span = f"0 or at least {_LOWEST_CUTOFF:g} (SI)"
            raise InputError("is out of range", field="cutoff", value=self.cutoff, allowed=span)


def axis_vector(name: str) -> np.ndarray:
    """Unit vector of a signed axis such as "-y" (3,)."""
    vector = np.zeros(3)
    vector["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
    return vector


def nearest_axis(vector: np.ndarray) -> str:
    """The signed axis that is nearest to a vector."""
    k = int(np.argmax(np.abs(vector)))
    return ("-" if vector[k] < 0.0 else "") + "xyz"[k]


def read_options(given: JsonMapping) -> Choices:
    """Choices from options as a person types them."""
    values: Keywords = {name: given[name] for name in PLAIN if given.get(name) is not None}
    for name in (name for name in _QUANTITIES if given.get(name) is not None):
        text = given[name]
        both = name == "hip"  # forward and up
        values[name] = tuple(_quantity(name, each) for each in text) if both else _quantity(name, text)
    if values.get("cutoff", 0.0) > _HIGHEST_CUTOFF:
        problem, usual = f"is above {_HIGHEST_CUTOFF:g} Hz", "10 Hz, the default; 0 Hz leaves the data alone"
        raise InputError(problem, field="cutoff", value=given["cutoff"], allowed=usual)
    if given.get("angles") is not None:
        values["degrees"] = _choice("angles", given["angles"], {"deg": True, "rad": False})
    zero = given.get("ankle_zero", "flat")
    values["keep_zero"] = _choice("ankle_zero", zero, {"flat": False, "file": True})
    values["markers"] = _markers(given.get("marker") or ())
    side, stride = given.get("side"), given.get("stride")
    if side not in (None, "both", "each", *SIDES):
        raise unknown(side, (*SIDES, "both", "each"), field="side")
    # one mean of the right strides and the left ones, mirrored; or each side alone
    values |= {side or "either": True} if side in (None, "both", "each") else {"side": side}
    if stride == "mean":
        values["mean"] = True
    elif stride is not None:
        try:
            values["stride"] = int(stride)
        except ValueError:
            problem = "is not a valid stride"
            raise InputError(problem, field="stride", value=stride, allowed="1, 2, …, mean") from None
    return Choices(plates=tuple(given.get("plate") or ()), **values)


def _quantity(name: str, text: str) -> float:
    unit, example = _QUANTITIES[name]
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        problem, likened, _ = str(error).partition('write it like "')
        problem += f'{likened}{example}"' if likened else ""
        raise InputError(problem, field=name, value=text) from None


def _choice(name: str, text: str, choices: Mapping[str, bool]) -> bool:
    if text not in choices:
        raise InputError("is not a valid choice", field=name, value=text, allowed=", ".join(choices))
    return choices[text]


def _markers(texts: Sequence[str]) -> dict[str, tuple[str, ...]]:
    found = {}
    for text in texts:
        role, equals, names = text.partition("=")
        if not equals or not names.strip():
            raise InputError("is not ROLE=NAME", field="marker", value=text, allowed="ankle=R.Ankle.Lat")
        found[role.strip()] = tuple(name.strip() for name in names.split(","))
    return found

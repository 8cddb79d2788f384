"""What a laboratory's C3D file states of the walker and the walk beside markers and forces."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import Notice
from afo_sim.gait import BODY_HEIGHT, RANGES
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.c3d_file import Parameters
from afo_sim.gait_lab.readers.unit_checks import UNITS

_GROUPS = ("PROCESSING", "SUBJECTS", "SUBJECT", "ANALYSIS")  # in which programs keep the walker's measures
_NAMES = {  # in letters alone
    "bodymass": "mass", "mass": "mass", "weight": "mass", "height": "height", "bodyheight": "height",
    "rleglength": "right leg", "rightleglength": "right leg",
    "lleglength": "left leg", "leftleglength": "left leg",
}  # fmt: skip
_LEG = (0.3, 1.3)  # length of a leg, a child's or a tall adult's; assumed [m]
LIKELY = {"mass": RANGES["body_mass_kg"], "height": BODY_HEIGHT, "right leg": _LEG, "left leg": _LEG}
_RESULT = re.compile(r"(?:.*:)?(?P<side>[rl])ankle(?P<kind>angle|moment)s?(?:_\w+)?", re.IGNORECASE)
_PER_MASS = 10.0  # a plantarflexor moment's peak beyond it is no moment per mass; runners reach 4 [N·m/kg]
_KINDS = {"strike": "heel strike", "contact": "heel strike", "off": "toe-off"}  # by words of an event's label


@dataclass(frozen=True, eq=False)
class Stated:
    """What a laboratory measured, marked and computed itself, by side where it is a leg's."""

    mass: float | None = None  # [kg]
    height: float | None = None  # [m]
    legs: Mapping[str, float] = field(default_factory=dict)  # lengths [m]
    events: Mapping[tuple[str, str], tuple[float, ...]] = field(default_factory=dict)  # side and
    # "heel strike" or "toe-off": times [s]
    time: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of the curves [s] (n,)
    angles: Mapping[str, np.ndarray] = field(default_factory=dict)  # ankle's, dorsiflexion positive [rad]
    moments: Mapping[str, np.ndarray] = field(default_factory=dict)  # ankle's, internal, dorsiflexion
    # positive [N·m/kg] or [N·m], whichever has their size

    def whole_moments(self, mass: float) -> dict[str, np.ndarray]:
        """Internal ankle moments over `time`, dorsiflexion positive [N·m], of a body of `mass` [kg]."""
        sizes = {side: np.nanmax(np.abs(moment)) for side, moment in self.moments.items()}
        return {s: m if sizes[s] > _PER_MASS else mass * m for s, m in self.moments.items()}


def read_stated(
    file: Parameters, time: np.ndarray, names: Sequence[str], points: np.ndarray
) -> tuple[Stated, list[Notice]]:
    """The walker's measures, marked events and ankle curves, as Vicon's Plug-in Gait names them."""
    found, notices = _measures(file)
    curves: dict[str, dict[str, np.ndarray]] = {"angle": {}, "moment": {}}
    kinds = "UNITS", "ANGLE_UNITS", "MOMENT_UNITS"
    length, angle, moment = ("".join(file.texts("POINT", kind)[:1]) for kind in kinds)
    scales = {"angle": 1.0 if "rad" in angle else np.pi / 180.0}
    scales["moment"] = -1e-3 if "mm" in (moment or length or "mm").lower() else -1.0
    for k, name in enumerate(names):
        match = _RESULT.fullmatch(name)
        values = points[:, k, 0]
        if match and np.isfinite(values).any():
            kind, side = match["kind"].lower(), {"r": "right", "l": "left"}[match["side"].lower()]
            curves[kind].setdefault(side, scales[kind] * values)
    legs = {side: found[f"{side} leg"] for side in ("right", "left") if f"{side} leg" in found}
    events = _events(file)
    said = [f"mass {found['mass']:g} kg"] if "mass" in found else []
    said += [f"height {found['height']:.2f} m"] if "height" in found else []
    said += [f"{side} leg {length:.2f} m" for side, length in legs.items()]
    said += [f"{sum(map(len, events.values()))} events"] if events else []
    said += [f"ankle {kind} {' and '.join(sides)}" for kind, sides in curves.items() if sides]
    if said:
        text = "the laboratory states {stated}; events and curves are compared, not taken"
        notices.append(note("laboratory-states", text, stated=", ".join(said)))
    return Stated(found.get("mass"), found.get("height"), legs, events, time, *curves.values()), notices


def _measures(file: Parameters) -> tuple[dict[str, float], list[Notice]]:
    """Body mass [kg], body height and legs' lengths [m], in whatever unit makes them a person's."""
    found: dict[str, float] = {}
    notices: list[Notice] = []
    for group in _GROUPS:
        listed = dict(zip(file.texts(group, "NAMES"), file.numbers(group, "VALUES")[:, None], strict=False))
        for name in (*file.groups.get(group, {}), *listed):
            quantity = _NAMES.get(re.sub("[^a-z]", "", name.lower()), "")
            value = listed.get(name, file.numbers(group, name)) if quantity else np.empty(0)
            if quantity in found or len(value) != 1 or not value[0] > 0.0:
                continue  # programs write 0 where nobody typed a number
            low, high = LIKELY[quantity]
            factors = (1.0,) if quantity == "mass" else UNITS.values()
            fits = [float(value[0]) * factor for factor in factors if low <= value[0] * factor <= high]
            if len(fits) == 1:
                found[quantity] = fits[0]
            else:
                text = "its {subject} of {value:g} is not used: no walker's in kg, mm or m"
                notices.append(Notice("stated-unlikely", text, subject=quantity, value=float(value[0])))
    return found, notices


def _events(file: Parameters) -> dict[tuple[str, str], tuple[float, ...]]:
    """Heel strikes and toe-offs that somebody marked [s]."""
    times = file.numbers("EVENT", "TIMES")  # minutes and seconds
    labels, contexts = file.texts("EVENT", "LABELS"), file.texts("EVENT", "CONTEXTS")
    found: dict[tuple[str, str], tuple[float, ...]] = {}
    for label, context, minutes, seconds in zip(labels, contexts, times[::2], times[1::2], strict=False):
        words, at = f"{context} {label}".lower(), float(60.0 * minutes + seconds)
        side = next((side for side in ("right", "left") if side in words), "")
        kind = next((kind for word, kind in _KINDS.items() if word in words), "")
        if side and kind and np.isfinite(at):
            found[side, kind] = tuple(sorted((*found.get((side, kind), ()), at)))
    return found

"""What a laboratory's C3D file states of the walker and the walk beside markers and forces."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import Notice
from afo_sim.gait import BODY_HEIGHT, RANGES
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.c3d_file import C3dFile
from afo_sim.gait_lab.readers.unit_checks import UNITS

_GROUPS = ("PROCESSING", "SUBJECTS", "SUBJECT", "ANALYSIS")  # in which programs keep the walker's measures
_NAMES = {  # in letters alone
    "bodymass": "mass", "mass": "mass", "weight": "mass", "height": "height", "bodyheight": "height",
    "rleglength": "right leg", "rightleglength": "right leg",
    "lleglength": "left leg", "leftleglength": "left leg",
}  # fmt: skip
_LEG = (0.3, 1.3)  # length of a leg, a child's or a tall adult's; assumed [m]
_LIKELY = {"mass": RANGES["body_mass_kg"], "height": BODY_HEIGHT, "right leg": _LEG, "left leg": _LEG}
_RESULT = re.compile(r"(?:.*:)?(?P<side>[rl])ankle(?P<kind>angle|moment)s?(?:_\w+)?", re.IGNORECASE)
_PER_MASS = 10.0  # a plantarflexor moment's peak beyond it is no moment per mass; runners reach 4 [N·m/kg]
_KINDS = (("strike", re.compile(r"strike|contact|\bon\b|\bic\b|\bhs\b")), ("off", re.compile(r"off|\bto\b")))


@dataclass(frozen=True, eq=False)
class Stated:
    """What a laboratory measured, marked and computed itself, by side where it is a leg's."""

    mass: float | None = None  # [kg]
    height: float | None = None  # [m]
    legs: Mapping[str, float] = field(default_factory=dict)  # lengths [m]
    events: Mapping[tuple[str, str], tuple[float, ...]] = field(default_factory=dict)  # side, "strike" or
    # "off": times [s]
    time: np.ndarray = field(default_factory=lambda: np.zeros(0))  # of the curves [s] (n,)
    angles: Mapping[str, np.ndarray] = field(default_factory=dict)  # ankle's, dorsiflexion positive [rad]
    moments: Mapping[str, np.ndarray] = field(default_factory=dict)  # ankle's, internal, dorsiflexion
    # positive [N·m/kg] or [N·m], whichever has their size

    def moment(self, side: str, mass: float) -> np.ndarray | None:
        """Internal ankle moment, dorsiflexion positive, over `time` [N·m]; None where none is stated."""
        found = self.moments.get(side)
        if found is None:
            return None
        return found if np.nanmax(np.abs(found)) > _PER_MASS else mass * found


def read_stated(
    file: C3dFile, time: np.ndarray, names: Sequence[str], points: np.ndarray
) -> tuple[Stated, list[Notice]]:
    """The walker's measures, marked events and ankle curves, as Vicon's Plug-in Gait names them.

    Of an angle or a moment the first coordinate counts: dorsiflexion, and the plantarflexors' moment.

    Units: time [s] (n,), points in the file's own (n, points, 3).
    """
    found, notices = _measures(file)
    curves: dict[str, dict[str, np.ndarray]] = {"angle": {}, "moment": {}}
    radians = "rad" in _unit(file, "ANGLE_UNITS")
    newton_metre = 1e-3 if "mm" in (_unit(file, "MOMENT_UNITS") or _unit(file, "UNITS") or "mm") else 1.0
    for k, name in enumerate(names):
        match = _RESULT.fullmatch(name)
        values = points[:, k, 0]
        if match and np.isfinite(values).any():
            kind, side = match["kind"].lower(), {"r": "right", "l": "left"}[match["side"].lower()]
            scale = -newton_metre if kind == "moment" else 1.0 if radians else np.pi / 180.0
            curves[kind].setdefault(side, scale * values)
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


def _unit(file: C3dFile, name: str) -> str:
    """A unit of the points, letters alone."""
    return re.sub("[^a-z/]", "", (file.texts("POINT", name) or [""])[0].lower())


def _measures(file: C3dFile) -> tuple[dict[str, float], list[Notice]]:
    """Body mass [kg], body height and legs' lengths [m], in whatever unit makes them a person's."""
    found: dict[str, float] = {}
    notices: list[Notice] = []
    for group in _GROUPS:
        given = [(name, file.numbers(group, name)) for name in file.parameters.get(group, {})]
        given += zip(file.texts(group, "NAMES"), file.numbers(group, "VALUES")[:, None], strict=False)
        for name, value in given:
            quantity = _NAMES.get(re.sub("[^a-z]", "", name.lower()), "")
            if not quantity or quantity in found or len(value) != 1 or not value[0] > 0.0:
                continue  # programs write 0 where nobody typed a number
            low, high = _LIKELY[quantity]
            factors = (1.0,) if quantity == "mass" else UNITS.values()
            fits = [float(value[0]) * factor for factor in factors if low <= value[0] * factor <= high]
            if len(fits) == 1:
                found[quantity] = fits[0]
            else:
                text = "its {subject} of {value:g} is not used: no walker's in kg, mm or m"
                notices.append(Notice("stated-unlikely", text, subject=quantity, value=float(value[0])))
    return found, notices


def _events(file: C3dFile) -> dict[tuple[str, str], tuple[float, ...]]:
    """Heel strikes and toe-offs that somebody marked [s]."""
    times = file.numbers("EVENT", "TIMES")  # minutes and seconds
    labels, contexts = file.texts("EVENT", "LABELS"), file.texts("EVENT", "CONTEXTS")
    found: dict[tuple[str, str], list[float]] = {}
    for label, context, minutes, seconds in zip(labels, contexts, times[::2], times[1::2], strict=False):
        words = f"{context} {label}".lower()
        side = next((side for side in ("right", "left") if side in words), "")
        kind = next((kind for kind, pattern in _KINDS if pattern.search(label.lower())), "")
        at = 60.0 * minutes + seconds
        if side and kind and np.isfinite(at):
            found.setdefault((side, kind), []).append(float(at))
    return {key: tuple(sorted(each)) for key, each in found.items()}

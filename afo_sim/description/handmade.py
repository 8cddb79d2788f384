"""Hand-made braids: a muscle's numbers from bore, braid angle and length, and what the ideal braid does."""

import functools
import math
import operator
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from afo_sim.common import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    STANDARD_DENSITY,
    InputError,
    JsonDict,
    nearest_name,
    parse_quantity,
    quantity_at,
)
from afo_sim.description.muscle import Muscle
from afo_sim.physics import Braid

# argument: (unit, text of its range, lowest, highest, whether the lowest itself is allowed)
_RANGES: dict[str, tuple[str, str, float, float, bool]] = {
    "bore": ("m", "0.7 mm to 200 mm", 0.699e-3, 0.2, True),
    "braid_angle": ("rad", "5 deg to 49.9 deg", math.radians(5.01), math.radians(49.95), True),
    "length": ("m", "above 0 cm, to 1000 cm", 0.0, 10.0, False),
    "end_length": ("m", "at least 0 cm, and less than the length", 0.0, 2.0, True),
    "wall_thickness": ("m", "0.1 mm to 5 mm, and less than half the bore", 1e-4, 5e-3, True),
}
_NEEDED = ("bore", "braid_angle", "length")
_NEUTRAL = math.acos(1.0 / math.sqrt(3.0))  # 54.74°: such a braid encloses the most volume, and does not pull
_PRESSURE = 4e5  # assumed limit of a clamped silicone tube, gauge [Pa]
_STRONGEST = 15e3  # force at that pressure of a braid that is still taken for a hand-made one [N]
_S1 = Braid(1.0, 5.75e-3, math.radians(22.0))  # the muscle whose bladder, damping and braid are scaled
# its F0 and K_b [N], fitted to its tables I and II, see models/muscles/s1_215mm
_S1_BLADDER = (136.0, 153.0)
# Where a given quantity stands in a muscle's file.
_PLACE = {key: key for key in _RANGES} | {"length": "total_length", "wall_thickness": "tube.wall_thickness"}


def fill_braid(muscle: JsonDict, given: Mapping[str, str]) -> None:
    """Put a braid's numbers in place of those of a hand-made muscle, whose file names their sources."""
    q = _read(given)
    bore, end, total = q["bore"], q["end_length"], q["length"]
    braid = Braid(total - end, bore / 2.0, q["braid_angle"])
    area = (bore / 2.0 / _S1.nominal_radius) ** 2  # relative to S1's muscle
    most = round(maximum_contraction(braid.braid_angle), 4)
    bladder = _S1_BLADDER[0] * blocked_force(braid, 1.0) / blocked_force(_S1, 1.0)
    highest = parse_quantity(muscle["limits"]["pressure"]["value"], "Pa")
    rubber = "laws.tondu_lopez_2000_bladder.bladder"
    numbers: dict[str, str | float] = {
        **{place: given.get(key, f"{1e3 * q[key]:.3g} mm") for key, place in _PLACE.items()},
        "damping": f"{2e-4 * area:.3g} m^2*s",
        "braid_stiffness": f"{20.0 * bore / 11.5e-3:.3g} kN",
        "dead_volume": f"{max(1e6 * math.pi * bore**2 / 4.0 * end, 0.1):.3g} ml",
        "mass": f"{7.5e3 * bore * total + 4e5 * bore**2:.3g} g",
        f"{rubber}_force": f"{bladder:.4g} N",
        f"{rubber}_stiffness": f"{_S1_BLADDER[1] * area:.4g} N",
        "limits.force": f"{blocked_force(braid, highest):.4g} N",
        "limits.contraction_min": -min(0.03, math.floor(-500.0 * braid.lock) * 1e-3),
        "limits.contraction_max": most,
    }
    own = {_PLACE[key]: {"kind": "user", "source": "given to afo-sim new"} for key in given}
    for place, number in numbers.items():
        entry = functools.reduce(operator.getitem, place.split("."), muscle)
        entry.update(value=number, **own.get(place, {}))
    for law in muscle["laws"].values():
        law["contraction_range"] = [0.0, most]


def maximum_contraction(braid_angle: float) -> float:
    """Contraction ratio at which an ideal braid's force ends: κ = 1 − 1/(√3 cos α0) [-], α0 in [rad]."""
    return 1.0 - 1.0 / (math.sqrt(3.0) * math.cos(braid_angle))


def blocked_force(braid: Braid, pressure: float) -> float:
    """Force of an ideal braid at no contraction [N]: π r0² p (3/tan²α0 − 1/sin²α0), p gauge [Pa]."""
    return math.pi * braid.nominal_radius**2 * pressure * (3.0 * (braid.b - 1.0) - braid.b)


@dataclass(frozen=True)
class BraidFacts:
    """What the ideal braid of a muscle does at a gauge pressure."""

    pressure: float
    """Gauge pressure [Pa]."""
    maximum_contraction: float
    """Contraction ratio at which the force ends [-]."""
    blocked_force: float
    """Force at no contraction [N]."""
    volume: tuple[float, float]
    """Volume of air at no and at the maximum contraction, with the dead volume, less its tube [m³]."""
    free_air: float
    """Air of one filling from ambient pressure, to the maximum contraction [m³ ANR]."""

    @classmethod
    def of(cls, muscle: Muscle, pressure: float | None = None) -> "BraidFacts":
        """Facts at a gauge pressure [Pa], by default the muscle's limit."""
        gauge = muscle.limits.pressure if pressure is None else pressure
        most = maximum_contraction(muscle.braid_angle)
        rest, filled = (float(muscle.volume(contraction=kappa)) for kappa in (0.0, most))
        mass = (gauge + AMBIENT_PRESSURE) * filled - AMBIENT_PRESSURE * rest
        mass /= GAS_CONSTANT * AMBIENT_TEMPERATURE
        force = blocked_force(muscle.braid, gauge)
        return cls(gauge, most, force, (rest, filled), mass / STANDARD_DENSITY)

    def rows(self) -> Iterator[tuple[str, str]]:
        """Each fact with its name, as text."""
        bar = f"at {self.pressure * 1e-5:.4g} bar"
        yield "ideal braid, contraction at most", f"{100.0 * self.maximum_contraction:.3g} %"
        yield f"ideal braid, force {bar} and no contraction", f"{self.blocked_force:.4g} N"
        yield (
            f"air volume at rest, and at {100.0 * self.maximum_contraction:.3g} %",
            f"{1e6 * self.volume[0]:.4g} ml, {1e6 * self.volume[1]:.4g} ml",
        )
        yield f"air of one filling to there {bar}", f"{1e3 * self.free_air:.3g} l (ANR)"


def new_braid_facts(muscle: Muscle) -> list[tuple[str, str]]:
    """Facts of a new hand-made braid at its highest pressure, and what each of its laws makes of them."""
    facts = BraidFacts.of(muscle)
    found = [*facts.rows()]
    in_use = muscle.force(facts.pressure, contraction=0.0)
    for law in muscle.laws:
        other = muscle.using(law=law)
        force = other.force(facts.pressure, contraction=0.0)
        most = other.contraction(facts.pressure, force=0.0)
        beside = "in use" if law == muscle.law else f"{100.0 * (force / in_use - 1.0):+z.0f} %"
        said = f"{force:.4g} N ({beside}), contraction at most {100.0 * most:.3g} %"
        found.append((f"by the law {law} at {facts.pressure * 1e-5:.4g} bar", said))
    return found


def _read(given: Mapping[str, str]) -> dict[str, float]:
    """The given quantities in SI, each within its range, and those that are assumed."""
    for name in given:
        if name not in _RANGES:
            nearest = nearest_name(name, _RANGES)
            raise InputError("is unknown", field=name, allowed=", ".join(_RANGES), nearest=nearest)
    for name in _NEEDED:
        if name not in given:
            needs = "a braid needs `bore`, `braid_angle` and `length`"
            raise InputError("is missing", field=name, allowed=f"{_RANGES[name][1]}; {needs}")
    q = {name: _quantity(name, text) for name, text in given.items()}
    q = {"end_length": 2.0 * q["bore"], "wall_thickness": q["bore"] / 7.0} | q
    active, longer = q["length"] - q["end_length"], f"more than {1e3 * (q['bore'] + q['end_length']):g} mm"
    if active <= q["bore"]:
        problem = f"leaves {1e3 * active:g} mm of braid, no longer than the bore of {1e3 * q['bore']:g} mm: "
        problem += "the law is a long cylinder's"
        if active <= 0.0:
            problem = f"no braid is left between the ends, {1e3 * q['end_length']:g} mm in all"
        raise InputError(problem, field="length", value=given["length"], allowed=longer)
    if 2.0 * q["wall_thickness"] >= q["bore"]:
        problem, allowed = "leaves no air in the bore", f"less than {5e2 * q['bore']:g} mm"
        raise InputError(problem, field="wall_thickness", value=given["wall_thickness"], allowed=allowed)
    strength = blocked_force(Braid(active, q["bore"] / 2.0, q["braid_angle"]), _PRESSURE)
    if strength > _STRONGEST:
        raise InputError(
            f"would pull with {1e-3 * strength:.3g} kN at {1e-5 * _PRESSURE:g} bar: no clamps made by hand "
            "hold that",
            field="bore",
            value=given["bore"],
            allowed=f"up to {1e-3 * _STRONGEST:g} kN: a smaller bore or a larger braid angle",
        )
    return q


def _quantity(name: str, text: str) -> float:
    unit, allowed, low, high, closed = _RANGES[name]
    number = quantity_at(name, text, unit, allowed=allowed)
    if name == "braid_angle" and number >= _NEUTRAL:
        problem = f"a braid of {math.degrees(_NEUTRAL):.1f} deg or more does not shorten when it is filled"
        raise InputError(problem, field=name, value=text, allowed=allowed)
    if not (low <= number if closed else low < number) or not number <= high:
        raise InputError("is out of range", field=name, value=text, allowed=allowed)
    return number

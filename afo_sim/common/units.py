"""Quantities with units from text ("4 bar", "21.5 cm"), and physical constants in SI."""

import functools
import math
import re
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from math import pi
from numbers import Real

from afo_sim.common.errors import InputError
from afo_sim.common.magnitude import UNITS, magnitudes
from afo_sim.common.open_types import Foreign

GRAVITY = 9.80665  # standard gravity [m/s²]
LEAST_NUMBER = 1e3  # of a gauge pressure given as a bare number [Pa]: a smaller one was meant in bar
AMBIENT_PRESSURE = 101_325.0  # [Pa], absolute
AMBIENT_TEMPERATURE = 293.15  # [K]
GAS_CONSTANT = 287.05  # of dry air [J/(kg·K)]
HEAT_CAPACITY_RATIO = 1.4  # of dry air [-]
STANDARD_DENSITY = 1.185  # ISO 8778 reference atmosphere (ANR): air at 20 °C, 1 bar, 65 % humidity [kg/m³]
NORMAL_DENSITY = 1.293  # DIN 1343 normal conditions: dry air at 0 °C, 1.01325 bar [kg/m³]

EXAMPLES = {unit: example for unit, (example, _, _) in UNITS.items()}
_NUMBER_AND_UNIT = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf))\s*([^\W\d_°][\w°^*/()·\s-]*|°\w*)\s*$"
)
_TOWER = re.compile(r"(?:\^|\*\*)\s*-?(?:\d{3}|\d+\s*(?:\^|\*\*))|.{60}")  # powers of powers, or a novel


@functools.cache
def _registry() -> Foreign:
    import pint  # here and not above: it takes a third of a second

    registry = pint.UnitRegistry()
    registry.define("degree = π / 180 * radian = ° = deg = degrees")
    return registry


def parse_quantity(value: object, unit: str) -> float:
    """Read a quantity and return its magnitude in `unit`."""
    example = f'write it like "{EXAMPLES.get(unit, "1 " + unit)}"'
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise ValueError(f"is not a quantity; {example}")
    if unit == "":
        try:
            number = float(value)
        except ValueError:
            raise ValueError("is not a number, and this field has no unit") from None
        except OverflowError:  # a whole number beyond any float
            number = math.inf
        return _plausible(number, unit)
    if not isinstance(value, str) or _is_number(value):
        raise ValueError(f"has no unit; {example}")
    return _plausible(_convert(value, unit, example), unit)


def quantity_at(field: str, text: Foreign, unit: str, **others: Foreign) -> float:
    """A quantity in SI `unit`; what is wrong with it names the field, and what else is known of it."""
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(str(error), field=field, value=text, **others) from None


def si(value: Foreign, unit: str, field: str, allowed: str = "") -> float:
    """An argument in SI: a number as it is, a text or a number that knows its unit converted."""
    if own := getattr(value, "unit", ""):
        value = f"{float(value)!r} {own}"
    number = isinstance(value, Real) and not isinstance(value, bool)
    return float(value) if number else quantity_at(field, value, unit, allowed=allowed)


def gauge(value: Foreign, field: str = "pressure") -> float:
    """A gauge pressure [Pa], a number or with its unit; a number that was meant in bar is refused."""
    if isinstance(value, Real) and 0.0 < float(value) < LEAST_NUMBER:
        problem = "is a number of Pa: was it meant in bar?"
        raise InputError(problem, field=field, value=value, allowed='"4 bar"')
    return si(value, "Pa", field)


def format_quantity(value: float, unit: str) -> str | float:
    """The exact text of an SI value, as `parse_quantity` reads it again."""
    return f"{float(value)!r} {unit}" if unit else float(value)


Dimension = tuple[tuple[str, float], ...]  # base units and their exponents, sorted by name


def dimension(unit: str) -> Dimension:
    """The dimension of a unit, as base units with exponents; angles differ from bare numbers."""
    return _dimension(_registry().Quantity(1.0, unit))


def read_any_quantity(text: str) -> tuple[float, Dimension]:
    """A quantity of whatever dimension: its magnitude in the SI unit, and what it measures."""
    example = 'write it like "4 bar"'
    if _is_number(text):
        raise ValueError(f"has no unit; {example}")
    found = _dimension(_read(text, example))
    unit = _si_units().get(found)
    if unit is None:
        return _plausible(float(_read(text, example).to_base_units().magnitude)), found
    return parse_quantity(text, unit), found  # to the last digit as a field of that unit reads it


@functools.cache
def _si_units() -> dict[Dimension, str]:
    return {dimension(unit): unit for unit in EXAMPLES if unit}


def _dimension(quantity: Foreign) -> Dimension:
    items = quantity.to_base_units().unit_items()
    return tuple(sorted((str(name), float(power)) for name, power in items if power))


def is_si(unit: str) -> bool:
    """Whether a unit is SI's own: 1 of it is 1 in base units."""
    with suppress(Exception):  # whatever pint raises of what is no unit
        return bool(abs(_registry().Quantity(1.0, unit).to_base_units().magnitude - 1.0) < 1e-12)
    return False


def in_unit(value: float, si_unit: str, unit: str) -> float:
    """Convert `value` from `si_unit` to `unit`, for people's eyes."""
    known = factor(si_unit, unit)
    if known is not None:
        return float(value * known)
    return float(_registry().Quantity(value, si_unit).to(unit).magnitude)


@functools.lru_cache(maxsize=4096)  # the cases of a sweep share most of their texts
def _convert(text: str, unit: str, example: str) -> float:
    parts = _NUMBER_AND_UNIT.match(text)
    if parts is not None and parts[2] == unit:
        return float(parts[1])
    known = factor(parts[2], unit) if parts is not None and not _TOWER.search(parts[2]) else None
    if parts is not None and known is not None:
        return float(parts[1]) * known
    import pint  # not for the usual units, which are converted before

    quantity = _read(text, example)
    try:
        return float(quantity.to(unit).magnitude)
    except pint.DimensionalityError as error:
        raise ValueError(f"is in {error.units1}, which does not convert to {unit}; {example}") from None
    except Exception:  # what pint makes of a strange unit
        raise ValueError(f"is not a quantity; {example}") from None


def _read(text: str, example: str) -> Foreign:
    """Text as pint's quantity."""
    import pint

    # a number and a unit, nothing that pint would evaluate: "4,2 bar" is 42 bar to it
    parts = _NUMBER_AND_UNIT.match(text)
    if parts is None or _TOWER.search(parts[2]):
        raise ValueError(f"is not a quantity, a number and its unit; {example}")
    try:
        return _registry().Quantity(float(parts[1]), parts[2])
    except pint.UndefinedUnitError as error:
        names = [error.unit_names] if isinstance(error.unit_names, str) else error.unit_names
        raise ValueError(f"has the unknown unit {', '.join(map(repr, names))}; {example}") from None
    except Exception:  # pint lets tokenizer, syntax and type errors of the text through
        raise ValueError(f"is not a quantity; {example}") from None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _plausible(value: float, unit: str | None = None) -> float:
    """A value that is not beyond what something of its unit can have."""
    largest = magnitudes(unit)[1]
    if not math.isfinite(value):
        raise ValueError("is not finite")
    if abs(value) > largest:
        raise ValueError(f"is beyond ±{largest:g}{f' {unit}' if unit else ''}, which nothing is")
    return value


# Factors between the units that descriptions are written in, as pint computes them, to the last digit. pint
# reads a file of a thousand units for most of a second before it converts the first number. What stands in
# the tables below needs none of them; for any other text there is no factor here, and pint decides.
_Powers = dict[str, int]  # units and their exponents; their order is that in which factors are multiplied

_PREFIXES = {"u": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "h": 1e2, "k": 1e3, "M": 1e6}
BASES = ("m", "s", "g", "K", "rad")
_PREFIXED = ("m", "s", "g", "N", "Pa", "bar", "J", "W", "Hz", "l")
# {unit: (scale, units that it is made of)}, divided as pint divides them: this decides the last digit
_MADE: dict[str, tuple[float, _Powers]] = {
    "deg": (1.0 / 180.0, {"π": 1, "rad": 1}), "π": (pi, {}), "N": (1.0, {"kg": 1, "m": 1, "s": -2}),
    "Pa": (1.0, {"N": 1, "m": -2}), "bar": (1e5, {"Pa": 1}), "J": (1.0, {"N": 1, "m": 1}),
    "W": (1.0, {"J": 1, "s": -1}), "Hz": (1.0, {"s": -1}), "l": (1.0, {"dm": 3}), "min": (60.0, {"s": 1}),
    "h": (60.0, {"min": 1}), "percent": (0.01, {}),
}  # fmt: skip
_MADE |= {
    mark + unit: (scale, {unit: 1})
    for unit in _PREFIXED
    for mark, scale in _PREFIXES.items()
    if mark + unit != "hbar"  # Planck's constant to pint
}
_FACTOR = re.compile(
    r"(?P<operator>[*/]?)(?P<opens>\(?)"
    r"(?P<name>[A-Za-zµμ]+|°)(?:(?:\^|\*\*)(?P<power>-?[1-9])(?!\d))?(?P<closes>\)?)"
)
_MICRO = re.compile("^[µμ]")


@functools.lru_cache(maxsize=4096)
def factor(unit: str, into: str) -> float | None:
    """Number by which an amount in `unit` is multiplied to have it in `into`."""
    source, target = _units_of(unit), _units_of(into)
    if source is None or target is None:
        return None
    quotient = Counter(source)
    quotient.subtract(target)
    above, below, bases = Counter[float](), Counter[float](), Counter[str]()
    _take_apart({name: power for name, power in quotient.items() if power}, 1, above, below, bases)
    if any(power for name, power in bases.items() if name != "rad"):  # an angle is a bare number
        return None
    product = 1.0
    for scale, exponent in (above - below).items():  # what stands above and below cancels
        product *= scale**exponent
    for scale, exponent in (below - above).items():
        product *= scale**-exponent
    return product


def _units_of(text: str) -> _Powers | None:
    """The units of a text in their order; None where one is unknown or comes twice, or the form is odd."""
    found: _Powers = {}
    place, within = 0, 0  # sign of the brackets that are open, 0 where none are
    while place < len(text):
        part = _FACTOR.match(text, place)
        if part is None or bool(part["operator"]) != bool(place):
            return None
        sign = -1 if part["operator"] == "/" else 1
        if part["opens"]:
            if within:
                return None
            within, sign = sign, 1
        name = _MICRO.sub("u", part["name"]).replace("°", "deg")
        if name in found or not (name in BASES or name in _MADE):
            return None
        found[name] = (within or 1) * sign * int(part["power"] or 1)
        if part["closes"]:
            if not within:
                return None
            within = 0
        place = part.end()
    return found if found and not within else None


def _take_apart(
    units: Mapping[str, int], power: int, above: Counter[float], below: Counter[float], bases: Counter[str]
) -> None:
    """Add the scales of units, and of those that they are made of, to numerator and denominator."""
    for name, exponent in units.items():
        total = power * exponent
        if name in BASES:
            bases[name] += total
            continue
        scale, parts = _MADE[name]
        (below if total < 0 else above)[scale] += abs(total)
        _take_apart(parts, total, above, below, bases)

"""Factors between the units that descriptions are written in, as pint computes them, to the last digit.

pint reads a file of a thousand units for most of a second before it converts the first number. What stands
in the tables below needs none of them; for any other text there is no factor here, and pint decides.
"""

import functools
import re
from collections.abc import Mapping
from math import pi

Powers = dict[str, int]  # units and their exponents; the order tells in which order factors are multiplied

PREFIXES = {"u": 1e-6, "m": 1e-3, "c": 1e-2, "d": 1e-1, "h": 1e2, "k": 1e3, "M": 1e6}
BASES = ("m", "s", "g", "K", "rad")
_PREFIXED = ("m", "s", "g", "N", "Pa", "bar", "J", "W", "Hz", "l")
# {unit: (scale, units that it is made of)}, divided as pint divides them: this decides the last digit
_MADE: dict[str, tuple[float, Powers]] = {
    "deg": (1.0 / 180.0, {"π": 1, "rad": 1}),
    "π": (pi, {}),
    "N": (1.0, {"kg": 1, "m": 1, "s": -2}),
    "Pa": (1.0, {"N": 1, "m": -2}),
    "bar": (1e5, {"Pa": 1}),
    "J": (1.0, {"N": 1, "m": 1}),
    "W": (1.0, {"J": 1, "s": -1}),
    "Hz": (1.0, {"s": -1}),
    "l": (1.0, {"dm": 3}),
    "min": (60.0, {"s": 1}),
    "h": (60.0, {"min": 1}),
    "percent": (0.01, {}),
}
_MADE |= {
    mark + unit: (scale, {unit: 1})
    for unit in _PREFIXED
    for mark, scale in PREFIXES.items()
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
    source, target = _read(unit), _read(into)
    if source is None or target is None:
        return None
    quotient = dict(source)
    for name, power in target.items():
        quotient[name] = quotient.get(name, 0) - power
    above: dict[float, int] = {}
    below: dict[float, int] = {}
    bases = dict.fromkeys(BASES, 0)
    _take_apart({name: power for name, power in quotient.items() if power}, 1, above, below, bases)
    if any(power for name, power in bases.items() if name != "rad"):  # an angle is a bare number
        return None
    return _multiplied(above, below)


def _read(text: str) -> Powers | None:
    """The units of a text in their order; None where one is unknown or comes twice, or the form is odd."""
    found: Powers = {}
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
    units: Mapping[str, int], power: int, above: dict[float, int], below: dict[float, int], bases: Powers
) -> None:
    """Add the scales of units, and of those that they are made of, to numerator and denominator."""
    for name, exponent in units.items():
        total = power * exponent
        if name in bases:
            bases[name] += total
            continue
        scale, parts = _MADE[name]
        side = below if total < 0 else above
        side[scale] = side.get(scale, 0) + abs(total)
        _take_apart(parts, total, above, below, bases)


def _multiplied(above: dict[float, int], below: dict[float, int]) -> float:
    """The product of scales, after those that stand above and below have cancelled."""
    for scale in list(above):
        common = min(above[scale], below.get(scale, 0))
        if common:
            above[scale] -= common
            below[scale] -= common
    product = 1.0
    for scale, exponent in above.items():
        if exponent:
            product *= scale**exponent
    for scale, exponent in below.items():
        if exponent:
            product *= scale**-exponent
    return product

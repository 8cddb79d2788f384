"""Quantities from text and back, refusals, and the factors between units against pint."""

import json
import math
import random
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from afo_sim.common import EXAMPLES, assets, format_quantity, in_unit, magnitudes, parse_quantity, units
from afo_sim.common.units import _registry, factor


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("4 bar", "Pa", 4e5),
        ("4bar", "Pa", 4e5),
        ("400 kPa", "Pa", 4e5),
        ("0.4 MPa", "Pa", 4e5),
        ("14.5 psi", "Pa", 14.5 * 4.4482216152605 / 0.0254**2),  # pound-force per square inch
        ("21.5 cm", "m", 0.215),
        ("-3 mm", "m", -0.003),
        ("180 deg", "rad", math.pi),
        ("22°", "rad", 22.0 * math.pi / 180.0),
        ("0.055 dm^3/(s*bar)", "m^3/(s*Pa)", 0.055e-8),  # 1 dm³/(s·bar) = 1e-8 m³/(s·Pa)
        ("3 ml", "m^3", 3e-6),
        ("2e-4 m^2*s", "m^2*s", 2e-4),
        ("1 kHz", "Hz", 1000.0),
        ("4 ms", "s", 0.004),
        ("2 min", "s", 120.0),
        ("80 g", "kg", 0.08),
        ("20 kN", "N", 20e3),
        ("1 N*m*s/deg", "N*m*s/rad", 180.0 / math.pi),
        ("0.3", "", 0.3),
        (0.3, "", 0.3),
        (1, "", 1.0),
    ],
)
def test_reads(text, unit, expected):
    assert parse_quantity(text, unit) == pytest.approx(expected, rel=1e-14)


def test_one_degree_of_text_is_math_radians():
    # Bit for bit, so that a muscle read from "22 deg" is the muscle made with math.radians(22).
    for degrees in (1.0, 22.0, 37.0, 54.74):
        assert parse_quantity(f"{degrees!r} deg", "rad") == math.radians(degrees)


@pytest.mark.parametrize(
    ("value", "unit", "complaint"),
    [
        (4, "Pa", "has no unit"),
        (4.0, "Pa", "has no unit"),
        ("4", "Pa", "has no unit"),
        ("4e5", "Pa", "has no unit"),
        ("nan", "Pa", "has no unit"),
        (math.nan, "Pa", "has no unit"),
        ("4 barr", "Pa", "unknown unit 'barr'"),
        ("4 Bar", "Pa", "unknown unit 'Bar'"),
        ("4 m", "Pa", "does not convert to Pa"),
        ("4 bar", "m", "does not convert to m"),
        ("4 s", "Hz", "does not convert to Hz"),
        ("nan bar", "Pa", "not finite"),
        ("inf bar", "Pa", "not finite"),
        ("-inf bar", "Pa", "not finite"),
        ("1e400 m", "m", "not finite"),
        ("", "Pa", "is not a quantity"),
        (" ", "Pa", "is not a quantity"),
        ("4 bar)", "Pa", "is not a quantity"),
        ("1/0 m", "m", "is not a quantity"),
        ("four bar", "Pa", "is not a quantity"),
        # pint alone would read these as 42 bar, 16 bar, 12 m, 1 bar, π m and 8 m
        ("4,2 bar", "Pa", "is not a quantity"),
        ("4 4 bar", "Pa", "is not a quantity"),
        ("[1,2] m", "m", "is not a quantity"),
        ("bar", "Pa", "is not a quantity"),
        ("pi m", "m", "is not a quantity"),
        ("2**3 m", "m", "is not a quantity"),
        ("4 bar # gauge", "Pa", "is not a quantity"),
        ("9 m**9**9**9", "m", "is not a quantity"),  # would take for ever
        (True, "Pa", "is not a quantity"),
        (None, "Pa", "is not a quantity"),
        ([4], "Pa", "is not a quantity"),
        (b"4 bar", "Pa", "is not a quantity"),
        (True, "", "is not a quantity"),
        (None, "", "is not a quantity"),
        ("", "", "is not a number"),
        ("4 bar", "", "is not a number"),
        ("many", "", "is not a number"),
        (math.nan, "", "not finite"),
        ("inf", "", "not finite"),
    ],
)
def test_refuses(value, unit, complaint):
    with pytest.raises(ValueError, match=complaint):
        parse_quantity(value, unit)


@pytest.mark.parametrize("unit", EXAMPLES)
def test_the_example_shown_on_refusal_is_itself_read(unit):
    assert parse_quantity(EXAMPLES[unit], unit) > 0.0
    if unit:
        with pytest.raises(ValueError) as refusal:
            parse_quantity(4.0, unit)
        assert EXAMPLES[unit] in str(refusal.value)


@pytest.mark.slow
@pytest.mark.parametrize("unit", EXAMPLES)
@settings(derandomize=True, deadline=None, max_examples=60)
@given(data=st.data())
def test_writing_and_reading_again_is_exact(unit, data):
    least, largest = magnitudes(unit)
    value = data.draw(st.floats(least, largest) | st.floats(-largest, -least))
    assert parse_quantity(format_quantity(value, unit), unit) == value


@pytest.mark.parametrize("unit", EXAMPLES)
def test_what_nothing_can_have_is_refused(unit):
    least, largest = magnitudes(unit)
    assert magnitudes(None)[0] < least < 1.0 < largest <= magnitudes(None)[1] or unit == "m^3/(s*Pa)"
    for sign in (-1.0, 1.0):
        assert parse_quantity(format_quantity(sign * least, unit), unit) == sign * least
        with pytest.raises(ValueError, match="is beyond ±"):
            parse_quantity(format_quantity(sign * 1.01 * largest, unit), unit)


def test_in_unit():
    assert in_unit(4e5, "Pa", "bar") == pytest.approx(4.0, rel=1e-15)
    assert in_unit(math.pi, "rad", "deg") == pytest.approx(180.0, rel=1e-15)
    assert in_unit(0.055e-8, "m^3/(s*Pa)", "dm^3/(s*bar)") == pytest.approx(0.055, rel=1e-14)


def test_constants():
    assert units.GRAVITY == 9.80665  # 3rd CGPM, 1901
    assert units.AMBIENT_PRESSURE == 101_325.0  # standard atmosphere
    assert units.AMBIENT_TEMPERATURE == 20.0 + 273.15  # ISO 6358 reference
    assert units.STANDARD_DENSITY == 1.185  # ISO 8778
    # dry air: the molar gas constant (SI 2019) over 28.965 g/mol; and a diatomic gas
    assert abs(units.GAS_CONSTANT - 8.31446261815324 / 28.965e-3) < 0.005
    assert abs(units.HEAT_CAPACITY_RATIO - 7.0 / 5.0) < 1e-15


# Units of one dimension that descriptions are written in.
ALIKE = (
    ("m", "mm", "cm", "dm", "km", "um", "µm"),
    ("s", "ms", "us", "min", "h"),
    ("g", "kg", "mg"),
    ("N", "kN", "mN"),
    ("Pa", "hPa", "kPa", "MPa", "bar", "mbar"),
    ("rad", "deg", "°", "percent"),
    ("l", "ml", "dl"),
    ("J", "kJ"),
    ("W", "mW", "kW"),
    ("Hz", "kHz"),
    ("K",),
)
QUANTITY = re.compile(r"([+-]?[\d.]+(?:e[+-]?\d+)?) ?([^\W\d_°][\w^*/()-]*|°)")


def by_pint(number: float, unit: str, into: str) -> float:
    """A number in another unit, as a registry of pint's computes it that has converted nothing before."""
    registry = _registry()
    for cache in (registry._cache.root_units, registry._cache.conversion_factor):
        cache.clear()
    return registry.Quantity(number, unit).to(into).magnitude


def texts(table: Any) -> Iterator[str]:
    """All texts of a TOML table."""
    if isinstance(table, str):
        yield table
    elif isinstance(table, dict | list):
        for item in table.values() if isinstance(table, dict) else table:
            yield from texts(item)


def shipped() -> list[tuple[float, str]]:
    """Every quantity of the shipped files."""
    found = set()
    kept = assets.folder("models").rglob("*.toml")
    for path in (path for path in kept if path.parent.name != "validation"):  # whose tests are called "40t"
        for text in texts(tomllib.loads(path.read_text(encoding="utf-8"))):
            if match := QUANTITY.fullmatch(text):
                found.add((float(match[1]), match[2]))
    return sorted(found)


def test_every_shipped_quantity_is_converted_as_pint_does() -> None:
    quantities = shipped()
    assert len({unit for _, unit in quantities}) > 25
    dimensions = {unit: _registry().Quantity(1.0, unit).dimensionality for unit in EXAMPLES if unit}
    for number, unit in quantities:
        of_unit = _registry().Quantity(1.0, unit).dimensionality
        for into in [si for si, dimension in dimensions.items() if dimension == of_unit]:
            assert factor(unit, into) is not None, (unit, into)
            assert parse_quantity(f"{number!r} {unit}", into) == by_pint(number, unit, into), (
                number,
                unit,
                into,
            )


@pytest.mark.slow
def test_products_quotients_and_powers_are_converted_as_pint_does() -> None:
    rng = random.Random(1)
    powers = ("", "", "", "", "^2", "**2", "^3", "^-1", "^-2")

    def product() -> str:
        chosen = rng.sample(ALIKE, rng.randint(1, 3))
        parts = [f"{rng.choice(units)}{rng.choice(powers)}" for units in chosen]
        return "".join(rng.choice("*/") + part for part in parts)[1:]

    def other(name: re.Match[str]) -> str:
        return rng.choice(next(units for units in ALIKE if name[0] in units))

    known = 0
    for _ in range(2000):
        unit = product() + (f"{rng.choice('*/')}({product()})" if rng.random() < 0.5 else "")
        into = re.sub("[a-zA-Zµ]+|°", other, unit)
        found = factor(unit, into)
        if found is not None:
            number = rng.uniform(-10.0, 10.0) * 10.0 ** rng.randint(-8, 8)
            assert number * found == by_pint(number, unit, into), (unit, into)
            known += 1
    assert known > 500


@pytest.mark.slow
def test_every_unit_of_the_tables_is_pints() -> None:
    from afo_sim.common.units import _MADE, BASES

    for unit in {*BASES, *_MADE} - {"π"}:
        base = _registry().Quantity(1.0, unit).to_base_units()
        si = next((si for si in [*EXAMPLES, "K", "J", "W"] if si and base.is_compatible_with(si)), None)
        if si is not None:
            assert factor(unit, si) == by_pint(1.0, unit, si)


@pytest.mark.parametrize(
    "unit",
    [
        *("", "4", "barr", "psi", "degC", "hbar", "kilogram", "k", "µ", "π", "kmin", "mdeg", "min_", "N m"),
        *("N*m/m", "N**", "N^0", "N^12", "N**2**2", "(N", "N)", "N*(m*(s))", "*N", "N//m", "1/s", "m²"),
    ],
)
def test_any_other_text_is_left_to_pint(unit: str) -> None:
    assert factor(unit, unit) is None


@pytest.mark.parametrize(("unit", "into"), [("bar", "m"), ("s", "Hz"), ("N*m", "N"), ("g", "N"), ("K", "s")])
def test_another_dimension_is_left_to_pint(unit: str, into: str) -> None:
    assert factor(unit, into) is None


def test_an_angle_is_a_bare_number() -> None:
    """SI: a radian is one metre per metre."""
    assert factor("rad/s", "s^-1") == 1.0
    assert factor("percent", "rad") == 0.01


def test_reading_a_scenario_imports_nothing_heavy() -> None:
    heavy = ("mujoco", "numba", "llvmlite", "scipy", "pint", "rerun", "pyarrow", "pandas", "matplotlib")
    program = (
        "import json, sys, afo_sim\n"
        f"afo_sim.load('scenario', 'seated')\nprint(json.dumps([m for m in {heavy} if m in sys.modules]))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == []

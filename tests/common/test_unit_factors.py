"""Conversion without pint's registry: the same numbers as pint's, to the last bit."""

import json
import random
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest

from afo_sim.common import assets
from afo_sim.common.units import EXAMPLES, _registry, factor, parse_quantity

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
    for path in assets.folder("models").rglob("*.toml"):
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

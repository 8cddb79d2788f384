"""Every number of a description is finite, and 0 or of a magnitude that something has."""

from collections.abc import Iterator
from typing import Any

import pytest

from afo_sim import run
from afo_sim.common import (
    AMBIENT_PRESSURE,
    EXAMPLES,
    STANDARD_DENSITY,
    InputError,
    format_quantity,
    magnitudes,
)
from afo_sim.description import SETS, Quantity, fields_of, load, tables
from afo_sim.description.schema import SPECS, quantity_of

SEATED = "orthosis.chamber.dorsiflexor"
MUSCLE = "orthosis.muscle.dorsiflexor.type"


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        (f"{SEATED}.inlet.conductance", "1e-30 m^3/(s*Pa)", "more than 0 .*; below 1e-07 dm.* it is 0"),
        (f"{SEATED}.inlet.orifice", "1e-9 m", "conductance: is out of range"),
        (f"{SEATED}.wall_conductance", "1e308 W/K", r"is beyond ±1e\+06 W/K"),
        (f"{SEATED}.tube_volume", "1e308 km^3", "is not finite"),
        (f"{MUSCLE}.bore", "5e-324 m", "more than 0 .*below 1e-08 cm it is 0"),
        (f"{MUSCLE}.laws.tondu_lopez_2000.k", 1e308, "is beyond"),
        ("record_rate", "5e-324 Hz", "more than 0 .*below 1e-06 Hz it is 0"),
        ("duration", "1e308 s", "is beyond"),
        ("duration", "1e5 s", "more than one run can hold; allowed: at most 40000 s"),
        ("timestep", "1e-300 s", "at least 1e-06 s"),
        ("load_moment", "nan N*m", "is not finite"),
    ],
)
def test_a_value_that_nothing_has_is_one_message(key: str, value: str | float, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        load("scenario", "seated", {key: value})
    assert {key.rpartition(".")[2], "conductance"} & set(caught.value.field.split("."))


def test_a_rest_of_rounding_is_zero() -> None:
    for unit in EXAMPLES:
        least, read = magnitudes(unit)[0], Quantity(unit).read
        assert [read(format_quantity(x * least, unit)) for x in (-1.0, -0.99, 0.99, 1.0)] == [
            -least,
            0,
            0,
            least,
        ]
    assert load("scenario", "seated", {"load_moment": "1e-17 N*m"}).load_moment == 0.0


def test_the_least_conductance_gives_a_bottle_many_cycles_but_not_endless_ones() -> None:
    """A choked path passes ṁ = ρ₀ C p (ISO 6358), to which an empty chamber is no counterpressure."""
    least = magnitudes("m^3/(s*Pa)")[0]
    scenario = load(
        "scenario", "seated", {f"{SEATED}.inlet.conductance": f"{least} m^3/(s*Pa)", "duration": "8 s"}
    )
    opened = sum(end - start for start, end in scenario.timer.chambers["dorsiflexor"].inlet)
    flow = STANDARD_DENSITY * least * (scenario.supply.pressure + AMBIENT_PRESSURE)  # [kg/s]
    found = run(scenario).metrics
    assert found["air_per_cycle_dorsiflexor"] == pytest.approx(1e3 * flow * opened, rel=1e-3)
    assert found["cycles_per_bottle"] < 1e12


def _numbers(kind: Any, seen: set[Any]) -> Iterator[tuple[str, Quantity]]:
    """Every field of a description, and of what stands below it, that is one number."""
    if kind not in seen:
        seen.add(kind)
        for law in SETS.get(kind, [""]):
            for name, leaf in fields_of(kind, law).items():
                inner, many = tables(leaf.annotation)
                if many:
                    yield from _numbers(inner, seen)
                elif (quantity := quantity_of(leaf.annotation)) is not None:
                    yield f"{kind.__name__} {law} {name}", quantity


@pytest.mark.parametrize("kind", SPECS)
def test_every_number_has_bounds_that_something_can_have(kind: str) -> None:
    found = dict(_numbers(SPECS[kind], set()))
    assert found
    for name, quantity in found.items():
        least, largest = magnitudes(quantity.unit)
        assert magnitudes(quantity.unit) != magnitudes(None), name
        assert quantity.at_most is not None, name
        for bound in (quantity.above, quantity.at_least, quantity.at_most):
            assert not bound or least <= abs(bound) <= largest, name

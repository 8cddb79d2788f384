"""One access to a field by its dotted key: value, unit and bounds."""

import math

import pytest

from afo_sim.description.keys import field_at
from afo_sim.description.reader import load
from afo_sim.lab.fitting.run_parameter import KINDS, find_parameters

SCENARIO = load("scenario", "walk-dropfoot-afo")
TIMES = SCENARIO.phases.chambers["dorsiflexor"]


@pytest.mark.parametrize(
    ("key", "value", "unit", "bounds"),
    [
        ("leg.friction", SCENARIO.leg.friction, "N*m", (0.0, 100.0)),
        ("supply.pressure", SCENARIO.supply.pressure, "Pa", None),
        ("gait.seed", SCENARIO.gait.seed, "", (-math.inf, math.inf)),
        (
            "phases.dorsiflexor.inlet[0][1]",
            SCENARIO.phases.chambers["dorsiflexor"].inlet[0][1],
            "",
            (0.0, 1.0),
        ),
        (
            "orthosis.chamber.dorsiflexor.inlet.conductance",
            SCENARIO.orthosis.chamber["dorsiflexor"].inlet.conductance,
            "m^3/(s*Pa)",
            (0.0, 1e-6),
        ),
    ],
)
def test_a_field_says_value_unit_and_bounds(
    key: str, value: object, unit: str, bounds: tuple[float, float] | None
) -> None:
    field = field_at(key, SCENARIO)
    assert field.value == value
    assert field.unit == unit
    assert bounds is None or field.bounds == bounds


def test_what_a_fit_searches_lies_within_what_its_field_allows() -> None:
    for name, kind in KINDS.items():
        if not kind.key:
            continue
        (parameter,) = find_parameters([name], SCENARIO)
        for key in parameter.keys:
            field = field_at(key, SCENARIO)
            low, high = field.bounds
            assert low <= kind.lower < kind.upper <= high, name
            assert parameter.kind.unit == field.unit
        assert parameter.start == field_at(next(iter(parameter.keys)), SCENARIO).value

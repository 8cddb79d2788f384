"""References over time: sine, chirp, table, column; and what cannot be one."""

import math
from typing import Any

import pytest
from control.samples import Sample

from afo_sim.control.tracking import cycles, target, value_at
from afo_sim.description import PressureReference, Reference

SEEN = Sample(0.25, 0.01, {"gait/ankle_angle": 0.12})


def test_a_sine_has_mean_amplitude_and_frequency() -> None:
    sine = Reference.model_validate({"mean": "1 deg", "amplitude": "5 deg", "frequency": "0.5 Hz"})
    for time, expected in ((0.0, 1.0), (0.5, 6.0), (1.0, 1.0), (1.5, -4.0), (20.5, 6.0)):
        assert math.degrees(value_at(sine, time)) == pytest.approx(expected, abs=1e-9)


def test_no_reference_is_zero() -> None:
    assert value_at(Reference(), 3.0) == 0.0


def test_a_chirp_has_its_frequencies_and_no_jump() -> None:
    """The frequency is the slope of the cycles: f0 at the start, geometric between, f1 from the end on."""
    chirp = Reference.model_validate(
        {"amplitude": "1 deg", "frequency": "0.2 Hz", "end_frequency": "3.2 Hz", "sweep_time": "8 s"}
    )
    for time, frequency in ((1e-6, 0.2), (4.0, 0.8), (8.0 - 1e-5, 3.2), (9.0, 3.2)):
        slope = (cycles(chirp, time + 1e-6) - cycles(chirp, time - 1e-6)) / 2e-6
        assert slope == pytest.approx(frequency, rel=1e-4)
    assert cycles(chirp, 8.0 + 1e-9) - cycles(chirp, 8.0 - 1e-9) == pytest.approx(6.4e-9, rel=1e-3)


@pytest.mark.parametrize(
    ("between", "expected"), [("hold", [1.0, 1.0, 1.0, 3.0, 3.0]), ("line", [1.0, 1.0, 2.0, 3.0, 3.0])]
)
def test_a_table_holds_or_runs_straight(between: str, expected: list[float]) -> None:
    table = [["1 s", "1 bar"], ["3 s", "3 bar"]]
    steps = PressureReference.model_validate({"table": table, "between": between})
    found = [value_at(steps, time) * 1e-5 for time in (0.0, 1.0, 2.0, 3.0, 9.0)]
    assert found == pytest.approx(expected)


def test_a_column_is_followed() -> None:
    assert target(Reference(column="gait/ankle_angle"), SEEN) == 0.12
    assert target(Reference().with_values(mean=0.3), SEEN) == 0.3


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"column": "ankle/angle", "amplitude": "1 deg"}, "conflicts with a sine or a table"),
        ({"table": [["0 s", "1 deg"]], "mean": "1 deg"}, "conflicts with a sine"),
        ({"end_frequency": "2 Hz"}, "sweep_time|a chirp has both"),
        ({"sweep_time": "2 s"}, "a chirp has both"),
        ({"table": [["1 s", "1 deg"], ["1 s", "2 deg"]]}, "times that do not rise"),
        ({"amplitude": "1 bar"}, "does not convert to rad"),
        ({"amplitude": 5}, "has no unit"),
    ],
)
def test_what_is_no_reference(table: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        Reference.model_validate(table)

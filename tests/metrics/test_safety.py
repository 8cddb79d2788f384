"""Safety margins of pulls, pressures and limits that are known by hand."""

import math
from typing import Any

import numpy as np
import pytest

from afo_sim.metrics import Metric
from afo_sim.metrics.metric import all_measured
from afo_sim.metrics.muscle_limits import cycles, life_metrics, muscle_metrics
from afo_sim.metrics.skin_pressure import pressures

AREA, FRICTION = 0.015, 0.5  # 150 cm²
LIMITS = (14e3, 53e3), 4e3
TIMESTEP = 5e-3  # [s]


def pull(forward: float, left: float, up: float) -> np.ndarray:
    """A force that rises to its peak for 10 ms, falls, and is greater for an instant (7, 3)."""
    return np.outer([0.5, 1.0, 1.0, 1.0, 0.2, 1.6, 0.2], [forward, left, up])


def pressed(part: str, force: np.ndarray, *given: Any) -> dict[str, Metric]:
    return all_measured(pressures(part, force, TIMESTEP, *given))


def test_a_hundred_newtons_along_the_shank_need_two_hundred_on_the_skin() -> None:
    found = pressed("cuff", pull(0.0, 0.0, -100.0), AREA, FRICTION, *LIMITS)
    assert found["cuff_pull_along"] == 100.0 and found["cuff_pull_across"] == 0.0
    assert found["cuff_holding_force"] == "200 N"
    assert found["cuff_skin_pressure"].value == pytest.approx(200.0 / 0.015 * 1e-3)  # 13.3 kPa
    assert found["cuff_skin_pressure_sustained"] == found["cuff_skin_pressure"]
    assert found["cuff_share_of_discomfort"].value == pytest.approx(100.0 * 13.333333 / 14.0)
    assert found["cuff_share_of_pain"].value == pytest.approx(100.0 * 13.333333 / 53.0)
    assert found["cuff_share_of_blood_flow"].value == pytest.approx(100.0 * 13.333333 / 4.0)


def test_a_pull_at_thirty_degrees_presses_across_and_slides_along() -> None:
    force = 80.0
    found = pressed("cuff", pull(-force * 0.5, 0.0, -force * math.sqrt(0.75)), AREA, FRICTION)
    assert found["cuff_pull_across"].value == pytest.approx(40.0)
    assert found["cuff_holding_force"].value == pytest.approx(138.5640646)
    assert found["cuff_skin_pressure"].value == pytest.approx((138.5640646 + 40.0) / 15.0)
    assert found["cuff_skin_pressure_sustained"].value == pytest.approx(138.5640646 / 15.0)
    assert not any("share" in name for name in found)


def test_the_strap_is_tight_for_the_strongest_pull_whenever_the_pull_across_comes() -> None:
    apart = np.repeat([[0.0, 0.0, -100.0], [30.0, 40.0, 0.0]], 3, axis=0)  # along first, then across
    found = pressed("cuff", apart, AREA, FRICTION)
    assert found["cuff_skin_pressure"].value == pytest.approx((200.0 + 50.0) / 15.0)


@pytest.mark.parametrize("part", ["cuff", "plate"])
def test_pressure_goes_with_the_pull_and_by_the_area(part: str) -> None:
    def pressure(times: float, area: float) -> float:
        return pressed(part, pull(90.0 * times, 0.0, 20.0 * times), area, 0.4)[f"{part}_skin_pressure"].value

    one = pressure(1.0, 0.01)
    assert one > 0.0
    assert (pressure(1.0, 0.02), pressure(2.0, 0.01)) == pytest.approx((0.5 * one, 2.0 * one))
    assert not any(pressed(part, np.zeros((4, 3)), AREA, FRICTION, *LIMITS).values())


def test_a_plate_that_is_pulled_up_steeper_than_the_angle_of_friction_needs_no_strap() -> None:
    angle = math.atan(FRICTION)  # of the pull from the vertical at which friction on the sole is just enough
    for off, needed in ((-0.01, False), (0.01, True)):
        up = pull(-100.0 * math.sin(angle + off), 0.0, 100.0 * math.cos(angle + off))
        assert (pressed("plate", up, 0.006, FRICTION)["plate_holding_force"].value > 0.0) is needed
    along = pressed("plate", pull(-60.0, 0.0, 0.0), 0.006, FRICTION)
    assert along["plate_holding_force"].value == pytest.approx(120.0)
    assert along["plate_skin_pressure"].value == pytest.approx(20.0)
    down = pressed("plate", pull(0.0, 0.0, -30.0), 0.006, FRICTION)  # the strap carries all of it
    assert down["plate_holding_force"].value == pytest.approx(30.0) and down["plate_pull_across"] == 0.0


def test_the_worst_muscle_counts_and_none_is_below_zero() -> None:
    found = dict(muscle_metrics({"force": [0.2, 0.9], "contraction": [-0.3, -0.1], "stretch": []}))
    assert found == {"muscle_share_of_force": 90.0, "muscle_share_of_contraction": 0.0}


def test_a_million_cycles_are_a_million_strides_of_one_filling() -> None:
    found = all_measured(life_metrics(2.0, 1e6, 2000.0))
    assert found["strides_until_muscle_life"] == 5e5 and found["days_until_muscle_life"] == "250 d"
    assert set(dict(life_metrics(0.0, 1e6, 2000.0))) == {"muscle_cycles_per_stride"}
    assert "days_until_muscle_life" not in dict(life_metrics(1.0, 1e6, 0.0))


@pytest.mark.parametrize("start", [0.0, 0.3, 0.7])
@pytest.mark.parametrize(
    ("fillings", "strides", "swing", "expected"),
    [(1, 1, 1.0, 1.0), (2, 1, 1.0, 2.0), (6, 3, 0.3, 2.0), (3, 1, 0.02, 1.0), (0, 2, 0.0, 1.0)],
)
def test_fillings_are_counted_wherever_the_stride_begins(
    start: float, fillings: int, strides: int, swing: float, expected: float
) -> None:
    wave = 0.5 - 0.5 * np.cos(2.0 * np.pi * fillings * (np.linspace(0.0, 1.0, 997, endpoint=False) + start))
    pressure = 4e5 * (1.0 - swing + swing * wave)
    assert cycles(pressure, strides) == expected


def test_a_chamber_that_is_never_filled_has_no_cycles() -> None:
    assert cycles(np.array([0.0, 1e-9, 0.0, 2e-9]), 1) == 0.0

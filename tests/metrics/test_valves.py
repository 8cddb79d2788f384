"""Switchings counted in made-up coils, and the life that follows."""

from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim.metrics.valves import life_metrics, rises, switching_by_the_minute

WALK: dict[str, Any] = {"duration": "5 s", "gait.settled": "walked"}


def columns(coil: list[float], **others: list[float]) -> dict[str, np.ndarray]:
    made = {"valve/a_inlet/coil": np.array(coil), "time": 1e-3 * np.arange(len(coil))}
    return made | {name: np.array(values) for name, values in others.items()}


@pytest.mark.parametrize(
    ("coil", "expected"),
    [
        ([0, 1, 1, 0, 1], [0, 1, 0, 0, 1]),
        ([1, 0, 0, 0, 1], [1, 0, 0, 0, 1]),
        ([0, 0.3, 0, 0.1, 0], [0, 1, 0, 1, 0]),  # within a step
        ([0, 0.3, 1, 0.2, 0], [0, 1, 0, 0, 0]),  # begins and ends within steps
        ([0, 0, 0, 0, 0], [0, 0, 0, 0, 0]),
    ],
)
def test_a_rise_counts_once(coil: list[float], expected: list[float]) -> None:
    assert rises(columns(coil), "a_inlet").tolist() == expected


def test_a_drive_s_own_count_goes_first() -> None:
    """Pulses that fill neighbouring steps in part are two, which the shares cannot tell."""
    made = columns([0.5, 0.5, 0.5, 0.0])
    made["valve/a_inlet/switches"] = np.array([0.0, 1.0, 2.0, 3.0])
    assert rises(made, "a_inlet").tolist() == [1, 1, 1, 0]


def test_by_the_minute() -> None:
    found = dict(switching_by_the_minute(columns([1.0, 0.0] * 500), np.full(1000, 1e-3)))
    assert found == pytest.approx({"switches_per_minute_a_inlet": 500 * 60.0})


def test_the_first_to_its_rating_counts() -> None:
    found = dict(life_metrics({"a": 2.0, "b": 0.5, "c": 9.0}, {"a": 7.2e6, "b": 9e6}))
    assert found == pytest.approx({"hours_until_valve_life": 1000.0})
    assert not dict(life_metrics({"a": 0.0, "c": 1.0}, {"a": 1e6}))


def test_phases_switch_once_a_stride_and_their_valve_lives_as_long() -> None:
    key = "orthosis.chamber.dorsiflexor.inlet.rated_switches"
    run = afo_sim.run("walk-dropfoot-afo-short", WALK | {key: 1e6})
    events = afo_sim.load("scenario", "walk-dropfoot-afo-short").phases.chambers["dorsiflexor"]
    assert run.metrics["switches_per_stride_dorsiflexor_inlet"] == len(events.inlet)
    assert run.metrics["switches_per_stride_dorsiflexor_outlet"] == len(events.outlet)
    hours = 1e6 * run.metrics["stride_time"] / len(events.inlet) / 3600.0
    assert run.metrics["hours_until_valve_life"] == pytest.approx(hours, rel=0.01)


def test_a_timer_switches_by_its_period() -> None:
    """Seated: once each 8 s, whose inlet event is one."""
    run = afo_sim.run("seated", {"duration": "16 s"})
    timer = afo_sim.load("scenario", "seated").timer
    events = len(timer.chambers["dorsiflexor"].inlet) * 16.0 / timer.period
    assert run.metrics["switches_per_minute_dorsiflexor_inlet"] == pytest.approx(60.0 / 16.0 * events)

"""Pace and clock of a walk: its integral, accelerations by the chain rule, shares of steps, refusals."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline

from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.model import Built, why_walked
from afo_sim.model.build import build
from afo_sim.model.muscle_weakness import ground_moment
from afo_sim.model.supply_and_timer import controls
from afo_sim.model.walk import Clock, Pace

STOPPED = [["0.8 s", 1.3], ["2 s", 0.0], ["3.5 s", 0.8]]
CHANGED = {"gait.pace": STOPPED, "gait.pace_change": "0.6 s", "duration": "5 s", "ground.mode": "recorded"}


@pytest.fixture(scope="module")
def built() -> Built:
    return build(load("scenario", "walk-dropfoot-afo", CHANGED))


KNOTS, LEVELS = [-1.0, 0.8, 1.4, 2.0, 2.6, 3.5, 4.1, 9.0], [1.0, 1.0, 1.3, 1.3, 0.0, 0.0, 0.8, 0.8]
SPLINE = CubicHermiteSpline(KNOTS, LEVELS, np.zeros(8))


def factor(time: float) -> float:
    """The factor of `CHANGED`: level pieces joined by cubics without a slope at either end."""
    return float(SPLINE(time))


def test_the_walk_comes_as_far_as_the_integral_of_the_factor() -> None:
    pace = Pace((0.8, 2.0, 3.5), (1.0, 1.3, 0.0, 0.8), 0.6)
    for time in (-0.001, 0.3, 0.8, 1.0, 1.9, 2.2, 3.0, 3.7, 5.0):
        points = [k for k in (0.8, 1.4, 2.0, 2.6, 3.5, 4.1) if k < time] or None
        expected = quad(factor, 0.0, time, points=points, epsabs=1e-12)[0]
        assert pace.walked(np.array([time]))[0] == pytest.approx(expected, abs=1e-10)
    assert pace.stands == ((2.6, 3.5),)
    assert np.ptp(pace.walked(np.linspace(2.6, 3.5, 91))) == 0.0
    assert Pace((1.0, 4.0), (0.0, 1.0, 0.0), 0.5).stands == ((0.0, 1.0), (4.5, math.inf))


def test_an_even_factor_is_another_stride_time() -> None:
    walks = [
        build(load("scenario", "walk-dropfoot-afo", {"duration": "2.4 s", "gait.settled": "walked"} | sets))
        for sets in (
            {"gait.stride_time": "1.2 s", "gait.pace": [["0 s", 1.25]]},
            {"gait.stride_time": "0.96 s"},
        )
    ]
    faster, told = walks
    assert faster.walk.phase == pytest.approx(told.walk.phase, abs=1e-12)
    assert faster.walk.acceleration == pytest.approx(told.walk.acceleration, abs=1e-4)
    assert faster.active.recorded == pytest.approx(told.active.recorded, abs=1e-4)


def test_accelerations_follow_the_chain_rule(built: Built) -> None:
    walk = built.walk
    time = walk.time[1:-1]
    rate = np.array([factor(t) for t in time]) / walk.cycle.stride_time
    fine = 1e-5
    second = np.array([factor(t + fine) - factor(t - fine) for t in time]) / (
        2.0 * fine * walk.cycle.stride_time
    )
    phase = walk.phase[1:-1]
    for column, name in enumerate(("ankle_x", "ankle_z", "shank_angle")):
        series = walk.cycle.series[name]
        expected = second * series(phase, 1) + rate**2 * series(phase, 2)
        most = np.abs(expected).max()
        # second differences are of second order in the step, and a change's ends have a kink of second order
        assert walk.acceleration[:, column] == pytest.approx(expected, abs=2e-3 * most)
        jump = np.abs(np.diff(walk.acceleration[:, column])).max()
        steady = np.abs(np.diff(walk.acceleration[:600, column])).max()
        assert jump < 3.0 * steady * 1.3**3  # no jerk where the pace changes
    ankle = walk.cycle.series["ankle_angle"]
    assert walk.velocity == pytest.approx(rate * ankle(phase, 1), abs=2e-3 * np.abs(walk.velocity).max())


def test_who_stands_needs_the_moment_of_weight_and_ground_alone(built: Built) -> None:
    walk = built.walk
    stands = (walk.time[1:-1] > 2.61) & (walk.time[1:-1] < 3.49)
    assert np.ptp(walk.phase[1:-1][stands]) == 0.0
    assert np.abs(walk.acceleration[stands]).max() == 0.0
    bare = build(load("scenario", "walk-dropfoot", CHANGED))
    # the bare foot has no orthosis: its weight is the foot's own, its toes bent at rest
    still = bare.active.recorded[stands] + ground_moment(bare.walk, bare.body_mass)[stands]
    weight = -bare.foot.gravity_moment(bare.walk.turn)[stands]
    assert np.ptp(still) < 1e-9
    assert still == pytest.approx(weight, abs=0.05)  # bent toes hang higher


def test_valves_follow_the_phase_of_who_stops(built: Built) -> None:
    walk, scenario = built.walk, built.scenario
    control = controls(built)
    assert np.isfinite(control).all()
    phase = walk.phase[1:-1] % 1.0
    for chamber, valves in scenario.phases.chambers.items():
        for side in ("inlet", "outlet"):
            coil = control[:, built.index.valves[f"{chamber}_{side}"]]
            on = np.zeros(len(phase), dtype=bool)
            for start, end in getattr(valves, side):
                inside = (phase >= start) & (phase < end)
                on |= inside if start < end else (phase >= start) | (phase < end)
            whole = (coil == 0.0) | (coil == 1.0)  # an event falls within the other steps
            assert np.count_nonzero(~whole) <= 4 * 8
            assert np.array_equal(coil[whole] == 1.0, on[whole])


@pytest.mark.parametrize(("stands", "on"), [(0.19, 0.0), (0.2, 1.0), (0.3, 1.0), (0.4, 0.0)])
def test_a_valve_of_who_stands_is_on_or_off(stands: float, on: float) -> None:
    clock = Clock.of(np.full(5, 3.0 + stands), np.zeros(5), 1.0)
    rounded = dataclasses.replace(clock, start=(np.full(5, 3.0), np.full(5, stands)))
    assert np.array_equal(rounded.share(((0.2, 0.4),)), np.full(5, on))


def test_strides_of_changing_pace_are_walked() -> None:
    assert "gait.pace" in why_walked(load("scenario", "walk-dropfoot-afo", CHANGED))
    assert not why_walked(load("scenario", "walk-dropfoot-afo"))


@pytest.mark.parametrize(
    "pace",
    [
        [["2 s", 1.1], ["1 s", 0.9]],
        [["1 s", 1.1], ["1.2 s", 0.9]],
        [["1 s", -0.1]],
        [["1 s", 4.0]],
        [["-1 s", 1.0]],
        [["1 s", float("nan")]],
        [["1 m", 1.0]],
        [["1 s"]],
    ],
)
def test_a_pace_that_cannot_be_walked_is_refused(pace: list[list[object]]) -> None:
    with pytest.raises(InputError, match="pace"):
        load("scenario", "walk-dropfoot-afo", {"gait.pace": pace})


def test_a_stop_in_swing_and_a_change_after_the_end_are_warned_of() -> None:
    swing = build(load("scenario", "walk-dropfoot", {"duration": "2 s", "gait.pace": [["0.6 s", 0.0]]}))
    assert any("in the air" in told for told in swing.warnings)
    late = build(load("scenario", "walk-dropfoot", {"duration": "2 s", "gait.pace": [["3 s", 0.5]]}))
    assert any("after the end" in told for told in late.warnings)


STEP = 1e-3


def test_s1_cycle() -> None:
    """S1, Fig. 6: filled from 0 s, vented from 4 s, 8 s in all; on the very step, in every cycle."""
    time = np.arange(40_000) * STEP
    on = Clock.of(time, STEP, 8.0).share(((0.0, 4.0),))
    edges = np.flatnonzero(np.diff(on)) + 1
    assert edges.tolist() == [4000, 8000, 12000, 16000, 20000, 24000, 28000, 32000, 36000]


def test_nothing_is_open_without_events() -> None:
    assert not Clock.of(np.arange(100) * STEP, STEP, 8.0).share(()).any()


@settings(deadline=None, derandomize=True)
@given(st.integers(1, 2000), st.integers(0, 1999), st.integers(1, 2000), st.integers(0, 20))
def test_open_share_is_the_intervals_share(period: int, start: int, length: int, cycle: int) -> None:
    """Whole milliseconds: each cycle is open for exactly the interval's number of steps."""
    end = min(start + length, period)
    if end <= start:
        return
    time = (cycle * period + np.arange(period)) * STEP
    on = Clock.of(time, STEP, period * STEP).share(((start * STEP, end * STEP),))
    assert on.sum() == end - start
    assert on[start] == 1.0
    assert set(np.unique(on)) <= {0.0, 1.0}


def test_overlapping_events_do_not_add_up() -> None:
    on = Clock.of(np.arange(1000) * STEP, STEP, 1.0).share(((0.0, 0.5), (0.3, 0.8)))
    assert on.max() == 1.0
    assert on.sum() == pytest.approx(800)


@pytest.mark.parametrize(("start", "end", "share"), [(0.2e-3, 0.8e-3, 0.6), (0.0, 0.2e-3, 0.2)])
def test_events_within_a_step_are_the_share_of_it(start: float, end: float, share: float) -> None:
    """Pulse-width modulation faster than the step must neither vanish nor stay on."""
    on = Clock.of(np.arange(50) * STEP, STEP, STEP).share(((start, end),))
    assert on == pytest.approx(share, abs=1e-9)


def test_edge_within_a_step() -> None:
    on = Clock.of(np.arange(4) * STEP, STEP, 1.0).share(((0.5e-3, 2.25e-3),))
    assert on.tolist() == [0.5, 1.0, 0.25, 0.0]

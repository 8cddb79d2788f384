"""The timer's coils, on the grid of steps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from afo_sim.model.walk import Clock

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

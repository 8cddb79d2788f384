"""Swings, and which of them are usual."""

import math

import numpy as np

from afo_sim.control.swings import ALIKE, RANGE, SETTLED, Swing, Swings, UsualSwings

OWN = Swing(math.radians(50.0), math.radians(-20.0), 0.3, 0.1)
SMALL = Swing(math.radians(25.0), math.radians(-12.0), 0.3, 0.1)


def test_a_swing_is_from_the_highest_to_the_lowest_angle() -> None:
    swings, time = Swings(), np.arange(0.0, 3.3, 0.01)
    angle = -np.radians(30.0) * np.cos(2.0 * np.pi * time)
    found = [(t, swing) for t, a in zip(time, angle, strict=True) if (swing := swings.after(float(a), 0.01))]
    assert len(found) == 3
    for t, swing in found:
        assert abs(swing.duration - 0.5) < 0.011 and abs(t - swing.ago - round(t)) < 0.011
        assert math.isclose(swing.high - swing.low, np.radians(60.0), rel_tol=1e-3)


def test_less_than_a_swing_is_none() -> None:
    swings = Swings()
    angle = 0.49 * RANGE * np.cos(np.arange(0.0, 20.0, 0.05))
    assert not any(swings.after(float(a), 0.01) for a in angle)


def test_another_kind_of_swing_is_strange_until_it_is_usual() -> None:
    usual = UsualSwings()
    for _ in range(3):
        usual.take(OWN)
    assert not usual.strange
    strange = []
    for _ in range(SETTLED + 2):
        usual.take(SMALL)
        strange.append(usual.strange)
    assert strange == [True] * SETTLED + [False] * 2
    usual.take(OWN)  # back home at once
    assert not usual.strange


def test_a_leg_that_does_not_swing_high_is_strange_before_its_swing_ends() -> None:
    usual = UsualSwings()
    usual.expect(0.0)
    assert not usual.strange  # nothing is usual yet
    usual.take(OWN)
    usual.expect(OWN.high - 0.9 * ALIKE)
    assert not usual.strange
    usual.expect(OWN.high - 1.1 * ALIKE)
    assert usual.strange
    usual.take(OWN)
    assert not usual.strange

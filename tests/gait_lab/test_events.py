"""Heel strikes and toe-offs from kinematics, against a walk whose force is known."""

import dataclasses

import numpy as np
import pytest
from recorded_leg import leg, toe_off
from walking import Walk

from afo_sim.gait_lab.readers.signals import low_pass
from afo_sim.gait_lab.trial.events import find_events
from afo_sim.gait_lab.trial.leg_motion import LegMotion

TIME = np.arange(0.0, 4.3, 0.01)


@pytest.mark.parametrize("belt", [0.0, 0.98])
def test_zeni_is_a_little_early_overground_and_on_a_belt(walk: Walk, belt: float) -> None:
    """Heel strikes come 0 to 40 ms before the force's, toe-offs within two frames of 60 Hz."""
    found = find_events(leg(walk, TIME, belt=belt))
    assert found.method == "Zeni 2008"
    assert len(found.strikes) == 4
    for number, strike in enumerate(found.strikes):
        assert 0.0 <= walk.heel_strike(number) - strike <= 0.040
    assert len(found.toe_offs) == 3
    for number, off in enumerate(found.toe_offs):
        assert abs(off - toe_off(walk, number)) < 0.033
    assert found.stride_time == pytest.approx(walk.cycle.stride_time, abs=1e-3)


def test_angles_give_the_hip_in_place_of_the_pelvis(walk: Walk) -> None:
    found = find_events(dataclasses.replace(leg(walk, TIME), pelvis_x=None))
    assert found.method == "Zeni 2008 with the heel against the hip"
    for number, strike in enumerate(found.strikes):
        assert 0.0 <= walk.heel_strike(number) - strike <= 0.040


@pytest.mark.parametrize(("heel", "toe"), [(0.0, 0.0), (0.08, 0.0)], ids=["flat", "forefoot"])
def test_lowest_point_decides_where_the_heel_does_not_land_first(walk: Walk, heel: float, toe: float) -> None:
    """Heel and toe come down at 0.3 m/s at phases that are known; the farthest heel is 36 ms early."""
    motion = leg(walk, TIME)

    def height(lands: float) -> np.ndarray:
        phase = (walk.phase(TIME) - lands) % 1.0
        swing = np.clip((phase - 0.6) / 0.4, 0.0, None)
        return low_pass(TIME, 0.3 * walk.cycle.stride_time * (1.0 - phase) * swing**2, 6.0)

    assert motion.heel is not None and motion.toe is not None
    points = {
        name: np.column_stack([path[:, 0], height(lands)])
        for name, path, lands in (("heel", motion.heel, heel), ("toe", motion.toe, toe))
    }
    found = find_events(dataclasses.replace(motion, **points))
    assert "lowest foot point" in found.method
    for number, strike in enumerate(found.strikes):
        true = walk.start + number * walk.cycle.stride_time
        assert strike == pytest.approx(true, abs=0.010)


def test_standing_has_no_events() -> None:
    still = np.zeros_like(TIME)
    points = np.column_stack([still, still])
    found = find_events(
        LegMotion(TIME, still, still, still, still, still, heel=points, toe=points, pelvis_x=still)
    )
    assert found.strikes == found.toe_offs == ()


def test_a_foot_in_the_air_between_two_peaks_is_no_second_step(walk: Walk) -> None:
    """A ripple about the farthest heel, as noise makes it, gives no second event."""
    motion = leg(walk, TIME)
    assert motion.heel is not None
    ripple = 0.005 * np.sin(2.0 * np.pi * 9.0 * TIME)
    shaken = dataclasses.replace(motion, heel=motion.heel + np.column_stack([ripple, 0.0 * TIME]))
    assert len(find_events(shaken).strikes) == 4

"""Heel strikes and toe-offs from kinematics, against a walk whose force is known."""

import dataclasses

import numpy as np
import pytest
from recorded_leg import leg, toe_off
from walking import Walk

from afo_sim.gait_lab.readers.signals import low_pass
from afo_sim.gait_lab.trial.events import find_events, posture_near, posture_return
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


def height(walk: Walk, lands: float) -> np.ndarray:
    """Of a point of the foot that comes down at 0.3 m/s at a phase [m]."""
    phase = (walk.phase(TIME) - lands) % 1.0
    swing = np.clip((phase - 0.6) / 0.4, 0.0, None)
    return low_pass(TIME, 0.3 * walk.cycle.stride_time * (1.0 - phase) * swing**2, 6.0)


def lifted(motion: LegMotion, **heights: np.ndarray) -> LegMotion:
    ways = {name: np.column_stack([getattr(motion, name)[:, 0], up]) for name, up in heights.items()}
    return dataclasses.replace(motion, **ways)


@pytest.mark.parametrize("bounces", [False, True])
@pytest.mark.parametrize(("heel", "toe"), [(0.0, 0.0), (0.08, 0.0)], ids=["flat", "forefoot"])
def test_lowest_point_decides_where_the_heel_does_not_land_first(
    walk: Walk, heel: float, toe: float, bounces: bool
) -> None:
    """Heel and toe come down at phases that are known; the farthest heel is 36 ms early.

    A foot that bounces off the floor once more, for 60 ms, has landed before.
    """
    after = (walk.phase(TIME) % 1.0) * walk.cycle.stride_time - 0.03
    again = bounces * 0.03 * np.sin(np.pi * np.clip(after / 0.06, 0.0, 1.0))
    found = find_events(
        lifted(leg(walk, TIME), heel=height(walk, heel) + again, toe=height(walk, toe) + again)
    )
    assert "lowest foot point" in found.method
    for number, strike in enumerate(found.strikes):
        true = walk.start + number * walk.cycle.stride_time
        assert strike == pytest.approx(true, abs=0.010)


@pytest.mark.parametrize(("raised", "first"), [(1.0, False), (3.0, True)])
def test_a_heel_that_lands_first_is_dated_by_its_farthest_place(
    walk: Walk, raised: float, first: bool
) -> None:
    """The toe is 3 or 14 deg up when the heel is farthest; from 8 deg on the heel lands first."""
    motion = leg(walk, TIME)
    found = find_events(lifted(motion, heel=height(walk, 0.0), toe=raised * height(walk, 0.1)))
    assert ("lowest foot point" in found.method) is not first
    assert (found.strikes == find_events(motion).strikes) is first


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


PERIOD = 1.1337  # [s]


def harmonic(end: float, phases: float = 0.0) -> LegMotion:
    """A leg whose posture comes back after `PERIOD`, and no sooner; its heel is farthest at known times."""
    time = np.arange(0.0, end, 0.01)
    wave = 2.0 * np.pi * (time - phases) / PERIOD
    still, ahead = np.zeros_like(time), np.column_stack([0.3 * np.cos(wave), 0.0 * time])
    angles = 0.3 * np.sin(wave), 0.5 + 0.4 * np.cos(wave), 0.1 * np.sin(wave + 1.0)
    return LegMotion(time, *angles, still, still, heel=ahead, toe=ahead, pelvis_x=still)


@pytest.mark.parametrize("start", [0.3, 0.7345, 1.002])
def test_events_and_postures_are_found_to_a_part_of_a_sample(start: float) -> None:
    """To 0.5 ms of samples of 10 ms."""
    motion = harmonic(4.0, start)
    assert posture_return(motion, start) == pytest.approx(start + PERIOD, abs=5e-4)
    for about in (start + PERIOD - 0.03, start + PERIOD + 0.04):
        assert posture_near(motion, start, about, 0.1) == pytest.approx(start + PERIOD, abs=5e-4)
    assert posture_near(motion, start, start + 1.5 * PERIOD, 0.1) is None
    found = find_events(motion)
    strikes = [time for time in start + PERIOD * np.arange(-1, 4) if 0.05 < time < 3.94]
    assert found.strikes == pytest.approx(strikes, abs=5e-4)
    offs = [time for time in start + PERIOD * (np.arange(-1, 4) + 0.5) if 0.05 < time < 3.94]
    assert found.toe_offs == pytest.approx(offs, abs=5e-4)


def test_a_recording_that_is_cut_where_the_posture_returns_ends_there() -> None:
    start = 0.4
    cut = harmonic(start + PERIOD)
    assert posture_return(cut, start) == pytest.approx(cut.time[-1], abs=1e-12)
    for end in (start + 0.45, start + 0.7 * PERIOD):
        assert posture_return(harmonic(end), start) is None

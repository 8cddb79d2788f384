"""Strides of a known walk: by force, by posture, by kinematics, and those that are none."""

import dataclasses

import numpy as np
import pytest
from recorded_leg import leg, plate, toe_off
from walking import Walk

from afo_sim.common import InputError
from afo_sim.gait_lab.trial.events import FootEvents
from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact
from afo_sim.gait_lab.trial.strides import beside_heel_strike, find_strides

TIME, FAST = np.arange(0.0, 4.3, 0.01), np.arange(0.0, 4.3, 0.001)


def test_force_gives_all_strides(walk: Walk) -> None:
    motion = leg(walk, TIME)
    found = find_strides(motion, plate(walk, FAST, motion))
    assert len(found) == 3
    for number, stride in enumerate(found):
        assert stride.start == pytest.approx(walk.heel_strike(number), abs=1e-3)
        assert stride.end == pytest.approx(walk.heel_strike(number + 1), abs=1e-3)
        assert stride.toe_off == pytest.approx(toe_off(walk, number), abs=1e-3)
        assert (stride.by, stride.loaded, stride.closed, stride.side) == ("force", True, None, "right")


@pytest.mark.parametrize("step", [0, 1, 2])
def test_one_plate_dates_the_other_strikes_by_posture(walk: Walk, step: int) -> None:
    """The foot meets one plate: every other strike is the plate's posture again, to a frame."""
    motion = leg(walk, TIME)
    found = find_strides(motion, plate(walk, FAST, motion, on=slice(step, step + 1)))
    assert len(found) == 3
    assert [stride.loaded for stride in found] == [number == step for number in range(3)]
    for number, stride in enumerate(found):
        assert stride.start == pytest.approx(walk.heel_strike(number), abs=0.01)
        assert stride.end == pytest.approx(walk.heel_strike(number + 1), abs=0.01)
        assert "the leg's posture" in stride.by
        assert ("the ground force is missing" in stride.by) is not stride.loaded


@pytest.mark.parametrize("belt", [0.0, 0.98])
def test_no_plate_gives_strides_without_force(walk: Walk, belt: float) -> None:
    found = find_strides(leg(walk, TIME, belt=belt), None)
    assert len(found) == 3
    for number, stride in enumerate(found):
        assert 0.0 <= walk.heel_strike(number) - stride.start <= 0.04
        assert stride.time == pytest.approx(walk.cycle.stride_time, abs=2e-3)
        assert not stride.loaded
        assert stride.by == "heel strike by Zeni 2008; the ground force is missing"


def test_another_foots_contact_is_no_heel_strike(walk: Walk) -> None:
    motion = leg(walk, TIME)
    own = plate(walk, FAST, motion)
    half = 0.5 * walk.cycle.stride_time
    moved = tuple(PlateContact("1", c.start + half, c.end + half) for c in own.contacts[:2])
    found = find_strides(motion, dataclasses.replace(own, contacts=moved))
    assert len(found) == 3
    assert not any(stride.loaded for stride in found)
    assert "another foot's" in found[0].by


def test_a_heel_beside_the_plate_is_told(walk: Walk) -> None:
    """The forefoot meets the plate 0.1 s after the heel has landed in front of it."""
    motion = leg(walk, TIME)
    found = find_strides(motion, plate(walk, FAST, motion, on=slice(1, 2), late=0.1))
    assert not any(stride.loaded for stride in found)
    assert "the heel landed 0.14 s before, beside the plate" in found[1].by


@pytest.mark.parametrize(("by", "when"), [(-0.2, "before"), (0.2, "after"), (-0.12, ""), (0.12, "")])
def test_a_foot_that_leaves_the_plate_before_or_after_its_toe_off_is_told(
    walk: Walk, by: float, when: str
) -> None:
    """By more than 15 % of the stride of 1.1 s, which no event of a motion is off by."""
    motion = leg(walk, TIME)
    own = plate(walk, FAST, motion)
    moved = tuple(dataclasses.replace(contact, end=contact.end + by) for contact in own.contacts)
    strides = find_strides(motion, dataclasses.replace(own, contacts=moved))
    found = [stride for stride in strides if stride.closed is None]
    assert len(found) == 3
    for stride in found:
        assert stride.loaded is not bool(when)
        assert not when or f"the foot leaves the plate 0.20 s {when} its toe-off" in stride.by


def test_hidden_markers_leave_strides_out(walk: Walk) -> None:
    motion = dataclasses.replace(leg(walk, TIME), hidden=(("R.Heel", 0.9, 1.3),))
    found = find_strides(motion, plate(walk, FAST, motion))
    assert [round(stride.start, 2) for stride in found] == [round(walk.heel_strike(k), 2) for k in (1, 2)]
    spans = tuple(("R.Heel", start, start + 0.3) for start in (0.2, 0.9, 1.7, 2.4, 3.3, 3.9))
    with pytest.raises(InputError, match=r"R\.Heel is missing for too long"):
        find_strides(dataclasses.replace(motion, hidden=spans), None)


def test_what_is_no_walk_is_refused(walk: Walk) -> None:
    point = np.zeros((len(TIME), 2))
    motion = dataclasses.replace(leg(walk, TIME), heel=point, toe=point, pelvis_x=point[:, 0])
    with pytest.raises(InputError, match=r"no whole stride was found: the foot moves only 0\.00 m"):
        find_strides(motion, None)


def test_both_feet_on_a_plate_are_told(walk: Walk) -> None:
    motion = leg(walk, np.arange(0.0, 1.0, 0.01))
    contact = PlateContact("1", 0.1, 4.5)
    force = np.zeros_like(FAST)
    ground = GroundForce(FAST, force, force, force, (contact,), {"1": (FAST, force)})
    with pytest.raises(InputError, match="too long for a step") as caught:
        find_strides(motion, ground)
    assert caught.value.problem.count(";") < 7


@pytest.mark.slow
def test_the_only_loaded_step_is_closed_beside_a_whole_stride(walk: Walk) -> None:
    """Two strikes, of which the second is on the plate, and 0.85 of a stride after it."""
    time = walk.start + np.arange(-0.1, 1.85, 0.01) * walk.cycle.stride_time
    motion = leg(walk, time)
    found = find_strides(motion, plate(walk, FAST[time[-1] > FAST], motion, on=slice(-1, None)))
    assert [stride.loaded for stride in found] == [False, True]
    assert found[1].closed is not None
    assert found[1].start == pytest.approx(walk.heel_strike(1), abs=1e-3)
    assert found[1].time == pytest.approx(walk.cycle.stride_time, rel=0.01)


def test_one_heel_strike_alone_tells_nothing_of_the_one_before(walk: Walk) -> None:
    """Of a quick walker's stride of 1.0 s one strike is seen: the usual 1.2 s are no law."""
    motion = leg(walk, TIME)
    seen = FootEvents(strikes=(1.04,), toe_offs=(0.66,), method="", reach=0.7)
    assert beside_heel_strike(0.04, motion, seen) == ""
    both = dataclasses.replace(seen, toe_offs=(0.66, 1.86))  # by which a stride is 1.2 s
    assert "begins +0.20 s from" in beside_heel_strike(0.04, motion, both)

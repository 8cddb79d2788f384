"""A recording of hardly a period, closed to a stride: a known walk comes back from any beginning."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from campaign import size
from recorded_leg import ANGLES, leg, plate, toe_off
from walking import Walk

from afo_sim.common import GRAVITY, InputError
from afo_sim.gait_lab.trial.events import period_by_force
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride, sample
from afo_sim.gait_lab.trial.strides import _toe_off, find_strides

FAST = np.arange(0.0, 6.0, 0.001)
PHASE = np.linspace(0.0, 1.0, 201)


def cut(walk: Walk, start: float, share: float, step: float = 0.005) -> np.ndarray:
    """Times of a recording that begins at a phase [-] and holds a share of a period."""
    first = walk.start + (1.0 + start) * walk.cycle.stride_time
    return first + np.arange(0.0, share * walk.cycle.stride_time, step)


def sampled(stride: RecordedStride, motion: LegMotion) -> np.ndarray:
    """Shank, knee and ankle angle and the ankle's x over the stride."""
    values = np.column_stack([*(getattr(motion, name) for name in ANGLES), motion.ankle_x])
    return sample(motion.time, values, stride, PHASE, [False, False, False, True])


def errors(walk: Walk, stride: RecordedStride, motion: LegMotion) -> tuple[float, float]:
    """Largest error of the angles [deg], and of the stride's length as a share of it."""
    found = sampled(stride, motion)
    phase = walk.phase(np.array([stride.start])) + PHASE
    true = np.column_stack([walk.cycle.signal(name, phase) for name in ANGLES])
    length = float(np.diff(walk.cycle.signal("ankle_x", np.array([0.0, 1.0])))[0])
    return float(np.degrees(np.abs(found[:, :3] - true).max())), abs(found[-1, 3] - found[0, 3]) / length - 1


@pytest.mark.parametrize("share", [0.96, 0.98, 1.0])
@pytest.mark.parametrize("start", np.arange(0.04, 1.0, 0.08))
def test_a_period_by_force_brings_the_walk_back(walk: Walk, start: float, share: float) -> None:
    motion = leg(walk, cut(walk, start, share))
    (stride,) = find_strides(motion, plate(walk, FAST, motion))
    assert stride.closed is not None and stride.loaded
    number = round(1.0 + start + 0.5 * share)  # of the heel strike nearest to the recording's middle
    assert stride.start == pytest.approx(walk.heel_strike(number), abs=1e-3)
    assert stride.toe_off == pytest.approx(toe_off(walk, number), abs=2e-3)
    assert stride.time == pytest.approx(walk.cycle.stride_time, abs=1e-3)
    gap = walk.cycle.stride_time - (motion.time[-1] - motion.time[0])
    assert stride.closed.gap == pytest.approx(gap, abs=1e-3)
    angle, way = errors(walk, stride, motion)
    assert angle < 0.3
    assert abs(way) < 0.01
    assert all(abs(np.degrees(stride.closed.residual[name])) < 0.5 for name in ANGLES)


def test_periods_by_force_count_by_how_much_of_each_was_recorded(walk: Walk) -> None:
    """A third of one period, the whole next, a sixth of a third; a pause between plates is none."""
    period = walk.cycle.stride_time
    motion = leg(walk, walk.start + period * np.arange(0.0, 1.5, 0.005))
    first, last = motion.time[0], motion.time[-1]
    lasts = np.array([0.98, 1.0, 1.03]) * period
    starts = first + np.array([lasts[0] / -1.5, lasts[0] / 3.0, lasts[0] / 3.0 + lasts[1], 0.0])
    starts[3] = starts[2] + lasts[2]
    covered = np.array([lasts[0] / 3.0, lasts[1], last - starts[2]])
    expected = float(covered @ lasts / covered.sum())
    assert period_by_force([*starts, starts[3] + 9.0], motion) == pytest.approx(expected, rel=1e-12)
    assert period_by_force(starts[:2], motion) is None  # of less than half of the recording


@pytest.mark.parametrize(
    ("moved", "by_force", "share"),
    [
        ((), (), 0.6),  # Perry 1992, where nothing was seen
        ((), (5.9, 6.6), 0.25),
        ((2.66,), (), 0.55),
        ((2.66,), (4.3, 3.94, 3.9), 7 / 12),  # the nearest within 15 % of a stride
        ((2.66,), (4.2,), 0.55),
    ],
)
def test_toe_off_is_the_forces_where_it_is_near_the_kinematics(
    moved: tuple[float, ...], by_force: tuple[float, ...], share: float
) -> None:
    """Strides of 1.2 s from 2 s on, in share of one; a stride later is the same event."""
    events: Any = SimpleNamespace(toe_offs=moved)
    assert _toe_off(events, by_force, 2.0, 1.2) == pytest.approx(2.0 + 1.2 * share)


@pytest.mark.parametrize("start", [0.15, 0.3, 0.5])
def test_a_stance_in_two_parts_is_put_together(walk: Walk, start: float) -> None:
    """The recording begins in stance and ends in the next, so no contact is whole."""
    time = cut(walk, start, 0.98)
    motion = leg(walk, time)
    fast = FAST[(time[0] <= FAST) & (time[-1] >= FAST)]
    ground = plate(walk, fast, motion)
    assert not any(contact.whole for contact in ground.contacts)
    (stride,) = find_strides(motion, ground)
    assert stride.loaded
    assert "its period by the leg's motion" in stride.by
    got = sample(ground.time, ground.force_z[:, None], stride, PHASE, [False])[:, 0]
    true = walk.force(stride.start + PHASE * walk.cycle.stride_time)[1]
    weight = walk.cycle.body_mass * GRAVITY
    stance = (PHASE > 0.03) & (PHASE < 0.6)
    # the period is right to 2.5 %, and the force's slope in stance is at most some 8 body weights a period
    assert np.abs(got - true)[stance].max() < 0.2 * weight
    assert np.sqrt(np.mean((got - true)[stance] ** 2)) < 0.03 * weight


@pytest.mark.parametrize("share", [0.98, 1.0, 1.1])
@pytest.mark.parametrize("start", np.arange(0.02, 1.0, 0.06)[:: size(3, 1)])
def test_a_period_by_motion_is_right_as_strides_repeat(walk: Walk, start: float, share: float) -> None:
    """Within 2.5 %: 12 strides in a row of one person scatter by 1.208 to 1.251 s."""
    motion = leg(walk, cut(walk, start, share, step=0.01))
    (stride,) = find_strides(motion, None)
    assert stride.time == pytest.approx(walk.cycle.stride_time, rel=0.025)
    assert not stride.loaded
    assert stride.by.endswith("the ground force is missing")
    early = (walk.heel_strike(1) - stride.start) % walk.cycle.stride_time
    assert early < 0.05


def test_more_than_a_period_takes_a_period_of_it(walk: Walk) -> None:
    motion = leg(walk, cut(walk, 0.1, 1.5))
    (stride,) = find_strides(motion, plate(walk, FAST, motion))
    assert stride.closed is not None
    start, end = stride.closed.window
    assert motion.time[0] <= start < end <= motion.time[-1] + 1e-9
    assert end - start == pytest.approx(stride.time, abs=1e-9)
    assert stride.closed.gap == 0.0
    assert errors(walk, stride, motion)[0] < 0.1


def test_a_belt_takes_the_travel_away(walk: Walk) -> None:
    belt = 0.98
    motion = leg(walk, cut(walk, 0.4, 0.97), belt=belt)
    (stride,) = find_strides(motion, plate(walk, FAST, motion))
    assert stride.closed is not None
    length = float(np.diff(walk.cycle.signal("ankle_x", np.array([0.0, 1.0])))[0])
    assert stride.closed.length == pytest.approx(length - belt * walk.cycle.stride_time, abs=0.01 * length)
    found = sampled(stride, motion)
    assert found[-1, 3] - found[0, 3] == pytest.approx(stride.closed.length, abs=1e-9)


@pytest.mark.parametrize("start", [0.1, 0.6])
def test_a_gap_of_six_percent_is_refused(walk: Walk, start: float) -> None:
    motion = leg(walk, cut(walk, start, 0.94))
    with pytest.raises(InputError, match=r"% of a period of 1\.20\d s; at least 95 % are needed") as caught:
        find_strides(motion, plate(walk, FAST, motion))
    assert caught.value.problem.count(";") < 7


def test_drift_is_reported_and_spread(walk: Walk) -> None:
    """An ankle angle that drifts by 3 degrees a second ends 3.5 degrees away, and closes."""
    motion = leg(walk, cut(walk, 0.7, 0.98))
    drift = np.radians(3.0) * (motion.time - motion.time.mean())
    drifted = LegMotion(**{**vars(motion), "ankle_angle": motion.ankle_angle + drift})
    (stride,) = find_strides(drifted, plate(walk, FAST, drifted))
    assert stride.closed is not None
    seam = np.degrees(stride.closed.residual["ankle_angle"])
    assert seam == pytest.approx(-3.0 * walk.cycle.stride_time, abs=0.1)
    assert errors(walk, stride, drifted)[0] < 0.3
    found = sampled(stride, drifted)
    assert np.allclose(found[0, :3], found[-1, :3], atol=1e-9)


def test_a_whole_stride_is_read_by_a_spline() -> None:
    time = np.arange(0.0, 2.0, 0.01)
    stride = RecordedStride("right", 0.5, 1.5, 1.1, "force", True)
    values = np.column_stack([np.sin(3.0 * time), np.full_like(time, np.nan)])
    found = sample(time, values, stride, PHASE, [False, False])
    assert np.allclose(found[:, 0], np.sin(3.0 * (0.5 + PHASE)), atol=1e-6)
    assert np.isnan(found[:, 1]).all()
    later = RecordedStride("right", 1.5, 2.5, 2.1, "force", True)
    beyond = 1.5 + PHASE > 2.0
    assert np.isnan(sample(time, values[:, :1], later, PHASE, [False])[beyond]).all()

"""A stride of another size, and one with steppage."""

import dataclasses

import numpy as np
import pytest
from gait_lab.rigid_leg import BALL, HEEL, RigidLeg

import afo_sim
from afo_sim.common import GRAVITY, assets
from afo_sim.gait import Chain, GaitCycle, examine, fit_to_leg, scaled, stance, stepped
from afo_sim.gait import file as gait
from afo_sim.gait.file import read

OUTSOLE = (HEEL, BALL)


@pytest.fixture(scope="module")
def stride() -> GaitCycle:
    known = gait.read(assets.find_gait("gatk_stride1"))
    return dataclasses.replace(known, body_height=1.75, sole_thickness=0.02)


@pytest.mark.parametrize("taller", [0.7, 1.13])
def test_froude_number_and_angles_stay(stride: GaitCycle, taller: float) -> None:
    other = scaled(stride, taller)
    assert stride.body_height is not None and other.body_height is not None
    for walker in (stride, other):
        assert walker.walking_speed == pytest.approx(np.ptp(walker.ankle_x) / walker.stride_time, rel=2e-3)
    froude = [c.walking_speed**2 / (GRAVITY * (c.body_height or 0.0)) for c in (stride, other)]
    assert froude[1] == pytest.approx(froude[0], rel=1e-12)
    assert other.body_height == pytest.approx(1.75 * taller)
    assert other.sole_thickness == pytest.approx(0.02 * taller)
    for name in ("phase", "shank_angle", "knee_angle", "ankle_angle", "grf_x", "grf_z"):
        assert np.array_equal(getattr(other, name), getattr(stride, name))
    assert other.body_mass == stride.body_mass
    assert stance(other) == stance(stride)
    assert (other.flat.start, other.flat.end) == pytest.approx((stride.flat.start, stride.flat.end), abs=0.03)
    examine(other)


@pytest.mark.parametrize("taller", [0.7, 1.13])
def test_moment_and_power_per_mass_go_with_length_and_its_root(stride: GaitCycle, taller: float) -> None:
    other = scaled(stride, taller)
    assert other.ground_moment() == pytest.approx(taller * stride.ground_moment(), rel=1e-12)
    assert other.ankle_moment == pytest.approx(taller * stride.ankle_moment, rel=1e-12)
    phase = np.linspace(0.0, 1.0, 50)
    for name, power in (("ankle_angle", -0.5), ("ankle_x", 0.5), ("ankle_z", 0.5)):
        slow, fast = (c.signal(name, phase, 1) for c in (stride, other))
        assert fast == pytest.approx(taller**power * slow, rel=1e-9, abs=1e-9)
    # whatever the size, gravity accelerates alike
    risen = [c.signal("ankle_z", phase, 2) for c in (stride, other)]
    assert risen[1] == pytest.approx(risen[0], rel=1e-9, abs=1e-9)


def test_placing_a_taller_walker_is_placing_and_growing() -> None:
    """Fitted to a leg that is taller as well, the marker has as much more to go."""
    recorded, taller = RigidLeg(marker=0.03).recorded(), 1.2
    small = fit_to_leg(recorded, OUTSOLE)
    grown = tuple((taller * x, taller * z) for x, z in OUTSOLE)
    big = fit_to_leg(scaled(recorded, taller), grown)
    assert big.along == pytest.approx(taller * small.along, abs=1e-4)
    again = scaled(small.cycle, taller)
    assert big.cycle.ankle_moment == pytest.approx(again.ankle_moment, abs=2e-3)


def test_unknown_stays_unknown_and_the_same_size_is_the_same_stride(stride: GaitCycle) -> None:
    assert scaled(stride, 1.0) is stride
    unknown = scaled(dataclasses.replace(stride, body_height=None, sole_thickness=None), 1.1)
    assert unknown.body_height is None
    assert unknown.sole_thickness is None
    back = scaled(scaled(stride, 1.1), 1.0 / 1.1)
    assert back.ankle_x == pytest.approx(stride.ankle_x, rel=1e-12)
    assert back.stride_time == pytest.approx(stride.stride_time)


CHAIN = Chain(0.42, 0.43)
HIP, KNEE = np.radians(15.0), np.radians(20.0)


def walker() -> GaitCycle:
    return read(assets.find_gait("bovi2011_natural"))


def joints(cycle: GaitCycle) -> dict[str, np.ndarray]:
    """Hip and knee in space, written out: the knee above the ankle, the hip above the knee."""
    thigh = cycle.knee_angle - cycle.shank_angle  # knee ahead of the hip
    knee_x = cycle.ankle_x + CHAIN.shank * np.sin(cycle.shank_angle)
    knee_z = cycle.ankle_z + CHAIN.shank * np.cos(cycle.shank_angle)
    return {
        "thigh": thigh,
        "hip_x": knee_x - CHAIN.thigh * np.sin(thigh),
        "hip_z": knee_z + CHAIN.thigh * np.cos(thigh),
    }


def test_the_hip_goes_its_way_and_thigh_and_knee_bend_as_told() -> None:
    before, after = walker(), stepped(walker(), HIP, KNEE, CHAIN)
    one, other = joints(before), joints(after)
    for name in ("hip_x", "hip_z"):
        assert other[name] == pytest.approx(one[name], abs=1e-12)
    bent = other["thigh"] - one["thigh"]
    assert bent.max() == pytest.approx(HIP, rel=1e-3)
    assert (after.knee_angle - before.knee_angle) * HIP == pytest.approx(bent * KNEE, abs=1e-12)
    middle = before.phase[np.argmax(bent)]
    toe_off = before.phase[(before.grf_z <= 0.05) & (before.phase > 0.35)][0]
    assert middle == pytest.approx(0.5 * (toe_off + 1.0), abs=0.01)


def test_stance_and_ankle_angle_stay() -> None:
    before, after = walker(), stepped(walker(), HIP, KNEE, CHAIN)
    stance = (before.grf_z > 0.05) & (before.phase < 0.9)
    for name in ("shank_angle", "knee_angle", "ankle_x", "ankle_z"):
        assert getattr(after, name)[stance] == pytest.approx(getattr(before, name)[stance], abs=1e-12)
    assert np.array_equal(after.ankle_angle, before.ankle_angle)
    assert stepped(walker(), 0.0, 0.0, CHAIN).ankle_z == pytest.approx(before.ankle_z, abs=0.0)


def test_steppage_lifts_a_drop_foot_and_returns_a_healthy_one() -> None:
    more = {"gait.steppage_hip": "10 deg", "gait.steppage_knee": "10 deg", "duration": "3.4 s"}
    plain, stepping = (afo_sim.run("walk-dropfoot", sets) for sets in ({"duration": "3.4 s"}, more))
    # the thigh swings from some 20 to 30 degrees, the shank stays: 0.42 m (cos 20° − cos 30°) = 31 mm
    assert 25.0 < stepping.metrics["toe_clearance"].value - plain.metrics["toe_clearance"].value < 60.0
    healthy = afo_sim.run("walk-healthy", more)
    assert np.degrees(np.abs(healthy["ankle/angle"] - healthy["gait/ankle_angle"])).max() < 0.1

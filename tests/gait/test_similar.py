"""A taller person's stride: dynamic similarity, held against the laws that it must keep."""

import dataclasses

import numpy as np
import pytest
from gait.rigid_leg import BALL, HEEL, RigidLeg

from afo_sim.common import assets
from afo_sim.common.units import GRAVITY
from afo_sim.gait import file as gait
from afo_sim.gait.checks import examine, stance
from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait.place import fit_to_leg
from afo_sim.gait.similar import scaled

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

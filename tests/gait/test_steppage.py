"""Hip and knee that bend more in swing: what moves, and what must not."""

import numpy as np
import pytest

import afo_sim
from afo_sim.common import assets
from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait.file import read
from afo_sim.gait.hip_path import Chain
from afo_sim.gait.steppage import stepped

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

"""Joints' powers by inverse dynamics: what a leg's energy gains comes through joints, floor and trunk."""

import numpy as np
import pytest

from afo_sim.common import GRAVITY, find_gait
from afo_sim.description import MASS_SHARES
from afo_sim.gait import Chain
from afo_sim.gait.file import read
from afo_sim.lab.calf_share import PHASE, calf_share, joint_powers, positive_work

# Winter 2009, table 4.1: centre of mass from the proximal end, radius of gyration about it, over the length
SEGMENTS = {"shank": (0.433, 0.302), "thigh": (0.433, 0.323)}
GAITS = ("bovi2011_natural", "gatk_stride1")


@pytest.mark.parametrize("name", GAITS)
def test_energy_is_gained_by_what_joints_floor_and_trunk_give(name: str) -> None:
    """d(T + V)/dt of shank and thigh: forces times speeds of ankle and hip, and moments times turning."""
    cycle = read(find_gait(name))
    step, powers = cycle.stride_time / (len(PHASE) - 1), joint_powers(cycle)
    assert cycle.body_height is not None
    lengths = Chain.of_height(cycle.body_height)
    shank, knee = (cycle.signal(f"{joint}_angle", PHASE) for joint in ("shank", "knee"))
    place = cycle.signal("ankle_x", PHASE) + 1j * cycle.signal("ankle_z", PHASE)

    def rate(x: np.ndarray) -> np.ndarray:
        return np.gradient(x, step)

    forward, upward, _ = cycle.ground(PHASE)
    floor = GRAVITY * (forward + 1j * upward)
    force = floor - MASS_SHARES["foot"] * (rate(rate(place)) + 1j * GRAVITY)  # of the foot on the shank
    moment = np.interp(PHASE, cycle.phase, cycle.ankle_moment)
    given, gained = (np.conj(force) * rate(place)).real + moment * rate(shank), np.zeros(len(PHASE))
    for segment, lean in (("shank", shank), ("thigh", shank - knee)):
        (proximal, gyration), mass = SEGMENTS[segment], MASS_SHARES[segment]
        along = getattr(lengths, segment) * 1j * np.exp(-1j * lean)
        centre = place + (1.0 - proximal) * along
        turning = (gyration * getattr(lengths, segment) * rate(lean)) ** 2
        gained += mass * rate(0.5 * np.abs(rate(centre)) ** 2 + 0.5 * turning + GRAVITY * centre.imag)
        force = force - mass * (rate(rate(centre)) + 1j * GRAVITY)  # on what is above
        place = place + along
    given += powers["knee"] + powers["hip"] - (np.conj(force) * rate(place)).real
    inner = slice(20, -20)
    assert np.abs(gained).max() > 1.0
    assert np.abs(given - gained)[inner].max() < 0.02 * np.abs(gained).max()
    assert powers["ankle"] == pytest.approx(moment * rate(cycle.signal("ankle_angle", PHASE)), abs=0.02)


def test_positive_work_is_the_mean_of_positive_power_times_the_time() -> None:
    """Of push-off that between heel rise and toe-off: nearly all that the ankle gives."""
    cycle = read(find_gait("bovi2011_natural"))
    work, powers = positive_work(cycle), joint_powers(cycle)
    for joint, power in powers.items():
        given = power[power > 0.0].sum() / len(PHASE) * cycle.stride_time
        assert work[joint] == pytest.approx(given, rel=2e-3)
    assert 0.8 * work["ankle"] < work["push-off"] < work["ankle"]
    shares = work["push-off"] / (work["ankle"] + work["knee"] + work["hip"])
    assert calf_share("bovi2011_natural") == pytest.approx(100.0 * shares)

"""Where the sole lies flat: before the heel rises, at whatever pitch."""

import dataclasses
import pathlib

import numpy as np
import pytest
from gait_lab.rigid_leg import RigidLeg

from afo_sim.common import assets
from afo_sim.gait import USUAL, findings, flat_part
from afo_sim.gait import file as gait
from afo_sim.gait_lab.trial.plausibility import _flat

PHASE = np.linspace(0.0, 1.0, 201)
LEVER = 0.12  # of the ball ahead of the ankle [m]


def lifted(start: float, end: float, level: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Pitch [rad] and ankle height [m] of a foot that turns by 1 deg per % outside its flat part."""
    turned = np.clip(start - PHASE, 0.0, None) - np.clip(PHASE - end, 0.0, None)
    pitch = np.radians(100.0 * turned + level)
    return pitch, 0.07 - LEVER * np.sin(np.minimum(pitch - np.radians(level), 0.0))


@pytest.mark.parametrize("level", [0.0, -25.0, 4.0])
@pytest.mark.parametrize(("start", "end"), [(0.12, 0.22), (0.10, 0.30), (0.16, 0.36)])
def test_a_known_flat_part_is_found_within_a_degree_of_turning(
    start: float, end: float, level: float
) -> None:
    found = flat_part(PHASE, *lifted(start, end, level))
    assert found.steady
    # 1 deg of pitch is 1 % of this stride, and 2 mm of the ankle are 0.95 %; the mean is drawn along
    assert start - 0.015 <= found.start <= start + 1e-9
    assert end - 1e-9 <= found.end <= end + 0.015


def test_it_never_leaves_8_to_40_percent_nor_stance() -> None:
    still = np.zeros_like(PHASE), np.full_like(PHASE, 0.07)
    found = flat_part(PHASE, *still)
    assert (found.start, found.end) == pytest.approx((0.08, 0.40))
    found = flat_part(PHASE, *still, PHASE < 0.3)
    assert found.end == pytest.approx(0.295)


def test_a_foot_that_never_rests_has_the_usual_part_and_says_so() -> None:
    turning = np.radians(50.0 * PHASE)  # 4 deg in 8 %
    found = flat_part(PHASE, turning, np.full_like(PHASE, 0.07))
    assert (found.start, found.end, found.steady) == (*USUAL, False)
    rising = flat_part(PHASE, np.zeros_like(PHASE), 0.07 + 0.05 * PHASE)  # 4 mm in 8 %
    assert not rising.steady
    assert not flat_part(PHASE, np.full_like(PHASE, np.nan), turning).steady
    leg = RigidLeg().recorded()
    rolling = dataclasses.replace(leg, ankle_angle=leg.ankle_angle - np.radians(60.0 * leg.phase))
    assert dict(findings(rolling))["foot flat"] == "15 to 35 % of the stride, as usual: it is never steady"
    assert "15 to 35 % of the stride are taken as flat" in _flat(rolling)[0]
    assert _flat(leg) == []


def test_a_heel_that_rises_early_is_not_in_the_ankles_height() -> None:
    """A fast walk: the heel leaves at 24 %, and by 35 % the ankle stands 2 cm higher."""
    pitch, height = lifted(0.10, 0.24)
    assert height[PHASE <= 0.35].max() > 0.09
    flat = flat_part(PHASE, pitch, height).holds(PHASE)
    assert height[flat].mean() == pytest.approx(0.07, abs=5e-4)
    usual = (USUAL[0] <= PHASE) & (USUAL[1] >= PHASE)
    assert height[usual].mean() > 0.075


@pytest.mark.parametrize("name", ["gatk_stride1", "gatk_stride2"])
def test_shipped_strides_are_flat_before_their_heel_rises(name: str) -> None:
    cycle = gait.read(assets.find_gait(name))
    assert cycle.flat.steady
    assert 0.08 <= cycle.flat.start < 0.15 < 0.22 < cycle.flat.end < 0.35
    flat = cycle.foot_flat()
    assert np.ptp(np.degrees(cycle.foot_pitch()[flat])) <= 2.0
    assert np.ptp(cycle.ankle_z[flat]) <= 0.002


RECORDED = sorted((pathlib.Path(__file__).parents[2].parent / "shared/data/walkers").glob("bmc_*.csv"))


@pytest.mark.skipif(not RECORDED, reason="recorded strides of other walkers are not at hand")
@pytest.mark.parametrize("file", RECORDED, ids=lambda file: file.stem)
def test_the_forefoot_of_recorded_strides_stands_where_flat(file: pathlib.Path) -> None:
    """Markers on the first and fifth metatarsal, whose height is no part of the finding.

    They lie 0.16 and 0.11 m ahead of the ankle: 1 deg about the mean pitch lifts them by 2.7 and 2 mm. What
    one of the feet turns before, while it comes down slowly, is as much again.
    """
    table = np.genfromtxt(file, delimiter=",", names=True)
    phase, pitch = table["pct"] / 100.0, np.radians(table["foot_pitch_deg"])
    found = flat_part(phase, pitch, table["ankle_z_m"], table["grf_v_N"] > 75.0)
    assert found.steady
    flat = found.holds(phase)
    assert np.abs(table["mt1_above_flat_mm"][flat]).mean() < 5.4
    assert np.abs(table["mt5_above_flat_mm"][flat]).mean() < 4.0
    usual = (phase >= USUAL[0]) & (phase <= USUAL[1])
    assert table["ankle_z_m"][flat].mean() < table["ankle_z_m"][usual].mean() - 0.001
    assert table["ankle_z_m"][flat].mean() < table["ankle_z_m"].min() + 0.002

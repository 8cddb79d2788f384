"""The mean of strides, against means computed by hand."""

import dataclasses

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.gait import GaitCycle
from afo_sim.gait_lab import mean_cycle

PHASE = np.linspace(0.0, 1.0, 101)


def stride(scale: float, force: float, place: float, time: float, side: str = "right") -> GaitCycle:
    """A stride of plain curves."""
    stance = PHASE < 0.6
    wave = np.sin(2.0 * np.pi * PHASE)
    return GaitCycle(
        source="a trial",
        licence="ours",
        side=side,
        stride_time=time,
        body_mass=70.0,
        walking_speed=1.2 * scale,
        ankle_height=0.08 * scale,
        phase=PHASE,
        shank_angle=scale * wave,
        knee_angle=scale * wave**2,
        ankle_angle=-scale * wave,
        ankle_x=5.0 * scale + 1.2 * scale * time * PHASE,
        ankle_z=0.08 * scale + 0.0 * PHASE,
        grf_x=np.where(stance, 0.1 * force * wave, 0.0),
        grf_z=np.where(stance, force, 0.0),
        cop_x=np.where(stance, place, np.nan),
        ankle_moment=np.where(stance, -force * place, 0.0),
        notes={"cut": f"{scale:g} s", "processing": "none"},
    )


def unloaded(cycle: GaitCycle) -> GaitCycle:
    lost = np.full_like(PHASE, np.nan)
    return dataclasses.replace(cycle, grf_x=lost, grf_z=lost, cop_x=lost, ankle_moment=lost)


def test_mean_and_band_are_those_of_the_strides() -> None:
    strides = [stride(0.9, 0.8, 0.05, 1.0), stride(1.1, 1.2, 0.10, 1.2, side="left")]
    mean, band = mean_cycle(strides)
    wave = np.sin(2.0 * np.pi * PHASE)
    assert np.allclose(mean.shank_angle, wave)
    assert np.allclose(band["shank_angle"], 0.2 / np.sqrt(2.0) * np.abs(wave))
    assert mean.stride_time == pytest.approx(1.1)
    assert mean.ankle_height == pytest.approx(0.08)
    # the way is each stride's from its own beginning, and the speed goes over it in the mean time
    assert mean.ankle_x[0] == 0.0
    assert mean.ankle_x[-1] == pytest.approx(0.5 * (1.08 * 1.0 + 1.32 * 1.2))
    assert mean.walking_speed * mean.stride_time == pytest.approx(mean.ankle_x[-1])
    # force times place is the mean moment
    stance = PHASE < 0.6
    assert np.allclose(mean.grf_z[stance], 1.0)
    assert np.allclose((mean.grf_z * mean.cop_x)[stance], 0.5 * (0.8 * 0.05 + 1.2 * 0.10))
    assert np.allclose(mean.ankle_moment[stance], -(mean.grf_z * mean.cop_x)[stance])
    assert np.isnan(mean.cop_x[~stance]).all()
    assert mean.notes["mean"] == "of 2 strides (1 right and 1 left), ground force of 2"
    assert mean.notes["cut"] == "0.9 s; 1.1 s"
    assert mean.notes["processing"] == "none"


def test_strides_without_force_count_in_the_motion_only() -> None:
    mean, band = mean_cycle([stride(0.9, 0.8, 0.05, 1.0), unloaded(stride(1.1, 1.2, 0.10, 1.2))])
    assert np.allclose(mean.grf_z[PHASE < 0.6], 0.8)
    assert np.allclose(mean.cop_x[PHASE < 0.6], 0.05)
    assert np.allclose(mean.ankle_moment[PHASE < 0.6], -0.04)
    assert np.allclose(mean.shank_angle, np.sin(2.0 * np.pi * PHASE))
    assert np.isnan(band["grf_z"]).all()  # one stride has no scatter
    assert np.isfinite(band["knee_angle"]).all()
    assert mean.notes["mean"].endswith("ground force of 1")


def test_no_force_at_all_leaves_none() -> None:
    mean, band = mean_cycle([unloaded(stride(s, 1.0, 0.1, 1.1)) for s in (0.9, 1.1)])
    assert np.isnan(mean.grf_z).all() and np.isnan(mean.cop_x).all() and len(mean.grf_z) == len(PHASE)
    assert np.isnan(band["cop_x"]).all()


def test_one_stride_is_its_own_mean() -> None:
    alone = stride(1.0, 1.0, 0.1, 1.1)
    mean, band = mean_cycle([alone])
    assert np.allclose(mean.cop_x, alone.cop_x, equal_nan=True)
    assert np.allclose(mean.knee_angle, alone.knee_angle)
    assert mean.notes["cut"] == alone.notes["cut"]
    assert np.isnan(band["knee_angle"]).all()


def test_other_rows_are_refused() -> None:
    one = stride(1.0, 1.0, 0.1, 1.1)
    with pytest.raises(InputError, match="other rows"):
        mean_cycle([one, dataclasses.replace(one, phase=PHASE[:-1])])
    with pytest.raises(InputError, match="at least one stride"):
        mean_cycle([])


def test_toe_offs_that_differ_leave_no_hole_in_the_pressure() -> None:
    """Three of five feet have left the floor: the other two carry all of the force, and have its place."""
    cycles = []
    for off in (0.55, 0.55, 0.55, 0.62, 0.62):
        on = off > PHASE
        standing = stride(1.0, 1.0, 0.15, 1.2)
        cycles.append(
            dataclasses.replace(
                standing,
                grf_z=np.where(on, 1.0, 0.0),
                cop_x=np.where(on, 0.15, np.nan),
                ankle_moment=-0.15 * on,
            )
        )
    mean, _ = mean_cycle(cycles)
    late = (PHASE > 0.56) & (PHASE < 0.61)
    assert np.allclose(mean.grf_z[late], 0.4)
    assert np.allclose(mean.cop_x[late], 0.15)
    assert np.isnan(mean.cop_x[PHASE > 0.63]).all()

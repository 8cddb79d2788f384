"""Paths with stops and short steps: the recorded walk where nothing changes, smooth, flat where it stands."""

import functools
import pickle

import numpy as np
import pytest

from afo_sim.common import GRAVITY
from afo_sim.model import STANDS, Built, on_track
from afo_sim.model.build import build
from afo_sim.rl.environments.day import path
from afo_sim.rl.environments.patients import USUAL


@functools.cache
def walked(timestep: str = "2 ms") -> Built:
    sets = {"duration": "18 s", "timestep": timestep, "gait.settled": "walked", "start": None}
    return build("walk-dropfoot-afo", {**sets, "reference": None})


def test_a_track_at_the_recorded_phase_and_reach_is_the_recorded_walk() -> None:
    built = walked()
    walk, whole = built.walk, np.ones(len(built.walk.phase))
    found = on_track(built, walk.phase, whole, whole)
    np.testing.assert_allclose(found.walk.pose - found.walk.pose[0], walk.pose - walk.pose[0], atol=1e-12)
    np.testing.assert_array_equal(found.walk.ankle, walk.ankle)
    np.testing.assert_allclose(found.active.recorded, built.active.recorded, atol=1e-6)
    np.testing.assert_allclose(found.active.moment, built.active.moment, atol=1e-6)
    with pytest.raises(TypeError, match="no scenario describes"):
        pickle.dumps(found)


@pytest.mark.parametrize("number", [USUAL, 0, 1])
def test_the_acceleration_is_continuous(number: int) -> None:
    """What jumps from step to step halves with the step; a kink in the pose would not."""
    jumps = []
    for timestep in ("2 ms", "1 ms"):
        built = walked(timestep)
        found = on_track(built, *path(number, built.walk.time, 1.2))
        jumps.append(np.abs(np.diff(found.walk.acceleration, axis=0)).max(axis=0))
    np.testing.assert_allclose(jumps[0] / jumps[1], 2.0, rtol=0.1)


def test_who_stands_is_upright_on_a_flat_foot_and_bears_half_the_weight() -> None:
    built = walked()
    phase, walking, reach = path(0, built.walk.time, 1.2)
    found = on_track(built, phase, walking, reach)
    still = walking == 0.0
    assert 0.1 < still.mean() < 0.5
    assert np.ptp(found.walk.pose[still, 1]) < 1e-12 and not found.walk.pose[still, 2].any()
    np.testing.assert_allclose(phase[still] % 1.0, STANDS, atol=1e-9)
    forward, upward, _ = found.walk.ground
    assert not forward[still].any() and (upward[still] == 0.5).all()
    # statics: the ground 4 cm ahead of the ankle, less the foot's own weight, less than with the plate
    carried = found.active.recorded[still[1:-1]] + 0.5 * built.body_mass * GRAVITY * 0.04
    weight = -built.foot.gravity_moment(found.walk.turn)[still[1:-1]]
    assert np.ptp(carried) < 1e-6 and 0.5 * weight.min() < carried.min() < weight.min()


def test_a_flat_foot_stays_flat_in_short_steps() -> None:
    built = walked()
    walk, whole = built.walk, np.ones(len(built.walk.phase))
    short = on_track(built, walk.phase, whole, 0.7 * whole).walk
    flat = walk.cycle.flat.holds(walk.phase % 1.0)
    assert (
        np.abs(short.ankle - short.pose[:, 2])[flat].max() < np.abs(walk.ankle - walk.pose[:, 2])[flat].max()
    )
    assert np.ptp(short.pose[:, 0]) == pytest.approx(0.7 * np.ptp(walk.pose[:, 0]), rel=1e-9)

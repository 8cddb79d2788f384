"""Laws of nature on guided cables with friction: first law, no negative heat, work on the joint."""

import functools
from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim import load
from afo_sim.model import muscle_names
from afo_sim.model.build import build
from afo_sim.simulation import Recording, balance

FRICTIONS = ("dorsiflexor", "dorsiflexor_side", "plantarflexor_side")


@functools.cache
def ran(scenario: str, friction: float, timestep: str = "1 ms") -> tuple[Any, Recording]:
    sets: dict[str, Any] = {"orthosis": "guided", "timestep": timestep}
    sets |= {f"orthosis.muscle.{name}.wrap_friction": friction for name in FRICTIONS}
    sets |= (
        {"duration": "9 s"}
        if scenario.startswith("seated")
        else {"gait.settled": "walked", "duration": "8 s"}
    )
    described = load("scenario", scenario, sets)
    recording = afo_sim.run(described)
    assert recording.ok and len(recording["time"]) == described.n_step  # every step
    return described, recording


CASES = [
    ("seated", 0.1),
    ("seated-antagonist", 0.4),
    pytest.param("walk-dropfoot-afo", 0.1, marks=pytest.mark.slow),
    pytest.param("walk-dropfoot-afo", 0.4, marks=pytest.mark.slow),
]


@pytest.mark.slow
@pytest.mark.parametrize(("scenario", "friction"), CASES)
def test_energy_is_kept_and_friction_only_takes(scenario: str, friction: float) -> None:
    described, recording = ran(scenario, friction)
    columns = recording.columns
    found = balance(build(described), columns)
    assert abs(found.error) <= 1e-3
    assert found.wrap_loss > 0.0
    total = 0.0
    for name in muscle_names(described.orthosis):
        tension, felt, path = (columns[f"muscle/{name}/{x}"] for x in ("force", "joint_force", "path_length"))
        heat = (felt - tension)[1:] * np.diff(path)
        assert heat.min() >= -1e-15, name
        total += float(heat.sum())
    assert total == pytest.approx(found.wrap_loss, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("scenario", "friction"), CASES)
def test_work_on_the_skeleton_is_the_ankle_moments(scenario: str, friction: float) -> None:
    """MuJoCo's own torque about the ankle over its angle: what friction takes is missing there."""
    described, recording = ran(scenario, friction)
    columns = recording.columns
    found = balance(build(described), columns)
    moment, angle = columns["ankle/moment/orthosis"], columns["ankle/angle"]
    done = float(np.sum(0.5 * (moment[1:] + moment[:-1]) * np.diff(angle)))
    assert found.skeleton_work == pytest.approx(done, abs=2e-3 * found.turnover)
    path_work = sum(
        -float(np.sum(0.5 * (t[1:] + t[:-1]) * np.diff(x)))
        for t, x in (
            (columns[f"muscle/{name}/force"], columns[f"muscle/{name}/path_length"])
            for name in muscle_names(described.orthosis)
        )
    )
    assert path_work - found.skeleton_work == pytest.approx(found.wrap_loss, abs=1e-3 * found.turnover)


def test_friction_is_between_the_bounds_of_the_capstan_and_takes_its_side() -> None:
    _, recording = ran("seated-antagonist", 0.4)
    columns = recording.columns
    force, felt = columns["muscle/dorsiflexor_side_1/force"], columns["muscle/dorsiflexor_side_1/joint_force"]
    path = columns["muscle/dorsiflexor_side_1/path_length"]
    pulls = force[1:] > 1.0
    ratio, moved = (felt[1:] / np.maximum(force[1:], 1e-9))[pulls], np.diff(path)[pulls]
    assert ratio.min() > np.exp(-0.4 * np.radians(40.0)) and ratio.max() < np.exp(0.4 * np.radians(40.0))
    assert np.all((ratio - 1.0) * moved >= 0.0)
    assert ratio.min() < 0.95 and ratio.max() > 1.05


@pytest.mark.slow
def test_halving_the_step_changes_little() -> None:
    angles = {}
    for timestep in ("2 ms", "1 ms", "0.5 ms"):
        sets = {"orthosis": "guided", "duration": "8 s", "timestep": timestep, "record_rate": "500 Hz"}
        sets |= {f"orthosis.muscle.{name}.wrap_friction": 0.4 for name in FRICTIONS}
        angles[timestep] = np.degrees(afo_sim.run("seated", sets)["ankle/angle"])
    coarse = np.abs(angles["2 ms"] - angles["0.5 ms"]).max()
    fine = np.abs(angles["1 ms"] - angles["0.5 ms"]).max()
    assert fine < 0.6 * coarse and coarse < 0.2


def test_without_guides_a_run_has_neither_column_nor_loss() -> None:
    run = afo_sim.run("seated", {"duration": "1 s"})
    assert not [name for name in run.columns if name.endswith("joint_force")]
    assert "wrap_loss" not in run.metrics


def test_a_friction_of_zero_is_the_same_run_to_the_last_bit() -> None:
    path = [{"segment": "shank", "from_joint": ["7 cm", "0 cm", "5 cm"], "spacing": "2.5 cm"}]
    sets = {"duration": "3 s", "orthosis.muscle.dorsiflexor.path": path}
    one = afo_sim.run("seated", sets)
    two = afo_sim.run("seated", sets | {"orthosis.muscle.dorsiflexor.wrap_friction": 0.0})
    assert set(one.columns) == set(two.columns)
    assert all(np.array_equal(one[name], two[name]) for name in one.columns)

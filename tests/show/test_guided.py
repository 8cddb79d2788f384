"""Guided paths in pictures: the line that is drawn is the path that MuJoCo computes."""

import itertools
import pathlib

import numpy as np
import pytest
from rerun_files import read

import afo_sim
from afo_sim.show.moving_parts import Mountings
from afo_sim.show.rerun.scene import guided_lines
from afo_sim.simulation.recording import Recording


@pytest.fixture(scope="module")
def run() -> Recording:
    return afo_sim.run("seated", {"orthosis": "guided", "duration": "2 s"})


def test_lines_are_as_long_as_the_paths(run: Recording) -> None:
    built = afo_sim.build(afo_sim.load("scenario", run.scenario))
    model, groups = built.full_model, {
        f"{name}_{k}": group
        for name, group in built.scenario.orthosis.muscle.items()
        for k in range(1, group.count + 1)
    }  # fmt: skip
    rows = slice(0, None, 100)
    # cuff and plate at home: there the path is as the recording has it
    block = {name: values[rows] for name, values in run.columns.items() if "displacement" not in name}
    lines = guided_lines(model, block, groups, Mountings(model, groups, block))
    assert set(lines) == set(groups)
    for name, line in lines.items():
        pieces = [np.linalg.norm(a - b, axis=1) for a, b in itertools.pairwise(line.swapaxes(0, 1))]
        length = np.sum(pieces, axis=0)
        assert length == pytest.approx(block[f"muscle/{name}/path_length"], abs=2e-5), name


def test_a_straight_device_has_none() -> None:
    built = afo_sim.build(afo_sim.load("scenario", "seated"))
    groups = {"dorsiflexor_1": built.scenario.orthosis.muscle["dorsiflexor"]}
    assert guided_lines(built.full_model, {}, groups, Mountings(built.full_model, groups, ())) == {}


def test_the_file_holds_the_bent_cable(run: Recording, tmp_path: pathlib.Path) -> None:
    """From the muscle's end to the insertion, over the heel, where the straight line would not come."""
    file = run.save(tmp_path / "run") / "recording.rrd"
    _, strips = read(file, "/world/cables/plantarflexor_1", "LineStrips3D:strips")
    points = strips[0].reshape(-1, 3)
    first, last = points[0], points[-1]
    away = np.linalg.norm(np.cross(points - first, (last - first) / np.linalg.norm(last - first)), axis=1)
    assert len(points) > 5 and away.max() > 5e-3

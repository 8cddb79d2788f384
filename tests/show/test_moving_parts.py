"""Cuff, plate and guided cables as they move in films and in the viewer."""

import itertools
import pathlib

import mujoco
import numpy as np
import pytest
from rerun_files import lists, read
from yielding import STIFFNESS

import afo_sim
from afo_sim.description import load
from afo_sim.model import muscle_names
from afo_sim.show.moving_parts import Mountings
from afo_sim.simulation import Recording


@pytest.fixture(scope="module")
def file(yielding: Recording, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    from afo_sim.show.rerun import write_rrd

    path = tmp_path_factory.mktemp("yielding") / "recording.rrd"
    write_rrd(yielding, path)
    return path


@pytest.mark.parametrize(
    ("body", "segment", "anchor", "sign"),
    [("cuff_cuff", "shank", "shank", -1.0), ("plate_plate", "foot", "foot", 1.0)],
)
def test_each_moves_along_its_segment_towards_the_pull(
    file: pathlib.Path, yielding: Recording, body: str, segment: str, anchor: str, sign: float
) -> None:
    """The cuff down the shank, the plate up to it, as far as the springs give under all tensions."""
    model = mujoco.MjModel.from_xml_string(yielding.model_xml)
    data = mujoco.MjData(model)
    time, moved = read(file, f"/world/bodies/{body}", "Transform3D:translation")
    rows = np.searchsorted(yielding["time"], time * 1e-9 - 1e-6)
    pull = 3.0 * yielding["muscle/dorsiflexor_1/force"] + 2.0 * yielding["muscle/plantarflexor_1/force"]
    given = pull[rows] / STIFFNESS[anchor]
    assert given.max() > 1e-3
    for k in range(0, len(rows), 50):
        data.qpos[0] = yielding["ankle/angle"][rows[k]]
        mujoco.mj_kinematics(model, data)
        upward = data.body(segment).xmat.reshape(3, 3)[:, 2]
        assert moved[k] == pytest.approx(data.body(body).xpos + sign * given[k] * upward, abs=1e-6)


def test_muscles_begin_at_the_moved_cuff(file: pathlib.Path, yielding: Recording) -> None:
    _, cuff = read(file, "/world/bodies/cuff_cuff", "Transform3D:translation")
    _, start = read(file, "/world/muscles/dorsiflexor_2", "Capsules3D:translations")
    _, radius = read(file, "/world/muscles/dorsiflexor_2", "Capsules3D:radii")
    top = np.linalg.norm(start - (cuff + np.array([0.06, 0.0, 0.30])), axis=1)  # the upper end
    assert top == pytest.approx(radius[:, 0], abs=1e-6)
    assert np.ptp(cuff[:, 2]) > 0.005


def test_a_taut_cable_is_straight_and_a_slack_one_as_long_as_it_is(
    file: pathlib.Path, yielding: Recording
) -> None:
    """Link, slack and offset are the cable's length, whatever the joint does."""
    from afo_sim.show.rerun.muscle_shapes import POINTS

    time, _ = read(file, "/world/bodies/foot", "Transform3D:translation")
    rows = np.searchsorted(yielding["time"], time * 1e-9 - 1e-6)
    for name, group in muscle_names(load("scenario", yielding.scenario).orthosis).items():
        cable = (group.link_length or 0.0) + group.slack + group.cable.offset
        force = yielding[f"muscle/{name}/force"][rows]
        drawn = [
            np.array(strip[0]) for strip in lists(file, f"/world/cables/{name}", "LineStrips3D:strips")[1]
        ]
        for k in range(0, len(rows), 20):
            length = np.linalg.norm(np.diff(drawn[k], axis=0), axis=1).sum()
            assert len(drawn[k]) == 2 or force[k] == 0.0
            assert length == pytest.approx(cable, abs=7e-4), (name, k)
        assert len(drawn[0]) == POINTS or name != "plantarflexor_1"


def test_a_bow_is_as_long_as_told_and_turns_away() -> None:
    from afo_sim.show.rerun.muscle_shapes import bow

    ends = np.array([[[0.06, 0.0, 0.2], [0.06, 0.0, 0.1]]] * 3)
    excess = np.array([0.0, 0.01, 0.05])
    points = bow(ends, excess, np.zeros((3, 3)))
    length = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    assert length == pytest.approx(0.1 + excess, rel=0.006)  # eight chords of each parabola
    assert points[0, :, 0] == pytest.approx(0.06, abs=1e-12)
    assert (points[1:, 1:-1, 0] > 0.06).all()
    assert np.array_equal(points[:, [0, -1]], ends)


def test_bodies_come_home(yielding: Recording) -> None:
    model = mujoco.MjModel.from_xml_string(yielding.model_xml)
    groups = muscle_names(load("scenario", yielding.scenario).orthosis)
    home = model.body_pos.copy()
    mountings = Mountings(model, groups, yielding.columns)
    mountings.place({"shank": 0.01, "foot": 0.002})
    shift = {model.body(b).name: v for b, v in enumerate((model.body_pos - home)[:, 2]) if v}
    expected = {"cuff_cuff": -0.01, "shank_anchors": -0.01, "plate_plate": 0.002, "foot_anchors": 0.002}
    assert shift == pytest.approx(expected)
    mountings.place({})
    assert np.array_equal(model.body_pos, home)


def test_a_rigid_device_stays_put(rigid: Recording) -> None:
    model = mujoco.MjModel.from_xml_string(rigid.model_xml)
    groups = muscle_names(load("scenario", rigid.scenario).orthosis)
    assert Mountings(model, groups, rigid.columns).columns == {}


@pytest.fixture(scope="module")
def run() -> Recording:
    return afo_sim.run("seated", {"orthosis": "guided", "duration": "2 s"})


def test_lines_are_as_long_as_the_paths(run: Recording) -> None:
    from afo_sim.show.rerun.scene import guided_lines

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
    from afo_sim.show.rerun.scene import guided_lines

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

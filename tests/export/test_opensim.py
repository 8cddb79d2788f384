"""OpenSim itself reads what is exported; these tests run where its wheel is installed."""

import contextlib
import dataclasses
import pathlib
import tempfile
import warnings
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import afo_sim
from afo_sim.common import InputError
from afo_sim.export import export
from afo_sim.export.opensim import write_storage
from afo_sim.gait_lab.readers.opensim_table import read_opensim_table
from afo_sim.gait_lab.readers.plates import plates_of
from afo_sim.simulation import Recording

with tempfile.TemporaryDirectory() as _scratch, contextlib.chdir(_scratch):  # it leaves opensim.log there
    osim = pytest.importorskip("opensim")
    osim.Logger.removeFileSink()


@pytest.fixture(scope="module")
def folder(walked: Recording, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    made = tmp_path_factory.mktemp("opensim")
    for to in ("sto", "mot"):
        export(walked, made / f"walk.{to}")
    return made


def test_table_has_every_number(folder: pathlib.Path, walked: Recording) -> None:
    table = osim.TimeSeriesTable(str(folder / "walk.sto"))
    assert np.array_equal(table.getIndependentColumn(), walked["time"])
    values = np.column_stack([v for name, v in walked.columns.items() if name != "time"])
    assert np.array_equal(table.getMatrix().to_numpy(), values)
    labels = [name.replace("/", "_") for name in walked.columns if name != "time"]
    assert list(table.getColumnLabels()) == labels
    assert table.getTableMetaDataString("inDegrees") == "no"


def test_storage_has_every_number(folder: pathlib.Path, walked: Recording) -> None:
    for file, degrees, columns in (
        ("walk.sto", False, [v for name, v in walked.columns.items() if name != "time"]),
        ("walk.mot", True, [np.degrees(walked["ankle/angle"]), np.degrees(walked["toe/extension"])]),
    ):
        storage = osim.Storage(str(folder / file))
        assert storage.isInDegrees() is degrees
        assert storage.getSize() == len(walked["time"])
        for row in range(0, storage.getSize(), 97):
            state = storage.getStateVector(row)
            assert state.getTime() == walked["time"][row]
            read = [state.getData().get(k) for k in range(state.getData().size())]
            assert read == [float(column[row]) for column in columns]
    labels = storage.getColumnLabels()
    assert [labels.get(k) for k in range(labels.size())] == ["time", "ankle_angle_r", "mtp_angle_r"]


def leg() -> Any:
    """A shank in the ground, foot and toes on pins about OpenSim's z; coordinates named as in Gait2392."""
    model, zero = osim.Model(), osim.Vec3(0)
    names = ("tibia_r", "calcn_r", "toes_r")
    bodies = [osim.Body(name, 1.0, zero, osim.Inertia(0.01, 0.01, 0.01)) for name in names]
    at = (osim.Vec3(0, -0.43, 0), osim.Vec3(0.18, -0.04, 0))
    joints = [osim.WeldJoint("shank", model.getGround(), bodies[0])]
    for name, parent, body, place in zip(("ankle", "mtp"), bodies, bodies[1:], at, strict=False):
        joints.append(osim.PinJoint(name, parent, place, zero, body, zero, zero))
        joints[-1].updCoordinate().setName(f"{name}_angle_r")
    for body in bodies:
        model.addBody(body)
    for joint in joints:
        model.addJoint(joint)
    return model


def test_model_follows_the_motion_and_feels_the_ground(folder: pathlib.Path, walked: Recording) -> None:
    """Pins about z, as Gait2392's signs are: dorsiflexion lifts the toes in the shank's frame."""
    model = leg()
    loads = osim.ExternalLoads(str(folder / "walk_external_loads.xml"), True)
    model.addModelComponent(loads)
    state = model.initSystem()
    motion = osim.Storage(str(folder / "walk.mot"))
    model.getSimbodyEngine().convertDegreesToRadians(motion)
    height = []
    rows = [int(np.argmin(walked["ankle/angle"])), int(np.argmax(walked["ankle/angle"]))]
    for row in rows:
        angle = motion.getStateVector(row).getData().get(0)
        assert angle == pytest.approx(walked["ankle/angle"][row], rel=1e-14)
        model.getCoordinateSet().get("ankle_angle_r").setValue(state, angle)
        model.realizePosition(state)
        toes, shank = (model.getBodySet().get(name) for name in ("toes_r", "tibia_r"))
        height.append(toes.findStationLocationInAnotherFrame(state, osim.Vec3(0), shank).get(1))
        time = float(walked["time"][row])
        force, point = loads.get(0).getForceAtTime(time), loads.get(0).getPointAtTime(time)
        assert [force.get(k) for k in range(3)] == pytest.approx(
            [walked["ground/force/x"][row], walked["ground/force/z"][row], 0.0], abs=1e-6
        )
        assert point.get(0) == pytest.approx(walked["ground/position/x"][row], abs=1e-9)
    assert loads.get(0).get_applied_to_body() == "calcn_r"
    assert height[1] > height[0] + 0.01


def test_number_that_is_none_would_cost_opensim_the_rest(tmp_path: pathlib.Path) -> None:
    """Why no such number is written: its Storage loses every later row without a word."""
    text = "a\nversion=1\nnRows=3\nnColumns=2\ninDegrees=no\nendheader\ntime\ta\n0\t1\n1\tnan\n2\t3\n"
    (tmp_path / "a.sto").write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert osim.Storage(str(tmp_path / "a.sto")).getSize() < 3


def parts(path: pathlib.Path) -> tuple[list[str], list[str], np.ndarray]:
    """(header, labels, numbers) by the format's own words: lines to endheader, tabs between values."""
    header, body = path.read_bytes().decode("utf-8").split("endheader\n")
    labels, *rows = body.rstrip("\n").split("\n")
    return header.splitlines(), labels.split("\t"), np.array([list(map(float, r.split("\t"))) for r in rows])


def test_every_number_comes_back_to_the_bit(walked: Recording, tmp_path: pathlib.Path) -> None:
    walked.export(tmp_path / "walk.sto")
    header, labels, numbers = parts(tmp_path / "walk.sto")
    assert header[0] == walked.scenario["name"]
    assert {"version=1", "inDegrees=no", f"nRows={len(numbers)}", f"nColumns={len(labels)}"} <= set(header)
    assert numbers.shape == (len(walked["time"]), len(walked.columns))
    assert all(np.array_equal(numbers[:, k], v) for k, v in enumerate(walked.columns.values()))
    table = read_opensim_table(tmp_path / "walk.sto")
    assert not table.remarks + table.warnings and table.degrees is False
    assert np.allclose(table.time, walked["time"], rtol=0.0, atol=1e-9)
    assert np.array_equal(table.columns["ankle_angle"], walked["ankle/angle"])
    assert np.array_equal(
        table.columns["chamber_dorsiflexor_pressure"], walked["chamber/dorsiflexor/pressure"]
    )


def test_time_increases_over_the_join_with_the_settled_stride(
    walked: Recording, tmp_path: pathlib.Path
) -> None:
    walked.export(tmp_path / "walk.sto")
    _, labels, numbers = parts(tmp_path / "walk.sto")
    solved = numbers[:, labels.index("gait_solved")]
    assert 0 < solved.sum() < len(solved)
    steps = np.diff(numbers[:, labels.index("time")])
    assert np.ptp(steps) < 1e-9 and steps.min() > 0.0


def test_labels_are_unique_words(walked: Recording, tmp_path: pathlib.Path) -> None:
    walked.export(tmp_path / "walk.sto")
    _, labels, _ = parts(tmp_path / "walk.sto")
    assert labels[0] == "time"
    assert len(set(labels)) == len(labels) == len(walked.columns)
    assert all(label.isidentifier() and label.isascii() for label in labels)


def test_a_name_is_one_line_and_no_key(tmp_path: pathlib.Path) -> None:
    columns = {"time": np.array([0.0, 0.5]), "a": np.array([1 / 3, -0.0])}
    write_storage(tmp_path / "a.sto", "two\nlines=1", columns, degrees=False, report=lambda done, of: None)
    header, _, numbers = parts(tmp_path / "a.sto")
    assert header[:2] == ["two lines 1", "version=1"]
    assert np.array_equal(numbers[:, 1], columns["a"]) and np.signbit(numbers[1, 1])


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_number_that_opensim_cannot_read_is_never_written(bad: float, tmp_path: pathlib.Path) -> None:
    columns = {"time": np.array([0.0, 0.5]), "a": np.array([1.0, bad])}
    with pytest.raises(InputError, match=r"^a: is not a finite number"):
        write_storage(tmp_path / "a.sto", "a", columns, degrees=False, report=lambda done, of: None)


def with_bad(run: Recording, column: str, row: slice, **changes: str) -> Recording:
    values = run[column].copy()
    values[row] = np.nan
    return dataclasses.replace(run, columns=run.columns | {column: values}, **changes)  # type: ignore[arg-type]


def test_column_that_is_not_finite_is_left_out_and_told(
    seated_second: Recording, tmp_path: pathlib.Path
) -> None:
    run = with_bad(seated_second, "supply/pressure", slice(3, 5))
    with pytest.warns(UserWarning, match="left out.*supply/pressure"):
        run.export(tmp_path / "a.sto")
    _, labels, numbers = parts(tmp_path / "a.sto")
    assert set(labels) >= {"ankle_angle"} and "supply_pressure" not in labels
    assert len(numbers) == len(run["time"])


def test_failed_run_ends_before_its_first_bad_row(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    run = with_bad(seated_second, "ankle/angle", slice(200, None), status="failed: why")
    with pytest.warns(UserWarning) as told:
        run.export(tmp_path / "a.sto")
    _, labels, numbers = parts(tmp_path / "a.sto")
    assert numbers.shape == (200, len(run.columns))
    assert np.array_equal(numbers[:, labels.index("ankle_angle")], seated_second["ankle/angle"][:200])
    text = " ".join(str(warning.message) for warning in told)
    assert "failed: why" in text and f"last {len(run['time']) - 200} rows" in text


# of opensim-org/opensim-models, Gait2392_Simbody/gait2392_simbody.osim; x forward, y up
GAIT2392 = {
    "ankle_angle_r": (-0.10501355, -0.17402245, 0.97912632),
    "mtp_angle_r": (-0.5809544, 0, 0.81393611),
}
# Models/Rajagopal/Rajagopal2016.osim of the same: x-y-z turns of the left toes' pin on the foot [rad]
RAJAGOPAL_MTP = (-3.14159, -0.619901, 0.0)


def written(run: Recording, folder: pathlib.Path) -> list[pathlib.Path]:
    return list(run.export(folder / "walk.mot"))


def test_axes_of_gait2392_turn_the_toes_up() -> None:
    """Its ankle and toes have this project's signs; the toes of the Rajagopal models the other one."""
    tip = np.array([0.1, 0.0, 0.0])
    for axis in GAIT2392.values():
        assert Rotation.from_rotvec(np.radians(10.0) * np.array(axis)).apply(tip)[1] > 0.01
    pin = Rotation.from_euler("XYZ", RAJAGOPAL_MTP).apply([0.0, 0.0, 1.0])
    assert Rotation.from_rotvec(np.radians(10.0) * pin).apply(tip)[1] < -0.01


def test_angles_are_degrees_by_opensims_names(walked: Recording, tmp_path: pathlib.Path) -> None:
    files = written(walked, tmp_path)
    names = ["walk.mot", "walk_grf.mot", "walk_external_loads.xml", "walk_metrics.csv"]
    assert [file.name for file in files] == names
    table = read_opensim_table(files[0])
    assert table.degrees is True and not table.remarks + table.warnings
    assert list(table.columns) == ["ankle_angle_r", "mtp_angle_r"]
    assert np.array_equal(table.columns["ankle_angle_r"], walked["ankle/angle"] * (180.0 / np.pi))
    assert np.array_equal(table.columns["mtp_angle_r"], walked["toe/extension"] * (180.0 / np.pi))


@pytest.mark.parametrize("mode", ["recorded", "contact"])
def test_ground_force_has_the_runs_moment_about_the_ankle(
    mode: str, walked: Recording, tmp_path: pathlib.Path
) -> None:
    """r × F + T about z, from forward to up: force, point and torque together, by the reader of plates."""
    run = walked
    if mode == "contact":
        run = afo_sim.run("walk-dropfoot-afo", {"duration": "1.2 s", "ground.mode": "contact"})
    table = read_opensim_table(written(run, tmp_path)[1])
    (plate,) = plates_of(table)
    ankle = np.column_stack([run["ankle/position/x"], run["ankle/position/z"]])
    rx, ry = (plate.place[:, :2] - ankle).T
    by_force = rx * plate.force[:, 1] - ry * plate.force[:, 0]
    moment = by_force + table.columns["ground_torque_z"]
    assert np.abs(moment).max() > 50.0
    assert np.allclose(moment, run["ankle/moment/ground"], rtol=0.0, atol=1e-9)
    if mode == "recorded":  # the force alone has all of it
        assert np.abs(table.columns["ground_torque_z"]).max() < 1e-5
    assert not plate.force[:, 2].any() and not plate.place[:, 1:].any()
    assert not table.columns["ground_torque_x"].any() and not table.columns["ground_torque_y"].any()


def test_left_leg_is_the_left_one(walked_left: Recording, tmp_path: pathlib.Path) -> None:
    files = written(walked_left, tmp_path)
    assert list(read_opensim_table(files[0]).columns) == ["ankle_angle_l", "mtp_angle_l"]
    assert "calcn_l" in files[2].read_text(encoding="utf-8")


@pytest.mark.parametrize("key", ["side", "leg.side"])
def test_a_told_side_is_the_exports(key: str, tmp_path: pathlib.Path) -> None:
    run = afo_sim.run("seated", {"duration": "0.2 s", key: "left"})
    table = read_opensim_table(written(run, tmp_path)[0])
    assert list(table.columns) == ["ankle_angle_l"]
    assert np.array_equal(table.columns["ankle_angle_l"], run["ankle/angle"] * (180.0 / np.pi))


def test_told_side_stands_before_the_recorded_walkers(tmp_path: pathlib.Path) -> None:
    run = afo_sim.run("walk-dropfoot", {"duration": "1.2 s", "side": "left"})  # a right leg was recorded
    assert "ankle_angle_l" in read_opensim_table(written(run, tmp_path)[0]).columns


def test_loads_name_their_file_and_columns(walked: Recording, tmp_path: pathlib.Path) -> None:
    files = written(walked, tmp_path)
    (force,) = ElementTree.parse(files[2]).getroot().iter("ExternalForce")
    facts = {child.tag: child.text for child in force}
    assert facts["applied_to_body"] == "calcn_r" and facts["data_source_name"] == files[1].name
    columns = read_opensim_table(files[1]).columns
    for key in ("force_identifier", "point_identifier", "torque_identifier"):
        assert {f"{facts[key]}{axis}" for axis in "xyz"} <= set(columns)


def test_seated_leg_has_an_angle_only(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    files = seated_second.export(tmp_path / "s.mot")
    assert [file.name for file in files] == ["s.mot", "s_metrics.csv"]
    assert list(read_opensim_table(files[0]).columns) == ["ankle_angle_r"]


def test_an_arm_is_no_leg(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="has no ankle"):
        afo_sim.run("arm", {"duration": "0.05 s"}).export(tmp_path / "arm.mot")
    assert not list(tmp_path.iterdir())

"""OpenSim itself reads what is exported; these tests run where its wheel is installed."""

import contextlib
import pathlib
import tempfile
import warnings
from typing import Any

import numpy as np
import pytest

from afo_sim.export.exported import export
from afo_sim.simulation.recording import Recording

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

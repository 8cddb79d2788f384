"""Joint angles and ground force in OpenSim's names, axes and signs."""

import pathlib
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import afo_sim
from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_table import read_opensim_table
from afo_sim.gait_lab.readers.plates import plates_of
from afo_sim.simulation.recording import Recording

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
    hinge = {"leg.subtalar.stiffness": "10 N*m/rad", "leg.subtalar.damping": "0.2 N*m*s/rad"}
    run = afo_sim.run("seated", {"duration": "0.2 s", key: "left"} | hinge)
    table = read_opensim_table(written(run, tmp_path)[0])
    assert list(table.columns) == ["ankle_angle_l", "subtalar_angle_l"]
    assert np.array_equal(table.columns["subtalar_angle_l"], run["subtalar/angle"] * (180.0 / np.pi))


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

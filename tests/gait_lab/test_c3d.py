"""C3D plates of types 1 to 4 written from a known force at a known place, and files with faults."""

import pathlib

import numpy as np
import pytest
from c3d_plates import (
    CENTRE,
    FRAMES,
    HALF,
    ORIGIN,
    RATE,
    SENSORS,
    STANCE,
    TIME,
    channels,
    matrix,
    pressed,
    turned,
    walker,
    write,
)

from afo_sim.common import InputError
from afo_sim.gait_lab import Plate
from afo_sim.gait_lab.readers.c3d import read_c3d


def assert_recovered(plate: Plate, *, newtons: float = 0.01, millimetres: float = 0.05) -> None:
    force, place, _ = pressed()
    assert np.abs(plate.force - force).max() < newtons
    loaded = np.linalg.norm(force, axis=1) > 100.0
    assert 1e3 * np.abs(plate.place - place)[loaded].max() < millimetres


@pytest.mark.parametrize("unit", ["mm", "m"])
def test_force_and_place_come_back(tmp_path: pathlib.Path, unit: str) -> None:
    """Every type, turned about three angles, all in one file."""
    cases = [(kind, turned(angle)) for kind in (1, 2, 3, 4) for angle in (0.0, 90.0, 197.0)]
    signals = [channels(kind, turn, ORIGIN, {"mm": 1e-3, "m": 1.0}[unit]) for kind, turn in cases]
    path = write(
        tmp_path / "a.c3d", signals, [kind for kind, _ in cases], [turn for _, turn in cases], unit=unit
    )
    markers, plates = read_c3d(path)
    assert [plate.name for plate in plates] == [str(k) for k in range(1, 13)]
    assert not markers.warnings
    for plate, (_, turn) in zip(plates, cases, strict=True):
        assert_recovered(plate)
        assert plate.time == pytest.approx(TIME)
        assert not plate.warnings
        assert plate.corners is not None
        assert plate.corners[0] == pytest.approx(CENTRE + turn[:, :2] @ HALF, abs=1e-6)


def test_a_constant_without_load_is_taken_off(tmp_path: pathlib.Path) -> None:
    """Some −15 N and 2 N·m, and the noise of an amplifier: force and place come back without them."""
    turn, kinds = turned(30.0), [2, 3, 4]
    offsets = {
        2: [2.0, -1.0, -15.0, 2000.0, -900.0, 300.0],
        3: [1.0, 1.0, -1.0, 0.5, -4.0, -3.0, 0.0, 0.0],
        4: [1.0, -0.4, -3.7, 2.2, -1.5, 0.7],
    }
    signals = [channels(kind, turn, ORIGIN, 1e-3) + offsets[kind] for kind in kinds]
    dice = np.random.default_rng(3)
    for signal, gain in zip(signals, (1.0, 1.0, matrix()[2, 2]), strict=True):
        signal[:, 4 if signal.shape[1] == 8 else 2] += dice.normal(0.0, 0.3, len(TIME)) / gain
    _, plates = read_c3d(write(tmp_path / "a.c3d", signals, kinds, [turn] * 3))
    force, place, _ = pressed()
    full = np.linalg.norm(force, axis=1) > 600.0
    for plate in plates:
        # five times the noise, at 100 N of load: places lie up to 0.14 m from the middle, sensors 0.29 m
        assert_recovered(plate, newtons=1.5, millimetres=1.5 / 100.0 * (140.0 + 290.0))
        assert np.abs(np.median(plate.force[~STANCE], axis=0)).max() < 0.05
        assert 1e3 * np.abs((plate.place - place)[full].mean(axis=0)).max() < 0.2
        assert any("N without load, which was taken off" in remark for remark in plate.remarks)
    assert "read 15.2 N without load" in plates[0].remarks[0]  # √(2² + 1² + 15²)


def test_a_type_1s_constant_is_taken_off_its_force(tmp_path: pathlib.Path) -> None:
    signal = channels(1, turned(0.0), ORIGIN, 1e-3)
    signal[:, 2] += 15.0
    _, (plate,) = read_c3d(write(tmp_path / "a.c3d", [signal], [1], [turned(0.0)]))
    assert_recovered(plate)
    assert plate.remarks == ("plate 1: read 15.0 N without load, which was taken off",)


def test_an_origin_that_points_up_is_turned(tmp_path: pathlib.Path) -> None:
    turn, kinds = turned(-70.0), [2, 4]
    signals = [channels(kind, turn, ORIGIN, 1e-3) for kind in kinds]
    _, plates = read_c3d(write(tmp_path / "a.c3d", signals, kinds, [turn] * 2, origin=-ORIGIN))
    for plate in plates:
        assert_recovered(plate)
        assert "its ORIGIN points up" in plate.remarks[0]
    upside = np.array([*SENSORS, -ORIGIN[2]])
    signal = channels(3, turn, ORIGIN, 1e-3)
    _, (plate,) = read_c3d(write(tmp_path / "a.c3d", [signal], [3], [turn], origin=upside))
    assert_recovered(plate)  # of type 3 the numbers are distances


def test_an_origin_in_another_unit_is_told(tmp_path: pathlib.Path) -> None:
    turn = turned(0.0)
    signal = channels(2, turn, ORIGIN, 1.0)
    path = write(tmp_path / "a.c3d", [signal], [2], [turn], unit="m", origin=1e3 * ORIGIN)
    _, (plate,) = read_c3d(path)
    assert_recovered(plate)
    assert plate.warnings == ("plate 1: its origin lies 40 m deep as stated; it was read as mm",)


@pytest.mark.parametrize(
    ("factor", "stated", "warned"),
    [
        (1e-3, "Nmm", False),
        (1.0, "Nm", False),
        (1.0, "N.m", False),
        (1.0, "", True),
        (1.0, "Nmm", True),
        (1e-3, "Nm", True),
    ],
)
def test_moments_are_in_the_unit_that_keeps_the_pressure_on_the_plate(
    tmp_path: pathlib.Path, factor: float, stated: str, warned: bool
) -> None:
    turn = turned(10.0)
    signal = channels(2, turn, ORIGIN, factor)
    _, (plate,) = read_c3d(write(tmp_path / "a.c3d", [signal], [2], [turn], moments=stated))
    assert_recovered(plate)
    assert bool(plate.warnings) is warned
    assert not warned or "moments in the stated unit" in plate.warnings[0]


def test_a_wrong_origin_is_doubted(tmp_path: pathlib.Path) -> None:
    turn = turned(0.0)
    signal = channels(2, turn, np.array([0.4, 0.0, -0.04]), 1e-3)
    _, (plate,) = read_c3d(write(tmp_path / "a.c3d", [signal], [2], [turn]))
    assert "lies off the plate in 100 % of its loaded samples" in plate.warnings[0]


def test_plates_without_channels_type_or_corners_are_left_out(tmp_path: pathlib.Path) -> None:
    turn = turned(0.0)
    signal = channels(2, turn, ORIGIN, 1e-3)

    def change(file) -> None:
        group = file.parameters["FORCE_PLATFORM"]
        group["CHANNEL"][:, 1] = [40, 41, 42, 43, 44, 45]
        group["TYPE"][2] = 6
        group["CORNERS"][:, :, 3] = 0.0

    path = write(tmp_path / "a.c3d", [signal] * 5, [2] * 5, [turn] * 5, change=change)
    markers, plates = read_c3d(path)
    assert [plate.name for plate in plates] == ["1", "5"]
    for plate in plates:
        assert_recovered(plate)
    assert markers.warnings == (
        "plate 2 was left out: the file has 30 analog channels, not all of its own (40, 41, 42, 43, 44, 45)",
        "plate 3 was left out: its type is 6, and types 1 to 4 are read",
        "plate 4 was left out: its corners are all the same point",
    )


def test_units_that_lie_are_found_by_size(tmp_path: pathlib.Path) -> None:
    turn = turned(0.0)
    signal = channels(2, turn, ORIGIN, 1e-3)
    path = write(tmp_path / "a.c3d", [signal], [2], [turn], unit="m", metre=1e-3)
    markers, (plate,) = read_c3d(path)
    assert markers.positions["C7"][0] == pytest.approx(walker(5)[0, 0], abs=1e-6)
    assert "they were read as mm" in markers.warnings[0]
    assert_recovered(plate)


def test_a_late_first_frame_shifts_both_clocks(tmp_path: pathlib.Path) -> None:
    turn = turned(0.0)
    path = write(tmp_path / "a.c3d", [channels(2, turn, ORIGIN, 1e-3)], [2], [turn], first=250)
    markers, (plate,) = read_c3d(path)
    assert markers.time == pytest.approx(2.5 + np.arange(FRAMES) / RATE)
    assert plate.time == pytest.approx(2.5 + TIME)


def test_labels_of_all_sorts(tmp_path: pathlib.Path) -> None:
    """Subjects' prefixes and blanks stay, doubles get a number, a 256th label is read."""
    labels = ["Anna:RANK", "R Knee ", "RHEE", "RHEE", ""] + [f"m{k}" for k in range(5, 300)]
    file = write(tmp_path / "a.c3d", [], [], [], labels=labels)
    markers, plates = read_c3d(file)
    names = list(markers.positions)
    assert not plates
    assert names[:4] == ["Anna:RANK", "R Knee", "RHEE", "RHEE.2"]
    assert names[255:257] == ["m255", "m256"]
    assert len(names) == 300
    assert names[4] == "unnamed 5"
    assert markers.positions["m256"] == pytest.approx(walker(300)[:, 256], abs=1e-5)


def test_lost_points_models_results_and_events(tmp_path: pathlib.Path) -> None:
    labels = ["C7", "RASI", "LASI", "RANK", "RHEE", "RKneeAngles"]
    points = walker(6)
    points[:, 5] = 60.0  # degrees in what is said to be mm
    points[10, 3] = 0.0

    def change(file) -> None:
        file.add_parameter("POINT", "ANGLES", ["RKneeAngles"])
        file.residuals = np.zeros((FRAMES, 6))
        file.residuals[20, 4] = -1.0
        file.add_event([0.0, 1.25], context="Right", label="Foot Strike")

    markers, _ = read_c3d(write(tmp_path / "a.c3d", [], [], [], labels=labels, points=points, change=change))
    assert list(markers.positions) == labels[:5]
    assert np.flatnonzero(np.isnan(markers.positions["RANK"][:, 0])).tolist() == [10]
    assert np.flatnonzero(np.isnan(markers.positions["RHEE"][:, 0])).tolist() == [20]
    assert markers.remarks == (
        "1 of its points are a model's results, no markers",
        "the laboratory states 1 events; events and curves are compared, not taken",
    )
    assert markers.stated is not None
    assert markers.stated.events == {("right", "heel strike"): (1.25,)}


def test_plates_alone_and_markers_alone(tmp_path: pathlib.Path) -> None:
    turn = turned(0.0)
    path = write(
        tmp_path / "a.c3d", [channels(2, turn, ORIGIN, 1e-3)], [2], [turn], labels=[], points=walker(1)[:, :0]
    )
    markers, (plate,) = read_c3d(path)
    assert not markers.positions
    assert_recovered(plate)
    markers, plates = read_c3d(write(tmp_path / "b.c3d", [], [], []))
    assert len(markers.positions) == 5 and not plates


def test_ezc3d_computes_the_same(tmp_path: pathlib.Path) -> None:
    """Two programs, one file: where nothing is to be mended, they agree to the last micrometre."""
    ezc3d = pytest.importorskip("ezc3d")
    turn, kinds = turned(33.0), [1, 2, 3, 4]
    signals = [channels(kind, turn, ORIGIN, 1e-3) for kind in kinds]
    path = write(tmp_path / "a.c3d", signals, kinds, [turn] * 4)
    others = ezc3d.c3d(str(path), extract_forceplat_data=True)["data"]["platform"]
    for plate, other in zip(read_c3d(path)[1], others, strict=True):
        assert plate.force == pytest.approx(other["force"].T, abs=1e-4)
        assert plate.place[STANCE] == pytest.approx(1e-3 * other["center_of_pressure"].T[STANCE], abs=1e-6)


def test_cut_and_foreign_files_are_one_sentence(tmp_path: pathlib.Path) -> None:
    path = write(tmp_path / "a.c3d", [], [], [])
    raw = path.read_bytes()
    for part in (0, 1, 100, 512, 700, len(raw) // 2, len(raw) - 600):
        path.write_bytes(raw[:part])
        with pytest.raises(InputError, match=r"not a whole C3D file|is cut short"):
            read_c3d(path)
    path.write_text("time,knee\n" * 500)
    with pytest.raises(InputError, match="is not a whole C3D file"):
        read_c3d(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_c3d(tmp_path / "nowhere.c3d")

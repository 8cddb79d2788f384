"""Marker files with odd headers, wrong units, lost and unnamed markers."""

import pathlib

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.gait_lab.readers.trc import read_trc

NAMES = ("C7", "R.ASIS", "L.ASIS", "R.Knee", "R.Ankle", "R.Heel", "R.Toe")
HEIGHTS = (1.45, 0.98, 0.99, 0.5, 0.1, 0.05, 0.04)  # [m]
TIME = np.arange(40) / 100.0
KEYS = ("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units")


def points() -> np.ndarray:
    """Somebody of 1.45 m to the neck walks at 1.2 m/s [m] (frames, markers, 3)."""
    along = 1.2 * TIME[:, None] + np.linspace(-0.1, 0.2, 7)
    return np.stack([along, np.broadcast_to(HEIGHTS, along.shape), 0.0 * along + 0.1], axis=2)


def trc(
    *,
    factor: float = 1000.0,
    unit: str | None = "mm",
    rate: str = "100",
    frames: int = 40,
    markers: int = 7,
    names: tuple[str, ...] = NAMES,
    time: np.ndarray = TIME,
) -> list[str]:
    """Lines of a file; `factor` is what a metre is in its numbers, `unit` what its header says."""
    values = [rate, rate, str(frames), str(markers), *([unit] if unit is not None else [])]
    keys = KEYS if unit is not None else KEYS[:-1]
    lines = ["PathFileType\t4\t(X/Y/Z)\twalk.trc", "\t".join(keys), "\t".join(values)]
    lines += ["Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t"]
    lines += ["\t\t" + "\t".join(f"{a}{k}" for k in range(1, len(names) + 1) for a in "XYZ"), ""]
    for k, row in enumerate(points()):
        cells = [f"{factor * value:.6g}" for value in row.ravel()]
        lines.append("\t".join([str(k + 1), f"{time[k]:.5f}", *cells]))
    return lines


def read(tmp_path: pathlib.Path, lines: list[str], end: str = "\n"):
    path = tmp_path / "walk.trc"
    path.write_text("\n".join(lines) + end)
    return read_trc(path)


def assert_the_points(markers, names: tuple[str, ...] = NAMES) -> None:
    assert tuple(markers.positions) == names
    for k, name in enumerate(names):
        assert markers.positions[name] == pytest.approx(points()[:, k], abs=1e-5)
    assert markers.time == pytest.approx(TIME)


@pytest.mark.parametrize(
    ("factor", "unit", "warning"),
    [
        (1000.0, "mm", ""),
        (1.0, "m", ""),
        (100.0, "cm", ""),
        (1000.0, "Millimeters", ""),
        (1000.0 / 25.4, "in", ""),
        (1000.0, "m", "span 1.41e+03 m if they are in m as stated; they were read as mm"),
        (1.0, "mm", "span 0.00141 m if they are in mm as stated; they were read as m"),
        (100.0, "m", "they were read as cm"),
        (1000.0, "", "not stated; read as mm, a person of 1.41 m"),
        (1.0, None, "not stated; read as m, a person of 1.41 m"),
    ],
)
def test_the_unit_is_the_one_that_makes_a_person(
    tmp_path: pathlib.Path, factor: float, unit: str | None, warning: str
) -> None:
    markers = read(tmp_path, trc(factor=factor, unit=unit))
    assert_the_points(markers)
    assert len(markers.warnings) == bool(warning)
    assert not warning or warning in markers.warnings[0]


def test_a_size_that_fits_no_unit_is_told_or_refused(tmp_path: pathlib.Path) -> None:
    markers = read(tmp_path, trc(factor=2e4, unit="mm"))  # 28 m, or 282 m in cm
    assert "nobody is of that size" in markers.warnings[0]
    assert markers.positions["C7"][0, 1] == pytest.approx(29.0)
    with pytest.raises(InputError, match="Units: is not stated"):
        read(tmp_path, trc(factor=2e4, unit=""))
    with pytest.raises(InputError, match="'parsnips': is not a valid length"):
        read(tmp_path, trc(unit="parsnips"))


def test_wrong_counts_are_warnings(tmp_path: pathlib.Path) -> None:
    markers = read(tmp_path, trc(frames=50, markers=9))
    assert_the_points(markers)
    assert markers.warnings == (
        "has 40 frames, its header says 50: cut short?",
        "has 7 markers, its header says 9",
    )


@pytest.mark.parametrize(
    "change",
    [
        lambda lines: lines[1:],  # no PathFileType
        lambda lines: [lines[0], "", *lines[1:3], "", *lines[3:]],
        lambda lines: [*lines[:3], lines[3].replace("Frame#", "Frame #"), *lines[4:]],
        lambda lines: [*lines[:3], lines[3].replace("Frame#", "Frame"), *lines[4:]],
        lambda lines: [*lines[:4], *lines[6:]],  # no line of X1 Y1 Z1
        lambda lines: [line + "\t\t" for line in lines],
        lambda lines: [line + "\r" for line in lines],
        lambda lines: [*lines[:6], *(line.replace(".", ",") for line in lines[6:])],
        lambda lines: [*lines[:3], *(" ".join(line.split()) for line in lines[3:])],  # blanks, no tabs
        lambda lines: [*lines[:4], *("   ".join(line.split()) for line in lines[4:])],
        lambda lines: [lines[0], lines[1].replace("\t", "  "), lines[2].replace("\t", "\t\t "), *lines[3:]],
        lambda lines: [*lines[:3], "\t".join(["Frame#", "Time", *NAMES]), *lines[4:]],  # names side by side
    ],
)
def test_odd_layouts_are_read(tmp_path: pathlib.Path, change) -> None:
    markers = read(tmp_path, change(trc()))
    assert_the_points(markers)
    assert not markers.warnings


@pytest.mark.parametrize(
    "cells",
    ["0\t0\t0", "\t\t", "NaN\tNaN\tNaN", "9999999\t9999999\t9999999", "12\t\t3", "-9999\t-9999\t-9999"],
)
def test_a_lost_marker_is_nan(tmp_path: pathlib.Path, cells: str) -> None:
    lines = trc()
    row = lines[16].split("\t")
    lines[16] = "\t".join([*row[:11], cells, *row[14:]])
    markers = read(tmp_path, lines)
    knee = markers.positions["R.Knee"]
    assert np.flatnonzero(np.isnan(knee).any(axis=1)).tolist() == [10]
    assert np.isnan(knee[10]).all()
    assert markers.positions["R.Ankle"] == pytest.approx(points()[:, 4], abs=1e-5)


def test_doubled_unnamed_and_unseen_markers(tmp_path: pathlib.Path) -> None:
    names = ("C7", "R.ASIS", "R.ASIS", "", "R.Ankle", "R.Heel", "R.Toe")
    lines = trc(names=names)
    lines[6:] = ["\t".join([*line.split("\t")[:20], "0", "0", "0"]) for line in lines[6:]]
    markers = read(tmp_path, lines)
    assert list(markers.positions) == ["C7", "R.ASIS", "R.ASIS.2", "unnamed 4", "R.Ankle", "R.Heel"]
    assert markers.positions["R.ASIS.2"] == pytest.approx(points()[:, 2], abs=1e-5)
    assert markers.positions["unnamed 4"] == pytest.approx(points()[:, 3], abs=1e-5)
    assert any("R.ASIS.2" in warning for warning in markers.warnings)
    assert any("1 marker has no name: unnamed 4" in warning for warning in markers.warnings)
    assert markers.remarks == ("never seen: R.Toe",)


def test_columns_beyond_the_names_are_unnamed(tmp_path: pathlib.Path) -> None:
    lines = trc()
    lines[3] = "Frame#\tTime\t" + "\t\t\t".join(NAMES[:5])
    markers = read(tmp_path, lines)
    assert list(markers.positions)[5:] == ["unnamed 6", "unnamed 7"]
    assert markers.positions["R.Ankle"] == pytest.approx(points()[:, 4], abs=1e-5)


def test_the_clock_and_the_rate(tmp_path: pathlib.Path) -> None:
    assert not read(tmp_path, trc(time=TIME + 1.0)).warnings
    markers = read(tmp_path, trc(rate="200"))  # two clocks
    assert markers.time == pytest.approx(TIME)
    assert markers.warnings == ("its clock has steps of 100 Hz, its header says 200 Hz: the clock is taken",)
    markers = read(tmp_path, trc(rate="150", time=0.007 * np.arange(40)))  # 1/150 s printed as 0.007
    assert markers.time == pytest.approx(np.arange(40) / 150.0)
    assert "rounded steps of 0.007 s; the stated 150 Hz are taken" in markers.warnings[0]
    markers = read(tmp_path, trc(rate="150", time=np.round(np.arange(40) / 150.0, 3)))
    assert markers.time == pytest.approx(np.arange(40) / 150.0, abs=1e-3)
    assert np.diff(markers.time) == pytest.approx(np.full(39, 1.0 / 150.0))
    assert not markers.warnings
    markers = read(tmp_path, trc(time=0.0 * TIME))
    assert markers.time == pytest.approx(TIME)
    assert markers.warnings == ("has no times; they were counted at DataRate 100 Hz",)
    with pytest.raises(InputError, match="neither times nor a DataRate"):
        read(tmp_path, trc(rate="?", time=0.0 * TIME))


def test_a_file_without_a_time_column(tmp_path: pathlib.Path) -> None:
    lines = trc()
    lines[3] = lines[3].replace("Time\t", "")
    lines[6:] = ["\t".join([line.split("\t")[0], *line.split("\t")[2:]]) for line in lines[6:]]
    assert_the_points(read(tmp_path, lines))


def test_a_cut_last_row_is_left_out(tmp_path: pathlib.Path) -> None:
    lines = trc()
    lines[-1] = lines[-1][: len(lines[-1]) // 2]
    markers = read(tmp_path, lines, end="")
    assert len(markers.time) == 39
    assert markers.warnings[0] == "its last row is cut short and was left out"
    assert read(tmp_path, trc(), end="").time == pytest.approx(TIME)


def test_what_cannot_be_told_apart_is_refused(tmp_path: pathlib.Path) -> None:
    lines = [*trc()[:3], *(" ".join(line.split()) for line in trc()[3:])]
    lines[12] = " ".join(lines[12].split()[:-3])  # blanks do not say which marker was lost
    with pytest.raises(InputError, match="tabs between the cells"):
        read(tmp_path, lines)
    lines = trc()
    lines[9] = lines[9].replace("\t", "\tword", 3)
    with pytest.raises(InputError, match="frame 4 holds something that is not a number"):
        read(tmp_path, lines)


def test_a_clock_in_milliseconds_is_refused(tmp_path: pathlib.Path) -> None:
    lines = trc()
    for k, line in enumerate(lines[6:], start=6):
        cells = line.split("\t")
        lines[k] = "\t".join([cells[0], f"{1e3 * float(cells[1]):.3f}", *cells[2:]])
    with pytest.raises(InputError, match="milliseconds, or numbers of frames"):
        read(tmp_path, lines)

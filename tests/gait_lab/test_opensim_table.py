"""Tables as other programs, spreadsheets and full disks leave them."""

import pathlib

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable, read_opensim_table
from afo_sim.gait_lab.readers.plates import plates_of
from afo_sim.gait_lab.readers.unit_checks import angle_unit

HEADER = "walk\nversion=1\nnRows={rows}\nnColumns={columns}\ninDegrees=yes\nendheader\n"
ROWS = [[0.01 * k, 10.0 + k, -2.5 * k] for k in range(8)]


def written(
    path: pathlib.Path,
    rows: list[list[float]] | None = None,
    titles: str = "time\tknee_angle_r\tankle_angle_r",
    rows_stated: int = 8,
    columns_stated: int = 3,
    cell: str = "{:g}",
    separator: str = "\t",
) -> pathlib.Path:
    head = HEADER.format(rows=rows_stated, columns=columns_stated)
    lines = [separator.join(cell.format(v) for v in row) for row in rows or ROWS]
    path.write_text(head + titles.replace("\t", separator) + "\n" + "\n".join(lines) + "\n")
    return path


@pytest.fixture
def path(tmp_path: pathlib.Path) -> pathlib.Path:
    return tmp_path / "walk.mot"


def assert_the_rows(path: pathlib.Path, rows: int = 8) -> None:
    table = read_opensim_table(path)
    assert table.time == pytest.approx([0.01 * k for k in range(rows)])
    assert table.columns["knee_angle_r"] == pytest.approx([10.0 + k for k in range(rows)])
    assert table.columns["ankle_angle_r"] == pytest.approx([-2.5 * k for k in range(rows)])
    assert table.degrees is True


def test_a_miscounting_header_is_a_warning(path: pathlib.Path) -> None:
    assert_the_rows(written(path, rows_stated=12, columns_stated=4))
    assert read_opensim_table(path).warnings == ("has 8 rows, its header says 12: cut short?",)
    assert "has 3 columns, its header says 4" in read_opensim_table(path).remarks
    assert_the_rows(written(path, rows_stated=5))
    assert read_opensim_table(path).warnings == ("has 8 rows, its header says 5",)


def test_a_cut_last_row_is_left_out(path: pathlib.Path) -> None:
    text = written(path).read_text()
    path.write_text(text[:-9])  # "0.07\t17\t-17.5" ends after "0.07\t"
    assert_the_rows(path, rows=7)
    warnings = read_opensim_table(path).warnings
    assert warnings[0] == "its last row is cut short and was left out"
    assert "has 7 rows, its header says 8: cut short?" in warnings
    path.write_text(text.rstrip("\n"))  # no line end, but a whole row
    assert_the_rows(path)


def test_a_short_row_in_the_middle_is_refused(path: pathlib.Path) -> None:
    lines = written(path).read_text().splitlines()
    lines[9] = lines[9].rsplit("\t", 1)[0]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match="row 3 of its table is not 3 numbers"):
        read_opensim_table(path)


@pytest.mark.parametrize("separator", ["\t", ";", " ", "   "])
def test_decimal_commas_and_separators(path: pathlib.Path, separator: str) -> None:
    written(path, separator=separator)
    assert_the_rows(path)
    head, _, body = path.read_text().partition("endheader\n")
    path.write_text(head + "endheader\n" + body.replace(".", ","))
    assert_the_rows(path)


def test_commas_between_cells_and_quoted_titles(path: pathlib.Path) -> None:
    assert_the_rows(written(path, separator=",", titles='"time"\t"knee_angle_r"\t"ankle_angle_r"'))


@pytest.mark.parametrize(
    "word", ["nan", "NaN", "-nan(ind)", "1.#QNAN", "-1.#IND", "1.#QNAN00", "", "N/A", "nan(0x8000)"]
)
def test_cells_without_a_number_are_nan(path: pathlib.Path, word: str) -> None:
    text = written(path).read_text().replace("\t12\t", f"\t{word}\t")
    path.write_text(text)
    knee = read_opensim_table(path).columns["knee_angle_r"]
    assert np.flatnonzero(np.isnan(knee)).tolist() == [2]
    assert knee[3] == 13.0


def test_trailing_tabs_windows_ends_byte_order_mark_and_latin_1(path: pathlib.Path) -> None:
    text = written(path).read_text().replace("walk\n", "Messung f\xfcr Gang\n", 1).replace("\n", "\t\t\r\n")
    path.write_bytes(text.encode("latin-1"))
    assert_the_rows(path)
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert_the_rows(path)
    path.write_bytes(text.encode("utf-16"))
    assert_the_rows(path)


def test_time_may_stand_elsewhere_and_be_called_otherwise(path: pathlib.Path) -> None:
    turned = [[row[1], row[2], row[0]] for row in ROWS]
    written(path, turned, titles="knee_angle_r\tankle_angle_r\tTime [s]")
    assert_the_rows(path)
    assert read_opensim_table(path).remarks == ("its clock is column 3, 'Time [s]'",)
    written(path, [[10.0 + row[0] * 1e3, *row[1:]] for row in ROWS], titles="time [ms]\tknee\tankle")
    assert read_opensim_table(path).time == pytest.approx([0.01 + 0.01 * k for k in range(8)])
    written(path, titles="instant\tknee_angle_r\tankle_angle_r")
    assert_the_rows(path)
    assert read_opensim_table(path).remarks == ("its first column, 'instant', was taken as the time",)
    written(path, [[10.0 * k, *row[1:]] for k, row in enumerate(ROWS)])
    with pytest.raises(InputError, match="its time runs in steps of 10 s: milliseconds"):
        read_opensim_table(path)


def test_doubled_columns_keep_both(path: pathlib.Path) -> None:
    table = read_opensim_table(written(path, titles="time\tknee_angle_r\tknee_angle_r"))
    assert table.columns["knee_angle_r"][1] == 11.0
    assert table.columns["knee_angle_r.2"][1] == -2.5
    (warning,) = table.warnings
    assert "knee_angle_r.2" in warning and "column names come more than once" in warning


def test_states_keep_angle_and_speed_apart(path: pathlib.Path) -> None:
    titles = "time\t/jointset/knee_r/knee_angle_r/value\t/jointset/knee_r/knee_angle_r/speed"
    assert list(read_opensim_table(written(path, titles=titles)).columns) == ["knee_angle_r", "speed"]
    four = [[*row, *row[1:]] for row in ROWS]
    titles += "\t/jointset/ankle_r/ankle_angle_r/value\t/jointset/ankle_r/ankle_angle_r/speed"
    assert list(read_opensim_table(written(path, four, titles=titles)).columns) == [
        "knee_angle_r",
        "knee_angle_r/speed",
        "ankle_angle_r",
        "ankle_angle_r/speed",
    ]


@pytest.mark.parametrize("header", [True, False])
def test_quaternions_are_refused_by_name(path: pathlib.Path, header: bool) -> None:
    lines = ["DataType=Quaternion" if header else "DataRate=100", "version=3", "endheader"]
    lines += ["time\tpelvis_imu\tfemur_r_imu", *[f"{0.01 * k}\t1,0,0,0\t0.7,0.7,0,0" for k in range(5)]]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError) as caught:
        read_opensim_table(path)
    assert "holds quaternions of pelvis_imu, femur_r_imu" in str(caught.value)
    assert "export joint angles" in str(caught.value)


def test_vectors_are_refused_by_name(path: pathlib.Path) -> None:
    lines = ["DataType=Vec3", "endheader", "time\tRASI", *[f"{0.01 * k}\t0.1,0.2,0.3" for k in range(5)]]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match="holds vectors of RASI"):
        read_opensim_table(path)


@pytest.mark.parametrize("digits", [2, 3, 4])
def test_a_rounded_clock_is_made_even(path: pathlib.Path, digits: int) -> None:
    """150 Hz for two seconds, the stamps rounded in print; at two digits every third comes twice."""
    true = np.arange(300) / 150.0
    rows = [[round(t, digits), 1.0 + k, 2.0] for k, t in enumerate(true)]
    table = read_opensim_table(written(path, rows, cell="{:.6f}", rows_stated=300))
    assert np.ptp(np.diff(table.time)) < 1e-9
    assert np.abs(table.time - true).max() < 0.6 * 10.0**-digits
    assert np.diff(table.time)[0] == pytest.approx(1.0 / 150.0, rel=1e-3)
    told = table.warnings if digits == 2 else table.remarks
    assert any(f"rounded to {10.0**-digits:g} s" in sentence for sentence in told)


def test_a_dropped_frame_is_no_rounding(path: pathlib.Path) -> None:
    rows = [[0.01 * k, 1.0 + k, 2.0] for k in range(60) if k != 30]
    time = read_opensim_table(written(path, rows)).time
    assert np.diff(time).max() == pytest.approx(0.02)
    assert np.diff(time).min() == pytest.approx(0.01)


@pytest.mark.parametrize("offset", [0.0, -15.0, 18.0])
def test_a_plates_constant_is_taken_off_with_its_place(path: pathlib.Path, offset: float) -> None:
    """A foot of 800 N at 1.2 to 1.4 m; the file's place is computed from what the plate reads."""
    time = np.arange(0.0, 2.0, 0.002)
    up = 800.0 * np.clip(np.sin(np.pi * (time - 0.6) / 0.7), 0.0, None) * ((time > 0.6) & (time < 1.3))
    along = 1.2 + 0.2 * np.clip((time - 0.6) / 0.7, 0.0, 1.0)
    read = up + offset
    moment = along * up + offset * 0.9  # the constant has its own arm
    place = np.divide(moment, read, out=np.full_like(read, 0.0), where=np.abs(read) > 1.0)
    rows = np.column_stack([time, 0.0 * time, read, 0.0 * time, place, 0.0 * time, 0.0 * time]).tolist()
    titles = "\t".join(["time", *(f"ground_force_{n}" for n in ("vx", "vy", "vz", "px", "py", "pz"))])
    (plate,) = plates_of(read_opensim_table(written(path, rows, titles, 1000, 7, cell="{:.9g}")))
    loaded = up > 100.0
    assert np.abs(plate.force[:, 1] - up).max() < 1e-6
    assert 1e3 * np.abs(plate.place[loaded, 0] - along[loaded]).max() < 0.01  # mm
    assert len(plate.remarks) == (1 if offset else 0)
    assert offset == 0.0 or f"read {abs(offset):.1f} N without load" in plate.remarks[0]


@pytest.mark.parametrize("sway", [0.0, 2.0, 150.0])
def test_a_plate_that_is_never_free_is_left_alone(path: pathlib.Path, sway: float) -> None:
    time = np.arange(0.0, 2.0, 0.002)
    up = 700.0 + sway * np.sin(2.0 * np.pi * time)
    rows = np.column_stack([time, 0.0 * time, up, 0.0 * time, 0.0 * time + 0.4]).tolist()
    titles = "\t".join(["time", *(f"ground_force_{n}" for n in ("vx", "vy", "vz", "px"))])
    (plate,) = plates_of(read_opensim_table(written(path, rows, titles, 1000, 5, cell="{:.9g}")))
    assert plate.force[:, 1] == pytest.approx(up, abs=1e-5)
    assert not plate.remarks


def test_places_in_millimetres_are_understood(path: pathlib.Path) -> None:
    time = np.arange(0.0, 1.0, 0.002)
    up = np.where((time > 0.2) & (time < 0.8), 700.0, 0.0)
    rows = np.column_stack([time, 0.0 * time, up, 0.0 * time, 0.0 * time + 420.0]).tolist()
    titles = "\t".join(["time", *(f"ground_force_{n}" for n in ("vx", "vy", "vz", "px"))])
    (plate,) = plates_of(read_opensim_table(written(path, rows, titles, 500, 5)))
    assert plate.place[200, 0] == pytest.approx(0.42)
    assert plate.warnings == ("plate ground_force: its centre of pressure is 420 m away; it was read as mm",)


TIME = np.arange(0.0, 1.0, 0.01)
KNEE = 32.0 - 30.0 * np.cos(2.0 * np.pi * TIME)  # 2 to 62 deg


def table(degrees: bool, header: bool | None, bend: float = 1.0) -> OpenSimTable:
    values = bend * KNEE if degrees else np.radians(bend * KNEE)
    return OpenSimTable(pathlib.Path("ik.mot"), TIME, {"knee_angle_r": values}, header)


@pytest.mark.parametrize("degrees", [True, False])
@pytest.mark.parametrize("header", [True, False, None])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_knee_outvotes_the_header(degrees: bool, header: bool | None, sign: float) -> None:
    found, warnings = angle_unit(table(degrees, header, sign), ["knee_angle_r"], None)
    assert found is degrees
    assert bool(warnings) is (header is not degrees)
    if warnings:
        assert "a knee that bends by 60 deg" in warnings[0]
        assert f"a range of {60 if degrees else 1.05:g}" in warnings[0]


def test_what_a_person_says_goes_first_unless_it_cannot_be() -> None:
    assert angle_unit(table(True, False), ["knee_angle_r"], True) == (True, ())
    assert angle_unit(table(False, True), ["knee_angle_r"], False) == (False, ())
    found, (warning,) = angle_unit(table(False, False), ["knee_angle_r"], True)
    assert found is True
    assert "bend by 60 deg" in warning
    with pytest.raises(InputError, match="reaches 62, which cannot be radians"):
        angle_unit(table(True, True), ["knee_angle_r"], False)


def test_a_locked_knee_tells_nothing() -> None:
    locked = table(True, True, bend=0.005)
    assert angle_unit(locked, ["knee_angle_r"], None) == (True, ())
    with pytest.raises(InputError, match="its knee does not show it"):
        angle_unit(table(True, None, bend=0.005), ["knee_angle_r"], None)
    with pytest.raises(InputError, match="its knee does not show it"):
        angle_unit(table(True, None), ["knee_angle_l"], None)


def test_a_stiff_knee_is_enough_and_gaps_do_not_matter() -> None:
    stiff = table(False, True, bend=0.4)  # 24 deg
    stiff.columns["knee_angle_r"][3:9] = np.nan
    assert angle_unit(stiff, ["knee_angle_l", "knee_angle_r"], None)[0] is False

"""CSV of a trial with units in its titles."""

import pathlib

import numpy as np
import pytest

from afo_sim.common import InputError, assets
from afo_sim.gait_lab.readers.csv_trial import read_csv_trial

TIME = np.arange(120) / 100.0
UP = np.where((TIME > 0.2) & (TIME < 0.8), 700.0, 0.0)
HEIGHTS = {"C7": 1.45, "R.Knee": 0.5, "R.Ankle": 0.1}


def columns(factor: float = 1.0, titles: str = "{name} {axis} [m]") -> dict[str, np.ndarray]:
    found = {}
    for name, height in HEIGHTS.items():
        for axis, values in (("x", 1.2 * TIME), ("y", height + 0.0 * TIME), ("z", 0.1 + 0.0 * TIME)):
            found[titles.format(name=name, axis=axis)] = factor * values
    return found


def write(
    path: pathlib.Path,
    data: dict[str, np.ndarray],
    *,
    clock: str = "time [s]",
    separator: str = ",",
    comma: bool = False,
    above: str = "",
) -> pathlib.Path:
    lines = [separator.join([clock, *data])]
    scale = 1000.0 if "ms" in clock else 1.0
    for row in np.column_stack([scale * TIME, *data.values()]):
        text = separator.join(f"{value:.9g}" for value in row)
        lines.append(text.replace(".", ",") if comma else text)
    path.write_text(above + "\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("factor", "titles"),
    [
        (1.0, "{name} {axis} [m]"),
        (1e3, "{name} {axis} [mm]"),
        (1e3, "{name}_{axis} (mm)"),
        (1e2, "{name}:{axis} [cm]"),
        (1e3, "{name} {axis} [m]"),  # mm under m
        (1.0, "{name} {axis} [mm]"),  # and the reverse
    ],
)
@pytest.mark.parametrize(
    ("separator", "comma"), [(",", False), (";", False), (";", True), ("\t", False), ("\t", True)]
)
def test_markers(tmp_path: pathlib.Path, factor: float, titles: str, separator: str, comma: bool) -> None:
    path = write(tmp_path / "a.csv", columns(factor, titles), separator=separator, comma=comma)
    trial = read_csv_trial(path)
    assert trial.markers is not None
    assert list(trial.markers.positions) == list(HEIGHTS)
    for name, height in HEIGHTS.items():
        expected = np.column_stack([1.2 * TIME, np.full_like(TIME, height), np.full_like(TIME, 0.1)])
        assert trial.markers.positions[name] == pytest.approx(expected, abs=1e-6)
    lies = (factor, titles[-3:]) in ((1e3, "[m]"), (1.0, "mm]"))
    assert len(trial.markers.warnings) == lies
    assert not trial.tables and not trial.plates


@pytest.mark.parametrize("prefix", ["plate1 ", "plate1_", ""])
@pytest.mark.parametrize(("newton", "metre"), [("N", "m"), ("kN", "mm")])
def test_plates(tmp_path: pathlib.Path, prefix: str, newton: str, metre: str) -> None:
    force, length = {"N": 1.0, "kN": 1e-3}[newton], {"m": 1.0, "mm": 1e3}[metre]
    data = {
        f"{prefix}f{axis} [{newton}]": force * part
        for axis, part in zip("xyz", (0.1 * UP, UP, 0.0 * UP), strict=True)
    }
    data |= {
        f"{prefix}p{axis} [{metre}]": length * (0.0 * UP + at)
        for axis, at in zip("xyz", (0.4, 0.0, 0.1), strict=True)
    }
    (plate,) = read_csv_trial(write(tmp_path / "a.csv", data)).plates
    assert plate.name == (prefix.strip(" _") or "1")
    assert plate.force == pytest.approx(np.column_stack([0.1 * UP, UP, 0.0 * UP]), abs=1e-6)
    assert plate.place[UP > 0] == pytest.approx(np.tile([0.4, 0.0, 0.1], (int((UP > 0).sum()), 1)), abs=1e-9)


def test_everything_in_one_file(tmp_path: pathlib.Path) -> None:
    """OpenSim's plate names, angles in radians, moments in two spellings, and a column of another kind."""
    data = columns() | {
        "knee_angle_r [rad]": np.radians(30.0 + TIME),
        "pelvis_tx [mm]": 1e3 * TIME,
        "ankle_angle_r_moment [Nm]": -50.0 * TIME,
        "ground_force_vx [N]": 0.1 * UP,
        "ground_force_vy [N]": UP,
        "ground_force_px [m]": 0.0 * UP + 0.4,
        "soleus [mV]": TIME,
    }
    trial = read_csv_trial(write(tmp_path / "a.csv", data, clock="Time [ms]", above="# Anna, trial 3\n"))
    assert trial.markers is not None and len(trial.markers.positions) == 3
    angles, moments = trial.tables
    assert angles.degrees is True
    assert angles.time == pytest.approx(TIME)
    assert angles.columns["knee_angle_r"] == pytest.approx(30.0 + TIME)
    assert angles.columns["pelvis_tx"] == pytest.approx(TIME)
    assert moments.columns["ankle_angle_r_moment"] == pytest.approx(-50.0 * TIME)
    assert [plate.name for plate in trial.plates] == ["ground_force"]
    assert trial.remarks == ("columns that were not used: soleus",)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize(
    ("separator", "comma"), [(",", False), (";", True), ("\t", True), ("\t", False), (";", False)]
)
def test_a_trial_that_a_spreadsheet_has_saved(
    tmp_path: pathlib.Path, separator: str, comma: bool, encoding: str
) -> None:
    """Its separator in the first line, quoted remarks, lines padded to a width, capital exponents."""
    path = write(tmp_path / "a.csv", columns(), separator=separator, comma=comma)
    lines = [line.replace("e-", "E-") for line in path.read_text().splitlines()]
    above = [f"sep={separator}", '"# Müller, at this time [s]"', "# trial 3"]
    padded = [above[0], *(line + 3 * separator for line in [*above[1:], *lines, ""])]
    path.write_bytes(("\r\n".join(padded) + "\r\n").encode(encoding))
    trial = read_csv_trial(path)
    assert trial.markers is not None and not trial.warnings
    assert trial.markers.time == pytest.approx(TIME, abs=1e-9)
    for name, height in HEIGHTS.items():
        expected = np.column_stack([1.2 * TIME, np.full_like(TIME, height), np.full_like(TIME, 0.1)])
        assert trial.markers.positions[name] == pytest.approx(expected, abs=1e-6)


def test_empty_cells_are_gaps(tmp_path: pathlib.Path) -> None:
    path = write(tmp_path / "a.csv", columns())
    lines = path.read_text().splitlines()
    cells = lines[11].split(",")
    lines[11] = ",".join([*cells[:4], "", "", "", *cells[7:]])
    path.write_text("\n".join(lines) + "\n")
    trial = read_csv_trial(path)
    assert trial.markers is not None
    assert np.flatnonzero(np.isnan(trial.markers.positions["R.Knee"]).all(axis=1)).tolist() == [10]


def test_a_cut_file_loses_its_last_row(tmp_path: pathlib.Path) -> None:
    path = write(tmp_path / "a.csv", columns())
    path.write_text(path.read_text()[:-20])
    trial = read_csv_trial(path)
    assert trial.markers is not None and len(trial.markers.time) == 119
    assert trial.warnings == ("its last row is cut short and was left out",)


def test_columns_without_a_unit_are_all_named(tmp_path: pathlib.Path) -> None:
    data = columns(titles="{name} {axis}") | {"knee_angle_r [deg]": TIME}
    with pytest.raises(InputError) as caught:
        read_csv_trial(write(tmp_path / "a.csv", data, clock="time"))
    assert "columns without a unit: 'time', 'C7 x', 'C7 y'" in str(caught.value)
    assert "time [s], R.Knee x [mm]" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a,b\n1,2\n", "has no line of titles with a time"),
        ("", "has no line of titles with a time"),
        ("time [s],knee_angle_r [deg]\n", "has fewer than two rows"),
        ("time [s],knee_angle_r [deg]\n0,1\n0.01,2\n0.02,x\n0.03,4\n", "row 3 of its table is not 2 numbers"),
        (
            "time [s],knee_angle_r [deg]\n0,1\n0,01,2\n0,02,3\n0,03,4\n",
            "decimal commas only where semicolons",
        ),
        ("time [s];knee_angle_r [deg]\n0;1,234\n0.01;1,235\n", "has decimal commas and decimal points"),
        ("time [kg],knee_angle_r [deg]\n0,1\n0.01,2\n", "is not a valid time"),
        ("time [s],knee_angle_r [deg]\n0,1\n10,2\n20,3\n", "its time runs in steps of 10 s"),
        ("time [s],R.Knee x [m],R.Knee z [m]\n0,1,1\n0.01,2,2\n", "marker R.Knee lacks its y"),
        ("time [s],p fx [N],p fz [N]\n0,1,1\n0.01,2,2\n", "plate p has the columns fx, fz only"),
        ("time [s],knee_angle_r [deg]\n0,1\n0.02,2\n0.01,2\n0.03,1\n", "time does not increase"),
    ],
)
def test_what_cannot_be_read_is_one_sentence(tmp_path: pathlib.Path, text: str, sentence: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_csv_trial(path)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_programs_own_gait_file_is_sent_elsewhere() -> None:
    with pytest.raises(InputError, match="is a gait cycle already: `gait show`"):
        read_csv_trial(assets.find_gait("gatk_stride1"))

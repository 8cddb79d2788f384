"""OpenSim's tables, read back by the reader of walking trials and by hand: the same bits, legal labels."""

import dataclasses
import pathlib

import numpy as np
import pytest

from afo_sim.common.errors import InputError
from afo_sim.export.opensim import write_storage
from afo_sim.gait_lab.readers.opensim_table import read_opensim_table
from afo_sim.simulation.recording import Recording


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

"""A run is not silently replaced by another, and no folder of another kind is written into."""

import json
import pathlib

import pytest
from command import call

SHORT = ("--no-rrd", "--set", "duration=0.1 s")


def test_only_the_same_run_is_replaced(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    summary = tmp_path / "runs" / "seated" / "summary.json"
    assert call(capsys, "run", *SHORT)[0] == 0
    first = summary.read_bytes()
    assert call(capsys, "run", *SHORT)[0] == 0
    second = summary.read_bytes()
    assert json.loads(first)["metrics"] == json.loads(second)["metrics"]
    for arguments, words in (
        (("--set", "supply.pressure=3 bar"), "holds a run of 'seated' with other values"),
        (("seated-antagonist", "--out", "runs/seated"), "the run of another scenario, 'seated'"),
    ):
        code, _, complaint = call(capsys, "run", *arguments, *SHORT)
        assert code == 2
        assert words in complaint
        assert all(option in complaint for option in ("--out = 'runs/seated'", "--force"))
        assert summary.read_bytes() == second
    assert call(capsys, "run", "--force", *SHORT, "--set", "supply.pressure=3 bar")[0] == 0
    assert json.loads(summary.read_text())["scenario"]["supply"]["pressure"] == "300000.0 Pa"


def test_damaged_summary_is_no_reason_to_replace(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "a"
    assert call(capsys, "run", "--out", out, *SHORT)[0] == 0
    for text in ("{", "[]", '{"scenario": null}'):
        (out / "summary.json").write_text(text)
        code, _, complaint = call(capsys, "run", "--out", out, *SHORT)
        assert (code, "--force" in complaint) == (2, True)


@pytest.mark.parametrize(
    ("file", "command"),
    [
        ("sweep.json", ("run", *SHORT)),
        ("fit.json", ("run", *SHORT)),
        ("recording.parquet", ("compare", "seated")),
        ("recording.parquet", ("stand", "isobaric", "dmsp_20")),
        ("search.json", ("stand", "isobaric", "dmsp_20")),
        ("recording.parquet", ("fit", "x.csv", "--law", "all")),
        ("fit.json", ("fit-run", "x.csv", "--scenario", "seated")),
        ("differences.csv", ("torque-map",)),
    ],
)
def test_folder_of_another_kind_is_refused(
    file: str, command: tuple[str, ...], tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / file).write_text("theirs")
    code, _, complaint = call(capsys, *command, "--out", tmp_path)
    assert code == 2
    assert f"({file})" in complaint
    assert "another folder with --out" in complaint
    assert [path.name for path in tmp_path.iterdir()] == [file]


def test_numbers_that_say_nothing_are_left_out(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, printed, _ = call(capsys, "run", "--set", "duration=10 ms", "--no-rrd", "--out", tmp_path / "a")
    assert code == 0
    table, _, rest = printed.partition("left out, ")
    assert "nan" not in table
    assert "rise_time" in rest
    assert "rise_time" not in table
    code, printed, complaint = call(capsys, "torque-map", "walk-healthy", "--out", tmp_path / "b")
    assert code == 2
    assert "has no chamber: there is no torque to map" in complaint
    assert not (tmp_path / "b").exists()

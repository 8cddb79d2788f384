"""A run is not silently replaced by another, and no folder of another kind is written into."""

import dataclasses
import json
import pathlib

import pytest
from command import Call

import afo_sim
from afo_sim.metrics import Metric
from afo_sim.simulation import run as running

SHORT = ("--no-rrd", "--set", "duration=0.1 s")


def test_only_the_same_run_is_replaced(
    tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    summary = tmp_path / "runs" / "seated" / "summary.json"
    assert call("run", *SHORT)[0] == 0
    first = summary.read_bytes()
    assert call("run", *SHORT)[0] == 0
    second = summary.read_bytes()
    assert json.loads(first)["metrics"] == json.loads(second)["metrics"]
    for arguments, words in (
        (("--set", "supply.pressure=3 bar"), "holds a run of 'seated' with other values"),
        (("seated-antagonist", "--out", "runs/seated"), "the run of another scenario, 'seated'"),
    ):
        code, _, complaint = call("run", *arguments, *SHORT)
        assert code == 2
        assert words in complaint
        assert all(option in complaint for option in ("--out = 'runs/seated'", "--force"))
        assert summary.read_bytes() == second
    assert call("run", "--force", *SHORT, "--set", "supply.pressure=3 bar")[0] == 0
    assert json.loads(summary.read_text())["scenario"]["supply"]["pressure"] == "300000.0 Pa"


def test_what_a_run_removes_is_told(tmp_path: pathlib.Path, call: Call) -> None:
    """A report of other numbers would mislead beside new ones; what no run writes stays."""
    out = tmp_path / "a"
    assert "removed" not in call("run", "--out", out, *SHORT)[1]
    for name in ("report.html", "recording.rrd", "mine.txt"):
        (out / name).write_text("of the run before")
    code, told, _ = call("run", "--out", out, *SHORT)
    (line,) = (line for line in told.splitlines() if "removed" in line)
    assert code == 0 and "report.html" in line and "recording.rrd" in line and "mine.txt" not in line
    assert {path.name for path in out.iterdir()} & {"report.html", "recording.rrd", "mine.txt"} == {
        "mine.txt"
    }


def test_damaged_summary_is_no_reason_to_replace(tmp_path: pathlib.Path, call: Call) -> None:
    out = tmp_path / "a"
    assert call("run", "--out", out, *SHORT)[0] == 0
    for text in ("{", "[]", '{"scenario": null}'):
        (out / "summary.json").write_text(text)
        code, _, complaint = call("run", "--out", out, *SHORT)
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
        ("fit.json", ("fit", "x.csv", "--scenario", "seated")),
        ("fit_torque.json", ("run", *SHORT)),
        ("fit.json", ("fit", "x.csv", "--orthosis", "s1")),
        ("differences.csv", ("torque-map",)),
    ],
)
def test_folder_of_another_kind_is_refused(
    file: str, command: tuple[str, ...], tmp_path: pathlib.Path, call: Call
) -> None:
    (tmp_path / file).write_text("theirs")
    code, _, complaint = call(*command, "--out", tmp_path)
    assert code == 2
    assert f"({file})" in complaint
    assert "another folder with --out" in complaint
    assert [path.name for path in tmp_path.iterdir()] == [file]


def test_numbers_that_say_nothing_are_left_out(tmp_path: pathlib.Path, call: Call) -> None:
    code, printed, _ = call("run", "--numbers", "--no-rrd", "--set", "duration=10 ms", "--out", tmp_path)
    assert code == 0
    table, _, rest = printed.partition("without a value ")
    assert "nan" not in table
    assert "rise_time" in rest
    assert "rise_time" not in table


def test_a_joint_that_only_rounding_moves_is_left_out(
    tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    still = dataclasses.replace(
        afo_sim.run("seated", {"duration": "10 ms"}), metrics={"range_of_motion": Metric(3e-14, "deg")}
    )
    monkeypatch.setattr(running, "run_built", lambda *_, **__: still)
    code, printed, _ = call("run", "--numbers", "--no-rrd", "--out", tmp_path / "a")
    assert code == 0
    assert "without a value (does not move): range_of_motion" in printed
    assert "3e-14" not in printed


@pytest.mark.slow
def test_an_older_comparison_goes_as_a_whole(tmp_path: pathlib.Path, call: Call) -> None:
    out = tmp_path / "laws"
    assert call("compare", "arm", "--laws", "polynomial,sarosi_2012", *SHORT, "--out", out)[0] == 0
    (out / "mine").mkdir()
    (out / "mine" / "recording.parquet").write_text("mine")
    (out / "polynomial" / "notes.txt").write_text("mine")
    assert call("compare", "arm", "--laws", "kerscher_2006,bolen_2026", *SHORT, "--out", out)[0] == 0
    assert not (out / "sarosi_2012").exists()
    assert [path.name for path in (out / "polynomial").iterdir()] == ["notes.txt"]
    assert [path.name for path in (out / "mine").iterdir()] == ["recording.parquet"]
    for law in ("kerscher_2006", "bolen_2026"):
        assert {p.name for p in (out / law).iterdir()} == {"recording.parquet", "summary.json", "model.xml"}


@pytest.mark.slow
def test_names_in_an_older_table_reach_no_other_folder(tmp_path: pathlib.Path, call: Call) -> None:
    out, other = tmp_path / "laws", tmp_path / "other"
    for folder in (out, other, out / "mine"):
        folder.mkdir()
    (other / "recording.parquet").write_text("theirs")
    (out / "mine" / "recording.parquet").write_text("mine")
    (out / "differences.csv").write_text("law,other law,angle\n../other,mine,1\n\xff")
    assert call("compare", "arm", "--laws", "polynomial,sarosi_2012", *SHORT, "--out", out)[0] == 0
    assert (other / "recording.parquet").read_text() == "theirs"
    assert (out / "mine" / "recording.parquet").read_text() == "mine"


def test_runs_are_not_compared_by_laws(tmp_path: pathlib.Path, call: Call) -> None:
    """Whoever types two runs, or one, is told which command compares them."""
    assert call("run", "--out", tmp_path / "a", *SHORT)[0] == 0
    for runs in ([tmp_path / "a", tmp_path / "b"], [tmp_path / "a"]):
        code, _, complaint = call("compare", *runs)
        assert code == 2 and f"afo-sim report {tmp_path / 'a'}" in complaint

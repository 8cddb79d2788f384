"""Sweeps as they run: the same rows however they are computed, whatever stops them, and nothing lost."""

import json
import pathlib
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from campaign import size
from command import Call
from sweep_runs import (
    COMMAND,
    SEATED,
    SWEEP,
    assert_same,
    exact,
    killed,
    opened,
    own_scenario,
    swept,
    table,
    written,
)

import afo_sim
import afo_sim.study
from afo_sim.cli.sweep import reporter
from afo_sim.common import InputError, read_json, write_json, write_parquet
from afo_sim.description import expand
from afo_sim.metrics import OTHER, Metric, words
from afo_sim.study import Store, SweepProgress, engine, folder, replay, runner, sweep_plan
from afo_sim.study.engine import Outcome
from afo_sim.study.findings import indices
from afo_sim.study.results import STEPS


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The folder of a sweep that nothing has disturbed."""
    folder = tmp_path_factory.mktemp("whole")
    swept(folder)
    return folder / "out"


@pytest.fixture(scope="module")
def seated_folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    folder = tmp_path_factory.mktemp("seated")
    swept(folder, SEATED)
    return folder


@pytest.fixture(scope="module")
def seated_table(seated_folder: pathlib.Path) -> Any:
    return table(seated_folder / "out")


@pytest.fixture
def seated(seated_folder: pathlib.Path, tmp_path: pathlib.Path) -> pathlib.Path:
    """A finished sweep's folder that a test may change; its file lies beside it."""
    shutil.copytree(seated_folder, tmp_path, dirs_exist_ok=True)
    return tmp_path / "out"


# -- the same rows ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_sweep_of_these_tests_has_every_kind_of_case(whole: pathlib.Path) -> None:
    results = afo_sim.study.read(whole)
    assert set(results["status"]) == {"ok", "unstable", "infeasible"}
    assert len(np.unique(results["count"][results.ok])) == 3
    assert set(results["patient"][results.ok]) == {"drop-foot", "healthy"}
    assert len(np.unique(results["variation"])) == len(results)


@pytest.mark.slow
@pytest.mark.parametrize(("chunk", "threads"), [(1, 1), (4, 2), (100, 3), (7, 1)][: size(2, 4)])
def test_rows_depend_on_neither_chunk_nor_threads(
    whole: pathlib.Path, tmp_path: pathlib.Path, chunk: int, threads: int
) -> None:
    assert_same(table(whole), swept(tmp_path, chunk=chunk, threads=threads))


@pytest.mark.slow
def test_a_case_is_itself_in_any_order_and_company(whole: pathlib.Path) -> None:
    results = afo_sim.study.read(whole)
    scenario = expand("scenario", "walk-dropfoot-afo")
    cases = [(row["case"], json.loads(row["overrides"])) for row in results.table.to_pylist()]
    backwards = dict(engine.outcomes(scenario, reversed(cases), threads=2, chunk=5))
    for number, outcome in backwards.items():
        row = results.table.slice(number, 1).to_pylist()[0]
        assert (outcome.status, outcome.reason) == (row["status"], row["reason"])
        found = {name: metric.value for name, metric in outcome.metrics.items()}
        assert found == pytest.approx({name: row[name] for name in found}, rel=0.0, abs=0.0, nan_ok=True)


@pytest.mark.slow
def test_replay_of_ten_cases_is_their_rows_to_the_last_bit(
    whole: pathlib.Path, tmp_path: pathlib.Path, call: Call
) -> None:
    results = afo_sim.study.read(whole)
    runs = np.flatnonzero(results["status"] != "infeasible")
    for case in np.random.default_rng(3).permutation(runs)[:10]:
        again = replay.replay(whole, int(case))
        assert again.different == {}
        assert again.recording.ok == (results["status"][case] == "ok")
    ok = int(np.flatnonzero(results.ok)[0])
    code, out, _ = call("replay", whole, ok, "--out", tmp_path / "again")
    assert code == 0 and "to the last bit" in out
    assert (tmp_path / "again" / "recording.rrd").stat().st_size > 0
    kept = afo_sim.read_recording(tmp_path / "again")
    assert kept.metrics["stride_time"].value == results["stride_time"][ok]


def test_replay_says_what_differs_from_the_row(
    whole: pathlib.Path, tmp_path: pathlib.Path, call: Call
) -> None:
    out = tmp_path / "out"
    shutil.copytree(whole, out)
    rows = table(out)
    column = rows.schema.get_field_index("toe_clearance")
    values = np.nextafter(rows["toe_clearance"].to_numpy(), np.inf)  # by one bit
    write_parquet(out / "results.parquet", rows.set_column(column, rows.schema.field(column), [values]))
    ok = int(np.flatnonzero(afo_sim.study.read(out).ok)[0])
    code, said, complained = call("replay", out, ok, "--no-rrd")
    assert code == 1
    assert "toe_clearance" in said and "another processor" in complained
    assert "stride_time" not in said


def test_replay_says_when_a_case_ends_otherwise(seated: pathlib.Path, call: Call) -> None:
    rows, out = table(seated), seated
    column = rows.schema.get_field_index("status")
    told = [["unstable"] + ["ok"] * 11]
    write_parquet(out / "results.parquet", rows.set_column(column, rows.schema.field(column), told))
    code, said, _ = call("replay", out, 0, "--no-rrd")
    assert code == 1 and "case 0: unstable in the sweep, now ok" in said
    assert call("replay", out, 1, "--no-rrd")[0] == 0


def test_replay_of_a_case_that_raises_is_one_message(
    seated: pathlib.Path, monkeypatch: pytest.MonkeyPatch, call: Call
) -> None:
    monkeypatch.setattr(replay, "run_scenario", lambda *_, **__: 1 / 0)
    code, _, complained = call("replay", seated, 3)
    assert code == 2 and "CASE = 3: fails: ZeroDivisionError" in complained


def test_replay_of_what_is_not_there(whole: pathlib.Path, call: Call) -> None:
    code, _, complained = call("replay", whole, 14)
    assert code == 2 and "no such case" in complained
    infeasible = int(np.flatnonzero(afo_sim.study.read(whole)["status"] == "infeasible")[0])
    code, _, complained = call("replay", whole, infeasible)
    assert code == 2 and "taut" in complained


# -- cases that fail --------------------------------------------------------------------------------------


def test_cases_in_plain_python_run_beside_compiled_ones() -> None:
    """A process has room for one pair of callbacks."""
    set_up = {"duration": "0.2 s"}
    modes = ["native", "native", "python", "native", "python", "native"]
    cases = [(k, {**set_up, "callback": mode}) for k, mode in enumerate(modes)]
    one = dict(engine.outcomes("seated", cases, threads=1, chunk=2))
    two = dict(engine.outcomes("seated", cases, threads=2, chunk=2))
    assert {k: exact(o) for k, o in one.items()} == {k: exact(o) for k, o in two.items()}
    assert {outcome.status for outcome in one.values()} == {"ok"}
    compiled, plain = one[0].metrics, one[2].metrics
    assert compiled.keys() == plain.keys()
    for name, metric in compiled.items():
        assert metric.value == pytest.approx(plain[name].value, rel=1e-9, abs=1e-12, nan_ok=True), name


def test_a_case_without_a_rest_position_is_a_row_and_its_company_is_untouched(
    seated_table: Any, tmp_path: pathlib.Path
) -> None:
    load = '[parameters.load]\nkey = "load_moment"\nvalues = ["0 N*m", "1000 N*m"]\n'
    rows = swept(tmp_path, SEATED + load).to_pylist()
    assert [row["status"] for row in rows] == ["ok", "infeasible"] * 12
    assert "no rest position" in rows[1]["reason"]
    for row, alone in zip(rows[::2], seated_table.to_pylist(), strict=True):
        assert all(
            repr(row[name]) == repr(alone[name])
            for name in alone
            if name not in ("case", "seed", "overrides")
        )


@pytest.mark.slow
def test_whatever_a_case_raises_is_its_row(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, seated_table: Any
) -> None:
    real, error = engine.examine, KeyError("x")

    def examine(built: Any, *rest: Any, **named: Any) -> Any:
        if abs(built.scenario.supply.pressure - 4e5) < 1.0:  # the last case
            raise error
        return real(built, *rest, **named)

    monkeypatch.setattr(engine, "examine", examine)
    rows = swept(tmp_path, SEATED)
    assert rows["status"].to_pylist() == ["ok"] * 11 + ["error"]
    assert rows["reason"].to_pylist()[-1] == f"{type(error).__name__}: {error}"
    assert_same(rows.slice(0, 11), seated_table.slice(0, 11))


def test_a_file_that_is_gone_for_a_while_is_no_case_s_row(
    tmp_path: pathlib.Path, call: Call, seated_table: Any
) -> None:
    own_scenario(tmp_path)
    file, out = written(tmp_path, SEATED.replace('"seated"', '"mine.toml"')), tmp_path / "out"
    store = opened(file, out)
    (tmp_path / "leg" / "leg.xml").rename(tmp_path / "away.xml")
    with pytest.raises(InputError, match=r"leg\.xml"):
        runner.run(store)
    assert not list(out.glob("chunks/*"))
    (tmp_path / "away.xml").rename(tmp_path / "leg" / "leg.xml")
    assert call("sweep", file, "--out", out)[0] == 0
    assert table(out)["status"].to_pylist() == ["ok"] * 12


def test_a_metric_that_the_first_cases_lack_has_its_column(tmp_path: pathlib.Path) -> None:
    """The foot rises under a load of 2 and 5 N·m, and not under the others."""
    loads = '[parameters.load]\nkey = "load_moment"\nvalues = [{}]\n'
    text = SEATED.replace('"0.3 s"', '"1 s"').replace("steps = 12", "steps = 1").replace('to = "4 bar"', "")
    pressure = 'from = "2 bar"\nsteps = 1'
    assert pressure in text.replace("\n\n", "\n")
    text = text.replace("\n\n", "\n").replace(pressure, 'values = ["2 bar"]')
    values = ('"-1 N*m"', '"2 N*m"', '"-1.1 N*m"', '"5 N*m"', '"-1.2 N*m"')
    rows = swept(tmp_path, text + loads.format(", ".join(values)))
    assert np.isfinite(rows["rise_time"].to_numpy()).tolist() == [False, True, False, True, False]


@pytest.mark.slow
def test_what_cases_warn_of_stands_in_their_rows_and_is_shown(whole: pathlib.Path, call: Call) -> None:
    results = afo_sim.study.read(whole)
    few = "2 whole strides are too few to tell whether the orthosis' air has settled"
    assert all(few in text for text in results.warnings[results.ok])
    assert not any(results.warnings[~results.ok])
    assert all("too-few-strides " in text for text in results.notices[results.ok])
    code, said, _ = call("sweep", "--show", whole, "--out", whole.parent / "figures")
    assert code == 0
    row = next(line.split() for line in said.splitlines() if "too few to tell" in line)
    assert int(row[0]) == results.ok.sum()


def test_a_machine_without_memory_is_no_case_s_row(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = written(tmp_path, SEATED)
    open_store = opened(file, tmp_path / "out")
    monkeypatch.setattr(engine, "examine", lambda *_, **__: (_ for _ in ()).throw(MemoryError()))
    with pytest.raises(MemoryError):
        runner.run(open_store)
    assert not list((tmp_path / "out").glob("chunks/*.parquet"))


def test_a_metric_that_some_cases_lack_is_nan_there(tmp_path: pathlib.Path) -> None:
    slack = 'key = "orthosis.muscle.dorsiflexor.slack"\nvalues = ["0 mm", "150 mm"]\n'  # that never pulls
    text = SEATED[: SEATED.index("[parameters.pressure]")].replace("0.3 s", "0.5 s")
    text += "[parameters.slack]\n" + slack
    rows = swept(tmp_path, text)
    assert rows["status"].to_pylist() == ["ok", "ok"]
    for row in rows.to_pylist():
        found = afo_sim.run("seated", json.loads(row["overrides"])).metrics
        known = {name for name, metric in found.items() if np.isfinite(metric.value)}
        assert {n for n in afo_sim.study.read(tmp_path / "out").metrics if np.isfinite(row[n])} == known
    assert any(np.isnan(row) for row in rows.slice(1, 1).to_pylist()[0].values() if isinstance(row, float))
    assert replay.replay(tmp_path / "out", 1).different == {}


# -- stopped and continued --------------------------------------------------------------------------------


@pytest.mark.slow
def test_killed_it_goes_on_and_ends_with_the_same_rows(
    whole: pathlib.Path, tmp_path: pathlib.Path, call: Call
) -> None:
    file, out = written(tmp_path), tmp_path / "out"
    arguments = [str(file), "--out", str(out), "--threads", "1"]
    there: list[dict[str, int]] = [{}]
    for _ in range(size(1, 3)):
        assert killed([*COMMAND, *arguments], out / "chunks")
        there.append({path.name: path.stat().st_mtime_ns for path in out.glob("chunks/*.parquet")})
    assert all(before.items() <= after.items() for before, after in pairwise(there))  # none computed twice
    assert not (out / "results.parquet").exists()
    code, said, _ = call("sweep", *arguments)
    assert code == 0
    assert f"{len(afo_sim.study.read(out))} of 14 are done" in said
    assert_same(table(whole), table(out))
    assert sorted(path.name for path in out.iterdir()) == ["results.parquet", "sweep.json", STEPS]
    before = (out / "results.parquet").stat().st_mtime_ns
    code, again, _ = call("sweep", *arguments)
    assert code == 0
    assert "0 cases computed" in again
    assert (out / "results.parquet").stat().st_mtime_ns == before


def test_killed_before_its_first_file_is_whole(tmp_path: pathlib.Path, seated_table: Any) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / ".sweep.json.x7ab").write_text("{")  # as `replacing` leaves it
    assert_same(swept(tmp_path, SEATED), seated_table)


def test_killed_between_the_results_and_taking_the_chunks_away(
    seated: pathlib.Path, tmp_path: pathlib.Path, seated_table: Any
) -> None:
    out = seated
    (out / "chunks").mkdir()
    (out / "chunks" / "0000000.parquet").write_bytes(b"PAR1")
    (out / ".results.parquet.abc").write_bytes(b"half")
    assert runner.run(opened(tmp_path / "sweep.toml", out)).new == 0
    assert_same(table(out), seated_table)
    assert sorted(path.name for path in out.iterdir()) == ["results.parquet", "sweep.json", STEPS]


def test_results_that_are_gone_are_computed_again(
    seated: pathlib.Path, tmp_path: pathlib.Path, seated_table: Any
) -> None:
    (seated / "results.parquet").unlink()
    assert_same(swept(tmp_path, SEATED), seated_table)


def test_ctrl_c_says_that_the_same_command_goes_on(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, call: Call
) -> None:
    file, out = written(tmp_path, SEATED), tmp_path / "out"
    real = Store.write

    def write(self: Store, chunk: int, outcomes: Any) -> None:
        if chunk == 1:
            raise KeyboardInterrupt
        real(self, chunk, outcomes)

    monkeypatch.setattr(Store, "write", write)
    code, _, complained = call("sweep", file, "--out", out, "--threads", 1)
    assert code == 130 and "same command to continue" in complained
    monkeypatch.undo()
    code, said, _ = call("sweep", file, "--out", out, "--threads", 1)
    assert code == 0 and "8 cases computed" in said and "12 of 12 are done" in said


# -- progress ---------------------------------------------------------------------------------------------


def test_progress_says_rate_failures_and_time_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    shown: list[Any] = []
    report = reporter(lambda *told: shown.append(told))
    clock[0] = 50.0
    report(SweepProgress(cases=1000, done=300, new=100, failed=0))
    assert shown[-1][:2] == (300, 1000)
    assert re.findall(r"[\d.]+ ?(?:min|s\b)?", shown[-1][2]) == ["300 ", "1000 ", "2 ", "5.8 min"]
    clock[0] = 100.0
    report(SweepProgress(cases=1000, done=600, new=400, failed=3))
    numbers = re.findall(r"[\d.]+ ?(?:min|s\b)?", shown[-1][2])
    assert numbers == ["600 ", "1000 ", "3 ", "4 ", "100 s"]


# -- the disk ---------------------------------------------------------------------------------------------


def test_a_disk_with_too_little_room_is_said_before_the_first_case(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_store = opened(written(tmp_path, SEATED), tmp_path / "out")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(1 << 30, 1 << 30, 4000))
    with pytest.raises(InputError, match=r"results need about .* GB left"):
        runner.run(open_store)
    assert not (tmp_path / "out" / "chunks").exists()


# -- what else lies in the folder -------------------------------------------------------------------------


def test_a_damaged_chunk_is_found_and_computed_again(tmp_path: pathlib.Path, seated_table: Any) -> None:
    open_store = opened(written(tmp_path, SEATED), tmp_path / "out")
    runner.run(open_store, part=(1, 2))
    chunk = tmp_path / "out" / "chunks" / "0000000.parquet"
    chunk.write_bytes(chunk.read_bytes()[:-200])
    with pytest.raises(InputError, match=r"1 of 3 chunks are damaged.*same command again"):
        runner.run(open_store)
    assert not open_store.finished and not chunk.exists()
    assert runner.run(open_store).new == 4
    assert_same(table(tmp_path / "out"), seated_table)


@pytest.mark.slow
def test_chunks_of_another_size_or_sweep_are_not_mixed_in(tmp_path: pathlib.Path, seated_table: Any) -> None:
    other = opened(written(tmp_path / "b", SEATED.replace("0.3 s", "0.4 s")), tmp_path / "b" / "out")
    runner.run(other, part=(1, 3))
    large = opened(written(tmp_path / "c", SEATED, chunk=5), tmp_path / "c" / "out")
    runner.run(large, part=(2, 3))
    mine = opened(written(tmp_path, SEATED), tmp_path / "out")
    (tmp_path / "out" / "chunks").mkdir()
    for at, chunk in (("b", "0000000"), ("c", "0000001")):
        shutil.copy(tmp_path / at / "out" / "chunks" / f"{chunk}.parquet", tmp_path / "out" / "chunks")
    with pytest.raises(InputError, match=r"2 of 3 chunks are damaged or of another sweep"):
        runner.run(mine)
    runner.run(mine)
    assert_same(table(tmp_path / "out"), seated_table)


def test_the_chunk_of_the_first_call_stays(tmp_path: pathlib.Path, seated_table: Any) -> None:
    runner.run(opened(written(tmp_path, SEATED), tmp_path / "out"), part=(1, 2))
    again = opened(written(tmp_path, SEATED, chunk=7), tmp_path / "out")
    assert again.chunk == 4
    assert runner.run(again).new == 4
    assert_same(table(tmp_path / "out"), seated_table)


@pytest.mark.slow
def test_two_processes_on_one_folder_lose_and_double_nothing(
    whole: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    command = [*COMMAND, str(written(tmp_path)), "--out", str(tmp_path / "out"), "--threads", "1"]
    both = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in "12"
    ]
    for process in both:
        said, complained = process.communicate()
        assert process.returncode == 0, complained
        assert "14 of 14 are done" in said
    assert_same(table(whole), table(tmp_path / "out"))


def test_who_begins_later_takes_nothing_away(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, seated_table: Any
) -> None:
    """While one process tries its first cases, another begins the same sweep and computes a third of it."""
    file, out = written(tmp_path, SEATED), tmp_path / "out"
    done: list[int] = []
    real = engine.outcomes

    def slow(*asked: Any) -> Any:
        monkeypatch.undo()
        done.append(runner.run(opened(file, out), part=(1, 3)).new)
        return real(*asked)

    monkeypatch.setattr(engine, "outcomes", slow)
    store = opened(file, out)
    assert done == [4]
    assert runner.run(store).new == 8
    assert_same(table(out), seated_table)


@pytest.mark.slow
def test_parts_in_any_order_are_gathered_by_the_last(
    whole: pathlib.Path, tmp_path: pathlib.Path, call: Call
) -> None:
    file, out = written(tmp_path), tmp_path / "out"
    for k in (3, 1, 2):
        assert not (out / "results.parquet").exists()
        code, said, _ = call("sweep", file, "--out", out, "--part", f"{k}/3")
        assert code == 0
    assert "of part 2/3 are done: " in said
    assert_same(table(whole), table(out))


def test_a_part_says_what_is_its_own(tmp_path: pathlib.Path) -> None:
    store = opened(written(tmp_path), tmp_path / "out")  # 14 cases, chunks of 4
    assert [runner.estimate(store, 1, (k, 3)).cases for k in (1, 2, 3)] == [6, 4, 4]
    whole, part = runner.estimate(store, 1), runner.estimate(store, 1, (1, 3))
    assert part.seconds == pytest.approx(whole.seconds * 6 / 14)
    states: list[SweepProgress] = []
    last = runner.run(store, part=(1, 3), report=states.append)
    assert (last.cases, last.done, last.new) == (6, 6, 6)
    assert sorted(state.done for state in states)[-1] == 6 and len(states) == 2
    assert runner.estimate(store, 1, (1, 3)).done == 6 and runner.left(store) == 8


def test_one_more_call_without_part_gathers(tmp_path: pathlib.Path, seated_table: Any) -> None:
    open_store = opened(written(tmp_path, SEATED), tmp_path / "out")
    for k in (1, 3):
        runner.run(open_store, part=(k, 3))
    assert afo_sim.study.read(tmp_path / "out").unfinished
    assert runner.run(open_store).new == 4
    assert_same(table(tmp_path / "out"), seated_table)


def test_a_folder_of_something_else_is_left_alone(tmp_path: pathlib.Path, call: Call) -> None:
    file, out = written(tmp_path, SEATED), tmp_path / "out"
    out.mkdir()
    (out / "thesis.tex").write_text("x")
    for changed in ("refuse", "restart", "continue"):
        code, _, complained = call("sweep", file, "--out", out, "--if-changed", changed)
        assert code == 2 and "something else than a sweep" in complained
    assert [path.name for path in out.iterdir()] == ["thesis.tex"]
    code, _, complained = call("sweep", file, "--out", out / "thesis.tex")
    assert code == 2 and "cannot be written to" in complained


# -- what has changed -------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_changed_sweep_is_refused_until_told(tmp_path: pathlib.Path, call: Call) -> None:
    file, out = written(tmp_path, SEATED), tmp_path / "out"
    assert call("sweep", file, "--out", out)[0] == 0
    (out / "recordings" / "case_0000000").mkdir(parents=True)
    before = (out / "results.parquet").read_bytes()
    written(tmp_path, SEATED.replace("0.3 s", "0.4 s"))
    for changed in ("refuse", "continue"):
        code, _, complained = call("sweep", file, "--out", out, "--if-changed", changed)
        assert code == 2 and "another sweep, or this one before a change" in complained
        assert (out / "results.parquet").read_bytes() == before
    command = ("sweep", file, "--out", out, "--if-changed", "restart")
    code, said, _ = call(*command)
    assert code == 0 and "12 cases computed" in said
    assert '"0.4 s"' in table(out)["overrides"][0].as_py()
    assert not (out / "recordings").exists()  # of the sweep before
    code, said, _ = call(*command)  # nothing has changed now
    assert code == 0 and "0 cases computed" in said


@pytest.mark.slow
def test_other_code_is_refused_until_told(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, call: Call, seated_table: Any
) -> None:
    file, out = written(tmp_path, SEATED), tmp_path / "out"
    runner.run(opened(file, out), part=(1, 3))
    monkeypatch.setattr(folder, "code_fingerprint", lambda: "0" * 64)
    code, _, complained = call("sweep", file, "--out", out)
    assert code == 2 and "computed by other code" in complained and "continue" in complained
    code, said, _ = call("sweep", file, "--out", out, "--if-changed", "continue")
    assert code == 0 and "8 cases computed" in said
    assert json.loads((out / "sweep.json").read_text())["mixed"] is True
    rows = table(out)
    assert_same(rows, seated_table, but=("mixed",))  # the code is the same in truth
    assert json.loads(rows.schema.metadata[b"sweep"])["mixed"] is True
    code, said, _ = call("sweep", "--show", out)
    assert code == 0 and "more than one version of the code" in said


@pytest.mark.slow
@pytest.mark.parametrize("told", ["3", "{}"])
def test_a_manifest_without_versions_is_other_code(told: str, tmp_path: pathlib.Path, call: Call) -> None:
    file, out = written(tmp_path, SEATED), tmp_path / "out"
    runner.run(opened(file, out), part=(1, 3))
    manifest = read_json(out / "sweep.json")
    manifest["fingerprint"]["versions"] = json.loads(told)
    write_json(out / "sweep.json", manifest)
    code, _, complained = call("sweep", file, "--out", out)
    assert code == 2 and "computed by other code" in complained and "--if-changed continue" in complained
    assert f"numpy None → {np.__version__}" in complained or told != "{}"
    assert call("sweep", "--show", out)[0] == 0
    assert call("replay", out, 0, "--no-rrd")[0] == 0
    code, said, complained = call("sweep", file, "--out", out, "--if-changed", "continue")
    assert code == 0 and "8 cases computed" in said, complained


def test_a_restart_that_is_refused_leaves_the_results(
    tmp_path: pathlib.Path, call: Call, seated_table: Any
) -> None:
    swept(tmp_path, SEATED)
    out = tmp_path / "out"
    file = written(tmp_path, SEATED.replace("[set]", 'metrics = ["toe_clearance"]\n[set]'))
    for option, problem in (("--dry-run", "--dry-run changes nothing"), ("--threads=1", "toe_clearance")):
        code, _, complained = call("sweep", file, "--out", out, "--if-changed", "restart", option)
        assert code == 2 and problem in complained
        assert_same(table(out), seated_table)


def test_a_set_value_that_holds_over_what_a_case_swaps_is_a_change(tmp_path: pathlib.Path) -> None:
    """0 is the drop foot's own strength, not that of the milder one."""
    text = SWEEP.replace('values = ["drop-foot", "healthy"]', 'values = ["drop-foot", "drop-foot-mild"]')
    before = sweep_plan.read(written(tmp_path / "before", text))
    own = '[set]\n"patient.dorsiflexor_strength" = 0.0'
    after = sweep_plan.read(written(tmp_path / "after", text.replace("[set]", own)))
    assert before.canonical() != after.canonical()


def test_a_sweep_that_has_no_row_yet_may_be_changed_freely(tmp_path: pathlib.Path, call: Call) -> None:
    file, out = written(tmp_path, SEATED), tmp_path / "out"
    code, said, _ = call("sweep", file, "--out", out, "--dry-run")
    assert code == 0 and "12 cases; about" in said and "MB of results" in said
    assert not (out / "results.parquet").exists() and not (out / "chunks").exists()
    written(tmp_path, SEATED.replace("steps = 12", "steps = 5"))
    code, said, _ = call("sweep", file, "--out", out)
    assert code == 0 and "5 of 5 are done" in said


@pytest.mark.slow
def test_a_sweep_and_its_scenario_may_move_with_their_files(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, call: Call, seated_table: Any
) -> None:
    before = tmp_path / "before"
    written(before, SEATED.replace('"seated"', '"mine.toml"'))
    own_scenario(before)
    monkeypatch.chdir(before)
    assert call("sweep", "sweep.toml", "--out", "../out", "--part", "1/3")[0] == 0
    monkeypatch.chdir(tmp_path)
    before.rename(tmp_path / "after")
    code, said, complained = call("sweep", "after/sweep.toml", "--out", "out")
    assert code == 0, complained
    assert "8 cases computed" in said
    rows = table(tmp_path / "out")
    for name in afo_sim.study.read(tmp_path / "out").metrics:
        assert repr(rows[name].to_pylist()) == repr(seated_table[name].to_pylist())
    assert replay.replay(tmp_path / "out", 3).different == {}


# -- kept cases -------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_kept_cases_have_their_recordings_also_after_a_kill(tmp_path: pathlib.Path, call: Call) -> None:
    file, out = written(tmp_path, "keep = [2]\n" + SEATED), tmp_path / "out"
    half = out / "recordings" / "case_0000002"
    assert call("sweep", file, "--out", out, "--part", "1/3")[0] == 0
    half.mkdir(parents=True)
    (half / "recording.parquet").write_bytes(b"half")  # killed while it was kept
    assert call("sweep", file, "--out", out)[0] == 0
    row = afo_sim.study.read(out).table.slice(2, 1).to_pylist()[0]
    kept = afo_sim.read_recording(half)
    assert all(m.value == row[name] for name, m in kept.metrics.items() if np.isfinite(m.value))
    assert (half / "recording.rrd").is_file()


# -- refused before anything runs -------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["case", "status", "overrides", "seed", "toe_clearance", "peak_pressure_dorsiflexor"]
)
def test_a_parameter_cannot_be_called_like_another_column(tmp_path: pathlib.Path, name: str) -> None:
    with pytest.raises(InputError, match="name of another column"):
        sweep_plan.read(written(tmp_path, SEATED.replace("parameters.pressure", f"parameters.{name}")))


def test_every_metric_s_name_is_refused_as_a_parameter_s(whole: pathlib.Path, seated_table: Any) -> None:
    known = [*afo_sim.study.read(whole).metrics, *seated_table.column_names]
    told = {"pressure", "case", "seed", "status", "reason", "overrides", "warnings", "notices"}
    assert [name for name in known if name not in told and words(name).group == OTHER] == []


@pytest.mark.parametrize(
    ("old", "new", "arguments", "problem"),
    [
        ("supply.pressure", "suply.pressure", (), "supply"),
        ("steps = 12", "steps = 12_000_000", (), "--yes-many"),
        ("[set]", "keep = [12]\n[set]", (), "no such case"),
        ("", "", ("--part", "0/3"), "--part"),
        ("", "", ("--part", "4/3"), "--part"),
        ("", "", ("--part", "x"), "--part"),
        ("", "", ("--threads", "-1"), "--threads"),
    ],
)
def test_bad_sweeps_and_options_leave_no_folder_behind(
    tmp_path: pathlib.Path, call: Call, old: str, new: str, arguments: tuple[str, ...], problem: str
) -> None:
    file = written(tmp_path, SEATED.replace(old, new, 1))
    code, _, complained = call("sweep", file, "--out", tmp_path / "out", *arguments)
    assert code == 2 and problem in complained and "Traceback" not in complained
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_run_too_short_for_any_metric_is_refused(tmp_path: pathlib.Path) -> None:
    text = SWEEP.replace("2.6 s", "0.9 s").replace("[set]", 'metrics = ["toe_clearance"]\n[set]', 1)
    with pytest.raises(InputError, match=r"toe_clearance|shorter than two strides"):
        opened(written(tmp_path, text), tmp_path / "out")


def test_a_sweep_of_which_nothing_runs_is_refused(tmp_path: pathlib.Path) -> None:
    text = SEATED.replace('duration = "0.3 s"', 'duration = "0.3 s"\nload_moment = "1000 N*m"')
    with pytest.raises(InputError, match=r"no tried case runs: .*no rest position"):
        opened(written(tmp_path, text), tmp_path / "out")


# -- Sobol' indices ---------------------------------------------------------------------------------------


@pytest.mark.slow
def test_sobol_indices_of_a_sweep_match_ishigami_in_closed_form(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys = {"load_moment": "N*m", "leg.damping": "N*m*s/rad", "leg.friction": "N*m"}

    def ishigami(_: Any, cases: Any, threads: int, chunk: int, asked: Any) -> Iterator[tuple[int, Outcome]]:
        for number, sets in cases:
            x, y, z = (np.pi * (2.0 * float(sets.get(key, "0").split()[0]) - 1.0) for key in keys)
            value = np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)
            yield number, Outcome("ok", "", {"toe_clearance": Metric(float(value), "mm")})

    text = 'scenario = "seated"\ndesign = "saltelli"\ncases = 4096\nchunk = 500\nseed = 2\n' + "".join(
        f'[parameters.x{k}]\nkey = "{key}"\nfrom = "0 {unit}"\nto = "1 {unit}"\n'
        for k, (key, unit) in enumerate(keys.items())
    )
    monkeypatch.setattr(engine, "outcomes", ishigami)
    runner.run(opened(written(tmp_path, text), tmp_path / "out"))
    results = afo_sim.study.read(tmp_path / "out")
    assert len(results) == 4096 * 8
    found = indices(results, "toe_clearance")
    # Ishigami & Homma 1990 with a = 7 and b = 0.1, doi 10.1109/ISUMA.1990.151285
    a, b = 7.0, 0.1
    alone = np.array([0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2, a**2 / 8.0, 0.0])
    pair = b**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    variance = alone.sum() + pair
    np.testing.assert_allclose(found.first, alone / variance, atol=0.02)
    np.testing.assert_allclose(found.total, (alone + np.array([pair, 0.0, pair])) / variance, atol=0.02)
    assert found.pairs()[0][:2] == ("x0", "x2")
    assert found.pairs()[0][2] == pytest.approx(pair / variance, abs=0.03)

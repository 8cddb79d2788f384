"""`afo-sim export` and `electronics`: files for other programs and for a board."""

import pathlib
import shutil

import pytest
from command import Call

import afo_sim


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    run = afo_sim.run("seated", {"duration": "0.5 s"})
    return run.save(tmp_path_factory.mktemp("runs") / "seated", rrd=False)


@pytest.mark.parametrize("to", ["sto", "mot", "csv", "mat", "mjb"])
def test_every_format_is_written_beside_the_run(folder: pathlib.Path, to: str, call: Call) -> None:
    code, out, err = call("export", folder, "--to", to, "--force")
    assert code == 0
    file = folder / f"recording.{to}"
    assert file.stat().st_size > 100 and f"written to {file}" in out and "open it with" in out
    assert ("native.installed()" in out, "toes up" in out, err) == (to == "mjb", to == "mot", "")
    assert call("export", folder, "--to", to)[0] == 2


def test_rate_columns_and_the_parquet_file_alone(
    folder: pathlib.Path, tmp_path: pathlib.Path, call: Call
) -> None:
    chosen = ("--column", "ankle/angle", "--column", "valve/*/coil")
    options = ("--out", tmp_path / "a.csv", "--rate", "50 Hz", *chosen)
    code, _, err = call("export", folder / "recording.parquet", *options)
    assert (code, err) == (0, "")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert len(lines) == 26
    assert lines[0].startswith("time [s],ankle/angle [rad],valve/dorsiflexor_inlet/coil [-]")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--to", "stp"), "did you mean 'sto'"),
        ((), "--to: is needed"),
        (("--out", "OUT/a.csv", "--rate", "9 kHz"), "--rate = '9000 Hz': is out of range"),
        (("--out", "OUT/a.csv", "--column", "ankle/angel"), "--column = 'ankle/angel': fits no column"),
        (("--to", "csv", "--out", "OUT/a.sto"), "--out"),
    ],
)
def test_wrong_options_are_told(
    folder: pathlib.Path, arguments: tuple[str, ...], words: str, tmp_path: pathlib.Path, call: Call
) -> None:
    given = [each.replace("OUT", str(tmp_path)) for each in arguments]
    code, out, err = call("export", folder, *given)
    assert (code, out) == (2, "") and words in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("file", "words"),
    [("sweep.json", "afo-sim replay"), ("search.json", "best.toml"), ("", "there is no run here")],
)
def test_folder_of_something_else_is_refused(
    file: str, words: str, tmp_path: pathlib.Path, call: Call
) -> None:
    if file:
        (tmp_path / file).write_text("{}")
    code, _, err = call("export", tmp_path, "--to", "csv")
    assert code == 2 and words in err
    assert {path.name for path in tmp_path.iterdir()} <= {file}


NAMES = ["commands.csv", "electronics.json", "host.c", "valves.h", "valves.ino"]


def test_a_timer_is_written_and_its_own_commands_read_back(tmp_path: pathlib.Path, call: Call) -> None:
    folder = tmp_path / "board"
    assert call("electronics", "seated", "--out", folder)[0] == 0
    assert sorted(path.name for path in folder.rglob("*") if path.is_file()) == NAMES
    log = folder / "commands.csv"
    code, out, _ = call("electronics", "seated", "--read", log, "--within", "0 ms")
    assert code == 0 and "they switch at the same times" in out
    hung = tmp_path / "hung.csv"
    hung.write_text("\n".join(log.read_text().splitlines()[1:4]))  # below the digest
    code, _, err = call("electronics", "seated", "--read", hung)
    assert code == 2 and "nothing to compare" in err
    late = tmp_path / "late.csv"
    late.write_text(log.read_text().partition("\n")[2].replace("4000.000000,", "4020.000000,"))
    code, out, _ = call("electronics", "seated", "--read", late)
    assert code == 1 and "switching 1: outlet at 4020.000 ms, simulated outlet at 4000.000 ms" in out


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("cc"), reason="firmware is compiled by cc")
def test_an_export_runs_in_the_loop(tmp_path: pathlib.Path, call: Call) -> None:
    seated = ("electronics", "seated", "--set", "duration=4.2 s")
    assert call(*seated, "--out", tmp_path / "board")[0] == 0
    code, out, _ = call(*seated, "--firmware", tmp_path / "board", "--within", "0 ms")
    assert code == 0 and "within 0 ms" in out


def test_an_export_is_not_replaced_by_another_scenarios(tmp_path: pathlib.Path, call: Call) -> None:
    out = ("--out", tmp_path / "board")
    assert call("electronics", "seated", *out)[0] == 0
    other = ("electronics", "seated", "--set", "timer.period=9 s", *out)
    code, _, err = call(*other)
    assert code == 2 and "holds the export of another scenario" in err
    assert call(*other, "--force")[0] == 0
    assert call("run", "seated", *out)[0] == 2

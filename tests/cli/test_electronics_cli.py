"""`afo-sim electronics`: what it writes, what it compares, and what it refuses."""

import pathlib

import pytest
from command import call

NAMES = ["commands.csv", "electronics.json", "host.c", "valves.h", "valves.ino"]


def test_a_timer_is_written_and_its_own_commands_read_back(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "board"
    assert call(capsys, "electronics", "seated", "--out", folder)[0] == 0
    assert sorted(path.name for path in folder.rglob("*") if path.is_file()) == NAMES
    log = folder / "commands.csv"
    code, out, _ = call(capsys, "electronics", "seated", "--read", log, "--within", "0 ms")
    assert code == 0 and "they switch alike" in out
    hung = tmp_path / "hung.csv"
    hung.write_text("\n".join(log.read_text().splitlines()[:3]))
    code, _, err = call(capsys, "electronics", "seated", "--read", hung)
    assert code == 2 and "nothing to compare" in err
    late = tmp_path / "late.csv"
    late.write_text(log.read_text().replace("4000.000000,", "4020.000000,"))
    code, out, _ = call(capsys, "electronics", "seated", "--read", late)
    assert code == 1 and "switching 1: outlet at 4020.000 ms, simulated outlet at 4000.000 ms" in out


def test_an_export_is_not_replaced_by_another_scenarios(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ("--out", tmp_path / "board")
    assert call(capsys, "electronics", "seated", *out)[0] == 0
    other = ("electronics", "seated", "--set", "timer.period=9 s", *out)
    code, _, err = call(capsys, *other)
    assert code == 2 and "holds the export of another scenario" in err
    assert call(capsys, *other, "--force")[0] == 0
    assert call(capsys, "run", "seated", *out)[0] == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("walk-healthy",), "no valve to switch"),
        (("seated", "--read", "no/such.csv"), "there is no such file"),
        (("seated", "--read", "a.csv", "--out", "b"), "one of the two"),
        (("seated", "--read", "a.csv", "--within", "3 bar"), "--within"),
    ],
)
def test_what_is_refused(
    arguments: tuple[str, ...], words: str, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, err = call(capsys, "electronics", *arguments)
    assert code == 2 and words in err

"""`afo-sim size`: its sentence, its table, its files, its exit codes, and what it refuses."""

import json
import pathlib
import re
import shlex

import pytest

from tests.command import call
from tests.documents import PAGES

SHORT = ("--set", "duration=2 s")
ANGLE = ("--limit", "peak_dorsiflexion_angle >= 2 deg")
FEW = ("--between", "2 bar", "4 bar")


def test_whether_a_pressure_suffices(capsys: pytest.CaptureFixture[str]) -> None:
    for pressure, code, says in (
        ("4 bar", 0, "4 bar suffices: "),
        ("1 bar", 1, "1 bar does not suffice: "),
        ("9 bar", 1, "9 bar is beyond what the muscles are allowed (4.2 bar): "),
    ):
        found, out, err = call(capsys, "size", "pressure", "seated", *SHORT, *ANGLE, "--at", pressure)
        assert (found, err) == (code, "")
        assert out.startswith(says) and len(out.strip().split("\n")) == 1


def test_table_files_and_what_is_not_replaced(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    folder = tmp_path / "a folder"
    asked = ("size", "pressure", "seated", *SHORT, *ANGLE, *FEW, "--out", folder)
    code, out, err = call(capsys, *asked)
    assert (code, err) == (0, "")
    assert "▶" in out and "1: Dorsiflexion angle, peak ≥ 2°" in out and "is the least that suffices" in out
    assert sorted(path.name for path in folder.iterdir()) == ["size.csv", "size.json", "size.png"]
    assert (folder / "size.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "size.png").stat().st_size < 150_000
    told = json.loads((folder / "size.json").read_text(encoding="utf-8"))
    rows = (folder / "size.csv").read_text(encoding="utf-8").splitlines()
    assert told["holds"] and len(rows) == 1 + len(told["tried"])
    assert call(capsys, *asked)[0] == 0  # the very same
    other = ("size", "pressure", "seated", *SHORT, "--limit", "rise_time <= 1 s", *FEW, "--out", folder)
    code, _, err = call(capsys, *other)
    assert code == 2 and "another question" in err and "--force" in err
    code, _, err = call(capsys, "run", "seated", "--out", folder)
    assert code == 2 and "holds a sizing" in err


def test_a_catalogue_is_drawn(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> None:
    limits = ("--limit", "peak_pressure_dorsiflexor >= 3.5 bar", "--limit", "air_per_cycle <= 2 g")
    for kind, more in (("tube", ("--length", "2 m")), ("supply", ("--hours", "0.1"))):
        folder = tmp_path / kind
        code, out, err = call(capsys, "size", kind, "seated", *SHORT, *limits, *more, "--out", folder)
        assert err == "" and code in (0, 1), out
        assert 10_000 < (folder / "size.png").stat().st_size < 150_000


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (("pump", "seated"), "pressure, valve, tube, supply, muscle"),
        (("pressure", "seatd"), "did you mean 'seated'"),
        (("pressure", "seated"), "--limit: is needed"),
        (("pressure", "seated", "--limit", "rise_time < 1 s"), "--limit"),
        (("pressure", "seated", *ANGLE, "--at", "3"), "--at"),
        (("tube", "seated", *ANGLE), "--length: is needed"),
        (("tube", "seated", *ANGLE, "--length", "-1 m"), "--length"),
        (("tube", "seated", *ANGLE, "--length", "1000 m"), "--length"),
        (("pressure", "seated", *ANGLE, "--at", "21 bar"), "to 20 bar"),
        (("valve", "seated", *ANGLE, "--chamber", "calf"), "--chamber"),
        (("muscle", "seated", *ANGLE, "--count", "one"), "--count"),
        (("muscle", "seated", *ANGLE, "--count", "0-2"), "--count"),
        (("valve", "seated", *ANGLE, "--hours", "2"), "--hours"),
    ],
)
def test_what_is_refused(
    more: tuple[str, ...], says: str, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    code, _, err = call(capsys, "size", *more, "--out", tmp_path / "none")
    assert code == 2 and says in err and "Traceback" not in err and len(err.strip().split("\n")) == 1
    assert not (tmp_path / "none").exists()


def test_the_pages_cheap_examples_answer_as_they_say(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    lines = re.findall(r"^    \.venv/bin/afo-sim (size pressure .*)$", PAGES["size"], flags=re.M)
    assert len(lines) >= 2
    for k, line in enumerate(lines):
        words = shlex.split(line)
        if "--out" in words:
            words[words.index("--out") + 1] = str(tmp_path / str(k))
        code, out, err = call(capsys, *words)
        assert code in (0, 1) and err == "", line
        if "--at" in words:
            assert out.strip() in PAGES["size"]

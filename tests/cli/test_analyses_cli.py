"""`afo-sim size` and `both`: tables, files, exit codes, and what they refuse."""

import json
import pathlib
import re
import shlex

import pytest
from command import Call
from documents import PAGES

import afo_sim as afo
from afo_sim.common import RETIRED, assets


def test_what_is_no_more_says_what_to_use(call: Call) -> None:
    code, _, err = call("bode", "seated", "--what", "valves")
    assert (code, len(err.splitlines())) == (2, 1) and RETIRED["bode"] in err
    with pytest.raises(AttributeError, match="a sweep over"):
        afo.bode  # noqa: B018


SHORT_OF_SIZE = ("--set", "duration=2 s")
ANGLE = ("--limit", "peak_dorsiflexion_angle >= 2 deg")
FEW = ("--between", "2 bar", "4 bar")


@pytest.mark.slow
def test_whether_a_pressure_suffices(call: Call) -> None:
    for pressure, code, says in (
        ("4 bar", 0, "4 bar suffices: "),
        ("1 bar", 1, "1 bar does not suffice: "),
        ("9 bar", 1, "9 bar is beyond what the muscles are allowed (4.2 bar): "),
    ):
        found, out, err = call("size", "pressure", "seated", *SHORT_OF_SIZE, *ANGLE, "--at", pressure)
        assert (found, err) == (code, "")
        assert out.startswith(says) and len(out.strip().split("\n")) == 1


@pytest.mark.slow
def test_table_files_and_what_is_not_replaced(call: Call, tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "a folder"
    asked = ("size", "pressure", "seated", *SHORT_OF_SIZE, *ANGLE, *FEW, "--out", folder)
    code, out, err = call(*asked)
    assert (code, err) == (0, "")
    assert "▶" in out and "1: Dorsiflexion angle, peak ≥ 2°" in out
    assert sorted(path.name for path in folder.iterdir()) == ["size.csv", "size.json", "size.png"]
    assert (folder / "size.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "size.png").stat().st_size < 150_000
    told = json.loads((folder / "size.json").read_text(encoding="utf-8"))
    rows = (folder / "size.csv").read_text(encoding="utf-8").splitlines()
    assert told["holds"] and len(rows) == 1 + len(told["tried"])
    assert call(*asked)[0] == 0  # the very same
    rise = ("--limit", "rise_time <= 1 s")
    code, _, err = call("size", "pressure", "seated", *SHORT_OF_SIZE, *rise, *FEW, "--out", folder)
    assert code == 2 and "another question" in err and "--force" in err
    code, _, err = call("run", "seated", "--out", folder)
    assert code == 2 and "holds a sizing" in err


@pytest.mark.slow
def test_a_catalogue_is_drawn(call: Call, tmp_path: pathlib.Path) -> None:
    limits = ("--limit", "peak_pressure_dorsiflexor >= 3.5 bar", "--limit", "air_per_cycle <= 2 g")
    for kind, more in (("tube", ("--length", "2 m")), ("supply", ("--hours", "0.1"))):
        folder = tmp_path / kind
        code, out, err = call("size", kind, "seated", *SHORT_OF_SIZE, *limits, *more, "--out", folder)
        assert err == "" and code in (0, 1), out
        assert 10_000 < (folder / "size.png").stat().st_size < 150_000


@pytest.mark.slow
def test_the_pages_cheap_examples_answer_as_they_say(call: Call, tmp_path: pathlib.Path) -> None:
    lines = re.findall(r"^    \.venv/bin/afo-sim (size pressure .*)$", PAGES["size"], flags=re.M)
    assert len(lines) >= 2
    for k, line in enumerate(lines):
        words = shlex.split(line)
        if "--out" in words:
            words[words.index("--out") + 1] = str(tmp_path / str(k))
        code, out, err = call(*words)
        assert code in (0, 1) and err == "", line
        if "--at" in words:
            assert out.strip() in PAGES["size"]


def both(call: Call, out: pathlib.Path, *more: str) -> tuple[int, str, str]:
    return call("both", "seated", "--out", out, "--set", "duration=8 s", "--no-rrd", *more)


def test_both_legs_on_the_terminal_and_on_disk(
    call: Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    code, out, err = both(call, tmp_path / "a")
    assert (code, err) == (0, "")
    assert "do not disturb each other" in " ".join(out.split())
    assert max(map(len, out.splitlines()[:-1])) <= 100
    assert sorted(p.name for p in (tmp_path / "a").iterdir()) == ["both.json", "both.png", "left", "right"]


@pytest.mark.slow
def test_two_walking_legs_answer_on_a_dozen_lines_and_hide_no_bad_answer(
    call: Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.chdir(tmp_path)
    words = ("both", "walk-dropfoot-afo", "--no-rrd", "--force", "--out", "a")
    code, short, _ = call(*words)
    # seven answers, notes of two lines, three of what they were worth so far and three of what they are not
    assert code == 0 and len(short.splitlines()) <= 24
    assert "air       together:" in short and "note: the muscles are filled" in short
    _, whole, _ = call(*words, "--numbers")
    mark = re.compile("^[✓!✗?] (GOOD|DOUBTFUL|BAD|UNKNOWN) ", re.M)
    assert mark.findall(short) == mark.findall(whole) and "BAD" in mark.findall(short)
    assert "right and left compared" in whole and "air on one supply" in whole


@pytest.mark.slow
def test_a_left_leg_has_its_own_cautions_and_kinds_of_limits(
    call: Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "120")
    usual = (assets.folder("models") / "limits" / "usual" / "limits.toml").read_text(encoding="utf-8")
    own = tmp_path / "own.toml"
    own.write_text(re.sub("toe_clearance = .*", 'toe_clearance = ["40 mm", "0 mm"]', usual), encoding="utf-8")
    words = ("both", "walk-dropfoot-afo", "--affected", "left", "--no-rrd", "--out", tmp_path / "a")
    code, found, err = call(*words, "--left-set", f"limits={own}")
    assert code == 0, err
    assert "(target ≥ 40) [user]" in found and "the assumed cuff stiffness" in " ".join(found.split())


@pytest.mark.slow
def test_other_legs_are_not_replaced(call: Call, tmp_path: pathlib.Path) -> None:
    assert both(call, tmp_path / "a")[0] == 0
    assert both(call, tmp_path / "a")[0] == 0  # the very same
    code, _, err = both(call, tmp_path / "a", "--left-set", "load_moment=1 N*m")
    assert code == 2 and "holds a run of 'seated' with other values" in err and "--force" in err
    assert both(call, tmp_path / "a", "--left-set", "load_moment=1 N*m", "--force")[0] == 0
    code, _, err = call("run", "seated", "--out", tmp_path / "a", "--no-rrd")
    assert code == 2 and "run of both legs" in err

"""`afo-sim both`: its table, its folder, and what it refuses."""

import pathlib

import pytest

from tests.command import call


def both(capsys: pytest.CaptureFixture[str], out: pathlib.Path, *more: str) -> tuple[int, str, str]:
    short = ("--set", "duration=8 s", "--no-rrd")
    return call(capsys, "both", "seated", "--out", out, *short, *more)


def test_both_legs_on_the_terminal_and_on_disk(
    capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    code, out, err = both(capsys, tmp_path / "a")
    assert (code, err) == (0, "")
    assert "neither leg disturbs the other" in " ".join(out.split())
    assert max(map(len, out.splitlines()[:-1])) <= 100
    assert sorted(p.name for p in (tmp_path / "a").iterdir()) == ["both.json", "both.png", "left", "right"]


def test_other_legs_are_not_replaced(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> None:
    assert both(capsys, tmp_path / "a")[0] == 0
    assert both(capsys, tmp_path / "a")[0] == 0  # the very same
    code, _, err = both(capsys, tmp_path / "a", "--set-left", "load_moment=1 N*m")
    assert code == 2 and "holds a run of 'seated' with other values" in err and "--force" in err
    assert both(capsys, tmp_path / "a", "--set-left", "load_moment=1 N*m", "--force")[0] == 0
    code, _, err = call(capsys, "run", "seated", "--out", tmp_path / "a", "--no-rrd")
    assert code == 2 and "run of both legs" in err


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (("--apart", "0.5"), "--apart"),
        (("--left", "walk-dropfoot-afo"), "sits"),
        (("--set-left", "duration"), "--set-left"),
        (("--left", "seatd"), "seated"),
    ],
)
def test_what_does_not_fit_is_one_sentence(
    more: tuple[str, ...], says: str, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    code, _, err = both(capsys, tmp_path / "a", *more)
    assert code == 2 and says in err and "Traceback" not in err
    assert not (tmp_path / "a").exists()

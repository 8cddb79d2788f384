"""`afo-sim bode`: its tables, its files, and what it refuses."""

import pathlib

import pytest

from tests.command import call

SHORT = ("--what", "valves", "--frequencies", "1, 2 Hz")


def test_tables_and_files(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "a folder"
    code, out, err = call(capsys, "bode", "seated", *SHORT, "--out", folder)
    assert (code, err) == (0, "")
    assert "ankle/angle over dorsiflexor's valves" in out and "−3 dB" in out
    assert sorted(path.name for path in folder.iterdir()) == ["bode.csv", "bode.json", "bode.png"]
    assert (folder / "bode.png").read_bytes().startswith(b"\x89PNG")
    assert call(capsys, "bode", "seated", *SHORT, "--out", folder)[0] == 0  # the very same
    before = (folder / "bode.json").read_bytes()
    other = ("bode", "seated", *SHORT, "--set", "supply.pressure=3 bar", "--out", folder)
    code, _, err = call(capsys, *other)
    assert code == 2 and "another description or excitation" in err and "--force" in err
    assert (folder / "bode.json").read_bytes() == before
    assert call(capsys, *other, "--force")[0] == 0
    code, _, err = call(capsys, "run", "seated", "--out", folder)
    assert code == 2 and "frequency response" in err


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (("seated", "--frequencies", "1, x"), "--frequencies"),
        (("seated", "--frequencies", "2, 1"), "rising"),
        (("seated", "--what", "valve"), "did you mean 'valves'"),
        (("seated", "--chamber", "dorsiflex"), "did you mean 'dorsiflexor'"),
        (("seated", "--what", "pressure"), "[drive.dorsiflexor]"),
        (("seated", "--what", "reference"), "controller"),
        (("seated", "--amplitude", "5"), "does not go with valves"),
        (("walk-dropfoot-afo",), "walks"),
        (("seatd",), "did you mean 'seated'"),
    ],
)
def test_what_is_refused(
    more: tuple[str, ...], says: str, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    code, _, err = call(capsys, "bode", *more, "--out", tmp_path / "none")
    assert code == 2 and says in err and "Traceback" not in err
    assert not (tmp_path / "none").exists()

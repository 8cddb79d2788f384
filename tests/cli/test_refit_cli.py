"""`afo-sim refit`: its table, its folder, and what it refuses."""

import pathlib

import pytest

from tests.command import call


def test_refit_to_lengths_and_run(capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path) -> None:
    lengths = ("--shank-length", "35 cm", "--foot-length", "22 cm")
    code, out, err = call(capsys, "refit", "s1", *lengths, "--out", tmp_path / "mine")
    assert (code, err) == (0, "")
    assert "shank × 0.813, foot × 0.8271" in out  # 35/(0.246·175), 22/(0.152·175)
    worn = ("--set", f"orthosis={tmp_path / 'mine'}", "--set", "duration=1 s", "--no-rrd")
    code, _, err = call(capsys, "run", "seated", *worn, "--out", tmp_path / "run")
    assert (code, err) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("s1", "--to", "adult_75kg"), "--out"),
        (("s1",), "--to"),
        (("s1", "--to", "adult_75kg", "--foot-length", "22 cm"), "--to"),
        (("s1", "--shank-length", "35"), "--shank-length"),
        (("s1", "--shank-length", "3 mm"), "--shank-length"),
        (("s1", "--foot-length", "nan m"), "--foot-length"),
        (("s2", "--to", "adult_75kg"), "s1"),
        (("s1", "--to", "adult_75"), "adult_75kg"),
        (("s1", "--shank-length", "20 cm", "--foot-length", "12 cm"), "a shorter muscle"),
    ],
)
def test_what_does_not_fit_is_one_sentence(
    arguments: tuple[str, ...], says: str, capsys: pytest.CaptureFixture[str], tmp_path: pathlib.Path
) -> None:
    out = () if says == "--out" else ("--out", tmp_path / "mine")
    code, _, err = call(capsys, "refit", *arguments, *out)
    assert code == 2 and says in err and "Traceback" not in err
    assert not (tmp_path / "mine").exists()

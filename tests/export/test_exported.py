"""Files together or not at all, nothing replaced unasked, words for what does not go."""

import pathlib
from typing import Any

import pytest

from afo_sim.common import InputError
from afo_sim.export import export, formats
from afo_sim.simulation import Recording


def test_ending_tells_the_format_and_format_the_ending(
    seated_second: Recording, tmp_path: pathlib.Path
) -> None:
    for given, to, name in (("a.sto", None, "a.sto"), ("b", "CSV", "b.csv"), ("new/c.Mat", ".mat", "c.Mat")):
        assert seated_second.export(tmp_path / given, to, rate=100.0)[0].name == name


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"out": "a.sot"}, r"a.sot': has no ending .*: .sto, .mot, .csv, .mat, .mjb.*did you mean '.sto'"),
        ({"out": "a.csv", "to": "cvs"}, "'cvs': is not a valid format; allowed: sto, .*did you mean 'csv'"),
        ({"out": "a.csv", "to": "sto"}, "not named as sto is"),
        ({"out": "a"}, "has no ending of a format"),
        ({"out": ".", "to": "csv"}, "out = .*: is a folder; allowed: a file in it, such as .*recording.csv"),
        ({"out": "a.mjb", "rate": 100.0}, "rate = '100 Hz': does not go with mjb"),
        ({"out": "a.mot", "columns": ["ankle/*"]}, "does not go with mot"),
        ({"out": "a.csv", "columns": ["knee"]}, "fits no column"),
    ],
)
def test_what_does_not_go_is_told(
    seated_second: Recording, arguments: dict[str, Any], says: str, tmp_path: pathlib.Path
) -> None:
    with pytest.raises(InputError, match=says):
        seated_second.export(tmp_path / arguments.pop("out"), **arguments)
    assert not list(tmp_path.iterdir())


def test_nothing_is_replaced_unasked(
    seated_second: Recording, walked: Recording, tmp_path: pathlib.Path
) -> None:
    seated_second.export(tmp_path / "a.csv", columns=["ankle/*"])
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    with pytest.raises(InputError, match="exists"):
        seated_second.export(tmp_path / "a.csv")
    seated_second.export(tmp_path / "a.sto", columns=["ankle/*"])  # the same metrics may stay
    with pytest.raises(InputError, match=r"would overwrite a_metrics\.csv"):
        export(walked, tmp_path / "a.mot")
    assert {file.name for file in tmp_path.iterdir()} == {*before, "a.sto"}
    assert all((tmp_path / name).read_bytes() == content for name, content in before.items())


def test_force_replaces_and_takes_away_what_is_of_the_older_run(
    seated_second: Recording, walked: Recording, tmp_path: pathlib.Path
) -> None:
    export(walked, tmp_path / "a.mot")
    assert (tmp_path / "a_grf.mot").is_file()
    export(seated_second, tmp_path / "a.mot", force=True)
    assert {file.name for file in tmp_path.iterdir()} == {"a.mot", "a_metrics.csv"}


def test_half_an_export_leaves_nothing(
    walked: Recording, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(formats, "_write_metrics", full)
    with pytest.raises(InputError, match="the disk is full"):
        export(walked, tmp_path / "a.mot")
    assert not list(tmp_path.iterdir())


def test_progress_is_told(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    told: list[tuple[int, int]] = []
    export(seated_second, tmp_path / "a.csv", report=lambda done, total: told.append((done, total)))
    assert told[-1] == (500, 500)

"""Command and figure of a torque fit: files, words, refusals; the pictures hold what was read."""

import json
import pathlib

import numpy as np
import pytest
from campaign import size
from command import call
from devices import device
from knee import knee_data, knee_orthosis
from matplotlib.figure import Figure

from afo_sim.description import reader, toml_text
from afo_sim.lab import fit_torque, knee_tests, paths, statics
from afo_sim.show import write_torque_figure

NAMES = {"fit_torque.json", "fit_torque.png", "fit_torque.pdf", "orthosis.toml"}
ANGLE = np.tile(np.linspace(-16.0, 12.0, 8), 3)
BAR = np.repeat([2.0, 3.0, 4.0], 8)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """S1's torques with 3 mm of offset and links of 30 kN/m on a known cuff, as a CSV."""
    orthosis = reader.load("orthosis", "s1")
    torque, _ = statics(
        orthosis, paths(orthosis, np.radians(ANGLE)), "dorsiflexor", 1e5 * BAR, device(30e3, 3e-3)
    )
    file = tmp_path_factory.mktemp("bench") / "bench.csv"
    rows = [f"{a},{p},{m:.5f}" for a, p, m in zip(ANGLE, BAR, torque, strict=True)]
    file.write_text("\n".join(["angle [deg],pressure [bar],torque [N*m]", *rows]) + "\n", encoding="utf-8")
    return file


@pytest.mark.slow
def test_command_writes_table_figure_numbers_and_an_orthosis_that_runs(
    bench: pathlib.Path, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "fitted"
    code, printed, complaint = call(capsys, "fit", bench, "--orthosis", "s1", "--out", out)
    assert code == 0, complaint
    assert {path.name for path in out.iterdir()} == NAMES
    for expected in ("series_stiffness", "kN/m", "3", "angle left out in turn", "without offset", f"={out}"):
        assert expected in printed
    told = json.loads((out / "fit_torque.json").read_text())
    assert told["parameters"]["series_stiffness"]["value"] == pytest.approx(30e3, rel=1e-3)
    assert told["parameters"]["offset"]["value"] == pytest.approx(3e-3, abs=1e-5)
    assert told["settings"] == 24 and len(told["points"]["residual"]) == 24
    text = (out / "orthosis.toml").read_text()
    assert 'kind = "fitted"' in text and "24 static torques of bench.csv" in text
    moved = out.rename(tmp_path / "moved")
    run = ("run", "seated", "--set", f"orthosis={moved}", "--set", "duration=0.05 s", "--no-rrd")
    code, _, complaint = call(capsys, *run, "--out", tmp_path / "run")
    assert code == 0, complaint


@pytest.mark.slow
def test_command_predicts_a_file_that_it_does_not_fit(
    bench: pathlib.Path, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = bench.read_text().splitlines()
    other = tmp_path / "other.csv"
    other.write_text("\n".join([lines[0], *(f"{line.rpartition(',')[0]},1.5" for line in lines[1:])]))
    options = ("--hold-out", "none", "--hold-out", other, "--out", tmp_path / "x")
    code, _, complaint = call(capsys, "fit", bench, "--orthosis", "s1", *options)
    assert code == 0, complaint
    told = json.loads((tmp_path / "x" / "fit_torque.json").read_text())
    measured = np.array(told["points"]["torque"])
    expected = float(np.sqrt(np.mean((measured - 1.5) ** 2)))
    assert list(told["held_out"]) == ["file"]
    assert told["held_out"]["file"]["rms"] == pytest.approx(expected, abs=1e-3)


@pytest.mark.slow
def test_command_takes_an_orthosis_for_each_group(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options, groups = [], list(knee_tests())[-size(2, 5) :]
    for name in groups:
        place = tmp_path / name
        place.mkdir()
        table = knee_orthosis(knee_tests()[name]).model_dump(mode="json", exclude_none=True)
        (place / "orthosis.toml").write_text(toml_text(table), encoding="utf-8")
        options += ["--orthosis", f"{name}={place}"]
    columns, data, out = knee_data(), tmp_path / "knees.csv", tmp_path / "out"
    rows = [row for row in zip(*columns.values(), strict=True) if row[0] in groups]
    data.write_text("\n".join(",".join(map(str, row)) for row in (columns, *rows)))
    code, printed, complaint = call(capsys, "fit", data, *options, "--hold-out", "group", "--out", out)
    assert code == 0, complaint
    if len(groups) == 5:  # tests/lab asks the fit itself
        assert "not identifiable one by one: without offset" in " ".join(printed.split())
    assert {path.name for path in out.iterdir()} == (NAMES - {"orthosis.toml"}) | set(groups)
    fitted = {name: reader.load("orthosis", out / name).muscle["flexor"] for name in groups}
    assert len({each.cable.offset for each in fitted.values()}) == 1
    assert len({each.type.total_length for each in fitted.values()}) == len(groups)


S1 = ("--orthosis", "s1")


@pytest.mark.parametrize(
    ("options", "text"),
    [
        *(
            (options, None)
            for options in (
                ("--orthosis", "s3"),
                ("--orthosis", "none"),
                (*S1, "--free", "stiffness"),
                (*S1, "--free", ""),
                (*S1, "--hold-out", "pres"),
                (*S1, "--chamber", "front"),
                (*S1, "--torque", "whole"),
                (*S1, "--rate", "angle"),
                (*S1, "--rate", "speed=1 deg/s"),
                ("--orthosis", "a=s1"),
                (*S1, *S1),
            )
        ),
        *((S1, text) for text in ("", "angle [deg]\n", "\0", "angle [deg],pressure [bar],torque [N*m]\n")),
    ],
)
def test_command_refuses_with_exit_2_and_writes_nothing(
    options: tuple[str, ...],
    text: str | None,
    bench: pathlib.Path,
    tmp_path: pathlib.Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if text is not None:
        bench = tmp_path / "x.csv"
        bench.write_text(text)
    code, _, complaint = call(capsys, "fit", bench, *options, "--out", tmp_path / "x")
    assert code == 2
    assert complaint.startswith("afo-sim: ") and complaint.strip().count("\n") == 0
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_figure_shows_every_reading_and_the_fit(
    bench: pathlib.Path, tmp_path: pathlib.Path, drawn: list[Figure]
) -> None:
    found = fit_torque(bench, "s1", hold_out="angle")
    assert [path.suffix for path in write_torque_figure(found, tmp_path)] == [".png", ".pdf"]
    torque, residuals, profile, *_ = drawn[0].axes
    points = [line for line in torque.lines if line.get_marker() == "o"]
    shown = np.concatenate([np.asarray(line.get_ydata()) for line in points])
    assert sorted(shown) == pytest.approx(sorted(found.problem.column("torque")))
    assert [line.get_label() for line in points] == ["2 bar", "3 bar", "4 bar"]
    assert sum(len(part.get_offsets()) for part in residuals.collections) == 24
    assert (profile.get_xlabel(), profile.get_ylabel()) == ("series_stiffness [kN/m]", "offset [mm]")
    assert profile.get_xlim()[0] < 30.0 < profile.get_xlim()[1]

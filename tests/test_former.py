"""Files that a former version wrote open still: runs, sweeps, searches, fits, and a user's own descriptions.

`tests/former/<version>` holds what `afo-sim run`, `sweep`, `optimise`, `fit` and `new` of that version wrote.
"""

import json
import pathlib
import shutil

import numpy as np
import pytest
from command import call

import afo_sim as afo
from afo_sim import study
from afo_sim.common import assets

INSTALLED = "/home/user/afo_sim"  # where the version stood that wrote them
FORMER = sorted((pathlib.Path(__file__).parent / "former").iterdir())
OWN = [pytest.param(path, id=path.name) for folder in FORMER for path in sorted((folder / "own").iterdir())]
each_version = pytest.mark.parametrize("folder", FORMER, ids=lambda folder: folder.name)


@each_version
@pytest.mark.parametrize("name", ["seated", "walk"])
def test_a_recording_opens_with_its_numbers(folder: pathlib.Path, name: str) -> None:
    run = afo.read_recording(folder / name)
    summary = json.loads((folder / name / "summary.json").read_text(encoding="utf-8"))
    assert run.status == "ok"
    values = {metric: found["value"] for metric, found in summary["metrics"].items()}
    values = {metric: np.nan if value is None else value for metric, value in values.items()}
    assert values == pytest.approx(
        {metric: found.value for metric, found in run.metrics.items()}, nan_ok=True
    )
    assert np.isfinite(run["ankle/angle"]).all() and list(run.warnings) == summary["warnings"]


@each_version
def test_a_former_scenario_runs_to_the_same_numbers(folder: pathlib.Path) -> None:
    before = afo.read_recording(folder / "seated")
    text = json.dumps(before.described).replace(INSTALLED, str(assets.folder("models").parent))
    now = afo.run(json.loads(text))
    for column in ("ankle/angle", "chamber/dorsiflexor/pressure", "muscle/dorsiflexor_1/force"):
        # version 0.1 stepped a muscle's length by another scheme: its error at 2 ms
        error = 1e-4 * np.abs(before[column]).max()
        assert now[column] == pytest.approx(before[column], abs=error + 1e-9)


@pytest.mark.slow
@each_version
@pytest.mark.parametrize("command", ["report", "figure", "export"])
def test_commands_take_a_former_run(
    command: str, folder: pathlib.Path, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(folder / "walk", tmp_path / "walk")
    out = tmp_path / {"report": "walk.html", "figure": "figures", "export": "walk.csv"}[command]
    words = ("--to", "csv") if command == "export" else ()
    code, _, wrong = call(capsys, command, tmp_path / "walk", *words, "--out", out)
    assert code == 0, wrong
    files = [out] if out.is_file() else list(out.glob("*.png"))
    assert files and all(file.stat().st_size > 5000 for file in files)


@each_version
def test_results_of_a_sweep_open_and_are_shown(
    folder: pathlib.Path, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = study.read(folder / "sweep")
    assert [row["pressure [Pa]"] for row in results.to_pandas().to_dict("records")] == [2e5, 3e5]
    shutil.copytree(folder / "sweep", tmp_path / "sweep")
    code, said, wrong = call(capsys, "sweep", "--show", tmp_path / "sweep")
    assert code == 0 and "pressure" in said, wrong
    assert list((tmp_path / "sweep").rglob("*.png"))


@each_version
def test_the_best_of_a_search_runs(
    folder: pathlib.Path, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("run", folder / "search" / "best.toml", "--no-rrd", "--out", tmp_path / "best")
    code, _, wrong = call(capsys, *words)
    assert code == 0, wrong
    best = json.loads((folder / "search" / "best.json").read_text(encoding="utf-8"))
    angle = afo.read_recording(tmp_path / "best").metrics["peak_dorsiflexion_angle"]
    assert float(angle) == pytest.approx(best["objective"]["value"], rel=1e-6)


@each_version
def test_a_fitted_muscle_is_a_muscle(folder: pathlib.Path) -> None:
    muscle = afo.load("muscle", str(folder / "fit" / "muscle.toml"))
    assert float(muscle.force("3 bar", contraction=0.05)) > 0.0


@pytest.mark.parametrize("path", OWN)
def test_a_users_own_file_is_good(path: pathlib.Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = path if path.is_file() else path / f"{path.name.removeprefix('my-')}.toml"
    code, said, wrong = call(capsys, "check", file)
    assert code == 0, said + wrong

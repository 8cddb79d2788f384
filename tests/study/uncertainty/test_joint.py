"""Sweeps whose cases are joint draws: the very draws of a run, stored and resumed as every sweep."""

import json
import pathlib
from typing import Any

import numpy as np
import pytest
from sweep_runs import swept

from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.study import cases_of, sweep_plan
from afo_sim.study import read as read_results
from afo_sim.study.replay import replay
from afo_sim.study.uncertainty.draw import applied, draw
from afo_sim.study.uncertainty.spreads import read

JOINT = """
scenario = "walk-dropfoot-afo"
design = "uncertainty"
spreads = "usual"
cases = 24
seed = 5
chunk = {chunk}
metrics = ["toe_clearance", "air_per_stride"]
[set]
duration = "2.6 s"
timestep = "4 ms"
"""


def plan_of(folder: pathlib.Path, text: str) -> sweep_plan.Plan:
    file = folder / "sweep.toml"
    file.write_text(text, encoding="utf-8")
    return sweep_plan.read(file)


def test_cases_are_the_draws_of_a_run(tmp_path: pathlib.Path) -> None:
    cases = cases_of(plan_of(tmp_path, JOINT.format(chunk=8)))
    walk = load("scenario", "walk-dropfoot-afo", {"duration": "2.6 s", "timestep": "4 ms"})
    drawn = draw(applied(read("usual"), walk), walk, 24, 5)
    assert len(cases) == 24
    for case in (0, 11, 23):
        fixed = {"duration": "2.6 s", "timestep": "4 ms"}
        assert cases.sets(case) == fixed | drawn.sets(case)


def test_heights_stand_in_no_row_and_that_is_told(tmp_path: pathlib.Path) -> None:
    plan = plan_of(tmp_path, JOINT.format(chunk=8))
    assert {"own_walking", "swing_path"}.isdisjoint(parameter.name for parameter in plan.parameters)
    assert any("own_walking" in note and "swing_path" in note for note in plan.notes)


@pytest.mark.slow
def test_rows_are_the_same_however_computed_and_replayed(tmp_path: pathlib.Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    one.mkdir()
    two.mkdir()
    swept(one, JOINT, chunk=24, threads=1)
    swept(two, JOINT, chunk=5, threads=2)
    first, second = (read_results(folder / "out") for folder in (one, two))
    assert first.design == "uncertainty" and set(first["status"]) == {"ok"}
    for column in (*first.parameters, *first.metrics):
        assert (first[column] == second[column]).all(), column
    for key in ("muscle_fit_braid_angle", "cuff", "tissue", "pace"):
        assert len(np.unique(first[key])) == 24
    assert replay(one / "out", 3).same
    overrides = json.loads(first["overrides"][3])
    assert overrides["orthosis.anchor.shank.stiffness"] == f"{float(first['cuff'][3])!r} N/m"


def test_other_draws_are_another_sweep(tmp_path: pathlib.Path) -> None:
    text = JOINT.format(chunk=8)
    mine = plan_of(tmp_path, text).canonical()
    assert mine == plan_of(tmp_path, text).canonical()
    assert mine != plan_of(tmp_path, text.replace("seed = 5", "seed = 6")).canonical()


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ('spreads = "usual"\n', "", "spreads"),
        ('spreads = "usual"', 'spreads = "usal"', "spreads"),
        ("cases = 24\n", "", "cases"),
        ("cases = 24", "cases = 1", "cases"),
        ("seed = 5", 'constraints = ["cuff < 5"]', "constraints"),
        ("walk-dropfoot-afo", "seated", "scenario"),
        (
            "[set]",
            "[parameters.pressure]\nkey = 'supply.pressure'\nfrom = '2 bar'\nto = '4 bar'\n[set]",
            "parameters",
        ),
        ("[set]", "[set]\n'patient.passive_scale' = 1.2", "set.patient.passive_scale"),
        ('design = "uncertainty"', 'design = "uncertanty"', "design"),
        ('design = "uncertainty"', 'design = "sobol"', "parameters"),
    ],
)
def test_what_does_not_go_together_is_refused(tmp_path: pathlib.Path, old: str, new: str, field: str) -> None:
    text = JOINT.format(chunk=8)
    assert old in text
    with pytest.raises(InputError) as caught:
        plan_of(tmp_path, text.replace(old, new))
    assert caught.value.field == field and caught.value.file == tmp_path / "sweep.toml"


def test_a_sweep_without_a_file_draws_the_same_cases(tmp_path: pathlib.Path) -> None:
    stated: dict[str, Any] = {
        "spreads": "usual",
        "cases": 24,
        "seed": 5,
        "metrics": ["toe_clearance", "air_per_stride"],
    }
    fixed = {"duration": "2.6 s", "timestep": "4 ms"}
    made = sweep_plan.plan_of("walk-dropfoot-afo", {}, fixed, design="uncertainty", **stated)
    assert made.canonical() == plan_of(tmp_path, JOINT.format(chunk=8)).canonical()


@pytest.mark.slow
def test_the_shipped_sweep_reads() -> None:
    assert len(cases_of(sweep_plan.read("uncertainty"))) == 500

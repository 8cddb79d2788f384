"""The step of a run, halved until its numbers agree with twice the step: errors, bounds, what names them."""

import dataclasses
import json
import math
import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from command import call

import afo_sim as afo
from afo_sim.common import InputError, with_code
from afo_sim.metrics import Metric
from afo_sim.model import as_run
from afo_sim.simulation import (
    Recording,
    at_step,
    controlled,
    found_step_errors,
    run_at_step,
    run_scenario,
    step_errors,
)
from afo_sim.simulation.step_control import OF_METHOD, PATTERN

SHORT = {"duration": "2 s"}
WIDE = SHORT | {f"orthosis.chamber.dorsiflexor.{valve}": "sy9000" for valve in ("inlet", "outlet")}
COARSE = WIDE | {"timestep": "8 ms"}
WALK = {"duration": "2.2 s", "timestep": "4 ms"}


def fill(seen: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    return {"dorsiflexor": (1.0, 0.0)}


class Counting:
    """Fills from its fifth command on."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, seen: object) -> dict[str, tuple[float, float]]:
        self.count += 1
        return {"dorsiflexor": (float(self.count > 5), 0.0)}


class Forgetting(Counting):
    reset = Counting.__init__


def taken(run: Recording) -> tuple[float, float]:
    """The step of a run and the one that was asked for [ms]."""
    study = run.studies["time_step"]
    return 1e3 * study["step"], 1e3 * study["asked"]


def watched(scenario: str, sets: dict[str, str]) -> tuple[Recording, list[tuple[float, float]]]:
    """A controlled run, and the step [ms] and the number of steps of all that were made for it."""
    done: list[tuple[float, float]] = []

    def simulate(at: afo.Scenario, what: str, start: bool) -> Recording:
        run = run_scenario(at)
        done.append((1e3 * as_run(at).timestep, run.timing["steps"]))
        return run

    return controlled(afo.load("scenario", scenario, sets), simulate), done


def test_a_run_that_agrees_with_twice_its_step_is_the_one_at_its_step(tmp_path: pathlib.Path) -> None:
    run = afo.run("seated", SHORT, step="controlled")
    plain, twice = afo.run("seated", SHORT), afo.run("seated", SHORT | {"timestep": "4 ms"})
    assert dict(run.metrics) == dict(plain.metrics) and run.warnings == plain.warnings
    assert all(np.array_equal(run[name], plain[name], equal_nan=True) for name in plain.columns)
    found = found_step_errors(afo.read_recording(run.save(tmp_path / "run", rrd=False)))
    assert found.keys() == plain.metrics.keys() - OF_METHOD
    for name, each in found.items():
        off = twice.metrics[name].value - plain.metrics[name].value
        assert each.error == pytest.approx(off, abs=1e-12) and each.times <= 1.0, name
        assert each.unit == plain.metrics[name].unit
    stored = json.loads((tmp_path / "run" / "summary.json").read_text())["studies"]["time_step"]
    assert (stored["step"], stored["asked"]) == pytest.approx((2e-3, 2e-3))
    assert not found_step_errors(plain) and taken(plain) == pytest.approx((2.0, 2.0))


def test_a_step_that_is_too_long_is_halved_and_rows_stay() -> None:
    run, plain = afo.run("seated", COARSE, step="controlled"), afo.run("seated", COARSE)
    step, asked = taken(run)
    assert asked == pytest.approx(8.0) and asked / step in (2.0, 4.0, 8.0, 16.0)
    assert dict(run.metrics) == dict(afo.run("seated", COARSE | {"timestep": f"{step!r} ms"}).metrics)
    assert run["time"] == pytest.approx(plain["time"], abs=1e-9) and run.scenario == plain.scenario
    named = {name for warning in with_code(run.warnings, "step-matters") for name in warning.data["names"]}
    assert named == {name for name, each in found_step_errors(run).items() if each.times > 1.0}


def test_what_still_depends_on_the_step_is_named_worst_first_and_patterns_say_no_more() -> None:
    plain = afo.run("seated", WIDE | {"timestep": "4 ms"})
    run = run_at_step(afo.load("scenario", "seated", WIDE | {"timestep": "4 ms"}), halvings=0)
    (warning,), errors = with_code(run.warnings, "step-matters"), found_step_errors(run)
    beyond = {name: each.times for name, each in errors.items() if each.times > 1.0}
    assert warning.data["names"] == sorted(beyond, key=lambda name: -beyond[name]) and "peak_flow" in beyond
    assert (warning.data["count"], warning.data["among"]) == (len(beyond), len(errors))
    assert not with_code(run.warnings, PATTERN)
    assert with_code(plain.warnings, "air-coarse") and not with_code(plain.warnings, "step-matters")


@pytest.mark.parametrize(
    ("scenario", "sets"),
    [("seated", SHORT | {"timestep": "4 ms"}), ("arm", SHORT), ("walk-dropfoot-afo", WALK)],
)
def test_no_number_is_further_off_an_eighth_of_the_step_than_it_may_be(
    scenario: str, sets: dict[str, str]
) -> None:
    run = afo.run(scenario, sets, step="controlled")
    exact = run_scenario(at_step(afo.load("scenario", scenario, sets), 1e-3 * taken(run)[1] / 8.0))
    off = {name: each.times for name, each in step_errors(run.metrics, exact.metrics).items()}
    assert max(off.values()) <= 1.0, {name: times for name, times in off.items() if times > 1.0}


@pytest.mark.parametrize(("scenario", "step"), [("seated", 9.0), ("walk-dropfoot", 4.0)])
def test_where_twice_the_step_is_refused_it_begins_with_half(scenario: str, step: float) -> None:
    """Twice 9 ms is no step; of twice 4 ms the floor makes none."""
    run, done = watched(scenario, {"duration": "2.2 s", "timestep": f"{step} ms"})
    assert [own for own, _ in done[:2]] == pytest.approx([step, step / 2.0], rel=2e-3)
    assert taken(run)[0] == pytest.approx(done[-1][0]) and len(found_step_errors(run)) > 30
    assert all(each.times <= 1.0 for each in found_step_errors(run).values())


@pytest.mark.parametrize("scenario", ["seated", "arm", "knee"])
def test_control_costs_half_a_run_more_where_the_first_pair_agrees(scenario: str) -> None:
    run, done = watched(scenario, SHORT)
    assert sum(steps for _, steps in done) <= 1.51 * run.timing["steps"]


def test_a_run_that_fails_is_returned_with_no_error_of_a_number(seated: Recording) -> None:
    failed = dataclasses.replace(seated, status="failed: cut off")
    run = controlled(afo.load("scenario", "seated"), lambda *_: failed)
    assert run.status == failed.status and not found_step_errors(run)


@pytest.mark.parametrize(
    ("unit", "value", "longer", "bound"),
    [
        ("deg", 50.0, 50.09, 0.1),  # of angles and heights no share of the value counts
        ("mm", -200.0, -200.2, 0.3),
        ("N*m", 10.0, 10.09, 0.1),  # 1 %
        ("N*m", 0.01, 0.0, 0.02),  # too little to matter
        ("", 1000.0, 1009.0, 10.0),
    ],
)
def test_bounds(unit: str, value: float, longer: float, bound: float) -> None:
    (found,) = step_errors({"x": Metric(value, unit)}, {"x": Metric(longer, unit)}).values()
    assert found.error == pytest.approx(longer - value)
    assert found.bound == pytest.approx(bound) and found.times <= 1.0
    beyond = step_errors({"x": Metric(value, unit)}, {"x": Metric(longer + 2.2 * bound, unit)})
    assert beyond["x"].times > 1.0


def test_what_no_run_defines_is_the_same() -> None:
    for value in (math.inf, math.nan):
        same = {"x": Metric(value, "h")}
        assert step_errors(same, same)["x"].times == 0.0
        assert step_errors(same, {"x": Metric(1.0, "h")})["x"].times > 1.0
    assert not step_errors({"settled_air_change": Metric(1.0)}, {})


def test_a_settled_strides_half_step_is_half_its_own() -> None:
    walk = afo.load("scenario", "walk-dropfoot-afo").set({"timestep": "1.3 ms"})
    own = as_run(walk).timestep
    assert as_run(at_step(walk, own / 2.0)).timestep == pytest.approx(own / 2.0, rel=1e-12)


def test_controllers_that_forget_are_asked_again_and_others_once() -> None:
    for controller in (fill, Forgetting()):
        run = afo.run("seated", SHORT, controller=controller, step="controlled")
        assert abs(found_step_errors(run)["air_per_cycle"].error) < 1e-3
    counting: Any = Counting()
    once = afo.run("seated", SHORT, controller=counting, step="controlled")
    assert once.ok and not found_step_errors(once) and taken(once) == pytest.approx((2.0, 2.0))
    alone: Any = Counting()
    assert dict(once.metrics) == dict(afo.run("seated", SHORT, controller=alone).metrics)
    assert counting.count == alone.count


def test_another_word_for_the_step_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    word: Any = "fixd"
    with pytest.raises(InputError) as refused:
        afo.run("seated", SHORT, step=word)
    assert (refused.value.field, refused.value.nearest) == ("step", "fixed")
    assert refused.value.allowed == "controlled, fixed"
    assert call(capsys, "run", "seated", "--step", word)[0] == 2


@pytest.mark.slow
def test_the_command_prints_errors_and_the_report_shows_them(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--set", "duration=2.2 s", "--no-change", "--no-rrd", "--numbers"]
    code, printed, _ = call(capsys, "run", "walk-dropfoot-afo", *options, "--out", str(tmp_path / "walk"))
    lines = {line.split()[0]: line.split() for line in printed.splitlines() if line.strip()}
    assert code == 0 and lines["metric"] == ["metric", "value", "step", "error", "allowed", "unit"]
    assert abs(float(lines["toe_clearance"][2])) <= float(lines["toe_clearance"][3]) == 0.3
    assert call(capsys, "report", str(tmp_path / "walk"))[0] == 0
    page = (tmp_path / "walk" / "report.html").read_text()
    assert "±: numerical error" in page and " ± 0" in page
    code, printed, _ = call(
        capsys, "run", "seated", "--step", "fixed", *options, "--out", str(tmp_path / "s")
    )
    assert (
        code == 0
        and "step error" not in printed
        and not found_step_errors(afo.read_recording(tmp_path / "s"))
    )

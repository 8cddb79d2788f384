"""Numerical errors of a run's numbers: differences of two runs, bounds, the warning that names them."""

import json
import math
import pathlib
from collections.abc import Mapping

import pytest
from command import call

import afo_sim as afo
from afo_sim.common import InputError, with_code
from afo_sim.metrics import Metric
from afo_sim.model import as_run
from afo_sim.simulation import found_step_errors, quarter_step
from afo_sim.simulation.step_check import OF_METHOD, step_errors

SHORT = {"duration": "2 s"}
COARSE = SHORT | {"timestep": "8 ms"}
COARSE |= {f"orthosis.chamber.dorsiflexor.{valve}": "sy9000" for valve in ("inlet", "outlet")}


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


def test_errors_are_differences_of_two_runs_and_stay_in_the_file(tmp_path: pathlib.Path) -> None:
    run = afo.run("seated", COARSE, check_step=True)
    plain, fine = afo.run("seated", COARSE), afo.run("seated", COARSE | {"timestep": "2 ms"})
    assert dict(run.metrics) == dict(plain.metrics)
    found = found_step_errors(afo.read_recording(run.save(tmp_path / "run", rrd=False)))
    assert set(found) == set(plain.metrics) - OF_METHOD
    for name, each in found.items():
        expected = (
            0.0 if plain.metrics[name] == fine.metrics[name] else plain.metrics[name] - fine.metrics[name]
        )
        assert each == pytest.approx(expected, abs=1e-12, nan_ok=True), name
    beyond = {name for name, e in step_errors(plain.metrics, fine.metrics).items() if e.times > 1.0}
    (warning,) = with_code(run.warnings, "step-matters")
    assert beyond and all(f"{name} by " in warning for name in beyond)
    assert warning.data["count"] == len(beyond) and not with_code(plain.warnings, "step-matters")
    stored = json.loads((tmp_path / "run" / "summary.json").read_text())["studies"]["time_step"]
    assert stored["step"] == pytest.approx(8e-3) and stored["finer"] == pytest.approx(2e-3)


@pytest.mark.parametrize(
    ("unit", "value", "fine", "bound"),
    [
        ("deg", 50.0, 50.09, 0.1),  # of angles and heights no share of the value counts
        ("mm", -200.0, -200.2, 0.3),
        ("N*m", 10.0, 10.09, 0.1009),  # 1 %
        ("N*m", 0.01, 0.0, 0.02),  # too little to matter
        ("", 1000.0, 1009.0, 10.09),
    ],
)
def test_bounds(unit: str, value: float, fine: float, bound: float) -> None:
    (found,) = step_errors({"x": Metric(value, unit)}, {"x": Metric(fine, unit)}).values()
    assert found.bound == pytest.approx(bound) and found.times <= 1.0
    beyond = step_errors({"x": Metric(value, unit)}, {"x": Metric(fine + 2.2 * bound, unit)})
    assert beyond["x"].times > 1.0


def test_what_no_run_defines_is_the_same() -> None:
    for value in (math.inf, math.nan):
        same = {"x": Metric(value, "h")}
        assert step_errors(same, same)["x"].times == 0.0
        assert step_errors(same, {"x": Metric(1.0, "h")})["x"].times > 1.0
    assert not step_errors({"settled_air_change": Metric(1.0)}, {})


@pytest.mark.slow
def test_a_settled_stride_is_checked_at_a_quarter_of_its_own_step() -> None:
    walk = afo.load("scenario", "walk-dropfoot-afo").set({"timestep": "1.3 ms"})
    assert as_run(quarter_step(walk)).timestep == pytest.approx(as_run(walk).timestep / 4.0, rel=1e-12)
    run = afo.run(walk, {"duration": "2.2 s"}, check_step=True)
    assert 0.0 < abs(found_step_errors(run)["toe_clearance"]) < 0.3
    assert abs(found_step_errors(run)["lift_over_reference"]) < 0.3


def test_controllers_are_asked_again_from_the_start() -> None:
    for controller in (fill, Forgetting()):
        run = afo.run("seated", SHORT, controller=controller, check_step=True)
        assert abs(found_step_errors(run)["air_per_cycle"]) < 1e-3
    with pytest.raises(InputError, match="may remember the first run"):
        afo.run("seated", SHORT, controller=Counting(), check_step=True)


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        ({"timestep": "2 us", "duration": "1 ms"}, "no quarter to check it with: is out of range"),
        ({"timestep": "0.1 ms", "duration": "1000 s"}, "more than one run can hold"),
    ],
)
def test_a_step_without_a_quarter_is_refused(sets: dict[str, str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        afo.run("seated", sets, check_step=True)


@pytest.mark.slow
def test_the_command_prints_errors_and_the_report_shows_them(
    tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--set", "duration=2.2 s", "--no-change", "--no-rrd", "--out", str(tmp_path / "walk")]
    code, printed, _ = call(capsys, "run", "walk-dropfoot", *options, "--check-step")
    lines = {line.split()[0]: line.split() for line in printed.splitlines() if line.strip()}
    assert code == 0 and lines["metric"] == ["metric", "value", "step", "error", "unit"]
    assert abs(float(lines["toe_clearance"][2])) < 0.3
    assert call(capsys, "report", str(tmp_path / "walk"))[0] == 0
    page = (tmp_path / "walk" / "report.html").read_text()
    assert "±: numerical error" in page and " ± 0" in page

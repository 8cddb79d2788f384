"""Each shipped scenario carries checks, which it passes and another scenario does not."""

import pathlib

import pytest
from command import call

import afo_sim
from afo_sim.common import assets
from afo_sim.simulation import Recording, read_checks

SCENARIOS = assets.names("scenario")
# Of each scenario another one that must fail some of its checks, and one of the columns or metrics where.
OTHERS = {
    "walk-healthy": ("walk-dropfoot", "angle_error_recorded"),
    "walk-dropfoot": ("walk-healthy", "toe_clearance_to_recorded"),
    "walk-dropfoot-afo": ("walk-dropfoot", "toe_clearance"),
    "walk-dropfoot-afo-short": ("walk-dropfoot", "toe_clearance"),
    "walk-dropfoot-afo-timer": ("walk-dropfoot", "toe_clearance"),
    "walk-dropfoot-afo-paper-timer": ("walk-dropfoot-afo-timer", "lowest_toe_clearance_first_ten"),
    "walk-dropfoot-afo-both": ("walk-dropfoot-afo", "push_off_torque"),
    "arm": ("arm-short", "range_of_motion"),
    "arm-short": ("arm", "range_of_motion"),
    "arm-s1": ("arm", "ankle/angle"),
    "arm-positions": ("seated", "ankle/angle"),
    "seated-s1-simulated": ("seated", "range_of_motion"),
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, pathlib.Path]:
    """Where each scenario's run is written, when it is first asked for."""
    root = tmp_path_factory.mktemp("runs")
    return {name: root / name for name in SCENARIOS}


def run_of(folders: dict[str, pathlib.Path], name: str) -> Recording:
    if not folders[name].exists():
        afo_sim.run(name).save(folders[name], rrd=False)
    return afo_sim.read_recording(folders[name])


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
def test_scenario_passes_its_own_checks(
    name: str, folders: dict[str, pathlib.Path], capsys: pytest.CaptureFixture[str]
) -> None:
    run_of(folders, name)
    code, printed, complaint = call(capsys, "check-run", folders[name])
    assert code == 0, printed + complaint
    assert f"{len(read_checks(assets.checks_of(name)))} passed, 0 failed" in printed
    assert printed.count("why: ") == printed.count("good  ") > 5


@pytest.mark.parametrize("name", OTHERS)
def test_checks_tell_another_scenario(name: str, folders: dict[str, pathlib.Path]) -> None:
    other, where = OTHERS[name]
    run = run_of(folders, other)
    entries = [entry for entry in read_checks(assets.checks_of(name)) if _fits(entry.table, run)]
    failed = {result.column for result in (entry.check(run) for entry in entries) if not result.ok}
    assert where in failed


def _fits(table: dict[str, object], run: Recording) -> bool:
    """Whether a run has what a check looks at; without an orthosis there is no chamber."""
    known = {*run.columns, *run.metrics}
    wanted = table.get("sum", [table.get("column", table.get("metric"))])
    return all(name in known for name in wanted)  # type: ignore[attr-defined]

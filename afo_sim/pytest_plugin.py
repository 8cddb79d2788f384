"""Pytest plugin: runs scenarios for tests, each once, and keeps the recording of a test that fails.

@pytest.mark.afo_scenario("seated", {"supply.pressure": "3 bar"})
def test_stops(afo_run):
    assert expect(afo_run, "ankle/angle").between("-50 deg", "30 deg")
"""

import json
import pathlib
import re
from collections.abc import Generator, Mapping
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from afo_sim.simulation import Recording

MARKER = "afo_scenario"
USAGE = f'@pytest.mark.{MARKER}("seated", {{"supply.pressure": "3 bar"}})'


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add --afo-failures."""
    parser.getgroup("afo_sim").addoption(
        "--afo-failures",
        metavar="DIR",
        default="afo-failures",
        help="folder for recording and figure of each failed test that used afo_run (%(default)s)",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker, and the recordings of this session."""
    config.addinivalue_line(
        "markers", f"{MARKER}(scenario, sets): the scenario that afo_run runs, and values set for it by key"
    )
    config.stash[_RUNS] = {}


@pytest.fixture
def afo_run(request: pytest.FixtureRequest) -> "Recording":
    """The recording of the scenario that the test's marker names; equal ones are run once per session.

    Tests share it, so its columns cannot be written to.

    Raises
    ------
    pytest.UsageError
        The test has no marker, or a malformed one.
    InputError
        The scenario, or a value set for it, is wrong.
    """
    scenario, sets = _asked(request.node)
    runs = request.config.stash[_RUNS]
    key = json.dumps([str(scenario), sets], sort_keys=True, default=str)
    if key not in runs:
        import afo_sim

        runs[key] = afo_sim.run(str(scenario), sets)
        for values in runs[key].columns.values():
            values.setflags(write=False)
    request.node.stash[_RUN] = runs[key]
    return runs[key]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Keep the recording of a failed test, and say where."""
    report = yield
    recording = item.stash.get(_RUN, None)
    if report.failed and recording is not None:
        folder = pathlib.Path(item.config.getoption("--afo-failures")).absolute() / _folder_name(item.nodeid)
        report.sections.append(("afo_sim recording", _keep(recording, folder)))
    return report


_RUNS = pytest.StashKey["dict[str, Recording]"]()
_RUN = pytest.StashKey["Recording"]()


def _asked(node: pytest.Item) -> tuple[str | pathlib.Path, dict[str, object]]:
    """Scenario and values that a test's marker asks for."""
    marker = node.get_closest_marker(MARKER)
    if marker is None:
        raise pytest.UsageError(f"{node.nodeid}: afo_run needs a scenario, such as {USAGE}")
    scenario, sets = (*marker.args, *[None] * 2)[:2]
    well_formed = 1 <= len(marker.args) <= 2 and not marker.kwargs
    if not well_formed or not isinstance(scenario, str | pathlib.Path) or not isinstance(sets or {}, Mapping):
        raise pytest.UsageError(
            f"{node.nodeid}: the marker takes a scenario and values by key, such as {USAGE}"
        )
    return scenario, dict(sets or {})


def _folder_name(node: str) -> str:
    """A folder's name after a test, without what file systems refuse."""
    return re.sub(r"[^\w.\[\]=+-]+", "_", node)[-200:]


def _keep(recording: "Recording", folder: pathlib.Path) -> str:
    """Save recording and figure; where they are, or why not: the test's own failure must stay in sight."""
    try:
        recording.save(folder)
        from afo_sim.show import draw_run

        draw_run(recording, folder / "figure.png")
    except Exception as error:  # of files, drawing, or an extra that is missing
        return f"could not be saved whole in {folder}: {error}"
    return f"recording and figure (figure.png) are in {folder}"

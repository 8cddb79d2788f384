"""Recordings that many tests look at, made once."""

import functools
import gc
import os
import subprocess
import sys

import command
import pytest
from campaign import SEED, of_other_days

import afo_sim
from afo_sim.common import assets, extending
from afo_sim.common.versions import CORE
from afo_sim.control import function
from afo_sim.physics import FIRST_USER_ID, FRICTIONS, LAWS
from afo_sim.simulation import Recording, own_column

os.environ["COLUMNS"] = "200"  # tables as on a wide terminal, wherever the tests run
# Tests run at the step that they name; those of its control ask for it.
afo_sim.run.__kwdefaults__["step"] = "fixed"


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str]) -> command.Call:
    """`afo-sim …`, as `command.call` has it."""
    return functools.partial(command.call, capsys)


@pytest.fixture(scope="session")
def seated() -> Recording:
    return afo_sim.run("seated")


@pytest.fixture(scope="session")
def antagonist() -> Recording:
    return afo_sim.run("seated-antagonist")


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown() -> None:
    """Nothing stays registered after the test that registered it."""
    for kept in (extending.ADDED, assets.OWN, function.OWN, own_column.OWN):
        kept.clear()
    for table in (LAWS, FRICTIONS):
        for name in [name for name, entry in table.items() if entry.native_id >= FIRST_USER_ID]:
            del table[name]
    metrics = sys.modules.get("afo_sim.metrics.own_metric")
    if metrics is not None and metrics.OWN:
        from afo_sim.metrics import REPORTED, WORDS
        from afo_sim.metrics.metric_words import METRICS

        for reports in [f for f, (row, *_) in REPORTED.items() if row.name in metrics.OWN]:
            del REPORTED[reports]
        for name in metrics.OWN:
            del METRICS[name], WORDS[name]
        metrics.OWN.clear()
        for cached in ("functions_of", "reporting", "known", "unit_of"):
            getattr(metrics.registry, cached).cache_clear()
    formats = sys.modules.get("afo_sim.export.formats")
    if formats is not None:
        for name in formats.FORMATS.keys() - set(formats.SHIPPED):
            del formats.FORMATS[name]


def pytest_collection_finish() -> None:
    """What is imported stays: Python's garbage collector need not look through it during each test."""
    gc.collect()
    gc.freeze()


def pytest_report_header() -> str:
    return f"seed of damaged files: AFO_SIM_FUZZ_SEED={SEED}"


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a test that is marked so in a process of its own.

    A profiler never returns from its first call where an interrupted thread ended before its exception came:
    Python 3.11 then finds something pending for ever. Tests of controllers that take too long leave that.
    """
    if not pyfuncitem.get_closest_marker("alone") or os.environ.get("AFO_SIM_ALONE"):
        return None
    words = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", pyfuncitem.nodeid]
    done = subprocess.run(
        words,
        cwd=pyfuncitem.config.rootpath,
        env={**os.environ, "AFO_SIM_ALONE": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-4000:]
    return True


CORE_FOLDERS = {*CORE, "air", "laws_of_nature"}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the core's tests, so that `-m core` runs them alone; leave out those of other days.

    Who names a folder, a file or a test runs all of it: only the whole suite is drawn from.
    """
    for item in items:
        if CORE_FOLDERS & set(item.path.parts):
            item.add_marker("core")
    if config.args_source is not config.ArgsSource.TESTPATHS:
        return
    left_out = of_other_days(items)
    config.hook.pytest_deselected(items=list(left_out))
    items[:] = [item for item in items if item not in left_out]

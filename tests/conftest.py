"""Recordings that many tests look at, made once."""

import gc
import os

import pytest
from campaign import SEED

import afo_sim
from afo_sim.common.versions import CORE
from afo_sim.simulation import Recording

os.environ["COLUMNS"] = "200"  # tables as on a wide terminal, wherever the tests run


@pytest.fixture(scope="session")
def seated() -> Recording:
    return afo_sim.run("seated")


@pytest.fixture(scope="session")
def antagonist() -> Recording:
    return afo_sim.run("seated-antagonist")


def pytest_collection_finish() -> None:
    """What is imported stays: Python's garbage collector need not look through it during each test."""
    gc.collect()
    gc.freeze()


def pytest_report_header() -> str:
    return f"seed of damaged files: AFO_SIM_FUZZ_SEED={SEED}"


CORE_FOLDERS = {*CORE, "air", "laws_of_nature"}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of the core's rooms, so that `-m core` runs them alone."""
    for item in items:
        if CORE_FOLDERS & set(item.path.parts):
            item.add_marker("core")

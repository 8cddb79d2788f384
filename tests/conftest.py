"""Recordings that many tests look at, made once."""

import os

import pytest

import afo_sim
from afo_sim.simulation.recording import Recording

os.environ["COLUMNS"] = "200"  # tables as on a wide terminal, wherever the tests run


@pytest.fixture(scope="session")
def seated() -> Recording:
    return afo_sim.run("seated")


@pytest.fixture(scope="session")
def antagonist() -> Recording:
    return afo_sim.run("seated-antagonist")

"""Runs that several files of tests show, made once."""

import pathlib

import pytest

import afo_sim
from afo_sim.simulation import Recording


@pytest.fixture(scope="session")
def walks() -> dict[str, Recording]:
    """Walking without and with an orthosis, and a seated run."""
    return {
        "bare": afo_sim.run("walk-dropfoot", {"duration": "4 s"}),
        "worn": afo_sim.run("walk-dropfoot-afo", {"duration": "4 s"}),
        "sitting": afo_sim.run("seated", {"duration": "2 s", "record_rate": "100 Hz"}),
    }


@pytest.fixture(scope="session")
def folders(walks: dict[str, Recording], tmp_path_factory: pytest.TempPathFactory) -> dict[str, pathlib.Path]:
    """The folders of `walks`."""
    base = tmp_path_factory.mktemp("walks")
    return {name: run.save(base / name, rrd=False) for name, run in walks.items()}

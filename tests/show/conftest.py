"""Runs that several files of tests show, made once."""

import dataclasses
import json
import pathlib
from typing import Any

import pytest
from figures import lay_out
from yielding import rigid_run, yielding_run

import afo_sim
from afo_sim.simulation import Recording


@pytest.fixture(scope="session")
def walks() -> dict[str, Recording]:
    """Walking without and with an orthosis and with short links, and a seated run."""
    pitch = {"limits.contact_pitch": ["5 deg", "0 deg"]}
    return {
        "bare": afo_sim.run("walk-dropfoot", {"duration": "4 s"}),
        "worn": afo_sim.run("walk-dropfoot-afo", {"duration": "4 s"}),
        "short": afo_sim.run("walk-dropfoot-afo-short", {"duration": "4 s"} | pitch),
        "sitting": afo_sim.run("seated", {"duration": "2 s", "record_rate": "100 Hz"}),
    }


@pytest.fixture(scope="session")
def folders(walks: dict[str, Recording], tmp_path_factory: pytest.TempPathFactory) -> dict[str, pathlib.Path]:
    """The folders of `walks`."""
    base = tmp_path_factory.mktemp("walks")
    return {name: run.save(base / name, rrd=False) for name, run in walks.items() if name != "short"}


@pytest.fixture(scope="session")
def studied(walks: dict[str, Recording]) -> Recording:
    """The walk with an orthosis, with what `with_studies` found of it: effects, and a band of 120 draws."""
    kept = json.loads(pathlib.Path(__file__).with_name("studies.json").read_text(encoding="utf-8"))
    return dataclasses.replace(walks["worn"], studies=kept)


@pytest.fixture(scope="session")
def yielding() -> Recording:
    """A seated run whose cuff and plate give."""
    return yielding_run()


@pytest.fixture(scope="session")
def rigid() -> Recording:
    """The same on a rigid cuff and plate."""
    return rigid_run()


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports with empty figures, for tests that read their words."""
    from afo_sim.show import report, report_figures

    def empty(name: str, count: int, height: float, draw: Any, runs: Any, *explained: str) -> Any:
        keys = tuple(("", run.label) for run in runs)
        return report_figures._Drawing(("<svg role='img'></svg>",) * count, keys, explained)

    monkeypatch.setattr(report_figures, "_figure", empty)
    monkeypatch.setattr(report, "walkers", lambda runs: [])


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Figures as they are laid out for their files, which stay empty."""
    return lay_out(monkeypatch)

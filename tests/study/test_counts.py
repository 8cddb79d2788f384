"""What a study costs beside its simulations, counted: flushes to the disk, models built, Python calls."""

import os
import pathlib
import sys
from collections import Counter
from collections.abc import Callable
from types import FrameType
from typing import Any

import pytest
from sweep_runs import SEATED, opened, swept, written

from afo_sim.simulation import Asked
from afo_sim.study import engine, runner
from afo_sim.study.search import plan
from afo_sim.study.search.runner import optimise

STUDY = str(pathlib.Path(engine.__file__).parent)
SEARCH = """
scenario = "{scenario}"
method = "cma-es"
generations = {generations}
population = 4
starts = 1
[set]
{sets}
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "4 bar"
[objective]
metric = "{metric}"
goal = "lowest"
"""
WALK = {"scenario": "walk-dropfoot-afo-short", "sets": 'timestep = "8 ms"'}
SITS = {"scenario": "seated", "sets": 'duration = "0.2 s"', "metric": "air_per_cycle"}


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Calls of what costs time, from now on."""
    found: Counter[str] = Counter()

    def counting(real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: object, **named: object) -> Any:
            found[real.__name__] += 1
            return real(*given, **named)

        return call

    for place, name in ((os, "fsync"), (engine, "build"), (engine, "prepare")):
        monkeypatch.setattr(place, name, counting(getattr(place, name)))
    return found


def searched(folder: pathlib.Path, generations: int, **of: str) -> None:
    folder.mkdir()
    file = folder / "search.toml"
    file.write_text(SEARCH.format(generations=generations, **of), encoding="utf-8")
    optimise(plan.read(file), folder / "out", threads=1)


@pytest.mark.slow
def test_a_chunk_is_flushed_once_and_its_name_once(tmp_path: pathlib.Path, counted: Counter[str]) -> None:
    flushes = []
    for chunk in (12, 2):
        swept(tmp_path / str(chunk), SEATED, chunk=chunk, threads=1)
        flushes.append(counted.pop("fsync"))
    assert flushes == [2 * (1 + 1 + 1 + 1), 2 * (1 + 6 + 1 + 1)]  # manifest, chunks, results, time step


def test_a_generation_is_flushed_once_and_its_name_once(
    tmp_path: pathlib.Path, counted: Counter[str]
) -> None:
    flushes = []
    for generations in (1, 4):
        searched(tmp_path / str(generations), generations, **SITS)
        flushes.append(counted.pop("fsync"))
    assert flushes[1] - flushes[0] == 2 * 3, flushes


@pytest.mark.parametrize(("metric", "builds"), [("air_per_stride", 1), ("toe_clearance_stride_1", 2)])
def test_a_run_of_a_search_builds_a_model_and_one_more_for_first_strides(
    metric: str, builds: int, tmp_path: pathlib.Path, counted: Counter[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Eight designs, and the best one at half its step."""
    monkeypatch.setattr("afo_sim.study.search.runner.probe", lambda *_: ({metric: "g"}, {}, 1.0))
    searched(tmp_path / "a", 2, metric=metric, **WALK)
    assert counted["prepare"] == 9
    assert counted["build"] == builds * 9


@pytest.mark.alone
def test_python_calls_of_a_settled_design() -> None:
    """From keys to metrics: what MuJoCo and compiled code do calls no Python; each further design as many."""
    calls = []
    asked = Asked(frozenset({"toe_clearance", "air_per_stride", "orthosis_peak_dorsiflexion_torque"}))
    for count in (3, 3, 9):  # the first for what is kept
        cases = [{"timestep": "8 ms", "supply.pressure": f"{2.0 + 0.1 * k} bar"} for k in range(count)]
        found = Counter[str]()

        def watch(frame: FrameType, event: str, _: object, found: Counter[str] = found) -> None:
            found["python"] += event == "call"

        sys.setprofile(watch)
        try:
            ended = dict(engine.outcomes(WALK["scenario"], enumerate(cases), asked=asked))
        finally:
            sys.setprofile(None)
        assert all(outcome.status == engine.OK for outcome in ended.values())
        calls.append(found["python"])
    assert (calls[2] - calls[1]) / 6 <= 1900, calls


@pytest.mark.slow
@pytest.mark.alone
def test_python_calls_of_a_sweep_beside_its_simulations(tmp_path: pathlib.Path) -> None:
    """Those of this room's own functions; from description to outcome it calls four other rooms."""
    calls = []
    for cases in (16, 32):
        file = written(tmp_path / str(cases), SEATED.replace("steps = 12", f"steps = {cases}"), chunk=16)
        store = opened(file, tmp_path / str(cases) / "out")
        found = Counter[str]()

        def watch(frame: FrameType, event: str, _: object, found: Counter[str] = found) -> None:
            found["study"] += event == "call" and frame.f_code.co_filename.startswith(STUDY)

        sys.setprofile(watch)
        try:
            runner.run(store, threads=1)
        finally:
            sys.setprofile(None)
        calls.append(found["study"])
    assert (calls[1] - calls[0]) / 16 <= 1.5 * 40, calls  # a quarter is run at two more steps

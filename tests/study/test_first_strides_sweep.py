"""Metrics of the first strides in sweeps and searches: the run's to the bit, and only where asked for."""

import pathlib
from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim.metrics import NAMES
from afo_sim.model import Built, steps_of_stride
from afo_sim.simulation import Asked, Rollout
from afo_sim.study import engine

LONG, SHORT = "walk-dropfoot-afo", "walk-dropfoot-afo-short"
FAST: dict[str, Any] = {"timestep": "4 ms", "duration": "6.1 s"}  # three strides, and the two settled ones
CASES: list[dict[str, Any]] = [
    {},
    {"supply.pressure": "2 bar"},
    {"start": {}},
    {"start": {"dorsiflexor": {"pressure": "3 bar"}}},
    {"start.dorsiflexor.fill_time": "0.4 s"},
    {"gait.variability": 0.03},
    {"gait.start_phase": 0.4},
    {"ground.mode": "contact", "timestep": "1 ms", "duration": "3.7 s"},
    {"load_moment": "1000 N*m"},  # through the stops
]


def computed(asked: Asked, threads: int = 1, chunk: int = 32) -> dict[int, engine.Outcome]:
    cases = list(enumerate(FAST | each for each in CASES))
    return dict(engine.outcomes(SHORT, cases, threads, chunk, asked))


@pytest.mark.slow
@pytest.mark.parametrize("names", [{"toe_clearance_stride_1"}, {"air_first_stride"}, NAMES])
def test_a_case_tells_what_its_run_tells(names: set[str]) -> None:
    found = computed(Asked(frozenset(names), doubts=False))
    for number, each in enumerate(CASES):
        run = afo_sim.run(SHORT, FAST | each)
        assert run.ok == (found[number].status == engine.OK), found[number].reason
        for name in names & found[number].metrics.keys() if run.ok else ():
            told = float(found[number].metrics[name])
            assert (np.isnan(told) and name not in run.metrics) or told == run.metrics[name], (number, name)
        assert run.ok is False or names - found[number].metrics.keys() <= {"air_before_first_step"}


@pytest.mark.slow
def test_neither_threads_nor_chunks_decide() -> None:
    asked = Asked(frozenset(NAMES), doubts=False)
    one = {number: repr(outcome) for number, outcome in computed(asked).items()}
    assert one == {number: repr(outcome) for number, outcome in computed(asked, 2, 3).items()}


def test_as_few_strides_are_walked_as_are_asked_for() -> None:
    def steps(*names: str) -> int:
        case = engine.prepare(SHORT, 0, FAST, Asked(frozenset(names)).first_strides)
        assert isinstance(case, engine.Prepared)
        return case.first_steps

    one = steps("toe_clearance_stride_1")
    assert steps("toe_clearance", "air_per_stride") == 0
    assert steps("toe_clearance", "toe_clearance_stride_3") == 3 * one
    assert steps("strides_until_clear") == 3 * one  # no more than the run has


@pytest.mark.parametrize(
    ("sets", "most"),
    [({}, 6), ({"supply.pressure": "2.5 bar"}, 6), ({"start": {}}, 10), ({"load_moment": "1 N*m"}, 7)],
)
def test_strides_near_the_settled_one_are_not_walked(
    sets: dict[str, Any], most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And what is told is what the run of all ten tells, to the bit."""
    begun: list[int] = []
    known = engine.first_strides

    def counted(built: Built, rollout: Rollout, *others: Any) -> Any:
        begun.append(len(rollout.control) // steps_of_stride(built.scenario))
        return known(built, rollout, *others)

    monkeypatch.setattr(engine, "first_strides", counted)
    described: dict[str, Any] = {"timestep": "4 ms", "duration": "13.2 s"} | sets
    case = dict(engine.outcomes(LONG, [(0, described)]))[0]
    run = afo_sim.run(LONG, described)
    assert {name for name in NAMES & run.metrics.keys() if case.metrics[name] != run.metrics[name]} == set()
    assert 3 <= begun[0] <= most
    heights = [float(stride["toe_clearance"]) for stride in list(run.strides.values())[:10]]
    assert run.metrics["lowest_toe_clearance_first_ten"] == pytest.approx(min(heights), abs=0.02)


@pytest.mark.slow
def test_a_limit_of_a_search_may_be_of_the_first_strides(tmp_path: pathlib.Path) -> None:
    best = afo_sim.optimise(
        afo_sim.load("scenario", SHORT).set({"start": {"dorsiflexor": {"pressure": "1 bar"}}}),
        {"start.dorsiflexor.pressure": ("0.5 bar", "4 bar")},
        lowest="air_before_first_step",
        limits=["toe_clearance_stride_1 >= 10 mm", "strides_until_clear <= 0"],
        sets=FAST,
        generations=2,
        starts=1,
        population=4,
        out=tmp_path / "out",
    )
    assert best.feasible
    run = afo_sim.run(best.scenario)
    assert run.metrics["toe_clearance_stride_1"] >= "10 mm" and run.metrics["strides_until_clear"] == 0
    assert run.metrics["air_before_first_step"] == best.metrics["air_before_first_step"]

"""A recording's verdict: limits of its own scenario, and what its bands tell."""

import dataclasses

import pytest

import afo_sim
from afo_sim.simulation import Recording


@pytest.fixture(scope="module")
def walk() -> Recording:
    return afo_sim.run("walk-dropfoot-afo", {"duration": "3 s", "timestep": "2 ms"})


@pytest.mark.parametrize(("share", "status"), [(0.0, "good"), (0.05, "doubtful"), (0.2, "bad")])
def test_drawn_strides_are_held_against_the_limits_of_the_scenario(
    walk: Recording, share: float, status: str
) -> None:
    assert [answer.status for answer in walk.verdict[:2]] == ["good", "good"]  # it helps, and lifts
    assert dataclasses.replace(walk, studies={"uncertainty": {"trips": {}}}).verdict == walk.verdict
    trips = {"touch": {"share": share}}
    study = {"draws": 510, "failed": {"count": 10}, "trips": trips}
    drawn = dataclasses.replace(walk, studies={"uncertainty": study})
    assert [answer.status for answer in drawn.verdict[:2]] == [status, status]  # wanted 2 %, bad beyond 10 %
    limits = walk.scenario["limits"] | {"drawn_trips": [0.5, 0.6]}
    lenient = dataclasses.replace(drawn, scenario=walk.scenario | {"limits": limits})
    assert lenient.verdict[1].status == "good"
    assert drawn.verdict[2:] == walk.verdict[2:]


def test_a_recording_without_limits_is_held_against_the_usual_ones(walk: Recording) -> None:
    older = {key: value for key, value in walk.scenario.items() if key != "limits"}
    assert dataclasses.replace(walk, scenario=older).verdict == walk.verdict


def test_of_what_failed_nothing_is_known(walk: Recording) -> None:
    answers = dataclasses.replace(walk, status="failed: unstable").verdict
    assert [answer.status for answer in answers] == 6 * ["unknown"]
    assert [answer.question for answer in answers] == [answer.question for answer in walk.verdict[1:]]
    assert all("stopped early" in answer.text and answer.limit for answer in answers)

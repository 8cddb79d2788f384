"""A described controller in a sweep gives the numbers of a run; its failure is that case's own."""

from typing import Any

import pytest

import afo_sim
from afo_sim.common import ControllerError
from afo_sim.description import load
from afo_sim.simulation import loop
from afo_sim.simulation.stepping import PolicyFault
from afo_sim.study.engine import BROKEN, outcomes

TABLE = {"angle": {"proportional_band": "4 deg", "reference": {"mean": "-3 deg"}}}
SETS = {"timer": None, "duration": "1.5 s", "controller": {"rate": "100 Hz", "pid": TABLE}}
BAND = "controller.pid.angle.proportional_band"
CASES = [
    {BAND: "2 deg"},
    {BAND: "60 deg"},
    {"controller.rate": "50 Hz"},
    {BAND: "60 deg", "controller.rate": "50 Hz"},
]


@pytest.mark.parametrize("threads", [1, 2])
def test_a_sweep_over_a_controller_gives_the_numbers_of_runs(threads: int) -> None:
    base = load("scenario", "seated", SETS)
    found = dict(outcomes(base.resolved(), enumerate(CASES), threads))
    ends: set[str] = set()
    for k, sets in enumerate(CASES):
        run = afo_sim.run(base, sets)
        assert found[k].status == "ok", found[k].reason
        assert {n: m.value for n, m in found[k].metrics.items()} == pytest.approx(
            {n: m.value for n, m in run.metrics.items()}, rel=0.0, abs=0.0, nan_ok=True
        )
        ends.add(str(run.metrics))
    assert len(ends) > 1  # what is swept moves something


def test_a_controller_that_fails_is_the_outcome_of_its_case_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: Any = loop.Loop.ask

    def fails(self: Any, seen: Any, step: int) -> None:
        if self.built.scenario.controller.pid.angle.proportional_band > 0.1 and seen.time > 0.2:
            raise PolicyFault("the controller raised ValueError: oh")
        asked(self, seen, step)

    monkeypatch.setattr(loop.Loop, "ask", fails)
    base = load("scenario", "seated", SETS)
    found = dict(outcomes(base.resolved(), enumerate(CASES[:2])))
    assert found[0].status == "ok"
    assert found[1].status == BROKEN
    assert found[1].reason == str(ControllerError("the controller raised ValueError: oh", time=0.21))

"""Control by the load under the toes."""

from typing import Any

import numpy as np
import pytest
from control.samples import commands, made, walker

import afo_sim

LOADS = [0.0, 50.0, 60.0, 350.0, 900.0, 200.0, 25.0, 19.0, 50.0]
DRIVEN: dict[str, Any] = {"drive": {name: {"kind": "bang_bang"} for name in ("dorsiflexor", "plantarflexor")}}


def test_pressures_go_with_the_load_up_to_the_peak() -> None:
    told = {"peak": "700 N", "pushes": "plantarflexor", "push_pressure": "2 bar", "lift_pressure": "3 bar"}
    told |= {"unloaded": 21 / 700, "loaded": 56 / 700}
    found = commands(made({"toe_load": told}, **DRIVEN), 0.01, foot__toe_load=LOADS)
    pushed = [command["plantarflexor"] for command in found]
    assert pushed == pytest.approx([2e5 * min(load / 700, 1.0) for load in LOADS])
    # loaded from 56 N on, unloaded below 21 N
    assert [command["dorsiflexor"] for command in found] == [3e5, 3e5, 0.0, 0.0, 0.0, 0.0, 0.0, 3e5, 3e5]


def test_without_drives_valves_are_switched_with_hysteresis() -> None:
    told = {"pushes": "plantarflexor", "peak": "500 N", "fill_above": 0.5, "vent_below": 0.3}
    told |= {"unloaded": 0.05, "loaded": 0.1}
    loads = [0.0, 200.0, 250.0, 200.0, 149.0, 200.0, 10.0]
    found = commands(made({"toe_load": told}), 0.01, foot__toe_load=loads)
    pushes = ["outlet", "shut", "inlet", "inlet", "outlet", "shut", "outlet"]
    assert [command["plantarflexor"] for command in found] == pushes
    assert [command["dorsiflexor"] for command in found] == ["inlet", *["outlet"] * 5, "inlet"]


def test_it_lifts_in_swing_and_vents_on_the_toes() -> None:
    run = afo_sim.run(walker({"toe_load": {}, "rate": "1 kHz"}, duration="2.2 s", reference=None))
    assert run.ok, run.status
    phase, inlet = run["gait/phase"], run["valve/dorsiflexor_inlet/coil"]
    assert inlet[(phase > 0.70) & (phase < 0.98)].min() == 1.0
    assert inlet[(phase > 0.40) & (phase < 0.54)].max() == 0.0
    assert np.array_equal(run["controller/toe_load"][1:], run["foot/toe_load"][:-1])  # a sample is a step old

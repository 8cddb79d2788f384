"""Every parameter of the walking controllers is live: changed, it moves a named column.

The parameters are found in the resolved scenarios, not listed here: a new one without an entry fails.
"""

from typing import Any

import numpy as np
import pytest
from laws_of_nature.liveness import is_one, leaves, nudged

import afo_sim
from afo_sim.description import Scenario, load

SCENARIO = "walk-dropfoot-afo"
PLAIN = {"phases": None, "reference": None, "duration": "3.4 s"}
MOMENT, LOAD, ALL = "gait/ankle_moment", "foot/toe_load", "ground/force/z"
INLET, OUTLET = (f"valve/dorsiflexor_{side}/coil" for side in ("inlet", "outlet"))
PUSH = "valve/plantarflexor_{}/coil"
CLOCK = {"inlet": [["0.55 s", "0.95 s"]], "outlet": [["0.16 s", "0.45 s"]]}
CONTROLLERS: dict[str, dict[str, Any]] = {
    "timer": {"period": "1.05 s", "dorsiflexor": CLOCK},
    "timer restarted": {"period": "2.4 s", "restart": {"after": "0.5 s"}, "dorsiflexor": CLOCK},
    "gait_phase": {
        "column": "shank/angle",
        "estimator": "oscillator",
        "dorsiflexor": {"inlet": [[0.5, 0.9]], "outlet": [[0.15, 0.45]]},
    },
    "gait_phase switched": {
        "estimator": "foot_switch",
        "switch": "foot/heel_load",
        "dorsiflexor": {"inlet": [[0.5, 0.9]], "outlet": [[0.15, 0.45]]},
    },
    "state_machine": {
        "start": "swing",
        "state": {"swing": {"dorsiflexor": "inlet"}, "stance": {"dorsiflexor": "outlet"}},
        "transition": [
            {"state": "swing", "to": "stance", "column": "foot/heel_load", "above": "50 N"},
            {"state": "stance", "to": "swing", "column": "foot/heel_load", "below": "30 N", "after": "0.5 s"},
        ],
    },
    "toe_load": {"pushes": "plantarflexor"},
    "emg": {"column": MOMENT, "side": "plantarflexor", "full": "60 N*m"},
}
# What is changed otherwise than by a share, and to what.
OTHER: dict[str, Any] = {
    "timer*.restart.after": "2 s",
    "timer*.restart.column": LOAD,
    "timer*.restart.above": "300 N",
    "timer*inlet": [["0.6 s", "0.95 s"]],
    "timer*outlet": [["0.2 s", "0.45 s"]],
    "gait_phase.waiting": "outlet",
    "gait_phase.column": "ankle/angle",
    "gait_phase.switch": LOAD,
    "gait_phase.heel_strike": "250 N",
    "gait_phase*inlet": [[0.6, 0.9]],
    "gait_phase*outlet": [[0.2, 0.45]],
    "state_machine.start": "stance",
    "state_machine.state.*": "shut",
    "state_machine.transition": [
        {"state": "swing", "to": "stance", "column": "foot/heel_load", "above": "100 N"},
        {"state": "stance", "to": "swing", "column": "foot/heel_load", "below": "30 N", "after": "0.5 s"},
    ],
    "toe_load.column": ALL,
    "toe_load.lifts": None,
    "toe_load.pushes": None,
    "emg.column": "gait/needed_moment",
    "emg.side": "dorsiflexor",
    "emg.chamber": "plantarflexor",
    "emg.full": "70 N*m",
    "emg.delay": "50 ms",
    "emg.*activation_time": "0.1 s",
}
# Which column moves, where it is not the lifting chamber's inlet.
OUTPUTS = {
    "*outlet": OUTLET,
    "gait_phase.waiting": OUTLET,
    "state_machine.state.stance.*": OUTLET,
    "toe_load.pushes": PUSH.format("inlet"),
    "toe_load.peak": PUSH.format("inlet"),
    "toe_load.fill_above": PUSH.format("inlet"),
    "toe_load.vent_below": PUSH.format("outlet"),
    "emg.vent_below": OUTLET,
}
# Strides that a foot switch counts with tell apart only where they differ; pressures need drives. Both are
# tested below.
ELSEWHERE = ("*provenance*", "gait_phase.strides", "*pressure", "gait_phase.estimator", "*plantarflexor*")
RATE = "200 Hz"


def scenario(name: str, sets: dict[str, Any] | None = None) -> Scenario:
    kind = name.split()[0]
    told = {"rate": RATE, kind: CONTROLLERS[name]}
    keys = {f"controller.{kind}.{key}": value for key, value in (sets or {}).items()}
    return load("scenario", SCENARIO, PLAIN | {"controller": told} | keys)


def parameters(name: str) -> dict[str, Any]:
    """The controller's values by their keys; lists stay whole."""
    kind = name.split()[0]
    found = leaves(scenario(name).resolved()["controller"][kind])
    if name == "gait_phase":
        del found["heel_strike"]  # of a foot switch, and there is none
    if "restart" in CONTROLLERS[name]:
        del found["period"]  # a clock that waits for the heel is over before
    return {k: v for k, v in found.items() if v is not None and not is_one(f"{kind}.{k}", ELSEWHERE)}


@pytest.fixture(scope="module")
def base() -> dict[str, afo_sim.Recording]:
    return {name: afo_sim.run(scenario(name)) for name in CONTROLLERS}


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_parameter_moves_its_column(name: str, base: dict[str, afo_sim.Recording]) -> None:
    told = parameters(name)
    assert told
    for key, value in told.items():
        full = f"{name.split()[0]}.{key}"
        pattern = is_one(full, OTHER)
        changed = OTHER[pattern] if pattern else nudged(value, 0.2)
        column = OUTPUTS.get(is_one(full, OUTPUTS) or "", INLET)
        after = afo_sim.run(scenario(name, {key: changed}))
        assert after.ok, after.status
        assert np.abs(after[column] - base[name][column]).max() > 0.5, f"{full} does not move {column}"


@pytest.mark.slow
def test_the_rate_moves_the_coils() -> None:
    slow, fast = (
        afo_sim.run(scenario("state_machine").set({"controller.rate": rate})) for rate in ("20 Hz", "1 kHz")
    )
    assert np.abs(slow[INLET] - fast[INLET]).max() == 1.0


@pytest.mark.slow
def test_strides_of_the_mean_count_where_strides_differ() -> None:
    one, many = (
        afo_sim.run(
            scenario("gait_phase switched", {"strides": n}), {"gait.variability": 0.08, "duration": "5.5 s"}
        )
        for n in (1, 4)
    )
    assert np.nanmax(np.abs(one["controller/phase"] - many["controller/phase"])) > 0.02

"""One 3/2 valve on a chamber: current fills, none vents, and never both beyond the switching."""

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description import load

CHAMBERS = ("dorsiflexor", "plantarflexor")
ON, OFF = 0.1, 0.5  # s
IDEAL = {"opening_delay": "0 ms", "closing_delay": "0 ms"}


def three_way(**changed: str) -> dict[str, object]:
    """The seated pair on 3/2 valves; the dorsiflexor has current from ON to OFF."""
    path = {"conductance": "0.6 dm^3/(s*bar)", "critical_ratio": "0.3"}
    valve = path | {"opening_delay": "4 ms", "closing_delay": "6 ms", "exhaust": dict(path)} | changed
    chamber = {"inlet": valve, "tube_volume": "4 ml", "wall_conductance": "0.5 W/K"}
    return {
        **{f"orthosis.chamber.{name}": chamber for name in CHAMBERS},
        "timer": {"period": "1 s", "dorsiflexor": {"inlet": [[f"{ON} s", f"{OFF} s"]]}},
        "duration": "1 s",
        "timestep": "1 ms",
    }


@pytest.fixture(scope="module")
def switched() -> afo.Recording:
    return afo.run("seated", three_way())


def test_current_fills_and_no_current_vents(switched: afo.Recording) -> None:
    time, pressure = switched["time"], switched["chamber/dorsiflexor/pressure"]
    assert np.abs(pressure[time < ON]).max() < 1.0
    assert pressure[time < OFF][-1] > 0.95 * 4e5 and pressure[-1] < 0.05 * 4e5
    assert np.all(np.diff(pressure[(time > ON) & (time < OFF)]) >= -1.0)
    assert np.abs(switched["chamber/plantarflexor/pressure"]).max() < 0.1e5  # its muscles are pulled on only


def test_its_ways_are_complements_and_answer_after_their_delays(switched: afo.Recording) -> None:
    time = switched["time"]
    inlet, outlet = (switched[f"valve/dorsiflexor_{side}/opening"] for side in ("inlet", "outlet"))
    assert np.array_equal(outlet, 1.0 - inlet)
    between = (inlet > 0.0) & (inlet < 1.0)  # both ways are open for the step of the switching at most
    assert between.sum() <= 2
    assert time[np.argmax(inlet > 0.5)] == pytest.approx(ON + 0.004, abs=0.0011)
    assert time[np.flatnonzero(inlet > 0.5)[-1]] == pytest.approx(OFF + 0.006, abs=0.0021)


def test_flow_goes_one_way_at_a_time(switched: afo.Recording) -> None:
    inlet, outlet = (switched[f"valve/dorsiflexor_{side}/mass_flow"] for side in ("inlet", "outlet"))
    assert inlet.max() > 1e-4 and outlet.max() > 1e-4
    assert not np.any((np.abs(inlet) > 0.0) & (np.abs(outlet) > 0.0))


def test_coil_of_the_way_out_is_what_the_one_coil_leaves(switched: afo.Recording) -> None:
    inlet, outlet = (switched[f"valve/dorsiflexor_{side}/coil"] for side in ("inlet", "outlet"))
    assert np.array_equal(outlet, 1.0 - inlet) and inlet.max() == 1.0 and inlet.min() == 0.0
    assert np.array_equal(switched["valve/plantarflexor_outlet/coil"], np.ones(len(inlet)))


def test_air_is_kept_and_energy_closes(switched: afo.Recording) -> None:
    step, mass = 1e-3, switched["chamber/dorsiflexor/mass"]
    inlet, outlet = (switched[f"valve/dorsiflexor_{side}/mass_flow"] for side in ("inlet", "outlet"))
    moved = float(np.abs(inlet).sum() + np.abs(outlet).sum()) * step
    assert np.abs(np.diff(mass) - step * (inlet - outlet)[:-1]).sum() < 1e-9 * moved
    assert abs(float(switched.metrics["energy_error"])) < 5e-3


def test_it_is_two_ideal_valves_switched_against_each_other() -> None:
    """Without delays a 3/2 valve is an inlet and an outlet whose coil is on where the other's is off."""
    path = {"conductance": "0.6 dm^3/(s*bar)", "critical_ratio": "0.3", **IDEAL}
    two = three_way(**IDEAL)
    for name in CHAMBERS:
        two[f"orthosis.chamber.{name}"] = {
            "inlet": path, "outlet": path, "tube_volume": "4 ml", "wall_conductance": "0.5 W/K",
        }  # fmt: skip
    two["timer"] = {
        "period": "1 s",
        "dorsiflexor": {"inlet": [["0.1 s", "0.5 s"]], "outlet": [["0 s", "0.1 s"], ["0.5 s", "1 s"]]},
        "plantarflexor": {"outlet": [["0 s", "1 s"]]},
    }
    one, pair = afo.run("seated", three_way(**IDEAL)), afo.run("seated", two)
    for column in ("chamber/dorsiflexor/pressure", "ankle/angle", "chamber/dorsiflexor/mass"):
        apart = np.abs(one[column] - pair[column]).max()
        assert apart <= 2e-3 * np.ptp(pair[column]), column  # the outlet of two opens a step late at first


def test_commands_that_it_cannot_follow_are_refused() -> None:
    with afo.Simulator("seated", three_way()) as seen:
        seen.step({"dorsiflexor": "inlet"})
        seen.step({"dorsiflexor": "outlet"})
        seen.step({"dorsiflexor": (1.0, 0.0)})
        for wrong in ("shut", "both", (1.0, 1.0)):
            with pytest.raises(InputError, match=r"dorsiflexor.*inlet, outlet"):
                seen.step({"dorsiflexor": wrong})


CONTROLLERS = {
    "a timer's outlet": (
        {"timer": {"period": "1 s", "dorsiflexor": {"outlet": [["0 s", "1 s"]]}}},
        "controller.timer.dorsiflexor.outlet.*has no coil",
    ),
    "a state that shuts": (
        {"state_machine": {"start": "a", "state": {"a": {"dorsiflexor": "shut"}}}},
        "controller.state_machine.state.a.dorsiflexor.*vents while",
    ),
    "a state that opens both": (
        {"state_machine": {"start": "a", "state": {"a": {"dorsiflexor": "both"}}}},
        "controller.state_machine.state.a.dorsiflexor.*has no coil",
    ),
    "a phase that waits shut": (
        {"gait_phase": {"dorsiflexor": {"inlet": [["0.6", "0.9"]]}}},
        'controller.gait_phase.waiting.*vents.*"outlet"',
    ),
    "a PID on valves": (
        {"pid": {"angle": {"proportional_band": "10 deg", "reference": {"mean": "5 deg"}}}},
        "controller.pid.raises.*2/2 valves",
    ),
}


@pytest.mark.parametrize("case", CONTROLLERS)
def test_controllers_that_it_cannot_follow_are_refused(case: str) -> None:
    controller, said = CONTROLLERS[case]
    sets = three_way() | {"controller": controller}
    sets["timer"] = None
    with pytest.raises(InputError, match=said):
        load("scenario", "seated", sets)


def test_controllers_that_it_can_follow_run() -> None:
    states = {"start": "a", "state": {"a": {"dorsiflexor": "inlet"}, "b": {"dorsiflexor": "outlet"}}}
    states["transition"] = [{"state": "a", "to": "b", "column": "state_time", "above": "0.3 s"}]
    for controller in (
        {"state_machine": states},
        {"timer": {"period": "1 s", "dorsiflexor": {"inlet": [["0 s", "0.3 s"]]}}},
    ):
        run = afo.run("seated", three_way() | {"timer": None, "controller": controller})
        pressure = run["chamber/dorsiflexor/pressure"]
        assert run.ok and pressure.max() > 3e5 and pressure[-1] < 0.2e5

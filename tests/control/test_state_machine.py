"""The state machine against sequences worked out by hand, and what of a description it refuses."""

from typing import Any

import numpy as np
import pytest
from control.samples import MACHINE, changed, commands, made, walker

import afo_sim
from afo_sim.common import InputError
from afo_sim.control import Machine, Transition, machine_of
from afo_sim.control.state_machine import StateMachineController, advance

FILL, SHUT, VENT = (1.0, 0.0), (0.0, 0.0), (0.0, 0.5)


def controller(**changed: Any) -> StateMachineController:
    found = made({"rate": "100 Hz", "state_machine": MACHINE | changed})
    assert isinstance(found, StateMachineController)
    return found


def test_the_machine_is_the_descriptions() -> None:
    scenario = walker({"state_machine": MACHINE})
    assert scenario.controller is not None and scenario.controller.state_machine is not None
    machine = machine_of(scenario.controller.state_machine, scenario)
    assert machine.states == ("swing", "contact", "stance")
    assert machine.start == 0
    assert machine.commands[0] == {"dorsiflexor": (1.0, 0.0), "plantarflexor": (0.0, 1.0)}
    assert machine.transitions[0] == Transition(0, 1, "foot/heel_load", True, 50.0, 0.0)
    last = machine.transitions[2]
    assert (last.source, last.to, last.above, last.after) == (2, 0, False, 0.02)
    assert last.threshold == pytest.approx(-np.pi / 3.0)


def test_it_goes_round_as_by_hand() -> None:
    heel = [0.0, 49.9, 50.0, 90.0, 90.0, 90.0, 90.0, 90.0, 0.0, 0.0]
    speed = [0.0, 0.0, 0.0, 0.0, 0.0, -2.0, -2.0, -2.0, -2.0, -2.0]
    # contact in sample 2; 30 ms later stance, in sample 5; looked at 20 ms later, in 7: swing
    machine = controller()
    found = commands(machine, 0.01, foot__heel_load=heel, ankle__velocity=speed)
    expected = [FILL, FILL, SHUT, SHUT, SHUT, VENT, VENT, FILL, FILL, FILL]
    assert [command["dorsiflexor"] for command in found] == expected
    assert machine.tell() == {"state": 0.0}
    assert "plantarflexor" not in found[5]  # keeps its command


def test_the_first_that_holds_fires_and_no_second_one() -> None:
    first = Transition(0, 1, "a", True, 1.0, 0.0)
    second = Transition(0, 2, "a", True, 0.5, 0.0)
    onward = Transition(1, 2, "a", True, 0.0, 0.0)
    machine = Machine(("x", "y", "z"), 0, ({}, {}, {}), (first, second, onward))
    assert advance(machine, 0, 0.0, {"a": 2.0}) == 1
    assert advance(machine, 0, 0.0, {"a": 0.7}) == 2
    assert advance(machine, 0, 0.0, {"a": 0.4}) == 0
    assert advance(machine, 2, 9.0, {"a": 9.0}) == 2
    assert machine.columns(2) == []
    assert machine.columns() == ["a"]


def test_a_value_that_is_no_number_moves_nothing() -> None:
    both = (Transition(0, 1, "a", True, 1.0, 0.0), Transition(0, 1, "a", False, 1.0, 0.0))
    machine = Machine(("x", "y"), 0, ({}, {}), both)
    assert advance(machine, 0, 1.0, {"a": float("nan")}) == 0


def test_a_reset_forgets() -> None:
    machine = controller()
    commands(machine, 0.01, foot__heel_load=[90.0] * 3, ankle__velocity=[0.0] * 3)
    machine.reset()
    assert (machine.state, machine.ticks) == (0, 0)


@pytest.mark.parametrize(
    ("sets", "field", "told"),
    [
        (changed(0, column="foot/heal_load"), "transition.0.column", "foot/heel_load"),
        (changed(0, column="sensor/heel"), "transition.0.column", "sees no such column"),
        (changed(0, above="20 mm"), "transition.0.above", "N"),
        (changed(0, above=20.0), "transition.0.above", "no unit"),
        (changed(1, above="20 N"), "transition.1.above", "s"),
        (changed(0, column="gait/phase", above="20 N"), "transition.0.above", "bare number"),
    ],
)
def test_a_run_refuses_columns_and_units_before_its_first_step(
    sets: dict[str, Any], field: str, told: str
) -> None:
    scenario = walker({"state_machine": MACHINE | sets}, duration="20 ms", reference=None)
    with pytest.raises(InputError) as refused:
        afo_sim.run(scenario)
    assert refused.value.field.endswith(field)
    assert told in str(refused.value)


def test_a_bare_number_is_right_for_a_column_without_unit() -> None:
    moved = changed(0, column="gait/phase", above=0.05)
    scenario = walker({"state_machine": MACHINE | moved}, duration="0.2 s", reference=None)
    run = afo_sim.run(scenario)
    assert run.ok, run.status
    first = np.flatnonzero(run["controller/state"] == 1.0)[0]
    assert run["gait/phase"][first] == pytest.approx(0.05, abs=0.012)  # a control period of 10 ms and a step


def test_its_description_is_written_and_read_again() -> None:
    scenario = walker({"state_machine": MACHINE})
    assert afo_sim.load("scenario", scenario.resolved()) == scenario
    assert scenario.controller is not None and scenario.controller.state_machine is not None
    coils = scenario.controller.state_machine.state["stance"].chambers["dorsiflexor"]
    assert coils == (0.0, 0.5)
    driven = {"drive": {"dorsiflexor": {"kind": "bang_bang"}}}
    pressed = MACHINE | {"state": MACHINE["state"] | {"swing": {"dorsiflexor": "3 bar"}}}
    scenario = walker({"state_machine": pressed}, **driven)
    again = afo_sim.load("scenario", scenario.resolved())
    assert again == scenario
    assert again.controller is not None and again.controller.state_machine is not None
    assert again.controller.state_machine.state["swing"].chambers["dorsiflexor"] == 3e5


def test_keys_of_its_states_can_be_set() -> None:
    scenario = walker({"state_machine": MACHINE}).set(
        {
            "controller.state_machine.state.swing.dorsiflexor": "shut",
            "controller.state_machine.transition[0].above": "70 N",
        }
    )
    assert scenario.controller is not None and scenario.controller.state_machine is not None
    machine = machine_of(scenario.controller.state_machine, scenario)
    assert machine.commands[0]["dorsiflexor"] == SHUT
    assert machine.transitions[0].threshold == 70.0


@pytest.mark.slow
def test_a_machine_on_heel_contact_goes_round_once_a_stride() -> None:
    moved = changed(2, after="0.35 s")  # earlier the foot turns as fast while the heel is down
    sets = {"state_machine": MACHINE | moved, "rate": "1 kHz"}
    run = afo_sim.run(walker(sets, duration="3.3 s", reference=None))
    assert run.ok, run.status
    entered = np.flatnonzero(np.diff(run["controller/state"]) == 1.0)
    strikes = run["time"][entered[run["controller/state"][entered] == 0.0] + 1]
    assert np.diff(strikes) == pytest.approx(1.094, abs=0.01)  # the recorded stride's duration
    inlet = run["valve/dorsiflexor_inlet/coil"]
    assert np.array_equal(inlet, np.where(run["controller/state"] == 0.0, 1.0, 0.0))

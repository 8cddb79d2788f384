"""The exported state machine against the simulated one, fed with what that one saw."""

import pathlib
import re
import subprocess

import pytest
from export.boards import CHAMBERS, MACHINE, compile_host, compile_sketch, controlled, export, printed

from afo_sim.common import InputError
from afo_sim.control import Machine, Transition, differences, read_log
from afo_sim.export import board_of, commanded
from afo_sim.export.electronics.board import states_of


def test_inputs_that_the_simulated_one_saw(tmp_path: pathlib.Path) -> None:
    scenario = controlled({"rate": "100 Hz", "state_machine": MACHINE}, duration="4.5 s")
    found = commanded(scenario)
    inputs = tmp_path / "inputs.csv"
    inputs.write_text(found.inputs_text(), encoding="utf-8")
    export(scenario, tmp_path / "machine")
    for options, start in (((), 0), (("-DVALVES_REAL=double",), 2**32 - 500)):
        host = compile_host(tmp_path / "machine", *options)
        (tmp_path / "host.csv").write_text(printed(host, inputs, start), encoding="utf-8")
        log = read_log(tmp_path / "host.csv", CHAMBERS)
        told = {d.chamber: d for d in differences(log, found.log, 0.0)}
        assert told["dorsiflexor"].first == told["plantarflexor"].first == ""
        assert told["dorsiflexor"].counts[0] == told["dorsiflexor"].counts[1] >= 10


def test_the_sketch_does_not_switch_until_its_inputs_are_calibrated(tmp_path: pathlib.Path) -> None:
    scenario = controlled({"rate": "100 Hz", "state_machine": MACHINE})
    folder = export(scenario, tmp_path / "machine")
    found = subprocess.run([compile_sketch(folder), "2", "0"], capture_output=True, text=True, check=True)
    assert found.stdout == "# stopped: an input has no calibration line\n"
    assert found.stderr.split() == ["boot", "0", "end", "0"]
    file = folder / "valves" / "valves.ino"
    text = file.read_text(encoding="utf-8")
    # 40 N a volt: 512 counts of 1023 at 5 V are 100 N, which is a heel on the ground
    file.write_text(re.sub(r"\{ A0, 0\.0f,", "{ A0, 40.0f,", text), encoding="utf-8")
    board = compile_sketch(folder)
    found = subprocess.run([board, "2", "0"], capture_output=True, text=True, check=True)
    assert found.stdout.splitlines() == [
        "time_ms,chamber,inlet,outlet",
        "0.000,dorsiflexor,1,0",
        "0.000,plantarflexor,0,1",
        "200.000,dorsiflexor,0,0",
        "280.000,dorsiflexor,0,1",
    ]
    broken = subprocess.run([board, "2", "0", "broken", "100"], capture_output=True, text=True, check=True)
    assert "# stopped: an input is outside its range" in broken.stdout
    assert broken.stderr.split() == ["boot", "0", "end", "0"]


def test_times_in_a_state_are_counted_as_the_simulation_rounds_them() -> None:
    transitions = (
        Transition(0, 1, "state_time", True, 0.03, 0.0),
        Transition(1, 0, "state_time", False, 0.0301, 0.02),
    )
    machine = Machine(("a", "b"), 0, ({}, {}), transitions)
    first, second = states_of(machine, 0.01, CHAMBERS).rules
    assert (first.threshold, first.after) == (3.0, 0)  # 0.03 is three periods, though 3 · 0.01 is below it
    assert (second.threshold, second.after) == (4.0, 2)


def standing(command: object) -> dict[str, object]:
    """The machine with another command in stance."""
    return {"state_machine": MACHINE | {"state": MACHINE["state"] | {"stance": {"dorsiflexor": command}}}}


@pytest.mark.parametrize(
    ("controller", "words"),
    [
        (standing([0.5, 0.0]), "share of a coil's current"),
        (standing("2 bar"), "is a pressure"),
        ({"rate": "300 Hz", "state_machine": MACHINE}, "controller.rate.*not a whole number of microseconds"),
        ({"toe_load": {}}, "is not exported as C"),
    ],
)
def test_what_no_board_does_is_refused(controller: dict[str, object], words: str) -> None:
    drive = {"drive.dorsiflexor": {"kind": "regulator"}} if words == "is a pressure" else {}
    with pytest.raises(InputError, match=words):
        board_of(controlled(controller, **drive))


def test_a_time_that_no_32_bits_count_is_refused() -> None:
    machine = Machine(("a", "b"), 0, ({}, {}), (Transition(0, 1, "state_time", True, 1e9, 0.0),))
    with pytest.raises(InputError, match="32-bit"):
        states_of(machine, 0.002, CHAMBERS)

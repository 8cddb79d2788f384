"""What is wrong about a controller is said with its field, in words, and with what is allowed."""

from typing import Any

import pytest

import afo_sim as afo
from afo_sim.common import InputError

PID = {"angle": {"proportional_band": "1 deg"}}
CLOCK = {"period": "1 s", "dorsiflexor": {"inlet": [["0 s", "1 s"]]}}
MACHINE: dict[str, Any] = {"start": "a", "state": {"a": {"dorsiflexor": "inlet"}}, "transition": []}
IMPEDANCE = {"stiffness": "1 N*m/rad", "mean_pressure": "1 bar", "half_range": "1 bar", "torque_map": []}
PHASE: dict[str, Any] = {"dorsiflexor": {"inlet": [[0.5, 0.9]]}}
WALK, BARE = "walk-dropfoot-afo", "walk-dropfoot"


@pytest.mark.parametrize(
    ("scenario", "controller", "told"),
    [
        ("seated", {"rate": "100 Hz"}, "controller: has no kind"),
        ("seated", {"timer": {"period": "1 s"}}, "controller.timer: names no chamber"),
        (
            "seated",
            {"state_machine": MACHINE | {"state": {}}},
            "state: has too few items; allowed: at least 1",
        ),
        ("seated", {"impedance": IMPEDANCE}, "has too few items; allowed: at least 2"),
        (WALK, {"gait_phase": PHASE | {"switch": "x"}}, "controller.gait_phase.switch = 'x'"),
        (
            WALK,
            {"gait_phase": PHASE | {"switch": "ankle/angle"}},
            "controller.gait_phase.switch = 'ankle/angle'",
        ),
        (WALK, {"gait_phase": PHASE | {"strides": 0}}, "strides = 0: is out of range; allowed: a whole"),
        (BARE, {"pid": PID}, "allowed: an orthosis with chambers"),
        (BARE, {"timer": CLOCK}, "allowed: an orthosis with chambers"),
    ],
)
def test_field_and_what_is_allowed(scenario: str, controller: dict[str, Any], told: str) -> None:
    sets = {"timer": None, "phases": None, "reference": None, "duration": "0.1 s", "controller": controller}
    with pytest.raises(InputError) as refused:
        afo.run(scenario, sets)
    assert told in str(refused.value)


def test_a_drive_without_an_orthosis() -> None:
    with pytest.raises(InputError, match="allowed: an orthosis with chambers"):
        afo.run(BARE, {"drive.dorsiflexor.kind": "pwm"})


@pytest.mark.parametrize("rate", ["100 Hz", True, None, [1]])
def test_a_rate_that_is_no_number(rate: Any) -> None:
    with pytest.raises(InputError, match="not a valid number of commands a second; allowed: a number in Hz"):
        afo.run("seated", {"duration": "0.1 s"}, controller=lambda seen: {}, rate=rate)


def test_a_state_that_is_no_table_lists_no_empty_keys() -> None:
    machine = {"state_machine": MACHINE | {"state": {"a": "inlet"}}}
    with pytest.raises(InputError, match=r"is not a table; allowed: a table$"):
        afo.run("seated", {"timer": None, "controller": machine})

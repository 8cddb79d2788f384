"""What is wrong about a controller is said with its field, in words, and with what is allowed."""

import pathlib
from typing import Any

import pytest

import afo_sim as afo
from afo_sim.common import InputError, assets

PID = {"angle": {"proportional_band": "1 deg"}}
CLOCK = {"period": "1 s", "dorsiflexor": {"inlet": [["0 s", "1 s"]]}}
MACHINE: dict[str, Any] = {"start": "a", "state": {"a": {"dorsiflexor": "inlet"}}, "transition": []}
PHASE: dict[str, Any] = {"dorsiflexor": {"inlet": [[0.5, 0.9]]}}
WALK, BARE = "walk-dropfoot-afo", "walk-dropfoot"


@pytest.mark.parametrize(
    ("scenario", "controller", "told"),
    [
        ("seated", {"rate": "100 Hz"}, "controller: has no kind"),
        ("seated", {"timer": {"period": "1 s"}}, "controller.timer: names no chamber"),
        ("seated", {"state_machine": MACHINE | {"state": {}}}, "state: has too few items; allowed: at least"),
        (WALK, {"gait_phase": PHASE | {"switch": "x"}}, "controller.gait_phase.switch = 'x'"),
        (WALK, {"gait_phase": PHASE | {"switch": "ankle/angle"}}, "gait_phase.switch = 'ankle/angle'"),
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


IMPEDANCE = {"stiffness": "1 N*m/rad", "mean_pressure": "1 bar", "half_range": "1 bar", "torque_map": []}


def test_retired_kind_is_refused_with_what_stands_for_it() -> None:
    sets = {"timer": None, "controller": {"impedance": IMPEDANCE}}
    with pytest.raises(InputError) as refused:
        afo.load("scenario", "seated", sets)
    assert refused.value.field == "controller.impedance" and "docs/controllers.md" in refused.value.allowed
    left = {"timer": None, "controller": {"timer": CLOCK, "impedance": None}}  # as a recording has it
    assert afo.load("scenario", "seated", left).controller.kind == "timer"


def test_retired_hinge_is_refused_where_it_turned_and_left_out_elsewhere(tmp_path: pathlib.Path) -> None:
    hinge = {"leg.subtalar.stiffness": "10 N*m/rad", "leg.subtalar.damping": "0.2 N*m*s/rad"}
    with pytest.raises(InputError) as refused:
        afo.load("scenario", "seated", hinge)
    assert refused.value.field == "leg.subtalar" and "peak_inversion_moment" in refused.value.allowed
    with pytest.warns(UserWarning, match="leg.subtalar: is retired"):
        assert afo.load("scenario", WALK, hinge).leg.damping == afo.load("scenario", WALK).leg.damping
    shipped = assets.find("leg", "adult_75kg")
    own = shipped.read_text().replace('"leg.xml"', f'"{shipped.with_name("leg.xml").as_posix()}"')
    (tmp_path / "leg.toml").write_text(
        own + '[subtalar]\nstiffness = "10 N*m/rad"\ndamping = "1 N*m*s/rad"\n'
    )
    with pytest.warns(UserWarning, match="subtalar: is retired"):
        assert afo.load("leg", tmp_path).damping == afo.load("leg", "adult_75kg").damping
    with pytest.raises(InputError, match="subtalar: is retired"):
        afo.load("scenario", "seated", {"leg": str(tmp_path)})


def test_a_drive_without_an_orthosis() -> None:
    with pytest.raises(InputError, match="allowed: an orthosis with chambers"):
        afo.run(BARE, {"drive.dorsiflexor.kind": "pwm"})


@pytest.mark.parametrize("rate", ["100 m", True, None, [1]])
def test_a_rate_that_is_no_number(rate: Any) -> None:
    with pytest.raises(InputError, match=r"controller\.rate"):
        afo.run("seated", {"duration": "0.1 s"}, controller=lambda seen: {}, rate=rate)


def test_a_state_that_is_no_table_lists_no_empty_keys() -> None:
    machine = {"state_machine": MACHINE | {"state": {"a": "inlet"}}}
    with pytest.raises(InputError, match=r"is not a table; allowed: a table$"):
        afo.run("seated", {"timer": None, "controller": machine})

"""Gait phase from a foot switch, and what is commanded over it."""

import math
from typing import Any

import numpy as np
import pytest
from campaign import NIGHTLY
from control.samples import commands, made, walker

import afo_sim
from afo_sim.common import Notice
from afo_sim.control import FootSwitch
from afo_sim.control.gait_phase import command_at
from afo_sim.description import ChamberPhases

DT = 0.01


def walked(switch: FootSwitch, *strides: float, contact: float = 0.3) -> None:
    """Strides of these durations [s], the heel down at the beginning of each, and the next heel strike."""
    for stride in strides:
        for k in range(round(stride / DT)):
            switch.update(100.0 if k * DT < contact else 0.0, DT)
    switch.update(100.0, DT)


def begun() -> FootSwitch:
    switch = FootSwitch(50.0, strides=2)
    switch.update(0.0, DT)
    return switch


def test_a_phase_is_known_after_one_whole_stride() -> None:
    switch = begun()
    switch.update(100.0, DT)
    assert not switch.ready and math.isnan(switch.stride_time)
    switch = begun()
    walked(switch, 1.0)
    assert switch.ready
    assert switch.stride_time == pytest.approx(1.0)
    assert switch.phase == 0.0


def test_the_phase_is_time_over_the_mean_of_the_last_strides() -> None:
    switch = begun()
    walked(switch, 1.4, 1.0, 1.2)  # the first has left the mean of two
    assert switch.stride_time == pytest.approx(1.1)
    for _ in range(55):
        switch.update(0.0, DT)
    assert switch.phase == pytest.approx(0.5)
    for _ in range(75):
        switch.update(0.0, DT)
    assert switch.ready and switch.phase == 1.0  # 1.3 s: late
    for _ in range(40):
        switch.update(0.0, DT)
    assert not switch.ready  # 1.7 s, over 1.5 strides: who knows


def test_a_lost_sample_in_a_contact_is_no_heel_strike() -> None:
    switch = begun()
    walked(switch, 1.0, contact=0.6)
    for k in range(60):
        switch.update(math.nan if k == 50 else 100.0, DT)  # 0.5 s after the strike
    assert switch.stride_time == pytest.approx(1.0) and switch.phase == pytest.approx(0.6)


def test_a_stop_is_no_stride_and_a_slower_walk_is_learned() -> None:
    switch = begun()
    walked(switch, 1.0, 4.0)
    assert not switch.ready  # neither the stop nor what was before tells the next stride
    switch = begun()
    walked(switch, 1.0, 4.0, 1.8)
    assert switch.stride_time == pytest.approx(1.8)


def test_a_switch_that_bounces_counts_once() -> None:
    switch = begun()
    for load in [100.0, 30.0, 100.0, 10.0, 100.0]:  # 30 N is above half the threshold: still closed
        switch.update(load, DT)
    for _ in range(95):
        switch.update(0.0, DT)
    switch.update(100.0, DT)
    assert switch.stride_time == pytest.approx(1.0)


def test_commands_over_the_phase() -> None:
    valves = ChamberPhases(inlet=((0.8, 0.2),), outlet=((0.3, 0.5),))
    fill, shut, vent = (1.0, 0.0), (0.0, 0.0), (0.0, 1.0)
    found = [command_at(valves, phase) for phase in (0.1, 0.2, 0.3, 0.5, 0.9)]
    assert found == [fill, shut, vent, shut, fill]
    table = {"pressure": [[0.2, "1 bar"], [0.6, "3 bar"]]}
    pressed = ChamberPhases.model_validate(table)
    assert [command_at(pressed, phase) for phase in (0.2, 0.4, 0.6, 0.9)] == pytest.approx(
        [1e5, 2e5, 3e5, 2e5]
    )


def test_it_waits_until_the_phase_is_known() -> None:
    told = {"dorsiflexor": {"inlet": [[0.0, 0.5]]}, "waiting": "outlet", "strides": 1}
    told |= {"estimator": "foot_switch"}
    controller = made({"gait_phase": told})
    stride = [100.0] * 3 + [0.0] * 7  # of 0.5 s
    found = commands(controller, 0.05, foot__heel_load=[0.0, *stride, *stride, *stride])
    orders = [command["dorsiflexor"] for command in found]
    assert orders[:11] == ["outlet"] * 11
    assert orders[11:] == ([(1.0, 0.0)] * 5 + [(0.0, 0.0)] * 5) * 2


@pytest.mark.slow
@pytest.mark.parametrize("told", [{"estimator": "foot_switch"}, {}, {"switch": "foot/heel_load"}])
def test_at_an_even_cadence_it_does_what_the_true_phase_does(told: dict[str, Any]) -> None:
    phases = told | {"dorsiflexor": {"inlet": [[0.5, 0.9]], "outlet": [[0.15, 0.45]]}}
    rate = "1 kHz" if "estimator" in told or NIGHTLY else "250 Hz"  # a switch is as late as a command
    scenario = walker({"gait_phase": phases, "rate": rate}, duration="4.4 s", reference=None)
    run = afo_sim.run(scenario)
    known = np.isfinite(run["controller/phase"])
    assert known[run["time"] > 2.2].all()
    off = (run["controller/phase"] - run["gait/phase"] + 0.5)[known] % 1.0 - 0.5
    assert np.abs(off).max() < (0.01 if "estimator" in told else 0.03)
    assert run["controller/stride_time"][run["time"] > 2.2] == pytest.approx(1.093, rel=0.05)


@pytest.mark.parametrize(("waiting", "coils"), [("shut", (0.0, 0.0)), ("outlet", (0.0, 1.0))])
def test_no_inlet_stays_open_on_who_stands(waiting: str, coils: tuple[float, float]) -> None:
    told = {"waiting": waiting, "dorsiflexor": {"inlet": [[0.5, 0.95]], "outlet": [[0.15, 0.45]]}}
    stop = {"gait.pace": [["4 s", 0.0], ["6 s", 1.0]]}  # within the inlet's interval
    scenario = walker({"gait_phase": told}, duration="7 s", reference=None, **stop)
    run = afo_sim.run(scenario)
    stands = (run["time"] > 5.0) & (run["time"] < 6.0)
    assert 0.5 < run["gait/phase"][stands][0] < 0.95
    for side, coil in zip(("inlet", "outlet"), coils, strict=True):
        assert (run[f"valve/dorsiflexor_{side}/coil"][stands] == coil).all()
    onward = run["time"] > 6.5  # and it goes on at once
    assert np.isfinite(run["controller/phase"][onward]).all()
    assert run["valve/dorsiflexor_inlet/coil"][onward].max() == 1.0


@pytest.mark.parametrize(
    ("told", "code"),
    [({"column": "ankle/angle"}, "phase-never-known"), ({}, ""), ({"switch": "foot/heel_load"}, "")],
)
def test_a_phase_that_was_never_known_answers_nothing(told: dict[str, Any], code: str) -> None:
    phases = told | {"dorsiflexor": {"inlet": [[0.5, 0.95]], "outlet": [[0.15, 0.45]]}}
    run = afo_sim.run(walker({"gait_phase": phases}, duration="5 s", reference=None))
    said = {warning.code for warning in run.warnings if isinstance(warning, Notice)}
    assert said & {"phase-never-known"} == {code} - {""}
    statuses = {answer.status for answer in run.verdict}
    assert (statuses == {"unknown"}) == bool(code)
    known = run["controller/heel_strike"].max()
    assert known == (2.0 if "switch" in told else 0.0 if code else known)


def test_a_walk_that_is_hardly_longer_than_it_takes_to_know_the_phase_is_doubtful() -> None:
    phases = {"dorsiflexor": {"inlet": [[0.5, 0.95]], "outlet": [[0.15, 0.45]]}}
    run = afo_sim.run(walker({"gait_phase": phases}, duration="3.4 s", reference=None))
    known = np.isfinite(run["controller/phase"]).mean()
    assert 0.0 < known < 0.5
    (said,) = [warning for warning in run.warnings if getattr(warning, "code", "") == "phase-seldom-known"]
    assert said.data["share"] == pytest.approx(100.0 * known)
    assert "good" not in {answer.status for answer in run.verdict}

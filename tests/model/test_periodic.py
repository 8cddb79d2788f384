"""A stride of whole steps, and for which scenarios there is one."""

import math

import numpy as np
import pytest

from afo_sim.common import with_code
from afo_sim.description import Scenario, load
from afo_sim.model import AFTER, as_run, start_up, steps_of_stride, stride_time_of, two_strides, why_walked
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.model.periodic import unseen_drift
from afo_sim.simulation.run import run


def scenario(name: str = "walk-dropfoot-afo", **sets: object) -> Scenario:
    return load("scenario", name, {key.replace("__", "."): value for key, value in sets.items()})


@pytest.mark.parametrize("step", ["0.1 ms", "0.3 ms", "1 ms", "2 ms", "7 ms", "10 ms"])
@pytest.mark.parametrize("stride", [None, "0.7 s", "1.2 s", "1.7999 s"])
def test_a_stride_is_a_whole_number_of_steps(step: str, stride: str | None) -> None:
    sets = {} if stride is None else {"gait.stride_time": stride}
    described = scenario(timestep=step).set(sets)
    n, adjusted = steps_of_stride(described), two_strides(described)
    duration = stride_time_of(described)
    assert n * adjusted.timestep == pytest.approx(duration, rel=1e-14)
    # by less than half a step in a stride
    assert abs(n * described.timestep - duration) <= 0.5 * described.timestep * (1.0 + 1e-9)
    assert adjusted.n_step == 2 * n + AFTER


@pytest.mark.parametrize("step", ["1 ms", "4 ms"])
@pytest.mark.parametrize("start", [0.0, 0.37, 1.0])
def test_the_second_stride_takes_the_inputs_of_the_first(step: str, start: float) -> None:
    described = scenario(timestep=step).set({"gait.start_phase": start})
    built, n = build(two_strides(described)), steps_of_stride(described)
    control = schedule.controls(built)
    coils = list(built.index.valves.values())
    assert np.array_equal(control[:n, coils], control[n : 2 * n, coils])
    scale = np.maximum(np.abs(control).max(axis=0), 1e-9)
    # the shank's acceleration is a second difference of metres: rounding over h²
    rounding = 1e-15 / built.scenario.timestep**2 * 100.0
    assert np.abs(control[:n] - control[n : 2 * n]).max(axis=0) / scale == pytest.approx(0.0, abs=rounding)
    assert built.walk is not None and built.walk.phase[1] == 0.0  # from heel strike


@pytest.mark.parametrize("start", [0.0, 0.2, 0.37, 0.499, 0.501, 0.9, 0.9999, 1.0])
@pytest.mark.parametrize("duration", [0.1, 1.3, 2.5, 3.61, 5.0, 14.4])
def test_strides_from_the_start_end_at_a_heel_strike(duration: float, start: float) -> None:
    described = scenario().set({"duration": f"{duration} s", "gait.start_phase": start})
    begun, n = start_up(described), steps_of_stride(described)
    first = begun.gait.start_phase * n
    assert first == pytest.approx(round(first), abs=1e-6) and abs(first - start * n) <= 0.5 + 1e-9
    assert (round(first) + begun.n_step) % n == 0
    assert begun.n_step >= n // 2  # about a stride at least
    whole = math.floor((start * stride_time_of(begun) + duration) / stride_time_of(begun) + 0.02)
    if whole >= 4:  # with the two that follow, what was asked for, less the part of a stride at its end
        assert round(first) + begun.n_step + 2 * n == whole * n


@pytest.mark.parametrize("rate", ["100 Hz", "1000 Hz", "500 Hz", "250 Hz"])
def test_every_so_many_steps_are_recorded_as_was_asked_for(rate: str) -> None:
    described = scenario(record_rate=rate)
    for adjusted in (start_up(described), two_strides(described)):
        assert adjusted.record_stride == described.record_stride
    assert start_up(scenario()).record_stride == 1  # at about 1 kHz, though the step is a little shorter


def test_the_scenario_as_run_is_its_own_where_nothing_is_solved() -> None:
    seated = load("scenario", "seated")
    assert as_run(seated) is seated
    plain = scenario().set({"gait.settled": "walked"})
    assert as_run(plain) is plain
    assert as_run(scenario()).timestep == two_strides(scenario()).timestep


SOLVED = {"gait.settled": "solved"}  # the shipped timer's scenario is walked


def timed(period: float, stride: float) -> Scenario:
    valves = {"dorsiflexor": {"inlet": [["0.1 s", "0.2 s"]], "outlet": [["0.3 s", "0.4 s"]]}}
    described = load("scenario", "walk-dropfoot-afo-timer", SOLVED | {"gait.stride_time": f"{stride} s"})
    return described.set({"timer": {"period": f"{period} s"} | valves})


@pytest.mark.parametrize("part", [1, 2, 3, 7])
def test_a_timer_fits_whose_period_is_a_whole_part_of_the_stride(part: int) -> None:
    stride = 3.5
    described = timed(stride / part, stride)
    assert why_walked(described) == ""
    control = schedule.controls(build(two_strides(described)))
    n = steps_of_stride(described)
    assert control[:n].max(axis=0) == pytest.approx(control[n : 2 * n].max(axis=0), rel=1e-6)


@pytest.mark.parametrize(
    ("period", "stride"), [(2.4, 1.2), (1.2, 1.20325), (0.8, 1.2), (1.2 * (1 + 1e-6), 1.2)]
)
def test_a_timer_that_drifts_against_the_stride_is_walked(period: float, stride: float) -> None:
    assert "timer" in why_walked(timed(period, stride))


def test_the_shipped_timer_is_walked_with_a_warning_where_it_is_to_be_solved() -> None:
    described = scenario("walk-dropfoot-afo-timer")
    assert why_walked(described)
    assert not [w for w in build(described).warnings if "walked" in w]
    described = described.set(SOLVED)
    assert "1.1 s" in why_walked(described)
    assert [w for w in build(described).warnings if "not solved for" in w]


def test_a_timer_that_switches_nothing_may_have_any_period() -> None:
    described = scenario("walk-dropfoot-afo-timer").set(SOLVED | {"timer": {"period": "0.77 s"}})
    assert why_walked(described) == ""


def test_a_timer_that_has_not_come_round_is_told() -> None:
    # 1.1 s against 1.0929 s: 0.65 % a stride, so 154.9 strides, 169.3 s, until the two meet again
    described = scenario("walk-dropfoot-afo-timer")
    [told] = with_code(build(described).warnings, "timer-drifts")
    assert "0.65 % of its period" in told
    assert "8.5 % of a full cycle" in told  # 14.4 s of 169.3 s
    assert "169 s" in told
    assert unseen_drift(described.set({"duration": "169.4 s"})) is None
    # one that fits after two strides has been seen after them
    assert unseen_drift(timed(2.4, 1.2).set({"duration": "2.4 s"})) is None
    assert unseen_drift(timed(2.4, 1.2).set({"duration": "1.2 s"}))
    assert unseen_drift(timed(1.2, 1.2)) is None
    assert unseen_drift(scenario("walk-dropfoot-afo")) is None


@pytest.mark.slow
def test_a_timer_s_verdict_may_turn_in_what_a_short_run_does_not_see() -> None:
    """Quick valves hold air in the right phase at first, and in the wrong one a minute later."""
    valve = "orthosis.chamber.dorsiflexor.{}.conductance"
    quick = {valve.format(side): "0.3 dm^3/(s*bar)" for side in ("inlet", "outlet")}
    sets = quick | {"reference": None, "timestep": "2 ms", "orthosis.anchor.shank.stiffness": "6 kN/m"}
    short, long = (
        run("walk-dropfoot-afo-timer", sets | {"duration": duration}) for duration in ("14.4 s", "170 s")
    )
    assert (
        float(short.metrics["lowest_toe_clearance"])
        > 10.0
        > 0.0
        > float(long.metrics["lowest_toe_clearance"])
    )
    assert any("drifts" in w for w in short.warnings)
    assert not any("the timer drifts" in w for w in long.warnings)

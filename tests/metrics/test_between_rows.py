"""Numbers of a stretch that ends between rows, against closed forms: none depends on where the rows lie."""

import math
from typing import Any

import numpy as np
import pytest
from synthetic_walk import AMPLITUDE, MASS, OMEGA, STRIDE, TOE_OFF, UPRIGHT, walk_columns, with_orthosis

import afo_sim
from afo_sim.common import GRAVITY
from afo_sim.gait import STANCE_FORCE
from afo_sim.metrics import Window, ankle_metrics, rise_time, walk_metrics
from afo_sim.metrics.valves import filling
from afo_sim.simulation.bilateral_air import cycle_of

STEPS = [2e-3, 1.9e-3, 1.1e-3, 0.7e-3]  # [s]; toe-off is 0.75 s after heel strike
OVER = (
    math.sin(2.0 * math.pi * TOE_OFF),
    math.sin(2.0 * math.pi * 0.4),
)  # of the ankle's sine, push-off's ends


def found(step: float, torque: Any) -> dict[str, float]:
    """Metrics of the written walk whose ground force falls evenly to its threshold at toe-off."""
    columns = walk_columns(step=step)
    phase = columns["gait/phase"]
    least = STANCE_FORCE * MASS * GRAVITY
    columns["ground/force/z"] = np.maximum(least + 4e3 * (TOE_OFF - phase), 0.0)
    columns["gait/needed_moment"] = 4.0 + 20.0 * (phase - TOE_OFF) ** 2
    columns["gait/passive_moment"] = -3.0 * phase
    # MuJoCo's velocity is the mean of the step before
    columns["ankle/velocity"] = np.diff(columns["ankle/angle"], prepend=-AMPLITUDE * OMEGA * step) / step
    worn = with_orthosis(columns, torque(phase, columns["ankle/angle"]))
    return {name: metric.value for name, metric in walk_metrics(worn, step, MASS).totals.items()}


@pytest.mark.parametrize("step", STEPS)
def test_push_off_ends_at_toe_off_and_not_at_a_row(step: float) -> None:
    """A torque that rises to toe-off: the mean of the last 10 ms is that of its middle. ∫ T dθ by parts."""
    values = found(step, lambda phase, _: 20.0 * phase)
    assert values["stance"] == pytest.approx(100.0 * TOE_OFF, rel=1e-9)
    assert values["torque_against_push_off"] == pytest.approx(20.0 * (TOE_OFF - 5e-3 / STRIDE), rel=1e-6)
    per_mass = values["torque_against_push_off_per_mass"]
    assert per_mass == pytest.approx(values["torque_against_push_off"] / MASS)
    turned = (math.cos(0.8 * math.pi) - math.cos(2.0 * math.pi * TOE_OFF)) / (2.0 * math.pi)
    work = 20.0 * AMPLITUDE * (TOE_OFF * OVER[0] - 0.4 * OVER[1] - turned)
    assert values["work_against_push_off"] == pytest.approx(-work / MASS, rel=1e-4)
    assert values["plantarflexion_at_toe_off"] == pytest.approx(-12.0 * OVER[0], rel=1e-4)


@pytest.mark.parametrize("step", STEPS)
def test_push_off_is_given_a_plantarflexion_torque_until_toe_off(step: float) -> None:
    """The same torque the other way, by integral; the recorded ankle's power is 20 v²."""
    values = found(step, lambda phase, _: -20.0 * phase)
    assert values["push_off_torque"] == pytest.approx(20.0 * (TOE_OFF - 5e-3 / STRIDE), rel=1e-6)
    turned = (math.cos(0.8 * math.pi) - math.cos(2.0 * math.pi * TOE_OFF)) / (2.0 * math.pi)
    work = -20.0 * AMPLITUDE * (TOE_OFF * OVER[0] - 0.4 * OVER[1] - turned)
    assert values["push_off_work"] == pytest.approx(work / MASS, rel=1e-4)
    doubled = math.sin(4.0 * math.pi * TOE_OFF) - math.sin(1.6 * math.pi)
    squared = 0.5 * (TOE_OFF - 0.4) + doubled / (8.0 * math.pi)
    own = 20.0 * (AMPLITUDE * OMEGA) ** 2 * STRIDE * squared
    assert values["share_of_push_off_work"] == pytest.approx(100.0 * work / own, rel=1e-3)
    fine = np.linspace(0.4, TOE_OFF, 200_001)  # highest mean power of 10 ms, over a grid of 1.25 µs
    power = 20.0 * fine * AMPLITUDE * OMEGA * np.abs(np.cos(2.0 * np.pi * fine))
    means = np.convolve(power, np.full(8000, 1 / 8000), "valid")
    assert values["push_off_power"] == pytest.approx(means.max() / MASS, rel=2e-3)
    assert values["work_against_push_off"] == values["torque_against_push_off"] == 0.0


@pytest.mark.parametrize("step", STEPS)
def test_the_parts_of_swing_end_at_toe_off_upright_shank_and_heel_strike(step: float) -> None:
    """A need of 4 + 20 (φ − 0.6)², its means by integral: over swing, and over the 10 ms to its end."""
    values = found(step, lambda phase, _: np.where(phase < 0.95, 20.0 * phase, 0.0))
    window = 0.010 / STRIDE
    highest = 4.0 + 20.0 * (0.3**3 - (0.3 - window) ** 3) / (3.0 * window)
    assert values["needed_swing_torque"] == pytest.approx(highest, rel=1e-5)
    assert values["needed_swing_torque_mean"] == pytest.approx(4.0 + 20.0 * 0.3**2 / 3.0, rel=1e-5)
    assert values["needed_swing_torque_tissue"] == pytest.approx(3.0 * UPRIGHT, rel=1e-5)
    assert values["orthosis_swing_torque_mean"] == pytest.approx(15.0, rel=1e-5)


@pytest.mark.parametrize("step", STEPS)
def test_the_peak_of_a_flow_does_not_depend_on_where_a_stride_begins(step: float) -> None:
    """A triangle of 40 ms and 1 g/s, whose middle 10 ms have a mean of 0.875 g/s."""
    columns = walk_columns(step=step)
    away = np.abs(columns["gait/phase"] - 0.8) * STRIDE / 20e-3
    worn = with_orthosis(columns, np.zeros_like(away))
    worn["valve/front_inlet/mass_flow"] = 1e-3 * np.maximum(1.0 - away, 0.0)
    for of_stride in walk_metrics(worn, step, MASS).strides.values():
        assert of_stride["peak_flow"].value == pytest.approx(60.0 * 0.875 / 1.185, rel=0.01)


@pytest.mark.parametrize("step", STEPS)
def test_a_spring_gives_back_in_a_stride_what_it_takes(step: float) -> None:
    """A spring of 30 N·m/rad, −c θ, is stretched and let go twice a stride, c A²/2 each time."""
    values = found(step, lambda _, angle: -30.0 * angle)
    work = 30.0 * AMPLITUDE**2
    assert values["orthosis_positive_work"] == pytest.approx(work / MASS, rel=1e-3)
    assert values["work_against_dorsiflexion"] == pytest.approx(0.5 * work / MASS, rel=1e-3)
    assert values["orthosis_negative_work"] == pytest.approx(-work / MASS, rel=1e-3)
    assert values["positive_work"] == pytest.approx(work, rel=1e-3)
    assert values["orthosis_peak_power"] == pytest.approx(0.5 * OMEGA * work / MASS, rel=1e-3)


@pytest.mark.parametrize("seconds", [2.1, 2.4, 2.7, 3.0])
def test_per_cycle_is_per_whole_cycle(seconds: float) -> None:
    """Steps of 0.3 s and cycles of 1 s: the inlet lets 1 g/s through, but for 0.4 s of each cycle: 0.6 g."""
    time = 0.3 * np.arange(round(seconds / 0.3))
    into = [0.6 * np.floor(t) + t % 1.0 - np.clip(t % 1.0 - 0.3, 0.0, 0.4) for t in (*time, seconds)]  # [g]
    columns = with_orthosis({"time": time, "gait/phase": np.zeros_like(time)}, np.ones_like(time))
    columns |= {"ankle/angle": time, "valve/front_inlet/mass_flow": 1e-3 * np.diff(into) / 0.3}
    values = {name: metric.value for name, metric in ankle_metrics(columns, 0.3, 1.0).items()}
    assert values["air_per_cycle"] == pytest.approx(0.6)
    assert values["air_per_hour"] == pytest.approx(3600.0 * values["air_per_cycle"])
    cycles = 3 if seconds > 2.9 else 2
    assert values["positive_work"] == pytest.approx(min(cycles, time[-1]) / cycles)  # to the last row


PER_CYCLE = ("air_per_cycle", "exergy_taken", "exergy_vented", "positive_work", "skeleton_work", "air_work")
RATES = ("damper_loss", "air_per_hour", "mean_flow", "cycles_per_bottle", "hours_per_bottle")
SWITCHED = tuple(f"switches_per_minute_{side}" for side in ("dorsiflexor_inlet", "plantarflexor_outlet"))


@pytest.mark.parametrize(
    "sets", [{"timestep": "2.4 ms"}, {"timestep": "0.7 ms"}, {"duration": "16.01 s"}, {"duration": "17 s"}]
)
def test_seated_cycles_are_alike_at_any_step_and_a_little_longer(sets: dict[str, str]) -> None:
    """Of a run of 15.9999 s too, which a step of 0.7 ms makes of two cycles of 8 s."""
    usual, other = afo_sim.run("seated").metrics, afo_sim.run("seated", sets)
    for name in (*PER_CYCLE, *RATES, *SWITCHED):
        assert other.metrics[name] == pytest.approx(usual[name], rel=1e-3), name
    assert cycle_of(other).columns["time"][0] == pytest.approx(8.0, abs=3e-3)


def test_filling_ends_between_rows() -> None:
    """A pressure that rises by 1 bar in each step of 10 ms is at 3.6 of 4 bar after 3.6 of them."""
    pressure = 1e5 * np.minimum(np.arange(6.0), 4.0)
    names = ("chamber/a/mass", "valve/a_inlet/coil", "supply/pressure", "valve/a_outlet/coil")
    columns = dict(zip(names, (pressure, np.ones(6), np.full(6, 4e5), np.zeros(6)), strict=True))
    columns |= {"chamber/a/pressure": pressure, "valve/a_outlet/opening": np.zeros(6)}
    found = dict(filling(columns | {"time": 0.01 * np.arange(6)}))
    assert found["fill_time_a"] == pytest.approx(0.036)


@pytest.mark.parametrize("step", STEPS)
def test_a_lag_of_first_order_rises_in_ln_9_time_constants(step: float) -> None:
    time = np.arange(0.0, 4.0, step)
    lag = 1.0 - np.exp(-time / 0.2)
    assert rise_time(time, 3.0 * lag - 7.0) == pytest.approx(0.2 * math.log(9.0), abs=step**2)
    assert rise_time(time, np.minimum(time, 1.0)) == pytest.approx(0.8)
    for never in (np.full(len(time), 1e3), -lag):
        assert math.isnan(rise_time(time, never))


def test_shares_of_steps_add_up_to_the_window_and_outer_rows_have_what_is_beyond() -> None:
    assert Window(0.0, 9.6).shares(0, 10) == pytest.approx([1.0] * 9 + [0.6])
    assert Window(0.0, 9.6).shares(0, 8) == pytest.approx([1.0] * 7 + [2.6])
    assert Window(2.3, 4.5).shares(3, 2) == pytest.approx([1.7, 0.5])

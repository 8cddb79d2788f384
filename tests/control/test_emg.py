"""Control by muscle activation."""

import math
from typing import Any

import numpy as np
import pytest
from control.samples import commands, made, walker

import afo_sim
from afo_sim.common import InputError
from afo_sim.control.emg import activated

DRIVEN: dict[str, Any] = {"drive": {"dorsiflexor": {"kind": "bang_bang"}}}
PRESSED: dict[str, Any] = {"pressure": "4 bar", "full": "10 N*m", "column": "gait/ankle_moment"}


def asked(told: dict[str, Any], moments: list[float], period: float) -> list[float]:
    """Pressures that are asked for [bar]."""
    controller = made({"emg": PRESSED | told}, **DRIVEN)
    return [1e-5 * c["dorsiflexor"] for c in commands(controller, period, gait__ankle_moment=moments)]


def test_a_step_rises_and_falls_by_its_two_time_constants() -> None:
    told = {"activation_time": "20 ms", "deactivation_time": "80 ms"}
    found = asked(told, [5.0] * 40 + [0.0] * 40, 0.005)
    rising = [4.0 * 0.5 * (1.0 - math.exp(-0.005 * (k + 1) / 0.02)) for k in range(40)]
    assert found[:40] == pytest.approx(rising)
    assert found[40:] == pytest.approx([rising[-1] * math.exp(-0.005 * (k + 1) / 0.08) for k in range(40)])


def test_it_is_rectified_and_ends_at_full_activation() -> None:
    at_once = {"activation_time": "0 s", "deactivation_time": "0 s"}
    assert asked(at_once, [-5.0, 0.0, 5.0, 15.0], 0.01) == pytest.approx([0.0, 0.0, 2.0, 4.0])
    other = at_once | {"side": "plantarflexor"}
    assert asked(other, [-5.0, 0.0, 5.0, -15.0], 0.01) == pytest.approx([2.0, 0.0, 0.0, 4.0])


def test_a_delay_is_whole_periods() -> None:
    told = {"activation_time": "0 s", "deactivation_time": "0 s", "delay": "30 ms"}
    assert asked(told, [1.0, 2.0, 3.0, 4.0, 5.0], 0.01) == pytest.approx([0.0, 0.0, 0.0, 0.4, 0.8])


def test_one_long_period_is_many_short_ones() -> None:
    a = 0.2
    for _ in range(10):
        a = activated(a, 0.9, 0.001, 0.02, 0.05)
    assert activated(0.2, 0.9, 0.01, 0.02, 0.05) == pytest.approx(a)


def test_without_a_drive_valves_are_switched_with_hysteresis() -> None:
    told = {"activation_time": "0 s", "deactivation_time": "0 s", "fill_above": 0.5, "vent_below": 0.2}
    controller = made({"emg": {"column": "gait/ankle_moment"} | told})
    found = commands(controller, 0.01, gait__ankle_moment=[0.0, 3.0, 5.0, 3.0, 1.9, 3.0])
    orders = [command["dorsiflexor"] for command in found]
    assert orders == ["outlet", "shut", "inlet", "inlet", "outlet", "shut"]


def test_what_a_patient_has_left_is_what_it_follows() -> None:
    """Nobody without dorsiflexors lifts the foot by them; half of their strength fills the chamber."""
    none, half = (
        afo_sim.run(
            walker({"emg": {"full": "4 N*m"}, "rate": "500 Hz"}, duration="2.2 s", reference=None).set(
                {"patient.dorsiflexor_strength": strength}
            )
        )
        for strength in (0.0, 0.5)
    )
    assert half.ok and none.ok
    assert half["controller/activation"].max() > 0.3
    assert half["valve/dorsiflexor_inlet/coil"].max() == 1.0
    swing = (none["gait/phase"] > 0.7) & (none["gait/phase"] < 0.95)
    assert none["controller/activation"][swing].max() < 0.5 * half["controller/activation"][swing].max()
    assert np.all((half["controller/activation"] >= 0.0) & (half["controller/activation"] <= 1.0))


def test_a_threshold_in_another_unit_is_refused_before_the_first_step() -> None:
    with pytest.raises(InputError, match=r"emg\.full"):
        afo_sim.run(walker({"emg": {"full": "4 N"}}, duration="20 ms", reference=None))

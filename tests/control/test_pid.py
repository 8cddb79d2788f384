"""The PID law against a second one, its units, its valves, and what is refused."""

import math
from typing import Any

import numpy as np
import pytest
from control.samples import Sample

import afo_sim
from afo_sim.control.pid import Law, PidController
from afo_sim.control.tracking import OpenPeriods
from afo_sim.description import Pid, load

PERIOD = 0.01
SEATED = load("scenario", "seated")


def reference_pid(
    error: np.ndarray, measured: np.ndarray, band: float, ti: float, td: float, tf: float
) -> np.ndarray:
    """u = (e + ∫e/Ti − D)/band; D = Td s/(Tf s + 1) y by backward differences; written as a difference
    equation of the whole, without limits."""
    integral = np.cumsum(error) * PERIOD / ti
    derivative, filtered = np.zeros_like(error), 0.0
    alpha = tf / (tf + PERIOD)
    for k in range(1, len(error)):
        filtered = alpha * filtered + (1.0 - alpha) * (measured[k] - measured[k - 1]) / PERIOD
        derivative[k] = td * filtered
    found: np.ndarray = (error + integral - derivative) / band
    return found


def test_the_law_is_that_of_a_second_pid() -> None:
    random = np.random.default_rng(7)
    measured = np.cumsum(random.normal(size=300)) * 1e-3
    error = 0.02 * np.sin(np.arange(300) * 0.05) - measured
    law = Law(band=5.0, integral_time=0.8, derivative_time=0.1, derivative_filter=0.02, limit=1.0)
    found = [law(e, y, PERIOD) for e, y in zip(error, measured, strict=True)]
    expected = reference_pid(error, measured, 5.0, 0.8, 0.1, 0.02)
    assert np.abs(expected).max() < 1.0
    assert found == pytest.approx(expected, abs=1e-12)


def test_a_step_of_the_reference_gives_no_kick() -> None:
    with_derivative, without = Law(2.0, None, 0.5, 0.05, 1.0), Law(2.0, None, 0.0, 0.0, 1.0)
    for error in (0.0, 0.0, 1.0, 1.0):  # of a measurement that stays
        assert with_derivative(error, 0.3, PERIOD) == without(error, 0.3, PERIOD) == error / 2.0


def test_the_derivative_acts_against_the_movement() -> None:
    law = Law(2.0, None, 0.1, 0.0, 1.0)
    law(0.0, 0.0, PERIOD)
    assert law(0.0, 0.01, PERIOD) == pytest.approx(-0.1 * 1.0 / 2.0)  # 1 unit/s, upward


def test_the_integral_does_not_wind_up() -> None:
    """After 10 s at the limit, the output leaves it in the first period in which the error has turned."""
    law, wound = Law(1.0, 0.5, 0.0, 0.0, 1.0), 0.0
    for _ in range(1000):
        assert law(3.0, 0.0, PERIOD) == 1.0
        wound += 3.0 * PERIOD / 0.5
    assert wound > 50.0  # what a plain integral would have gathered, and then taken 10 s to lose
    assert law(-0.2, 0.0, PERIOD) < 0.0


def test_the_integral_is_free_again_below_the_limit() -> None:
    law = Law(1.0, 0.5, 0.0, 0.0, 1.0)
    found = [law(0.1, 0.0, PERIOD) for _ in range(100)]
    assert found == pytest.approx(0.1 + 0.1 * PERIOD * np.arange(1, 101) / 0.5)


def test_a_reset_forgets() -> None:
    law = Law(1.0, 0.5, 0.1, 0.0, 1.0)
    first = [law(0.1 * k, 0.1 * k, PERIOD) for k in range(5)]
    law.reset()
    assert [law(0.1 * k, 0.1 * k, PERIOD) for k in range(5)] == first


# --- valves


@pytest.mark.parametrize("output", [0.03, 0.37, 0.5, 1.0, -0.2, -1.0])
def test_the_share_of_open_periods_is_the_output(output: float) -> None:
    valves = OpenPeriods("a", "b", 0.0)
    commands = [valves(output) for _ in range(1000)]
    filled, vented = ("a", "b") if output > 0.0 else ("b", "a")
    opened = [c for c in commands if c[filled] == "inlet"]
    assert len(opened) == pytest.approx(1000 * abs(output), abs=1)
    assert all(command[vented] == "outlet" for command in opened)
    assert all(c == {"a": "shut", "b": "shut"} for c in commands if c not in opened)


def test_below_the_least_output_both_stay_shut() -> None:
    valves = OpenPeriods("a", None, 0.1)
    assert all(valves(0.09) == {"a": "shut"} for _ in range(100))
    assert any(valves(0.11) == {"a": "inlet"} for _ in range(10))


def test_nothing_is_owed_to_the_other_side() -> None:
    valves = OpenPeriods("a", "b", 0.0)
    valves(0.9)
    assert valves(-1.0) == {"a": "outlet", "b": "inlet"}


# --- in the loop


def sets(**pid: Any) -> dict[str, Any]:
    table: dict[str, Any] = {"lowers": "plantarflexor", "angle": {"proportional_band": "2 deg"}} | pid
    return {"timer": None, "duration": "6 s", "controller": {"rate": "100 Hz", "pid": table}}


def angle(**loop: Any) -> dict[str, Any]:
    return {"angle": {"proportional_band": "2 deg"} | loop}


def test_an_angle_is_held_and_what_is_told_is_what_acts() -> None:
    reference = {"table": [["0 s", "-3 deg"], ["3 s", "3 deg"]]}
    run = afo_sim.run("seated", sets(integral_time="1 s", **angle(reference=reference)))
    assert run.ok, run.status
    time, found = run["time"], np.degrees(run["ankle/angle"])
    assert np.degrees(run["controller/reference"][[0, -1]]) == pytest.approx([-3.0, 3.0])
    for end, expected in ((2.9, -3.0), (5.9, 3.0)):
        assert found[np.searchsorted(time, end)] == pytest.approx(expected, abs=0.5)
    # the error of a command is of the sample before it
    k = np.flatnonzero(time >= 3.0)[0]
    sample = run["controller/reference"][k] - run["ankle/angle"][k - 1]
    assert run["controller/error"][k] == pytest.approx(sample, abs=1e-12)


def test_a_pressure_of_one_chamber() -> None:
    """The other chamber is not touched: its valves stay shut, and it is empty."""
    reference = {"mean": "1.5 bar", "amplitude": "0.3 bar", "frequency": "0.2 Hz"}
    column = "chamber/dorsiflexor/pressure"
    loop = {"column": column, "proportional_band": "0.2 bar", "reference": reference}
    run = afo_sim.run("seated", sets(angle=None, lowers=None, pressure=loop))
    late = run["time"] > 2.0
    asked = 1.5e5 + 0.3e5 * np.sin(2.0 * math.pi * 0.2 * run["time"][late])
    assert run["controller/reference_pressure"][late] == pytest.approx(asked, abs=600.0)
    assert run[column][late] == pytest.approx(asked, abs=1.5e4)
    assert np.abs(run["chamber/plantarflexor/pressure"]).max() < 5e3


def test_a_moment_of_the_orthosis() -> None:
    loop = {"proportional_band": "1 N*m", "reference": {"mean": "1.5 N*m"}}
    run = afo_sim.run("seated", sets(angle=None, moment=loop))
    assert run["ankle/moment/orthosis"][-500:].mean() == pytest.approx(1.5, abs=0.3)
    assert run["controller/reference_moment"][0] == 1.5


def test_pressures_of_drives_are_mean_and_difference() -> None:
    described = Pid.model_validate(
        {
            "lowers": "plantarflexor",
            "angle": {"proportional_band": "10 deg", "reference": {"mean": "6 deg"}},
            "pressures": {"mean": "2 bar", "half_range": "1.5 bar"},
        }
    )
    driven = SEATED.set({"drive": {name: {"kind": "bang_bang"} for name in SEATED.orthosis.chamber}})

    controller = PidController(described, driven)
    assert controller(Sample(0.0, PERIOD, {"ankle/angle": math.radians(1.0)})) == pytest.approx(
        {"dorsiflexor": 2.75e5, "plantarflexor": 1.25e5}
    )
    assert controller.tell()["output"] == pytest.approx(0.5)


def test_an_error_within_the_dead_band_is_none() -> None:
    run = afo_sim.run("seated", sets(**angle(dead_band="20 deg", reference={"mean": "3 deg"})))
    assert not run["controller/output"].any()
    assert not run["valve/dorsiflexor_inlet/coil"].any()


@pytest.mark.parametrize(
    ("pid", "says"),
    [
        ({"raises": "dorsi"}, "no chamber 'dorsi'.*did you mean 'dorsiflexor'"),
        ({"lowers": "plantar"}, "pid.lowers.*did you mean 'plantarflexor'"),
        ({"lowers": "dorsiflexor"}, "lowers = 'dorsiflexor': is the chamber that raises too"),
        (angle(column="ankle/angel"), "pid.angle.column = 'ankle/angel'.*did you mean 'ankle/angle'"),
        (angle(column="ankle/velocity"), "is in rad/s, where rad are needed"),
        (angle(column="sensor/knee"), "sees no such column"),
        (angle(reference={"column": "gait/ankle_angle"}), "reference.column.*no such column"),
        (angle(proportional_band="2 N*m"), "does not convert to rad"),
        ({"moment": {"proportional_band": "1 N*m"}}, "moment.*conflicts with angle"),
        ({"angle": None}, "nothing is controlled"),
        ({"pressures": {"mean": "2 bar", "half_range": "2 bar"}}, "has no drive.*\\[drive.dorsiflexor\\]"),
    ],
)
def test_what_is_refused(pid: dict[str, Any], says: str) -> None:
    with pytest.raises(afo_sim.InputError, match=f"(?s){says}"):
        afo_sim.run("seated", sets(**pid))

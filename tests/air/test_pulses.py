"""Pulses of 5 to 30 ms: the air that they bring at any step, and what a valve's delays leave of them."""

import functools

import numpy as np
import pytest
from air.native_network import behind_valve
from scipy.integrate import solve_ivp

import afo_sim as afo
from afo_sim.description import load
from afo_sim.model import circuit_of
from afo_sim.model.air_checks import check_air_path, check_drives, too_short

BAR, AMBIENT, SUPPLY = 1e5, 101_325.0, 7e5  # Pa, absolute
VOLUME, RATIO, WARM = 30e-6, 0.3, 293.15
GAS, DENSITY = 287.05, 1.185
# Pressure step of one ideal pulse, 30 ml, 7 to 1 bar, isothermal, b = 0.3: C [dm³/(s·bar)] → [bar] after
# 5, 10, 20, 30 ms; derived apart from this package, to 0.01 bar
TABLE = {0.055: (0.06, 0.13, 0.26, 0.38), 0.39: (0.45, 0.91, 1.81, 2.69), 0.86: (1.00, 2.00, 3.84, 5.23)}
PULSES = (5.0, 10.0, 20.0, 30.0)  # ms
EVERY = [(c, ms, step) for c in TABLE for ms in PULSES for step in (1.0, 2.0)]


@functools.cache
def rise(
    c: float,
    pulse: float,
    step: float,
    start: float = 10.0,
    on: float = 0.0,
    off: float = 0.0,
    ramps: tuple[float, float] = (0.0, 0.0),
) -> float:
    """Pressure [bar] that a coil's pulse [ms] adds to 30 ml behind one valve of delays and ramps [ms], in a
    run."""
    valve = {
        "conductance": f"{c} dm^3/(s*bar)",
        "critical_ratio": str(RATIO),
        "opening_delay": f"{on} ms",
        "closing_delay": f"{off} ms",
        "opening_ramp": f"{ramps[0]} ms",
        "closing_ramp": f"{ramps[1]} ms",
    }
    isothermal = {"volume": "30 ml", "wall_conductance": "1 kW/K"}
    sets = behind_valve(valve, isothermal, [[f"{start} ms", f"{start + pulse} ms"]], "80 ms")
    supply = {"supply.pressure": f"{(SUPPLY - AMBIENT) / BAR:.6f} bar", "timestep": f"{step} ms"}
    run = afo.run("seated", sets | supply)
    return float(run["volume/v/pressure"][-1]) / BAR


def solved(c: float, seconds: float) -> float:
    """The same [bar] from ISO 6358 by an integrator of its own."""

    def slope(_: float, p: np.ndarray) -> list[float]:
        x = max((p[0] / SUPPLY - RATIO) / (1.0 - RATIO), 0.0)
        flow = c * 1e-8 * DENSITY * SUPPLY * np.sqrt(max(1.0 - x * x, 0.0))
        return [GAS * WARM * flow / VOLUME]

    end = solve_ivp(slope, (0.0, seconds), [AMBIENT], rtol=1e-9, atol=1e-3).y[0, -1]
    return float(end - AMBIENT) / BAR


@pytest.mark.parametrize(("c", "pulse", "step"), EVERY)
def test_one_ideal_pulse_brings_its_air(c: float, pulse: float, step: float) -> None:
    found = rise(c, pulse, step)
    assert found == pytest.approx(solved(c, 1e-3 * pulse), rel=0.01)
    assert found == pytest.approx(TABLE[c][PULSES.index(pulse)], rel=0.01, abs=0.006)  # printed to 0.01 bar


@pytest.mark.parametrize("start", [10.37, 11.0, 11.99])
@pytest.mark.parametrize("pulse", [0.3, 1.7, 5.3, 9.77])
def test_pulses_off_the_grid_of_steps_count_in_proportion(start: float, pulse: float) -> None:
    """Also those within one step."""
    for step in (1.0, 2.0):
        assert rise(0.39, pulse, step, start) == pytest.approx(solved(0.39, 1e-3 * pulse), rel=0.002)


@pytest.mark.parametrize("step", [0.5, 1.0, 3.0, 8.0])
def test_delays_cut_a_pulse(step: float) -> None:
    """On-delay 4 ms, off-delay 1 ms: a pulse of 10 ms is open for 7, one below 4 ms for none, at any step."""
    for pulse in (4.02, 5.0, 10.0):
        assert rise(0.39, pulse, step, on=4.0, off=1.0) == pytest.approx(
            solved(0.39, 1e-3 * (pulse - 3.0)), rel=0.002
        )
    for pulse in (2.0, 3.98):
        assert abs(rise(0.39, pulse, step, on=4.0, off=1.0)) < 1e-9


@pytest.mark.parametrize("step", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("ramps", [(3.0, 2.0), (0.0, 5.0), (6.5, 0.0)])
def test_ramps_open_a_pulse_in_part(step: float, ramps: tuple[float, float]) -> None:
    """The volume is held at T0, so that its pressure follows from ∫ opening dt alone: of a trapezium."""
    up, down = ramps
    for pulse in (2.0, 3.9, 4.5, 6.0, 9.77, 20.0):
        told = pulse - 3.0 if pulse >= 4.0 else 0.0  # time for which the seat is told to be open
        reached = min(told / up, 1.0) if up > 0.0 else float(told > 0.0)
        opened = told - reached * up + 0.5 * reached**2 * (up + down)
        found = rise(0.39, pulse, step, on=4.0, off=1.0, ramps=ramps)
        assert found == pytest.approx(solved(0.39, 1e-3 * opened), rel=0.002, abs=1e-9)


def test_longer_pulses_bring_more_air() -> None:
    rises = [rise(0.39, pulse, 1.0, on=4.0, off=1.0) for pulse in (3.0, 4.5, 5.0, 7.0, 10.0, 15.0, 20.0)]
    assert rises[0] == pytest.approx(0.0, abs=1e-9) and np.all(np.diff(rises) > 0.0)


# --- what is told -----------------------------------------------------------------------------------

SLOW = {"conductance": "0.055 dm^3/(s*bar)", "critical_ratio": "0.3", "closing_delay": "1 ms"}
SLOW |= {"opening_delay": "4 ms", "minimum_on_time": "8 ms"}
INLET = "orthosis.chamber.dorsiflexor.inlet"


def told(**sets: object) -> list[str]:
    return check_air_path(load("scenario", "seated", {INLET: SLOW} | sets))


def test_pulses_that_a_valve_does_not_answer_are_told() -> None:
    times = {"period": "1 s", "dorsiflexor": {"inlet": [["0 s", "3 ms"], ["0.5 s", "0.6 s"]]}}
    assert told(timer=times) == [
        "valve dorsiflexor_inlet: a pulse of 3 ms is shorter than its opening delay, 4 ms: it does not open"
    ]
    times["dorsiflexor"] = {"inlet": [["0 s", "6 ms"]]}
    (warning,) = told(timer=times)
    assert "a pulse of 6 ms is shorter than its minimum_on_time, 8 ms" in warning
    times["dorsiflexor"] = {"inlet": [["0 s", "5 ms"], ["0.995 s", "1 s"]]}  # one pulse over the period's end
    assert told(timer=times) == []


def test_phases_and_controllers_are_looked_at_too() -> None:
    walk = load("scenario", "walk-dropfoot-afo", {INLET: SLOW, "phases.dorsiflexor.inlet": [[0.6, 0.602]]})
    assert any("dorsiflexor_inlet: a pulse of" in warning for warning in check_air_path(walk))
    loop = {
        "pid": {"angle": {"proportional_band": "10 deg", "reference": {"mean": "5 deg"}}},
        "rate": "500 Hz",
    }
    assert any("a pulse of 2 ms is shorter" in w for w in told(timer=None, controller=loop))


def test_drives_give_no_pulse_below_the_minimum_on_time() -> None:
    sets = {INLET: SLOW, "drive.dorsiflexor": {"kind": "pwm", "period": "20 ms"}}
    scenario = load("scenario", "seated", sets)
    chamber = circuit_of(scenario.orthosis, drives=tuple(scenario.drive.items())).chambers[0]
    assert chamber.drive is not None and chamber.drive.row["least_on"] == pytest.approx(8e-3)
    assert not any("minimum_on_time" in warning for warning in check_drives(scenario)[1])
    own = load("scenario", "seated", sets | {"drive.dorsiflexor.least_on": "5 ms"})
    assert any("a pulse of 5 ms is shorter than its minimum_on_time" in w for w in check_drives(own)[1])


def test_pulses_are_told_from_the_delay_alone() -> None:
    valve = load("valve", "mha2")  # 2 ms
    assert "does not open" in too_short("x", valve, 1.99e-3)
    assert too_short("x", valve, 2.0e-3) == ""


@pytest.mark.parametrize("width", [30.0, 40.0, 60.0])
def test_a_hold_that_decays_opens_the_sooner_the_higher_the_pressure(width: float) -> None:
    """τ = 20 ms and p0 = 36 bar: 35.8 ms at 6 bar, 49.7 at 3; choked and isothermal, ṗ = −C ρ0 R T p/V."""
    valve = {"conductance": "0.05 dm^3/(s*bar)", "critical_ratio": str(RATIO), "opening_delay": "0 s"}
    valve |= {"closing_delay": "0 s", "hold_decay": "20 ms", "hold_pressure": "36 bar"}
    for start in (6.0, 3.0):
        volume = {"volume": "30 ml", "wall_conductance": "1 kW/K", "start_pressure": f"{start} bar"}
        sets = behind_valve(valve, volume, [["10 ms", f"{10.0 + width} ms"]], "120 ms")
        sets["orthosis.restriction.i"] |= {"upstream": "v", "downstream": "ambient"}
        end = afo.run("seated", sets | {"timestep": "1 ms"})["volume/v/pressure"][-1] / BAR
        opened = 1e-3 * max(width - 20.0 * np.log(36.0 / start), 0.0)
        rate = 0.05e-8 * DENSITY * GAS * WARM / VOLUME
        expected = (start + AMBIENT / BAR) * np.exp(-rate * opened) - AMBIENT / BAR
        assert end == pytest.approx(expected, abs=1e-3), start

"""Air before the first step: by pressure, by time, and what it must not change."""

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest

import afo_sim
from afo_sim import InputError, native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.description import load
from afo_sim.description.orthosis import Chamber
from afo_sim.model import Built, air_before, start_up, walking_start
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.model.prefill import STEP, Held, _pressure_at_rest, filled
from afo_sim.simulation.simulate import simulate

SHORT = "walk-dropfoot-afo-short"
EMPTY: dict[str, Any] = {"start": {}}
FAST = {"timestep": "4 ms", "duration": "3.7 s"}
VOLUME = 1e-4


def chamber(**changes: float) -> Chamber:
    return load("scenario", SHORT).orthosis.chamber["dorsiflexor"].model_copy(update=changes)


def rigid(pressure: float) -> float:
    return VOLUME


def widening(pressure: float) -> float:
    """A chamber that grows with its pressure as a muscle does."""
    return VOLUME * (2.0 - math.exp(-(pressure - AMBIENT_PRESSURE) / 2e5))


def begun(**told: str) -> dict[str, Any]:
    """The dorsiflexor's start as an override, in place of the scenario's own."""
    return {"start": {"dorsiflexor": told}}


def started(start: dict[str, Any]) -> tuple[Built, np.ndarray]:
    """A scenario at its first step: (built, act)."""
    built = build(start_up(load("scenario", SHORT, FAST | start)))
    rollout = simulate(built, schedule.controls(built)[:1])
    return built, rollout.rows["act"][0]


def of(built: Built, act: np.ndarray) -> np.ndarray:
    return native.read_held(built.model, act, built.index.chambers["dorsiflexor"])


# --- by time


def test_an_insulated_rigid_chamber_fills_by_the_first_law() -> None:
    """m c_v T = m0 c_v T0 + (m − m0) c_p T_supply: warm by up to γ."""
    found = filled(chamber(wall_conductance=0.0), 4e5, 0.4, rigid)
    empty = AMBIENT_PRESSURE * VOLUME / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
    warm = (empty + HEAT_CAPACITY_RATIO * (found.mass - empty)) / found.mass * AMBIENT_TEMPERATURE
    assert found.temperature == pytest.approx(warm, rel=1e-9)
    assert found.temperature > 1.1 * AMBIENT_TEMPERATURE


def test_choked_flow_fills_as_fast_as_the_norm_says() -> None:
    """ISO 6358: C ρ0 p while the chamber is below b times the supply, from the opening delay on."""
    one = chamber()
    time = one.inlet.opening_delay + 0.05
    found = filled(one, 4e5, time, rigid)
    assert found.pressure / (4e5 + AMBIENT_PRESSURE) < one.inlet.critical_ratio
    entered = found.mass - AMBIENT_PRESSURE * VOLUME / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
    assert entered == pytest.approx(one.inlet.conductance * 1.185 * (4e5 + AMBIENT_PRESSURE) * 0.05, rel=1e-9)


@pytest.mark.parametrize("volume", [rigid, widening])
@pytest.mark.parametrize("time", [0.05, 0.4, 1.5])
def test_half_the_step_changes_less_than_half_a_percent(
    time: float, volume: Callable[[float], float]
) -> None:
    coarse, fine = (filled(chamber(), 4e5, time, volume, step) for step in (STEP, 0.5 * STEP))
    assert coarse.mass == pytest.approx(fine.mass, rel=5e-3)
    assert coarse.pressure == pytest.approx(fine.pressure, rel=5e-3)


def test_a_widening_chamber_is_what_scipy_integrates() -> None:
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    from afo_sim.physics import sigma_rate, valve_flow

    one, supply = chamber(), 4e5 + AMBIENT_PRESSURE

    def rates(_: float, held: np.ndarray) -> list[float]:
        mass, sigma = held
        p = brentq(lambda q: q * widening(q) ** HEAT_CAPACITY_RATIO - sigma, 0.5 * AMBIENT_PRESSURE, 1e6)
        air = Held(mass, p, widening(p))
        flow = valve_flow(
            supply,
            AMBIENT_TEMPERATURE,
            p,
            air.temperature,
            1.0,
            one.inlet.conductance,
            one.inlet.critical_ratio,
        )
        return [flow, sigma_rate(air.temperature, air.volume, flow, 0.0, one.wall_conductance)]

    empty = AMBIENT_PRESSURE * VOLUME / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
    first = [empty, AMBIENT_PRESSURE * VOLUME**HEAT_CAPACITY_RATIO]
    time = 0.4 - one.inlet.opening_delay
    mass, sigma = solve_ivp(rates, (0.0, time), first, rtol=1e-8, atol=1e-14, max_step=0.01).y[:, -1]
    found = filled(one, 4e5, 0.4, widening)
    assert (found.mass, found.sigma) == (pytest.approx(mass, rel=2e-3), pytest.approx(sigma, rel=2e-3))


def test_a_valve_that_has_not_opened_fills_nothing() -> None:
    one = chamber()
    found = filled(one, 4e5, one.inlet.opening_delay, rigid)
    assert (found.pressure, found.temperature) == (AMBIENT_PRESSURE, pytest.approx(AMBIENT_TEMPERATURE))


def test_a_long_time_is_the_pressure_of_the_supply() -> None:
    long, full = started(begun(fill_time="30 s")), started(begun(pressure="3.5 bar"))
    assert of(*long) == pytest.approx(of(*full), rel=1e-3)


# --- in the scenario


def test_the_told_pressure_stands_at_ambient_temperature() -> None:
    built = build(start_up(load("scenario", SHORT, FAST | begun(pressure="2 bar"))))
    chambers = built.index.chambers
    with native.installed():
        state = walking_start(built, schedule.controls(built, 1)[0])
        data = native.scratch(built.model)
        mujoco.mj_setState(built.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        mass, sigma = native.read_held(built.model, data.act, chambers["dorsiflexor"])
        empty = native.read_held(built.model, data.act, chambers["plantarflexor"])
    pressure = 2e5 + AMBIENT_PRESSURE
    volume = (sigma / pressure) ** (1.0 / HEAT_CAPACITY_RATIO)
    assert pressure * volume / (mass * GAS_CONSTANT) == pytest.approx(AMBIENT_TEMPERATURE, rel=1e-9)
    volume = (empty[1] / AMBIENT_PRESSURE) ** (1.0 / HEAT_CAPACITY_RATIO)
    assert empty[0] == pytest.approx(AMBIENT_PRESSURE * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE))


def test_a_muscle_that_nothing_stretches_takes_up_air_at_one_pressure() -> None:
    """Its volume jumps where its pressure is above ambient: between both volumes all air is at ambient."""

    def volume(pressure: float) -> float:
        return 1e-4 if pressure > AMBIENT_PRESSURE else 5e-5

    found = _pressure_at_rest(volume, AMBIENT_PRESSURE * 7e-5**1.4, 1.4, 1.2 * AMBIENT_PRESSURE)
    assert found == pytest.approx(AMBIENT_PRESSURE, rel=1e-8)
    law = "orthosis.muscle.dorsiflexor.type.law"  # without a bladder it has no force without pressure
    own = {law: "chou_hannaford_1996", f"{law}s.chou_hannaford_1996": {}}
    run = afo_sim.run("walk-dropfoot-afo", FAST | own)
    assert run.ok, run.status


def test_a_pressure_above_the_supply_is_refused() -> None:
    with pytest.raises(InputError, match=r"start\.dorsiflexor\.pressure.*exceeds the supply"):
        load("scenario", SHORT, begun(pressure="3 bar") | {"supply.pressure": "2 bar"})


def test_the_air_before_the_first_step_is_that_of_the_chambers_beyond_empty_ones() -> None:
    empty, full = started(EMPTY), started(begun(pressure="3 bar"))
    assert air_before(*empty) == pytest.approx(0.0, abs=1e-12)
    # the plantarflexor's chamber is open in both; the cuff moves it by nothing
    assert air_before(*full) == pytest.approx(of(*full)[0] - of(*empty)[0], rel=1e-3)


@pytest.mark.parametrize("start", [begun(pressure="3.5 bar"), begun(fill_time="0.4 s")])
def test_it_lifts_the_first_stride_and_leaves_the_settled_one(start: dict[str, Any]) -> None:
    empty, full = (afo_sim.run(SHORT, FAST | more) for more in (EMPTY, start))
    first = "toe_clearance_stride_1"
    assert full.metrics[first] > empty.metrics[first]
    assert full.metrics["air_first_stride"] < empty.metrics["air_first_stride"]
    assert full.metrics["air_before_first_step"] > 0.1
    assert empty.metrics["air_before_first_step"] == pytest.approx(0.0, abs=1e-9)
    for name in ("toe_clearance", "air_per_stride", "orthosis_peak_dorsiflexion_torque"):
        assert full.metrics[name] == empty.metrics[name], name


@pytest.mark.parametrize(
    ("name", "sets"),
    [
        (SHORT, {"gait.settled": "walked"}),
        (SHORT, {"gait.variability": 0.03}),
        (SHORT, {"ground.mode": "contact", "timestep": "1 ms"}),
        (SHORT, {"gait.start_phase": 0.3}),
        ("walk-dropfoot-afo-timer", {}),
    ],
)
def test_every_kind_of_walk_begins_with_it(name: str, sets: dict[str, object]) -> None:
    run = afo_sim.run(name, FAST | sets | begun(pressure="3 bar"))
    assert run.ok, run.status
    # the muscles stand still half a step before: by that they move in the first row
    assert run["chamber/dorsiflexor/pressure"][0] == pytest.approx(3e5, rel=0.02)
    assert run.metrics["air_before_first_step"] > 0.1

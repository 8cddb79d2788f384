"""Air of networks before the first step: against the filling of a chamber alone, and a second integration."""

from typing import Any

import mujoco
import numpy as np
import pytest

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.description import load
from afo_sim.model import Built, cooled, two_strides
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.model.prefill import _pressure_at_rest, prefill, prefill_network
from afo_sim.model.start import _at_first_posture
from afo_sim.physics import valve_flow

TUBE = {
    "orthosis.chamber.dorsiflexor.tube": "pun_4x2_5",
    "orthosis.chamber.dorsiflexor.tube_length": "2 m",
    "orthosis.chamber.dorsiflexor.tube_volume": "0 ml",
}


def filled(time: str, sets: dict[str, Any], fill: Any = prefill) -> tuple[Built, mujoco.MjData]:
    scenario = load("scenario", "walk-dropfoot-afo", {"start": {"dorsiflexor": {"fill_time": time}}} | sets)
    built = build(two_strides(scenario))
    data = _at_first_posture(built)
    data.ctrl[:] = schedule.controls(built)[0]
    fill(built, data)
    return built, data


def air(built: Built, data: mujoco.MjData) -> np.ndarray:
    return native.read_held(built.model, data.act, built.index.chambers["dorsiflexor"])


@pytest.mark.parametrize("time", ["0.05 s", "0.3 s", "1.5 s"])
def test_a_chamber_alone_is_filled_alike_both_ways(time: str) -> None:
    with native.installed():
        alone, stepped = (air(*filled(time, {}, fill)) for fill in (prefill, prefill_network))
    assert stepped == pytest.approx(alone, rel=1e-2)


def test_a_tube_and_its_muscles_hold_what_a_second_integration_says() -> None:
    """Valve, end of the tube, tube, muscles: scipy, with the volume of muscles at rest by its pressure."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    time = 0.4
    with native.installed():
        built, data = filled(f"{time} s", TUBE)
        model, chamber = built.model, built.index.chambers["dorsiflexor"]
        found = {chamber: air(built, data).copy()}
        end = built.index.volumes["dorsiflexor_valve_end"]
        found[end] = native.read_held(model, data.act, end).copy()
        gauges, rooms = np.linspace(0.0, 4e5, 33), []
        for gauge in gauges:
            native.fill_chambers(model, data, {chamber: gauge})
            rooms.append(float(native.read_flows(model, data.userdata, chamber).volume))
    described = built.scenario.orthosis.chamber["dorsiflexor"]
    inlet, tube, supply = described.inlet, described.tube, built.scenario.supply.pressure + AMBIENT_PRESSURE
    half, gamma = 0.5 * tube.volume(described.tube_length), HEAT_CAPACITY_RATIO

    def room(p: float) -> float:
        return float(np.interp(p - AMBIENT_PRESSURE, gauges, rooms))

    def rates(_: float, x: np.ndarray) -> list[float]:
        p1 = x[1] / half**gamma
        p2 = brentq(lambda p: p * room(p) ** gamma - x[3], 0.9 * AMBIENT_PRESSURE, 6e5)
        t1, t2 = p1 * half / (x[0] * GAS_CONSTANT), p2 * room(p2) / (x[2] * GAS_CONSTANT)
        into = valve_flow(supply, AMBIENT_TEMPERATURE, p1, t1, 1.0, inlet.conductance, inlet.critical_ratio)
        length = described.tube_length or 0.0
        on = valve_flow(p1, t1, p2, t2, 1.0, tube.conductance(length), tube.critical_ratio(length))
        carried = gamma * GAS_CONSTANT * on * (t1 if on > 0.0 else t2)
        heat = (gamma - 1.0) * described.wall_conductance * (AMBIENT_TEMPERATURE - t2)
        entering = gamma * GAS_CONSTANT * into * AMBIENT_TEMPERATURE
        lifted = half ** (gamma - 1.0) * (entering - carried), room(p2) ** (gamma - 1.0) * (carried + heat)
        return [into - on, lifted[0], on, lifted[1]]

    first = []
    for volume in (half, room(AMBIENT_PRESSURE)):
        mass = AMBIENT_PRESSURE * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
        first += [mass, AMBIENT_PRESSURE * volume**gamma]
    scale = np.array(first)
    passed = time - inlet.opening_delay
    told = solve_ivp(rates, (0.0, passed), first, method="LSODA", rtol=1e-6, atol=1e-8 * scale)
    end_mass, end_sigma, mass, sigma = told.y[:, -1]
    assert found[chamber] == pytest.approx([mass, sigma], rel=1e-2)
    assert found[chamber][0] + found[end][0] == pytest.approx(mass + end_mass, rel=2e-3)
    # the tube's end is as before the muscles came to rest, which lowers the pressure behind it by as much
    assert found[end] == pytest.approx([end_mass, end_sigma], rel=2e-2)


def test_what_is_not_filled_is_as_it_begins() -> None:
    with native.installed():
        built, data = filled("0.3 s", TUBE)
        model = built.model
        other = native.read_air(model, data.act, data.userdata, built.index.chambers["plantarflexor"])
        assert float(other.absolute_pressure) == pytest.approx(AMBIENT_PRESSURE, rel=1e-9)
        mujoco.mj_forward(model, data)
        valves = [native.read_opening(model, data.userdata, v) for v in built.index.valves.values()]
    assert not np.any(valves) and data.time == 0.0


def at_rest(built: Built, data: mujoco.MjData, gauge: dict[int, float]) -> np.ndarray:
    native.fill_chambers(built.model, data, gauge)
    return np.array([float(native.read_flows(built.model, data.userdata, k).volume) for k in gauge])


@pytest.mark.slow
@pytest.mark.parametrize(("delay", "step", "bar"), [(70, 1.0, 1.5), (35, 0.5, 6.0), (100, 1.0, 1.0)])
def test_a_minute_fills_to_the_supply_whatever_step_and_delay(delay: int, step: float, bar: float) -> None:
    """Muscles at rest at the supply's pressure, their air as warm as the room."""
    sets = {"orthosis": "s1_waist", "supply.pressure": f"{bar} bar", "timestep": f"{step} ms"}
    late = {"orthosis.chamber.dorsiflexor.inlet.opening_delay": f"{delay} ms"}
    with native.installed():
        built, data = filled("60 s", sets | late)
        found = air(built, data).copy()
        room = at_rest(built, data, {built.index.chambers["dorsiflexor"]: bar * 1e5})[0]
    p = bar * 1e5 + AMBIENT_PRESSURE
    full = [p * room / (GAS_CONSTANT * AMBIENT_TEMPERATURE), p * room**HEAT_CAPACITY_RATIO]
    assert found == pytest.approx(full, rel=1e-3)


def test_muscles_that_begin_to_widen_rest_with_what_their_chambers_hold() -> None:
    """At 1.2 to 1.6 bar V grows as p³; both chambers pull on one soft cuff."""
    start = {"start": {name: {"fill_time": "2.5 s"} for name in ("dorsiflexor", "plantarflexor")}}
    sets = {"orthosis": "s1_waist", "supply.pressure": "1.5 bar", "orthosis.anchor.shank.stiffness": "1 kN/m"}
    with native.installed():
        built, data = filled("2.5 s", sets | start)
        model, chambers = built.model, [*built.index.chambers.values()]
        sigma = [float(native.read_held(model, data.act, k)[1]) for k in chambers]
        told = np.array([native.read_air(model, data.act, data.userdata, k) for k in chambers])[:, 2]
        rooms = at_rest(built, data, dict(zip(chambers, told - AMBIENT_PRESSURE, strict=True)))
        assert told * rooms**HEAT_CAPACITY_RATIO == pytest.approx(sigma, rel=1e-4)
        native.fill_chambers(model, data, {chambers[0]: 1.3e5})
        assert cooled(model, data, chambers[0], air(built, data)[0]) == pytest.approx(231325.0, rel=1e-4)


def test_muscles_that_snap_to_three_times_their_volume_hold_nothing_between() -> None:
    with pytest.raises(native.KernelFailure, match="no pressure was found"):
        _pressure_at_rest(lambda p: 1e-4 if p < 1.5e5 else 3e-4, 30.0, 1.0, AMBIENT_PRESSURE)

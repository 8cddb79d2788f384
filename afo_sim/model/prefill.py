"""Air in the chambers before the first step: filled while standing, by pressure or by time.

A chamber that is filled for a time is integrated from ambient air, with mass and σ = p V^γ as its states:

    ṁ = ṁ_in        σ̇ as `pneumatics.sigma_rate`        p V(p)^γ = σ

The posture is that of the first step. V(p) is the volume of muscles at rest at their own length, on the cuff
that gives way under them. Behind tubes, restrictions or a source that sags the whole network is stepped
instead (`prefill_network`).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.description.orthosis import Chamber
from afo_sim.model.air_path import SOURCE
from afo_sim.model.build import Built
from afo_sim.model.periodic import beyond_chambers
from afo_sim.model.supply_and_timer import OFF
from afo_sim.physics import laminar_slope, sigma_rate, valve_flow

LOOK = 0.064  # between two looks at whether a network is full [s]


def prefill_network(built: Built, data: mujoco.MjData) -> None:
    """Put the air into chambers and volumes with which the scenario starts to walk."""
    model, index, scenario = built.model, built.index, built.scenario
    told = scenario.start.chambers if scenario.start is not None else {}
    gauge = {index.chambers[k]: s.pressure for k, s in told.items() if s.pressure is not None}
    times = {name: start.fill_time for name, start in told.items() if start.fill_time is not None}
    native.fill_chambers(model, data, gauge)
    if not times:
        return
    held = _stepped(built, data, times)
    _rest(model, data, gauge, {index.chambers[name]: held[index.chambers[name]] for name in times})
    for k in index.volumes.values():
        native.write_held(model, data.act, k, held[k])


def _rest(
    model: mujoco.MjModel, data: mujoco.MjData, gauge: dict[int, float], held: dict[int, np.ndarray]
) -> None:
    """Muscles at rest with what chambers hold, others at their pressures: mass and σ stay as they widen."""
    gamma = native.gas_of(model, next(iter(held))).heat_capacity_ratio
    absolute = {k: float(native.read_air(model, data.act, data.userdata, k).absolute_pressure) for k in held}
    for _ in range(TRIES):
        last = dict(absolute)
        for k, (_, sigma) in held.items():
            others = gauge | {other: p - AMBIENT_PRESSURE for other, p in absolute.items()}
            absolute[k] = _pressure_at_rest(_volume_of(model, data, k, others), sigma, gamma, absolute[k])
        if all(abs(absolute[k] / p - 1.0) < SAME for k, p in last.items()):
            break
    else:
        raise native.KernelFailure(UNBALANCED)
    native.fill_chambers(model, data, gauge | {k: p - AMBIENT_PRESSURE for k, p in absolute.items()})
    for k, air in held.items():
        native.write_held(model, data.act, k, air)


def _stepped(built: Built, data: mujoco.MjData, times: dict[str, float]) -> dict[int, np.ndarray]:
    """Mass and σ of every chamber and volume after the longest time; but for `userdata` all stays."""
    model, index, step = built.model, built.index, built.model.opt.timestep
    before = {name: getattr(data, name).copy() for name in ("qpos", "qvel", "act", "ctrl")}
    time, nodes = data.time, (*index.chambers.values(), *index.volumes.values())
    inlets = [index.valves[f"{name}_inlet"] for name in times]
    data.ctrl[list(index.valves.values())] = 0.0
    data.ctrl[list(index.drives.values())] = OFF
    data.qvel[:] = 0.0
    steps, look = math.ceil(max(times.values()) / step), max(round(LOOK / step), 1)
    last: np.ndarray | float = math.inf
    for k in range(steps):
        left = (steps - k) * step
        data.ctrl[inlets] = np.clip([(t - left) / step + 1.0 for t in times.values()], 0.0, 1.0)
        mujoco.mj_step(model, data)
        data.qpos[:], data.qvel[:] = before["qpos"], 0.0
        if (k + 1) % look or not all(native.read_opening(model, data.userdata, v) > 0.0 for v in inlets):
            continue
        now = np.array([native.read_held(model, data.act, k) for k in nodes])
        if np.max(np.abs(now / last - 1.0)) * max(left, 1.0) < STILL * LOOK:
            break
        last = now
    held = {k: native.read_held(model, data.act, k).copy() for k in nodes}
    for name, values in before.items():
        getattr(data, name)[:] = values
    data.time = time
    return held


STEP = 0.025  # of the filling at first; half of it changes air and pressure by less than 0.1 % [s]
SLOWER = 0.25  # time from which on it grows with the time that has passed [s]
STABLE = 0.8  # of the time in which a chamber follows its supply, or its wall: a step is no longer [-]
SAME = 1e-5  # relative residual of the pressure, or of the pressure at rest
JUMP = 1e-9  # relative change of ambient pressure over which a muscle that nothing stretches takes up air
TRIES = 60  # of a pressure at rest; each halves its residual, or its bounds once there are two
CLOSE = 2e-3  # relative change of the pressure over which the volume follows as it did before
FLAT = 1e-5  # relative change of the pressure below which it does not tell how the volume follows
STILL = 1e-4  # relative change until the end, or in 1 s, below which a chamber, or a network, is full [-]
UNBALANCED = (
    "no pressure was found at which the muscles rest with the air that they hold before the first step"
)

Volume = Callable[[float], float]  # absolute pressure [Pa] → volume [m³]


@dataclass(frozen=True)
class Held:
    """The air of a chamber: mass [kg], absolute pressure [Pa], volume [m³]."""

    mass: float
    pressure: float
    volume: float

    @property
    def temperature(self) -> float:
        """Of the air [K]."""
        return self.pressure * self.volume / (self.mass * GAS_CONSTANT)

    @property
    def sigma(self) -> float:
        """p V^γ [Pa·m^(3γ)]."""
        return float(self.pressure * self.volume**HEAT_CAPACITY_RATIO)


def prefill(built: Built, data: mujoco.MjData) -> None:
    """Put the air into the chambers with which the scenario starts to walk."""
    model, scenario = built.model, built.scenario
    if beyond_chambers(scenario):
        prefill_network(built, data)
        return
    told = scenario.start.chambers if scenario.start is not None else {}
    actuators = {built.index.chambers[name]: start for name, start in told.items()}
    gauge = {k: start.pressure for k, start in actuators.items() if start.pressure is not None}
    names = {actuator: name for name, actuator in built.index.chambers.items()}
    warm = {}
    for actuator, start in actuators.items():
        if start.fill_time is None:
            continue
        # one after the other: the next one fills beside those that are full
        chamber = scenario.orthosis.chamber[names[actuator]]
        volume = _volume_of(model, data, actuator, gauge)
        warm[actuator] = filled(chamber, scenario.supply.pressure, start.fill_time, volume)
        gauge[actuator] = warm[actuator].pressure - AMBIENT_PRESSURE
    native.fill_chambers(model, data, gauge)
    for actuator, held in warm.items():
        there = float(native.read_flows(model, data.userdata, actuator).volume)
        mass = held.pressure * there / (GAS_CONSTANT * held.temperature)
        sigma = held.pressure * there**HEAT_CAPACITY_RATIO
        native.write_held(model, data.act, actuator, np.array([mass, sigma]))


def filled(chamber: Chamber, supply: float, time: float, volume: Volume, step: float = STEP) -> Held:
    """The air of a chamber whose inlet valve's coil has had current for a time, from ambient air."""
    inlet, source = chamber.inlet, supply + AMBIENT_PRESSURE
    empty = volume(AMBIENT_PRESSURE)
    held = Held(AMBIENT_PRESSURE * empty / (GAS_CONSTANT * AMBIENT_TEMPERATURE), AMBIENT_PRESSURE, empty)
    left = time - inlet.opening_delay - 0.5 * inlet.opening_ramp  # a ramp lets half of its air in
    if left <= 0.0 or supply <= 0.0:
        return held
    stiff = laminar_slope(inlet.conductance, inlet.critical_ratio) * HEAT_CAPACITY_RATIO * GAS_CONSTANT
    # known: where the volume was last solved for; gives: d ln V/d ln p before it
    passed, known, gives, begun = 0.0, held, 0.0, False

    def rates(air: Held) -> tuple[float, float]:
        """Of mass and σ."""
        flow = valve_flow(
            source, AMBIENT_TEMPERATURE, air.pressure, air.temperature, 1.0, inlet.conductance,
            inlet.critical_ratio,
        )  # fmt: skip
        into, out = max(flow, 0.0), max(-flow, 0.0)
        wall = chamber.wall_conductance + chamber.wall_conductance_by_flow * into
        return flow, sigma_rate(air.temperature, air.volume, into, out, wall)

    while passed < left:
        longest = STABLE * min(
            held.volume / (stiff * held.temperature),  # the supply's, and the wall's
            held.mass * GAS_CONSTANT / ((HEAT_CAPACITY_RATIO - 1.0) * max(chamber.wall_conductance, 1e-9)),
        )
        h = min(step * max(1.0, passed / SLOWER), longest, left - passed)
        passed = left if h == left - passed else passed + h
        flow, rise = rates(held)
        if max(abs(flow) / held.mass, abs(rise) / held.sigma) * max(left - passed, 1.0) < STILL:
            break
        half = _given_way(held, held.sigma + 0.5 * h * rise, held.mass + 0.5 * h * flow, gives)
        flow, rise = rates(half)
        guess = _given_way(held, held.sigma + h * rise, held.mass + h * flow, gives)
        held = guess
        if begun and abs(guess.pressure / known.pressure - 1.0) < CLOSE:
            continue
        # The air at the pressure at which its volume at rest holds its σ
        sigma = guess.sigma
        pressure = _pressure_at_rest(volume, sigma, HEAT_CAPACITY_RATIO, guess.pressure, gives)
        begun, held = True, Held(guess.mass, pressure, (sigma / pressure) ** (1.0 / HEAT_CAPACITY_RATIO))
        pressed = math.log(held.pressure / known.pressure)
        if abs(pressed) > FLAT:
            gives = max(math.log(held.volume / known.volume) / pressed, 0.0)
        known = held
    return held


def _given_way(held: Held, sigma: float, mass: float, gives: float) -> Held:
    """The air with another σ and mass, where its volume gives way as before."""
    ratio = (sigma / held.sigma) ** (1.0 / (1.0 + HEAT_CAPACITY_RATIO * gives))
    return Held(mass, held.pressure * ratio, held.volume * ratio**gives)


def _pressure_at_rest(volume: Volume, held: float, power: float, guess: float, gives: float = 0.0) -> float:
    """Absolute pressure p at which a volume at rest holds p V(p)^power = held [Pa]."""
    log_p, last_p, last_v, before = math.log(guess), math.nan, math.nan, math.inf
    low, high, wanted = -math.inf, math.inf, math.log(held)
    for _ in range(TRIES):
        log_v = math.log(volume(math.exp(log_p)))
        left = wanted - log_p - power * log_v
        if abs(left) < SAME or (high - low < JUMP and abs(log_p - math.log(AMBIENT_PRESSURE)) < SAME):
            return math.exp(log_p)
        low, high = (log_p, high) if left > 0.0 else (low, log_p)
        if abs(log_p - last_p) > FLAT:  # never of no number
            gives = max((log_v - last_v) / (log_p - last_p), 0.0)
        last_p, last_v = log_p, log_v
        log_p += left / (1.0 + power * gives)
        if not low < log_p < high or (abs(left) > 0.5 * before and high - low < math.inf):
            log_p = 0.5 * (low + high)
        before = abs(left)
    raise native.KernelFailure(UNBALANCED)


def _volume_of(model: mujoco.MjModel, data: mujoco.MjData, actuator: int, others: dict[int, float]) -> Volume:
    """The volume at rest of a chamber's actuator by its pressure, beside others at theirs."""
    native.fill_chambers(model, data, others)
    return native.volume_at_rest(model, data, actuator)


def cooled(model: mujoco.MjModel, data: mujoco.MjData, actuator: int, mass: float) -> float:
    """Absolute pressure at which a chamber at rest holds a mass [kg] at ambient temperature [Pa]."""
    held = mass * native.gas_of(model, actuator).constant * AMBIENT_TEMPERATURE
    return _pressure_at_rest(_volume_of(model, data, actuator, {}), held, 1.0, AMBIENT_PRESSURE)


def ambient_mass(built: Built, data: mujoco.MjData) -> float:
    """Air in a posture, all at ambient pressure and temperature [kg]; callbacks installed."""
    model = built.model
    native.fill_chambers(model, data, 0.0)
    in_chambers = sum(native.read_held(model, data.act, k)[0] for k in built.index.chambers.values())
    rigid = ((native.room_of(model, k), native.gas_of(model, k)) for k in _volumes(built))
    return float(in_chambers + sum(native.air_at(0.0, room, gas).mass for room, gas in rigid))


def held_mass(built: Built, act: np.ndarray) -> float:
    """Air in all chambers and volumes in a state `act` (na,) [kg]; a compressor's tank is not in it."""
    nodes = (*built.index.chambers.values(), *_volumes(built))
    return float(sum(native.read_held(built.model, act, k)[0] for k in nodes))


def _volumes(built: Built) -> list[int]:
    """Actuators of rigid volumes behind the source."""
    return [k for name, k in built.index.volumes.items() if name != SOURCE]

"""Whether pressure drives fit their valves, their chamber and the time step."""

import math
from collections.abc import Callable, Iterator

import numpy as np

from afo_sim.common import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    STANDARD_DENSITY,
    InputError,
    in_unit,
)
from afo_sim.description import Drive, Orthosis, Scenario
from afo_sim.model.air_checks import too_short
from afo_sim.model.chamber_volume import least_volume
from afo_sim.model.pneumatic_circuit import shortest_pulse

SAMPLED = 2.0  # rate × period beyond which an integrator that is corrected once a period swings
FINE = 64.0  # a step by so much shorter is taken for continuous
HALVINGS = 40  # of a search for what would do


def check_drives(scenario: Scenario) -> tuple[dict[str, float], list[str]]:
    """Rate × time step of the drives' loops, and warnings; refuse a pulse train faster than the step."""
    numbers, warnings = [], []
    for name, drive in scenario.drive.items():
        rate = fastest_rise(scenario.orthosis, name, scenario.supply.pressure)
        if drive.kind == "pwm" and drive.period < scenario.timestep * (1.0 - 1e-9):
            raise InputError(
                "is shorter than the time step",
                field=f"drive.{name}.period",
                value=f"{in_unit(drive.period, 's', 'ms'):g} ms",
                allowed=f"at least {in_unit(scenario.timestep, 's', 'ms'):g} ms, or a shorter timestep",
            )
        said = [
            *_idle(drive),
            *_short(drive, scenario.orthosis, name),
            *CHECKS[drive.kind](drive, rate, scenario, name),
        ]
        warnings += [f"drive of chamber {name!r}: {text}" for text in said]
        if drive.kind != "bang_bang":
            numbers.append(scenario.timestep * rate / drive.full_at)
    return ({"drive": max(numbers)} if numbers else {}), warnings


def fastest_rise(orthosis: Orthosis, chamber: str, supply: float) -> float:
    """The fastest rate of a chamber's pressure through a fully open valve [Pa/s]."""
    described = orthosis.chamber[chamber]
    conductance = max(described.inlet.conductance, described.vent.conductance)
    flow = conductance * STANDARD_DENSITY * (supply + AMBIENT_PRESSURE)
    stiff = HEAT_CAPACITY_RATIO * GAS_CONSTANT * AMBIENT_TEMPERATURE
    return stiff * flow / least_volume(orthosis, chamber)


def _idle(drive: Drive) -> Iterator[str]:
    if drive.idle:
        yield f"{', '.join(drive.idle)} changes nothing in a drive of kind {drive.kind}"


def _short(drive: Drive, orthosis: Orthosis, name: str) -> Iterator[str]:
    """Pulses that the drive gives, and that are too short for its valves."""
    chamber = orthosis.chamber[name]
    shortest = drive.shortest_pulse(shortest_pulse(chamber))
    if drive.kind == "regulator" or (drive.least_on is None and shortest < drive.period):
        return
    for side, valve in (("inlet", chamber.inlet), ("outlet", chamber.outlet)):
        if valve is not None and (text := too_short(f"{name}_{side}", valve, shortest)):
            yield text


def _bang_bang(drive: Drive, rate: float, scenario: Scenario, name: str) -> Iterator[str]:
    """An open valve moves the pressure on until it is shut; it must not come to where the other opens."""
    chamber = scenario.orthosis.chamber[name]
    shuts = max(chamber.inlet.closing_delay, chamber.vent.closing_delay)
    late = shuts + scenario.timestep  # it is looked at once a step
    swing = rate * (late + drive.filter_time)
    if swing > drive.dead_band + drive.releases_at:
        share = 1.0 + (drive.releases_at / drive.dead_band if drive.dead_band > 0.0 else 0.0)
        yield (
            f"while an open valve shuts, the pressure may move on by {1e-5 * swing:.2g} bar, so that the "
            f"other valve opens again and again; a dead_band of {1e-5 * swing / share:.2g} bar would do"
        )


def _pwm(drive: Drive, rate: float, scenario: Scenario, name: str) -> Iterator[str]:
    chamber = scenario.orthosis.chamber[name]
    opening = max(chamber.inlet.opening_delay, chamber.vent.opening_delay)
    if drive.period <= opening:
        yield (
            f"its period is not longer than the valves' opening delay, {in_unit(opening, 's', 'ms'):g} ms: "
            "no pulse opens them"
        )
    swings = rate * drive.period / drive.full_at
    if swings > SAMPLED:
        yield (
            "the pressure may swing from pulse to pulse: its period is too long for this valve and full_at; "
            f"{in_unit(drive.period * SAMPLED / swings, 's', 'ms'):.2g} ms, or a full_at of "
            f"{1e-5 * drive.full_at * swings / SAMPLED:.2g} bar would do"
        )
    # the output of one period moves that of the next by −T_d ṗ/e_full of itself: beyond 1 that grows
    seen = 1.0 if drive.filter_time <= 0.0 else -math.expm1(-drive.period / drive.filter_time)
    kick = seen * rate * drive.derivative_time / drive.full_at
    if kick > 1.0:
        yield (
            "the pressure may swing from pulse to pulse: its derivative alone makes of each pulse a longer "
            "one of the other valve; a derivative_time of "
            f"{in_unit(drive.derivative_time / kick, 's', 'ms'):.2g} ms would do"
        )


def _regulator(drive: Drive, rate: float, scenario: Scenario, name: str) -> Iterator[str]:
    step = scenario.timestep
    if _damped(drive, rate, step):
        return
    gentle = _most(lambda factor: _damped(drive, rate / factor, step))
    text = f"the pressure may swing; a full_at of {1e-5 * drive.full_at * gentle:.2g} bar would do"
    if _damped(drive, rate, step / FINE):
        enough = step / _most(lambda factor: _damped(drive, rate, step / factor))
        text += f", or a timestep of {in_unit(enough, 's', 'ms'):.2g} ms"
    yield text


CHECKS = {"bang_bang": _bang_bang, "pwm": _pwm, "regulator": _regulator}


def _most(good: Callable[[float], bool]) -> float:
    """The least factor from 1 on that is good, where larger ones are good too."""
    low, high = 1.0, 2.0
    while not good(high) and high < 1e9:
        low, high = high, 2.0 * high
    for _ in range(HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if good(middle) else (middle, high)
    return high


def _damped(drive: Drive, rate: float, step: float) -> bool:
    """Whether the loop of PID, transducer, proportional valve and chamber comes to rest by itself."""
    gain, valve = step * rate / drive.full_at, -math.expm1(-2.0 * math.pi * drive.bandwidth * step)
    low = 1.0 if drive.filter_time <= 0.0 else -math.expm1(-step / drive.filter_time)
    # rows and columns: p, y, o, I
    reading = np.array([low, 1.0 - low, 0.0, 0.0])
    change = reading - np.array([0.0, 1.0, 0.0, 0.0])
    kept = np.array([0.0, 0.0, 0.0, 1.0])
    integral = kept if drive.integral_time is None else kept - step / drive.integral_time * reading
    output = integral - reading - drive.derivative_time / step * change
    pressure = np.array([1.0, 0.0, gain, 0.0])
    opening = np.array([0.0, 0.0, 1.0 - valve, 0.0]) + valve * output
    matrix = np.array([pressure, reading, opening, integral])
    if drive.integral_time is None:
        matrix = matrix[:3, :3]
    return bool(np.abs(np.linalg.eigvals(matrix)).max() <= 1.0 + 1e-9)

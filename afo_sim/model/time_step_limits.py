"""Whether a time step is short enough: numbers of air and friction."""

import functools
import math

import mujoco
import numpy as np

from afo_sim.common import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    InputError,
    Notice,
    in_unit,
)
from afo_sim.description import Orthosis, Scenario
from afo_sim.model.air_checks import check_drives
from afo_sim.model.air_path import least_volume
from afo_sim.model.mounting import Index, sweep_ankle
from afo_sim.physics import FRICTIONS, laminar_slope

# Of rate × time step of a chamber's air. Measured on S1's muscles at 1 and 2 ms against 20 µs, filled and
# vented through ideal valves of up to 40 dm³/(s·bar): up to 6 pressures are within 0.7 % of the supply's and
# moments within 0.5 % of their swing; from 8 on pressures are up to 2.4 % off, moments 2 % and, at 50, 5 %.
# What errs is the muscles' volume, which moves on once in a step.
AIR_ACCURATE = 6.0
LONGEST_STEP = 0.01  # of any model [s]
FRICTION_LIMIT = 0.5  # of rate × time step of friction that falls with speed


def check_stability(
    model: mujoco.MjModel, index: Index, scenario: Scenario
) -> tuple[dict[str, float], list[str]]:
    """Rate × time step of the air and of friction; refuse or warn where the step is too long."""
    orthosis, friction = scenario.orthosis, 0.0
    falling = falling_frictions(orthosis, scenario.supply.pressure)
    if falling.any():  # the largest over the range of motion
        _, arm, inertia = sweep_ankle(model, index, np.linspace(*orthosis.range_of_motion, 9))
        friction = float(np.max(scenario.timestep * (arm**2 @ falling) / inertia))
    check_friction(friction, scenario.timestep)
    air, warnings = check_air(orthosis, scenario.timestep)
    drives, of_drives = check_drives(scenario)
    return {"air": air, "friction": friction} | drives, [*warnings, *of_drives]


def check_longest(step: float) -> None:
    """Refuse a time step [s] that is longer than a scenario's may be."""
    if step > LONGEST_STEP * (1.0 + 1e-9):
        raise _too_long("muscles and valves move too fast", step, LONGEST_STEP / 0.99)


def check_friction(friction: float, step: float) -> None:
    """Refuse a time step [s] that is too long for its number of friction, rate × time step."""
    if friction > FRICTION_LIMIT:
        enough = step * FRICTION_LIMIT / friction
        raise _too_long("friction falls too fast with speed", step, enough)


@functools.lru_cache(maxsize=4)  # cases of a sweep share it
def check_air(orthosis: Orthosis, step: float) -> tuple[float, tuple[Notice, ...]]:
    """Rate × time step [s] of the chambers' air, and warnings where it makes a run inaccurate."""
    air, warnings = 0.0, list[Notice]()
    for name, chamber in orthosis.chamber.items():
        # Fastest rate: laminar flow of tube, quick exhaust or valves, heat to the wall [1/s]
        volume = least_volume(orthosis, name)
        flow = sum(laminar_slope(v.conductance, v.critical_ratio) for v in (chamber.inlet, chamber.vent))
        if chamber.tube is not None and chamber.tube_length is not None:
            tube, length = chamber.tube, chamber.tube_length
            flow = laminar_slope(tube.conductance(length), tube.critical_ratio(length))
        if (quick := chamber.quick_exhaust) is not None:  # one of its ways is open
            widest = max(quick.conductance, quick.exhaust_conductance)
            flow = laminar_slope(widest, quick.critical_ratio)
        mass = AMBIENT_PRESSURE * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
        heat = chamber.wall_conductance / (mass * GAS_CONSTANT / (HEAT_CAPACITY_RATIO - 1.0))
        stiff = HEAT_CAPACITY_RATIO * GAS_CONSTANT * AMBIENT_TEMPERATURE / volume
        rate = stiff * flow + heat
        if chamber.tube_inertia and quick is None:  # no flow follows faster than the line rings
            rate = min(rate, math.sqrt(stiff * tube.volume(length)) / length + heat)
        air = max(air, step * rate)
        if step * rate > AIR_ACCURATE:
            enough = AIR_ACCURATE / rate
            text = (
                "the air of chamber {subject!r} is coarse at this time step (number {number:.3g}): while "
                "it fills or vents, pressures may be off by 1 to 3 % of the supply's, moments by 1 to "
                f"5 %; take a step of {in_unit(enough, 's', 'ms'):.2g} ms"
            )
            warnings.append(Notice("air-coarse", text, subject=name, number=step * rate, enough=enough))
    return air, tuple(warnings)


def falling_frictions(orthosis: Orthosis, pressure: float) -> np.ndarray:
    """The steepest fall of each muscle's friction with speed, damping of the wrong sign [N·s/m]."""
    found: list[float] = []
    for group in orthosis.muscle.values():
        muscle, fall = group.type, 0.0
        if muscle.friction in FRICTIONS:
            parameters = muscle.frictions[muscle.friction].parameters
            fall = FRICTIONS[muscle.friction].steepest_fall(muscle.piece, parameters, pressure)
        found += [fall] * group.count
    return np.array(found)


def _too_long(reason: str, step: float, enough: float) -> InputError:
    problem, allowed = f"{reason} for this time step", f"at most {0.99 * in_unit(enough, 's', 'ms'):.2g} ms"
    value = f"{in_unit(step, 's', 'ms'):g} ms"
    return InputError(problem, field="timestep", value=value, allowed=allowed)

"""Whether a time step is short enough: numbers of air and friction."""

import mujoco
import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.units import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    in_unit,
)
from afo_sim.description.muscle import Muscle
from afo_sim.description.orthosis import Orthosis
from afo_sim.description.scenario import Scenario
from afo_sim.model.chamber_volume import least_volume
from afo_sim.model.drive_checks import check_drives
from afo_sim.model.mounting import Index, muscle_names, sweep_ankle
from afo_sim.physics.friction import FRICTIONS
from afo_sim.physics.pneumatics import laminar_slope

AIR_LIMIT = 1.0  # of rate × time step of the explicitly integrated air; it is unstable at 2
AIR_ACCURATE = 0.3  # above it a run warns
FRICTION_LIMIT = 0.5  # of rate × time step of friction that falls with speed


def check_stability(
    model: mujoco.MjModel, index: Index, scenario: Scenario
) -> tuple[dict[str, float], list[str]]:
    """Rate × time step of the air and of friction; refuse or warn where the step is too long.

    Muscle, damper, braid and cable are solved at the end of each step and set no limit. The air is explicit:
    laminar flow through open valves, and heat to the wall, must be slow against the step. So must friction
    be where it falls with speed, and what pressure drives ask for.

    Returns
    -------
    ({"air", "friction", with drives "drive": number}, warnings)
    """
    friction = _friction_number(model, index, scenario)
    check_friction(friction, scenario.timestep)
    air, warnings = check_air(scenario.orthosis, scenario.timestep)
    drives, told = check_drives(scenario)
    return {"air": air, "friction": friction} | drives, [*warnings, *told]


def check_friction(friction: float, step: float) -> None:
    """Refuse a time step [s] that is too long for its number of friction, rate × time step."""
    if friction > FRICTION_LIMIT:
        enough = step * FRICTION_LIMIT / friction
        raise _too_long("friction falls too fast with speed", step, enough)


def check_air(orthosis: Orthosis, step: float) -> tuple[float, list[str]]:
    """Rate × time step [s] of the air: (number, warnings); refuse a step that is too long."""
    air, warnings = 0.0, []
    for name in orthosis.chamber:
        rate = _air_rate(orthosis, name)
        air = max(air, step * rate)
        if step * rate > AIR_LIMIT:
            raise _too_long(f"the air of chamber {name!r} moves too fast", step, AIR_LIMIT / rate)
        if step * rate > AIR_ACCURATE:
            warnings.append(
                f"the air of chamber {name!r} is coarse at this time step (number "
                f"{step * rate:.2f}): pressures and torques may be off by several per cent; "
                f"{in_unit(AIR_ACCURATE / rate, 's', 'ms'):.2g} ms would do"
            )
    return air, warnings


def _friction_number(model: mujoco.MjModel, index: Index, scenario: Scenario) -> float:
    """Rate × time step of friction that falls with speed, the largest over the range of motion."""
    orthosis, pressure = scenario.orthosis, scenario.supply.pressure
    falling = falling_frictions(orthosis, pressure)
    if not falling.any():
        return 0.0
    _, arm, inertia = sweep_ankle(model, index, np.linspace(*orthosis.range_of_motion, 9))
    return float(np.max(scenario.timestep * (arm**2 @ falling) / inertia))


def falling_frictions(orthosis: Orthosis, pressure: float) -> np.ndarray:
    """The steepest fall of every single muscle's friction with its speed at a gauge pressure [N·s/m]."""
    of_group = {name: _falling_friction(g.type, pressure) for name, g in orthosis.muscle.items()}
    return np.array([of_group[name.rsplit("_", 1)[0]] for name in muscle_names(orthosis)])


def _falling_friction(muscle: Muscle, pressure: float) -> float:
    """The steepest fall of a muscle's friction with its speed [N·s/m]: damping of the wrong sign."""
    if muscle.friction not in FRICTIONS:
        return 0.0
    parameters = muscle.frictions[muscle.friction].parameters
    return FRICTIONS[muscle.friction].steepest_fall(muscle.braid, parameters, pressure)


def _too_long(reason: str, step: float, enough: float) -> InputError:
    return InputError(
        f"{reason} for this time step",
        field="timestep",
        value=f"{in_unit(step, 's', 'ms'):g} ms",
        allowed=f"at most {0.99 * in_unit(enough, 's', 'ms'):.2g} ms",
    )


def _air_rate(orthosis: Orthosis, name: str) -> float:
    """The fastest rate of a chamber: laminar flow through both valves, and heat to the wall [1/s]."""
    chamber, volume = orthosis.chamber[name], least_volume(orthosis, name)
    flow = sum(laminar_slope(v.conductance, v.critical_ratio) for v in (chamber.inlet, chamber.outlet))
    mass = AMBIENT_PRESSURE * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE)
    heat = chamber.wall_conductance / (mass * GAS_CONSTANT / (HEAT_CAPACITY_RATIO - 1.0))
    return HEAT_CAPACITY_RATIO * GAS_CONSTANT * AMBIENT_TEMPERATURE * flow / volume + heat

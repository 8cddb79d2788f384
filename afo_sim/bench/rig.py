"""The stand as a MuJoCo model: frame, muscle, carriage on a slide, air; and its roll-out.

The muscle is a spatial tendon between the frame above and a carriage that slides along its axis; the
slide's coordinate is its shortening. Muscle, chamber, valves and friction are the same compiled
actuators as everywhere.

* A *regulator* keeps the pressure: an inlet valve that is never shut, as wide as the time step allows,
  whose supply follows the pressure that is wanted. Air flows through it either way.
* A *prescribed length*: the carriage is given the inertia of a mountain and the force that moves the
  mountain as planned. No muscle can disturb it.
* A *load*: a weight on the carriage, with its inertia; the carriage has that of half the muscle.
"""

import os
from collections.abc import Callable

import mujoco
import numpy as np
from mujoco.batch import Batch
from mujoco.batch import SimulationError as BatchError

from afo_sim import native
from afo_sim.bench.plan import Plan
from afo_sim.bench.rest import damping
from afo_sim.common.errors import InputError, SimulationError
from afo_sim.common.units import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    GRAVITY,
    HEAT_CAPACITY_RATIO,
    STANDARD_DENSITY,
)
from afo_sim.model.mounting import AIR_LIMIT, BRAID_LIMIT
from afo_sim.model.start import get_state
from afo_sim.physics.friction import FRICTIONS
from afo_sim.physics.pneumatics import LAMINAR_RATIO, muscle_volume
from afo_sim.simulation.rollout import instability

MOUNTAIN = 1e15  # inertia of a carriage whose length is prescribed [kg]: moved 1e-12 m/s² by 1 kN
REGULATOR_RATIO = 0.3  # critical pressure ratio of the regulator's valve [-]
REGULATOR_NUMBER = 0.6  # rate × time step of the regulator: wide, and well below the limit of 1
MUSCLE, CHAMBER, INLET, OUTLET, FRICTION = range(5)  # the actuators
BLOCK = 40_000  # steps of all simulations together that are in memory at once
RECORD = ("qpos", "qvel", "act", "actuator_force", "userdata")  # the first three are states

Progress = Callable[[int, int], None]
Rows = dict[str, np.ndarray]


def build_rig(plan: Plan) -> mujoco.MjModel:
    """Compile the stand for a plan's muscle, valves and time step.

    Raises
    ------
    InputError
        The time step is too long for the valve's air, or for the braid's stiffness under the least load.
    """
    muscle = plan.muscle
    spec = mujoco.MjSpec()
    spec.nuser_actuator, spec.nuserdata = native.N_USER, native.FLOWS_PER_CHAMBER
    top = [0.0, 0.0, muscle.nominal_length]
    spec.worldbody.add_site(name="frame", pos=top)
    carriage = spec.worldbody.add_body(
        name="carriage", mass=1.0, inertia=[1.0, 1.0, 1.0], explicitinertial=True
    )
    inertia = MOUNTAIN if plan.held else plan.inertia
    carriage.add_joint(name="slide", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, 1.0], armature=inertia)
    carriage.add_site(name="hook")
    tendon = spec.add_tendon(name="muscle", width=muscle.bore / 2.0)
    tendon.wrap_site("frame")
    tendon.wrap_site("hook")
    _add_actuators(spec, muscle.friction)
    option = spec.option
    option.timestep, option.gravity = plan.timestep, [0.0, 0.0, -GRAVITY]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    model = spec.compile()
    _fill_parameters(model, plan)
    return model


def _add_actuators(spec: mujoco.MjSpec, friction: str) -> None:
    blank = [0.0] * native.N_USER
    spec.add_actuator(
        name="muscle",
        trntype=mujoco.mjtTrn.mjTRN_TENDON,
        target="muscle",
        gaintype=mujoco.mjtGain.mjGAIN_AFFINE,
        gainprm=[0.0, 0.0, -1.0] + [0.0] * 7,
        biastype=mujoco.mjtBias.mjBIAS_USER,
        userdata=blank,
    )
    states = {"chamber": 3, "inlet": 2, "outlet": 2}
    if friction != "none" and FRICTIONS[friction].n_state:
        states["friction"] = FRICTIONS[friction].n_state
    for name, count in states.items():
        spec.add_actuator(
            name=name,
            actdim=count,
            userdata=blank,
            dyntype=mujoco.mjtDyn.mjDYN_USER,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[0.0] * 10,
            biastype=mujoco.mjtBias.mjBIAS_NONE,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target="slide",
        )


def _fill_parameters(model: mujoco.MjModel, plan: Plan) -> None:
    muscle, laboratory, user = plan.muscle, plan.laboratory, model.actuator_user
    remembers = model.nu > FRICTION
    user[MUSCLE] = native.muscle_row(
        **muscle.row,
        series_length=0.0,
        chamber=CHAMBER,
        next_muscle=-1,
        friction_states=FRICTION if remembers else -1,
    )
    user[CHAMBER] = native.chamber_row(
        first_muscle=MUSCLE,
        inlet=INLET,
        outlet=OUTLET,
        tube_volume=laboratory.tube_volume,
        wall_conductance=laboratory.wall_conductance,
        userdata=0,
    )
    for i in (INLET, OUTLET):
        if plan.valve is None:
            values = (_regulator_conductance(plan), REGULATOR_RATIO, 0.0, 0.0)
        else:
            valve = plan.valve
            values = (valve.conductance, valve.critical_ratio, valve.opening_delay, valve.closing_delay)
        names = ("conductance", "critical_ratio", "opening_delay", "closing_delay")
        user[i] = native.valve_row(**dict(zip(names, values, strict=True)))
    if remembers:
        user[FRICTION] = native.friction_row(muscle=MUSCLE)


def stability(plan: Plan) -> dict[str, float]:
    """Rate × time step of air, braid and dampers; above the limits of a run it is refused.

    Returns
    -------
    {"air", "braid", "damper": number}: the damper is integrated implicitly and its number only told.

    Raises
    ------
    InputError
        Air or braid would be unstable at this time step.
    """
    muscle, step = plan.muscle, plan.timestep
    inertia = MOUNTAIN if plan.held else float(np.min(plan.load)) / GRAVITY + plan.inertia
    air = REGULATOR_NUMBER
    if plan.valve is not None:
        slope = 2.0 * _laminar_slope(plan.valve.conductance, plan.valve.critical_ratio)
        air = step * _per_slope(plan) * slope
    braid = step**2 * muscle.braid_stiffness / (muscle.nominal_length * inertia)
    for name, number, limit in (("air", air, AIR_LIMIT), ("braid", braid, BRAID_LIMIT)):
        if number > limit:
            power = 1.0 if name == "air" else 0.5
            raise InputError(
                f"is too long for the {name} of this stand",
                field="timestep",
                value=f"{step * 1e3:g} ms",
                allowed=f"at most {0.99e3 * step * (limit / number) ** power:.2g} ms",
            )
    c = max(damping(muscle, float(p)) for p in plan.pressure[:, 1])
    return {"air": air, "braid": braid, "damper": step * c / (muscle.nominal_length**2 * inertia)}


def _laminar_slope(conductance: float, critical: float) -> float:
    """Slope of a valve's mass flow at equal pressures [kg/(s·Pa)]."""
    x = (LAMINAR_RATIO - critical) / (1.0 - critical)
    return conductance * STANDARD_DENSITY * float(np.sqrt(1.0 - x * x)) / (1.0 - LAMINAR_RATIO)


def _per_slope(plan: Plan) -> float:
    """A chamber's fastest rate over the slope of its valves' flow [Pa/kg], at its smallest volume."""
    kappa = min(float(plan.contraction.min()), 0.0)
    volume = plan.laboratory.tube_volume + _volume(plan, kappa)
    return HEAT_CAPACITY_RATIO * GAS_CONSTANT * AMBIENT_TEMPERATURE / volume


def _regulator_conductance(plan: Plan) -> float:
    """As wide as the time step allows: the chamber follows within a few steps [m³/(s·Pa)]."""
    number = REGULATOR_NUMBER / plan.timestep
    return number / (_per_slope(plan) * _laminar_slope(1.0, REGULATOR_RATIO))


def _volume(plan: Plan, contraction: float) -> float:
    braid = plan.muscle.braid
    dead = plan.muscle.dead_volume
    return muscle_volume(contraction, braid.nominal_length, braid.nominal_radius, braid.b, dead)[0]


def _starts(model: mujoco.MjModel, plan: Plan) -> np.ndarray:
    """mjSTATE_INTEGRATION rows at rest: air at ambient temperature, the regulator open (n, width)."""
    data, rows = mujoco.MjData(model), []
    opened = plan.kind != "step"
    for kappa, gauge in zip(plan.contraction[:, 0], plan.start_pressure, strict=True):
        data.qpos[0] = kappa * plan.muscle.nominal_length
        volume = plan.laboratory.tube_volume + _volume(plan, float(kappa))
        absolute = gauge + AMBIENT_PRESSURE
        air = absolute * volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE), volume, absolute
        data.act[:7] = *air, opened, opened, 0.0, 0.0
        rows.append(get_state(model, data))
    return np.array(rows)


def _inputs(model: mujoco.MjModel, plan: Plan, first: int, stop: int) -> np.ndarray:
    """ctrl and applied force of the steps first…stop (n, stop − first, nu + 1)."""
    step = plan.timestep
    time = np.arange(first - 1, stop + 1) * step
    wave = plan.wave(time)
    n = len(plan.set_points)
    inputs = np.zeros((n, stop - first, model.nu + 1))
    # the supply at the end of each step, so that the regulator is not a step late
    low, high = plan.pressure.T
    inputs[:, :, CHAMBER] = low[:, None] + (high - low)[:, None] * wave[2:]
    if plan.kind == "step":
        venting = plan.branch(time[1:-1] + 0.5 * step) % 2
        inputs[:, :, INLET], inputs[:, :, OUTLET] = 1.0 - venting, venting
    else:
        inputs[:, :, INLET] = 1.0
    if plan.held:
        low, high = plan.contraction.T * plan.muscle.nominal_length
        place = low[:, None] + (high - low)[:, None] * wave
        inputs[:, :, -1] = MOUNTAIN * np.diff(place, 2) / step**2
    return inputs


def roll(plan: Plan, progress: Progress | None = None) -> list[Rows]:
    """Run a plan, all its curves side by side.

    Parameters
    ----------
    plan : what is set
    progress : called with (steps done, steps in all)

    Returns
    -------
    Per curve {column: values (rows,)}: time [s]; pressure, gauge [Pa]; contraction [-]; its rate [1/s];
    force, tension [N]; air_mass [kg]; volume [m³]; inflow and outflow through both valves, ≥ 0 [kg/s]. A row
    is the state before a step and what belongs to that state.

    Raises
    ------
    InputError
        The time step is too long.
    SimulationError
        A curve became unstable.
    CallbackError
        The muscle callbacks cannot be installed or are not in force.
    """
    stability(plan)
    model = build_rig(plan)
    step = plan.timestep
    n_step = round(plan.duration * plan.branches / step)
    with native.installed():
        starts = _starts(model, plan)
        _assert_pulling(model, starts[0])
        batch = Batch(model, nsim=len(starts), nthread=min(len(starts), os.cpu_count() or 1))
        if not plan.held:
            batch.expand("body_mass")[:, 1] = plan.load / GRAVITY
            batch.set_const()  # or the slide would keep the inertia that it was compiled with
        batch.state[:] = starts
        rows = _roll(model, plan, batch, n_step + 1, progress)
    rows["time"] = np.arange(0, n_step + 1, plan.stride) * step
    return [_columns(model, plan, rows, k) for k in range(len(starts))]


def _assert_pulling(model: mujoco.MjModel, start: np.ndarray) -> None:
    """Refuse a limp muscle: at 3 bar and zero contraction it must carry what its kernels say."""
    native.assert_rows(model)
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, start, mujoco.mjtState.mjSTATE_INTEGRATION)
    data.qpos[0], data.act[2] = 0.0, 3e5 + AMBIENT_PRESSURE
    mujoco.mj_forward(model, data)
    native.assert_live(model, data, [MUSCLE])


def _roll(model: mujoco.MjModel, plan: Plan, batch: Batch, n_step: int, progress: Progress | None) -> Rows:
    """Every stride-th row of a roll-out, states and what was computed from them side by side."""
    n, stride = len(plan.set_points), plan.stride
    inputs = mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_QFRC_APPLIED
    length = max(BLOCK // n // stride, 1) * stride
    kept: dict[str, list[np.ndarray]] = {name: [] for name in RECORD}
    data = mujoco.MjData(model)
    before: dict[str, list[np.ndarray]] = {}
    for k in range(n):
        mujoco.mj_setState(model, data, batch.state[k], mujoco.mjtState.mjSTATE_INTEGRATION)
        for name in RECORD[:3]:
            before.setdefault(name, []).append(np.copy(getattr(data, name)))
    last = {name: np.array(values)[:, None] for name, values in before.items()}
    for first in range(0, n_step, length):
        stop = min(first + length, n_step)
        try:
            out = batch.rollout(stop - first, _inputs(model, plan, first, stop), int(inputs), list(RECORD))
        except BatchError as error:
            raise SimulationError(str(error), time=first * plan.timestep) from None
        for k in range(n):
            reason = instability(batch.warning[k])
            if reason is not None:
                raise SimulationError(reason, simulation=k, time=stop * plan.timestep)
        for name in RECORD:
            values = out[name]
            if name in last:  # states come after their step, forces before it
                values = np.concatenate([last[name], values], axis=1)[:, :-1]
                last[name] = out[name][:, -1:]
            kept[name].append(values[:, ::stride])
        if progress is not None:
            progress(stop, n_step)
    return {name: np.concatenate(parts, axis=1) for name, parts in kept.items()}


def _columns(model: mujoco.MjModel, plan: Plan, rows: Rows, k: int) -> Rows:
    act = rows["act"][k]
    inlet, outlet, volume = rows["userdata"][k].T
    length = plan.muscle.nominal_length
    return {
        "time": rows["time"],
        "pressure": act[:, 2] - AMBIENT_PRESSURE,
        "contraction": rows["qpos"][k, :, 0] / length,
        "contraction_rate": rows["qvel"][k, :, 0] / length,
        "force": 0.0 - rows["actuator_force"][k, :, MUSCLE],
        "air_mass": act[:, 0],
        "volume": volume,
        "inflow": np.maximum(inlet, 0.0) + np.maximum(-outlet, 0.0),
        "outflow": np.maximum(outlet, 0.0) + np.maximum(-inlet, 0.0),
    }

"""The stand as a MuJoCo model: frame, muscle, carriage on a slide, air; and its roll-out.

The muscle is a spatial tendon between the frame above and a carriage that slides along its axis; the
slide's coordinate is its shortening.

* A *regulator* is an inlet valve that is never shut, as wide as the time step allows, whose supply follows
  the pressure that is wanted. Air flows through it either way.
* A *prescribed length*: the carriage has the inertia of a mountain and the force that moves it as planned.
* A *spring* holds the carriage; with the frame in series it is as stiff as planned, from rest length on.
* Frame and hook give by `MOUNTING` between muscle and carriage, or as stated. The muscle's own contraction is
  recorded; it is the one that is planned, but with a stated mounting, which belongs to the measured length.
"""

import copy
import os
from collections.abc import Callable
from itertools import pairwise

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import (
    AMBIENT_PRESSURE,
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    GRAVITY,
    HEAT_CAPACITY_RATIO,
    STANDARD_DENSITY,
    InputError,
    Keywords,
    Mixed,
)
from afo_sim.lab.stand_plan import StandPlan
from afo_sim.model import get_state
from afo_sim.physics import flow_edge, laminar_slope, tube_heat, tube_volume
from afo_sim.simulation import Case, Moment, Policy, Recipe, Rollout, roll_out

MOUNTAIN = 1e15  # inertia of a carriage whose length is prescribed [kg]: moved 1e-12 m/s² by 1 kN
REGULATOR_RATIO = 0.3  # critical pressure ratio of the regulator's valve [-]
AIR_LIMIT = 1.0  # of rate × time step of the stand's air, so that its readings are exact beside a sensor's
REGULATOR_NUMBER = 0.6  # rate × time step of the regulator: wide, and well below the limit of 1
MUSCLE, CHAMBER, GAUGE = "muscle", "stand", "gauge"  # names in the circuit
INLET, OUTLET = f"{CHAMBER}_inlet", f"{CHAMBER}_outlet"
MOUNTING = 1e7  # stiffness of frame and hook [N/m]: 0.1 mm under 1 kN
CELLS = 4  # of a line: its air rings and carries waves of half a cell
BLOCK = 40_000  # steps of all simulations together that are in memory at once
INPUTS = int(mujoco.mjtState.mjSTATE_CTRL | mujoco.mjtState.mjSTATE_QFRC_APPLIED)

Progress = Callable[[int, int], None]
Rows = dict[str, np.ndarray]


def _build_rig(plan: StandPlan) -> tuple[mujoco.MjModel, native.CircuitIds]:
    """The compiled stand for a plan's muscle, valves and time step, and its actuators by name."""
    muscle = plan.muscle
    spec, circuit = mujoco.MjSpec(), _circuit_of(plan)
    spec.worldbody.add_site(name="frame", pos=[0.0, 0.0, muscle.nominal_length])
    body = {"mass": 1.0, "inertia": [1.0, 1.0, 1.0], "explicitinertial": True}
    carriage = spec.worldbody.add_body(name="carriage", **body)
    slide = {"name": "slide", "type": mujoco.mjtJoint.mjJNT_SLIDE, "axis": [0.0, 0.0, 1.0]}
    carriage.add_joint(**slide, armature=MOUNTAIN if plan.held else plan.inertia)
    carriage.add_site(name="hook")
    tendon = spec.add_tendon(name=MUSCLE, width=muscle.bore / 2.0)
    tendon.wrap_site("frame")
    tendon.wrap_site("hook")
    native.add_circuit(spec, circuit)
    option = spec.option
    option.timestep, option.gravity = plan.timestep, [0.0, 0.0, -GRAVITY]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    model = spec.compile()
    return model, native.fill_circuit(model, circuit)


def _circuit_of(plan: StandPlan) -> native.Circuit:
    """One muscle on one chamber, between solenoid valves or regulators."""
    laboratory = plan.laboratory
    # as wide as the time step allows: the chamber follows within a few steps
    wide = REGULATOR_NUMBER / plan.timestep / (_per_slope(plan) * laminar_slope(1.0, REGULATOR_RATIO))
    valve: Mixed = native.CircuitValve(wide, REGULATOR_RATIO) if plan.valve is None else plan.valve
    room, wall = laboratory.tube_volume, laboratory.wall_conductance
    volumes, edges, port = [], [], ""
    if laboratory.line_length > 0.0:  # the valves open into the gauge's volume, and a line leads on in cells
        port, bore, length = GAUGE, laboratory.line_bore, laboratory.line_length / CELLS
        cell, (still, by_flow) = tube_volume(bore, length), tube_heat(bore, length)
        room += 0.5 * cell
        spaces = [laboratory.gauge_volume + 0.5 * cell, *[cell] * (CELLS - 1)]
        nodes = [GAUGE, *(f"cell_{k}" for k in range(1, CELLS))]
        volumes = [
            native.CircuitVolume(node, space, still, 0.0, CHAMBER, by_flow)
            for node, space in zip(nodes, spaces, strict=True)
        ]
        ends = pairwise([*nodes, CHAMBER])
        edges = [flow_edge.line(f"of_{a}", a, b, bore, length, CELLS) for a, b in ends]
    if laboratory.leak_conductance > 0.0:
        c = laboratory.leak_conductance  # measured leaks follow the gauge pressure, and no orifice
        edges.append(flow_edge.relief("leak", CHAMBER, c, 0.0, limit=0.0, per_excess=c * STANDARD_DENSITY))
    ways: Keywords = {"port": port, "wall_conductance_by_flow": laboratory.wall_conductance_by_flow}
    chamber = native.CircuitChamber(CHAMBER, "slide", room, wall, valve, plan.outlet or valve, **ways)
    muscle = native.CircuitMuscle(MUSCLE, (MUSCLE,), plan.muscle.row, 0.0, CHAMBER, _mounting(plan))
    return native.Circuit((muscle,), (chamber,), volumes=tuple(volumes), restrictions=tuple(edges))


def _require_stable(plan: StandPlan) -> None:
    if plan.valve is None or plan.laboratory.line_length > 0.0:  # behind a line the parts of a step suffice
        return
    step, valves = plan.timestep, (plan.valve, plan.outlet or plan.valve)
    slope = sum(laminar_slope(each.conductance, each.critical_ratio) for each in valves)
    air = step * _per_slope(plan) * slope
    if air > AIR_LIMIT:
        problem, value = "is too long for the air of this stand", f"{step * 1e3:g} ms"
        allowed = f"at most {0.99e3 * step * AIR_LIMIT / air:.2g} ms"
        raise InputError(problem, field="timestep", value=value, allowed=allowed)


def _per_slope(plan: StandPlan) -> float:
    """A chamber's fastest rate over the slope of its valves' flow [Pa/kg], at its smallest volume."""
    kappa = min(float(plan.contraction.min()), 0.0)
    volume = plan.laboratory.tube_volume + float(plan.muscle.volume(contraction=kappa))
    return HEAT_CAPACITY_RATIO * GAS_CONSTANT * AMBIENT_TEMPERATURE / volume


def _mounting(plan: StandPlan) -> float:
    return plan.laboratory.mounting_stiffness or MOUNTING


def _hook(plan: StandPlan, k: int) -> np.ndarray:
    """Coordinates of the slide [m] at which the muscle of a curve has its two contractions."""
    contraction = plan.contraction[k]
    if plan.held and plan.laboratory.mounting_stiffness is not None:
        force = np.zeros(2)
    elif plan.held:
        force = plan.muscle.force(plan.pressure[k, 1], contraction=contraction)
    else:
        force = plan.carried(k, contraction)
    return contraction * plan.muscle.nominal_length - force / _mounting(plan)


def _start(model: mujoco.MjModel, ids: native.CircuitIds, plan: StandPlan, k: int) -> np.ndarray:
    """mjSTATE_INTEGRATION row of a curve at rest: air at ambient temperature, a regulator open."""
    data = mujoco.MjData(model)
    opened = float(plan.kind not in ("step", "sealed"))
    data.qpos[0] = _hook(plan, k)[0]
    with native.installed():
        native.fill_chambers(model, data, float(plan.start_pressure[k]))
    native.write_valve(model, data.act, ids.valves[INLET], opened, opened)
    return get_state(model, data)


def _loaded(rigid: mujoco.MjModel, plan: StandPlan, k: int) -> mujoco.MjModel:
    """The stand with the weight and spring of a curve on its carriage."""
    if plan.held:
        return rigid
    model = copy.copy(rigid)
    model.body_mass[1] = plan.load[k] / GRAVITY
    model.jnt_stiffness[0] = plan.spring[k] / (1.0 - plan.spring[k] / _mounting(plan))
    model.qpos_spring[0] = -plan.load[k] / _mounting(plan)
    # or the slide would keep the inertia it was compiled with
    mujoco.mj_setConst(model, mujoco.MjData(model))
    native.fill_inverse_masses(model)
    return model


def _policy(model: mujoco.MjModel, ids: native.CircuitIds, plan: StandPlan, k: int) -> Policy:
    """ctrl and applied force of a curve (n, nu + 1)."""
    step = plan.timestep

    def choose(moment: Moment) -> np.ndarray:
        time = np.arange(moment.steps.start - 1, moment.steps.stop + 1) * step
        inputs = np.zeros((len(moment.steps), model.nu + 1))
        # the supply at the end of each step, so that the regulator is not a step late
        inputs[:, ids.chambers[CHAMBER]] = plan.supply(k, time[2:])
        inputs[:, ids.valves[INLET]], inputs[:, ids.valves[OUTLET]] = plan.coils(time[1:-1])
        if plan.held:
            low, high = _hook(plan, k)
            inputs[:, -1] = MOUNTAIN * np.diff(low + (high - low) * plan.wave(time), 2) / step**2
        return inputs

    return Policy(choose)


def roll(plan: StandPlan, progress: Progress | None = None) -> list[Rows]:
    """Run a plan, all its curves side by side."""
    _require_stable(plan)
    rig, n = _build_rig(plan), len(plan.set_points)
    cases = []
    for k in range(n):
        cases.append(Case(_loaded(rig[0], plan, k), _start(*rig, plan, k), _policy(*rig, plan, k), k))
    block, threads = max(BLOCK // n // plan.stride, 1) * plan.stride, min(n, os.cpu_count() or 1)
    recipe = Recipe(("actuator_force", "userdata"), INPUTS, plan.stride, block, threads)
    n_step = round(plan.duration * plan.branches / plan.timestep)
    rollouts = roll_out(cases, n_step + 1, recipe, progress=progress)
    for rollout in rollouts:
        if rollout.failure is not None:
            raise rollout.failure
    time = np.arange(0, n_step + 1, plan.stride) * plan.timestep
    return [_columns(*rig, time, rollout) for rollout in rollouts]


def _columns(model: mujoco.MjModel, ids: native.CircuitIds, time: np.ndarray, rollout: Rollout) -> Rows:
    rows, chamber, muscle = rollout.rows, ids.chambers[CHAMBER], ids.muscles[MUSCLE]
    air = native.read_air(model, rows["act"], rows["userdata"], chamber)
    own = native.read_own(model, rows["userdata"], muscle)
    inlet, outlet, volume = native.read_flows(model, rows["userdata"], chamber)
    gauge = native.read_node(model, rows["act"], rows["userdata"], ids.volumes.get(GAUGE, chamber))
    return {
        "time": time,
        "pressure": gauge.absolute_pressure - AMBIENT_PRESSURE,
        "muscle_pressure": air.absolute_pressure - AMBIENT_PRESSURE,
        "contraction": own.contraction,
        "contraction_rate": own.rate,
        "force": 0.0 - rows["actuator_force"][:, muscle],
        "air_mass": np.array(air.mass),
        "volume": volume,
        "inflow": np.maximum(inlet, 0.0) + np.maximum(-outlet, 0.0),
        "outflow": np.maximum(outlet, 0.0) + np.maximum(-inlet, 0.0),
    }

"""Air of a network before the first step: it is stepped while the wearer stands, with valves that fill."""

import math

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.units import AMBIENT_PRESSURE
from afo_sim.model.build import Built

OFF = -1.0  # input of a drive that leaves its valves to their own inputs
STILL = 1e-4  # relative change in a second below which a network is full [1/s]
TRIES, SAME = 40, 1e-5  # of the pressure at rest, and its relative residual
GIVES = 0.3  # d ln V/d ln p of a chamber, about [-]
LOOK = 64  # steps between two looks at that


def prefill_network(built: Built, data: mujoco.MjData) -> None:
    """Put the air into chambers and volumes with which the scenario starts to walk.

    The inlets of chambers with a `fill_time` end it together, at the start; chambers with a pressure have it
    all the while. Other valves are shut, and a store is full when the walk begins.
    """
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
    absolute = {k: native.read_air(model, data.act, data.userdata, k).absolute_pressure for k in held}
    for _ in range(TRIES):
        native.fill_chambers(model, data, gauge | {k: p - AMBIENT_PRESSURE for k, p in absolute.items()})
        wanted = {k: held[k][1] / native.read_flows(model, data.userdata, k).volume ** gamma for k in held}
        off = max(abs(float(wanted[k] / absolute[k]) - 1.0) for k in held)
        if off < SAME:
            break
        for k, p in wanted.items():
            absolute[k] *= (p / absolute[k]) ** (1.0 / (1.0 + gamma * GIVES))
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
    steps = math.ceil(max(times.values()) / step)
    last = np.array([native.read_held(model, data.act, k) for k in nodes])
    for k in range(steps):
        left = (steps - k) * step
        data.ctrl[inlets] = np.clip([(t - left) / step + 1.0 for t in times.values()], 0.0, 1.0)
        mujoco.mj_step(model, data)
        data.qpos[:], data.qvel[:] = before["qpos"], 0.0
        if k % LOOK == LOOK - 1 and data.ctrl[inlets].all():
            now = np.array([native.read_held(model, data.act, k) for k in nodes])
            if np.max(np.abs(now / last - 1.0)) < STILL * LOOK * step:
                break
            last = now
    held = {k: native.read_held(model, data.act, k).copy() for k in nodes}
    for name, values in before.items():
        getattr(data, name)[:] = values
    data.time = time
    return held

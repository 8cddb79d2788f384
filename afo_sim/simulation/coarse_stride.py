"""A stride in steps of `LONG`, for the search of the settled one: a guess, on which no result depends."""

import dataclasses

import numpy as np

from afo_sim.model import JOINTS, Built
from afo_sim.simulation.rollout import state_parts
from afo_sim.simulation.stride_search import remembers

LONG = 12e-3  # [s]
LEAST = 2.5  # times the asked step, below which longer steps save little


def coarse(built: Built, control: np.ndarray) -> tuple[Built, np.ndarray] | None:
    """The scenario in long steps, and its inputs over two strides; None if only its own step will do."""
    # Its model is the same one: who steps it sets the time step.
    assert built.walk is not None
    scenario, n = built.scenario, built.walk.steps_of_stride
    count = round(n * scenario.timestep / LONG)
    if n < LEAST * count or remembers(built, control):
        return None
    long = scenario.model_copy(update={"timestep": scenario.timestep * n / count})
    inputs = _inputs(built, control, n, count)
    return dataclasses.replace(built, scenario=long), np.concatenate([inputs, inputs])


def _inputs(built: Built, control: np.ndarray, n: int, count: int) -> np.ndarray:
    """Inputs of the second stride's long steps (count, nu)."""
    assert built.walk is not None
    index = built.index
    at = n + np.arange(count + 1) * (n / count)
    found = _between(control, at[:-1])
    valves = list(index.valves.values())
    opened = np.zeros((len(control) + 1, len(valves)))
    np.cumsum(control[:, valves], axis=0, out=opened[1:])
    opened = _between(opened, at)
    found[:, valves] = (opened[1:] - opened[:-1]) * (count / n)
    pose = _between(built.walk.pose, 1.0 + n + np.arange(-1, count + 1) * (n / count))
    step = built.scenario.timestep * n / count
    found[:, [index.walking[f"drive_{joint}"] for joint in JOINTS]] = np.diff(pose, 2, axis=0) / step**2
    return found


def _between(rows: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Rows (n, width) at places between them, linear."""
    first = np.minimum(at.astype(int), len(rows) - 2)
    return rows[first] + (at - first)[:, np.newaxis] * (rows[first + 1] - rows[first])


def at_heel_strike(built: Built, state: np.ndarray, step: float) -> np.ndarray:
    """A state at a heel strike, at time 0 and with the shank as steps of this length want it."""
    assert built.walk is not None
    pose, n = built.walk.pose, built.walk.steps_of_stride
    before = _between(pose, np.array([1.0 + n - step / built.scenario.timestep]))[0]
    places, dofs = np.array([built.index.joints[joint] for joint in JOINTS]).T
    found = state.copy()
    ((time,), (qpos,), (qvel,), _) = state_parts(built.model, found[np.newaxis]).values()
    time[:], qpos[places], qvel[dofs] = 0.0, pose[1], (pose[1 + n] - before) / step
    return found

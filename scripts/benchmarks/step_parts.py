"""A step taken apart: µs of kinematics, actuation, callbacks and the rest, at the states of a whole run.

MuJoCo's own functions are called one by one from compiled code, with a clock between them. The callbacks'
time is the difference to callbacks that do nothing. The clock's own time is taken off. For Linux and macOS.
Beside it, what an air network costs: callbacks of S1, and of three chambers with tubes, manifold, reservoir.
"""

import ctypes
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import mujoco
import numba
import numpy as np
from measuring import Figure, difference, figure, in_turn
from mujoco.batch import Batch
from numba import types

import afo_sim
from afo_sim import native
from afo_sim.description import load
from afo_sim.model import Built, equilibrium, walking_start
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.native import mujoco_library
from afo_sim.simulation import FIELDS, METRIC_FIELDS

ROUNDS = 4  # for each repeat that is asked for: a visit is short, and its parts are differences
INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION
CALLBACKS = "step: callbacks"
TUBES = {"tube": "pun_4x2_5", "tube_length": "0.8 m", "tube_volume": "0 ml", "feed": "manifold"}
AIR = {
    "volume": {
        "reservoir": {"volume": "400 ml", "wall_conductance": "0.5 W/K"},
        "manifold": {"volume": "20 ml", "wall_conductance": "0.1 W/K"},
    },
    "restriction": {
        name: {
            "kind": "tube",
            "tube": "pun_4x2_5",
            "length": "1 m",
            "upstream": upstream,
            "downstream": downstream,
        }
        for name, upstream, downstream in (
            ("feed", "supply", "reservoir"),
            ("link", "reservoir", "manifold"),
        )
    },
}
_MUJOCO = ctypes.CDLL(str(mujoco_library()))
_CLOCK = int(time.CLOCK_MONOTONIC)


def _function(library: ctypes.CDLL, name: str, *kinds: Any) -> Any:
    """A C function that compiled code can call; pointers are taken as numbers."""
    function = library[name]
    function.argtypes, function.restype = kinds, None
    return function


_SIZE = ctypes.c_size_t
_position = _function(_MUJOCO, "mj_fwdPosition", _SIZE, _SIZE)
_velocity = _function(_MUJOCO, "mj_fwdVelocity", _SIZE, _SIZE)
_actuation = _function(_MUJOCO, "mj_fwdActuation", _SIZE, _SIZE)
_step = _function(_MUJOCO, "mj_step", _SIZE, _SIZE)
_set_state = _function(_MUJOCO, "mj_setState", _SIZE, _SIZE, _SIZE, ctypes.c_int)
_read_clock = _function(ctypes.CDLL(None), "clock_gettime", ctypes.c_int, _SIZE)


@numba.njit
def _now(clock: np.ndarray) -> int:
    _read_clock(_CLOCK, clock.ctypes.data)
    return int(clock[0]) * 1_000_000_000 + int(clock[1])


@numba.njit
def _stages(model: int, data: int, states: np.ndarray, kind: int) -> np.ndarray:
    """Nanoseconds at each state (n, 4): of position, actuation, a whole step, and of the clock alone."""
    clock, found = np.zeros(2, np.int64), np.empty((len(states), 4))
    for k in range(len(states)):
        _set_state(model, data, states[k].ctypes.data, kind)
        begun = _now(clock)
        _position(model, data)
        placed = _now(clock)
        _velocity(model, data)
        moved = _now(clock)
        _actuation(model, data)
        acted = _now(clock)
        found[k, 0] = placed - begun
        found[k, 1] = acted - moved
        _set_state(model, data, states[k].ctypes.data, kind)
        begun = _now(clock)
        _step(model, data)
        stepped = _now(clock)
        found[k, 2] = stepped - begun
        found[k, 3] = _now(clock) - stepped
    return found


@numba.cfunc(types.double(types.voidptr, types.voidptr, types.int32))
def _nothing(model: Any, data: Any, actuator: Any) -> float:
    return 0.0


@contextmanager
def idle() -> Iterator[None]:
    """Install callbacks that do nothing."""
    mujoco.set_mjcb_act_bias(_nothing.ctypes)
    mujoco.set_mjcb_act_dyn(_nothing.ctypes)
    try:
        yield
    finally:
        mujoco.set_mjcb_act_bias(None)
        mujoco.set_mjcb_act_dyn(None)


def states_of(built: Built, control: np.ndarray) -> np.ndarray:
    """States before each step of a run (n_step, size)."""
    with native.installed():
        first = first_state(built, control)
        batch = Batch(built.model, nsim=1, nthread=1)
        batch.state[:] = first
        found = np.empty((1, len(control), len(first)))
        batch.rollout(len(control), control[None], record=[int(INTEGRATION)], out={int(INTEGRATION): found})
    return np.concatenate([first[None], found[0, :-1]])


def first_state(built: Built, control: np.ndarray) -> np.ndarray:
    """The state that a run starts from; the callbacks must be installed."""
    return equilibrium(built, control[0]) if built.walk is None else walking_start(built, control[0])


def _recorder(built: Built, control: np.ndarray, fields: Sequence[str]) -> Callable[[], float]:
    """A measurement: processor time per step [µs] of a roll-out that records fields into old memory."""
    with native.installed():
        first = first_state(built, control)
    batch = Batch(built.model, nsim=1, nthread=1)
    data = mujoco.MjData(built.model)
    out = {name: np.zeros((1, len(control), np.size(getattr(data, name)))) for name in fields}

    def measure() -> float:
        batch.state[:] = first
        with native.installed(), native.without_clock():
            begun = time.process_time()
            batch.rollout(len(control), control[None], record=list(fields), out=out)
            return 1e6 * (time.process_time() - begun) / len(control)

    return measure


def step_parts(
    name: str, steps: int, repeats: int, sets: Mapping[str, Any] | None = None, title: str = ""
) -> list[Figure]:
    """Figures of one shipped scenario.

    Parameters
    ----------
    name : of the scenario
    steps : of the run whose states are visited
    repeats : rounds
    sets, title : overrides, and what the scenario is called with them
    """
    built, name = build(load("scenario", name, sets)), title or name
    control = schedule.controls(built)[:steps]
    states, data = states_of(built, control), mujoco.MjData(built.model)

    def visit(installed: Callable[[], AbstractContextManager[None]]) -> np.ndarray:
        with installed(), native.without_clock():
            return np.asarray(_stages(built.model._address, data._address, states, int(INTEGRATION)))

    ours: list[np.ndarray] = []
    idle_ones: list[np.ndarray] = []

    def both() -> float:
        ours.append(visit(native.installed))
        idle_ones.append(visit(idle))
        return 0.0

    kinds = {"one": [], "sweep": ["qvel", "act", *METRIC_FIELDS], "run": ["qvel", "act", *FIELDS]}
    recorders = {kind: _recorder(built, control, ["qpos", *fields]) for kind, fields in kinds.items()}
    spent = in_turn({"parts": both, **recorders}, ROUNDS * repeats, first=True)
    return [
        *_figures(name, np.array(ours[1:]), np.array(idle_ones[1:])),
        figure(f"{name}: roll-out of one column", "µs", "lower", spent["one"]),
        difference(f"{name}: recording a sweep's rows", "µs", spent["sweep"], spent["one"]),
        difference(f"{name}: recording a run's rows", "µs", spent["run"], spent["one"]),
    ]


def _figures(name: str, ours: np.ndarray, idle_ones: np.ndarray) -> list[Figure]:
    """Parts of a step from what all rounds took at each state (round, state, 4) [ns].

    Best and median are those of each state, averaged over the states: another program that takes the
    processor for a moment spoils a few states of one round.
    """
    parts = {}
    for summary, of_states in (("best", np.min), ("median", np.median)):
        position, actuation, step, clock = of_states(ours, axis=0).mean(axis=0) / 1e3
        engine = of_states(idle_ones, axis=0).mean(axis=0)[1] / 1e3
        parts[summary] = {
            "step": step - clock,
            "step: kinematics, tendons and inertia": position - clock,
            "step: actuation without callbacks": engine - clock,
            "step: callbacks": actuation - engine,
            "step: velocities, constraints, integrator": step - position - actuation + clock,
        }
    return [
        Figure(f"{name}: {word}", "µs", "lower", float(best), float(parts["median"][word]), len(ours))
        for word, best in parts["best"].items()
    ]


def three_chambers() -> dict[str, Any]:
    """Overrides of S1's seated scenario: its plantarflexors on a chamber each, and the network."""
    orthosis = afo_sim.load("orthosis", "s1").model_dump(mode="json", exclude_none=True)
    back = orthosis["muscle"]["plantarflexor"]
    orthosis["muscle"]["third"] = back
    orthosis["chamber"]["third"] = orthosis["chamber"]["plantarflexor"]
    for chamber in orthosis["chamber"].values():
        chamber.update(TUBES)
    timer = afo_sim.load("scenario", "seated").model_dump(mode="json", exclude_none=True)["timer"]
    timer["third"] = timer["plantarflexor"]
    return {"orthosis": orthosis | AIR, "timer": timer}


def network_costs(steps: int, repeats: int) -> list[Figure]:
    """Callbacks of the smallest circuit and of the network, and their ratio; parameters of `step_parts`."""
    found = {}
    for title, sets in (("two chambers", {}), ("three chambers and a network", three_chambers())):
        figures = step_parts("seated", steps, repeats, sets, title)
        found[title] = next(each for each in figures if each.name.endswith(CALLBACKS))
    small, large = found.values()
    name = "callbacks of a network by those of two chambers"
    ratio = Figure(name, "-", "lower", large.best / small.best, large.median / small.median, repeats)
    return [small, large, ratio]

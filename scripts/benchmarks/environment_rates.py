"""What an environment costs beside stepping alone: of dm_control, and of many simulations in Gymnasium."""

import os
import time
from collections.abc import Callable

import mujoco
import numpy as np
from measuring import Figure, figure, in_turn, ratio

from afo_sim.rl import TASKS, OrthosisEnvironment, OrthosisVectorEnv, coils_of, load

PERIODS = 200  # of a round, from the episode's start on
SIMULATIONS = 256
BATCH_PERIODS = 20
CONTROL = int(mujoco.mjtState.mjSTATE_CTRL)


def environment_rates(repeats: int) -> list[Figure]:
    """Rates and ratios of all tasks: 1 is an environment that costs nothing."""
    found: list[Figure] = []
    for name in TASKS:
        found += _one(name, 3 * repeats)
        for threads in sorted({1, os.cpu_count() or 1}):
            found += _many(name, threads, repeats)
    return found


def _one(name: str, repeats: int) -> list[Figure]:
    environment = load(name, task_kwargs={"random": 0})
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (PERIODS, 2))
    steps, physics = environment.task.setting.steps, environment.physics
    model, data = physics.model.ptr, physics.data.ptr

    def whole() -> None:
        for action in actions:
            environment.step(action)

    coils, made = coils_of(actions), environment.task.setting
    inputs = made.inputs[: PERIODS * steps].copy()
    inputs[:, made.valves] = np.repeat(coils, steps, axis=0)

    def plain() -> None:
        for row in coils:
            physics.command(row)
            physics.step(steps)

    def bare() -> None:
        for row in inputs:
            data.ctrl[:] = row
            mujoco.mj_step(model, data)

    ways = {"whole": whole, "plain": plain, "bare": bare}
    rates = in_turn({way: _afresh(environment, call) for way, call in ways.items()}, repeats, first=True)
    environment.close()
    return [
        figure(f"{name}, dm_control: periods", "1/s", "higher", rates["whole"]),
        ratio(f"{name}, dm_control / Physics.step", rates["whole"], rates["plain"], "higher"),
        ratio(f"{name}, dm_control / mj_step in Python", rates["whole"], rates["bare"], "higher"),
    ]


def _afresh(environment: OrthosisEnvironment, call: Callable[[], None]) -> Callable[[], float]:
    def measure() -> float:
        environment.task.random.seed(0)
        environment.reset()
        begun = time.perf_counter()
        call()
        return PERIODS / (time.perf_counter() - begun)

    return measure


def _many(name: str, threads: int, repeats: int) -> list[Figure]:
    """The vector environment beside `mujoco.batch` alone, with the same inputs, through the same states."""
    envs = OrthosisVectorEnv(name, SIMULATIONS, threads=threads)
    made, episodes = envs.setting, envs._episodes
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (BATCH_PERIODS, SIMULATIONS, 2))

    def whole() -> float:
        envs.reset(seed=0)
        begun = time.perf_counter()
        for action in actions:
            envs.step(action)
        return SIMULATIONS * BATCH_PERIODS / (time.perf_counter() - begun)

    def bare() -> float:
        envs.reset(seed=0)
        rows = np.stack([made.inputs[: BATCH_PERIODS * made.steps]] * SIMULATIONS)
        inputs = np.ascontiguousarray(
            np.swapaxes(rows.reshape(SIMULATIONS, BATCH_PERIODS, made.steps, -1), 0, 1)
        )
        inputs[..., made.valves] = coils_of(actions)[:, :, None]
        batch = episodes.stepped.stepper.batch  # type: ignore[attr-defined]
        begun = time.perf_counter()
        for one in inputs:
            batch.rollout(made.steps, one, CONTROL, record=[])
        return SIMULATIONS * BATCH_PERIODS / (time.perf_counter() - begun)

    rates = in_turn({"whole": whole, "bare": bare}, repeats, first=True)
    envs.close()
    label = f"{name}, {SIMULATIONS} simulations, {threads} thread{'s' if threads > 1 else ''}"
    return [
        figure(f"{label}: periods", "1/s", "higher", rates["whole"]),
        ratio(f"{label} / mujoco.batch", rates["whole"], rates["bare"], "higher"),
    ]

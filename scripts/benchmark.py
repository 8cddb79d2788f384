"""Speed, as ratios measured in one run on one machine; prints JSON.

(a) the shipped model with native muscle callbacks, one thread and two
(b) the same model and trajectory with `motor` actuators that replay the recorded forces, without any
    callback: the engine's own limit
(c) the same with Python callbacks
(d) a cold `afo-sim run`, wall time

    python scripts/benchmark.py [--simulations 256] [--steps 2000] [--repeats 9]
"""

import argparse
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch

from afo_sim import native
from afo_sim.description.reader import load
from afo_sim.model import controls as schedule
from afo_sim.model.build import PASSIVE, Built, build
from afo_sim.model.mounting import muscle_names
from afo_sim.model.start import equilibrium
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.run import run


def motor_model(built: Built) -> mujoco.MjModel:
    """The same bodies, joints and tendons, with a motor for every muscle and for the passive ankle."""
    spec = mujoco.MjSpec.from_string(built.xml)
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    spec.nuserdata = 0
    for name in muscle_names(built.scenario.orthosis):
        motor = spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_TENDON, target=name)
        motor.set_to_motor()
    motor = spec.add_actuator(name=PASSIVE, trntype=mujoco.mjtTrn.mjTRN_JOINT, target="ankle")
    motor.set_to_motor()
    return spec.compile()


def motor_controls(built: Built, recording: Recording, model: mujoco.MjModel) -> np.ndarray:
    """Recorded forces as motor inputs (n_step, nu)."""
    control = np.zeros((len(recording["time"]), model.nu))
    for name in muscle_names(built.scenario.orthosis):
        control[:, model.actuator(name).id] = -recording[f"muscle/{name}/force"]
    # the joint's own half of the damping acts in the motors' model too
    damping = 0.5 * built.scenario.leg.damping * recording["ankle/velocity"]
    control[:, model.actuator(PASSIVE).id] = recording["ankle/moment/passive"] + damping
    return control


def batch_rate(
    model: mujoco.MjModel, control: np.ndarray, state: np.ndarray | None, simulations: int, threads: int
) -> Callable[[], float]:
    """A measurement: steps per second of a batch that starts afresh each time it is called."""
    batch = Batch(model, nsim=simulations, nthread=threads)
    control = np.ascontiguousarray(np.broadcast_to(control, (simulations, *control.shape)))
    first = batch.state.copy()
    if state is not None:
        first[:] = state

    def measure() -> float:
        batch.state[:] = first
        start = time.perf_counter()
        batch.rollout(control.shape[1], control, record=["qpos"])
        return simulations * control.shape[1] / (time.perf_counter() - start)

    return measure


def python_rate(built: Built, control: np.ndarray, state: np.ndarray) -> float:
    """Steps per second of a plain loop with the kernels as Python callbacks."""
    data = mujoco.MjData(built.model)
    with native.installed("python"):
        mujoco.mj_setState(built.model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        start = time.perf_counter()
        for row in control:
            data.ctrl[:] = row
            mujoco.mj_step(built.model, data)
        return len(control) / (time.perf_counter() - start)


def cold_run() -> float:
    """Wall time of `afo-sim run` in a process of its own [s]."""
    command = [sys.executable, "-m", "afo_sim", "run", "--out"]
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        subprocess.run([*command, str(pathlib.Path(folder) / "run")], check=True, capture_output=True)
        return time.perf_counter() - start


def measure(simulations: int, steps: int, repeats: int) -> dict[str, Any]:
    """All four, interleaved, so that a slow moment of the machine hits them alike."""
    built = build(load("scenario", "seated"))
    control = schedule.controls(built, steps)
    motors = motor_model(built)
    replay = motor_controls(built, run("seated", {"duration": f"{2 * steps} ms"}), motors)
    with native.installed():
        state = equilibrium(built, control[0])
    motor_state = np.zeros(mujoco.mj_stateSize(motors, mujoco.mjtState.mjSTATE_INTEGRATION))
    data = mujoco.MjData(motors)
    data.qpos[built.index.ankle_qpos] = run("seated", {"duration": "2 ms"})["ankle/angle"][0]
    mujoco.mj_getState(motors, data, motor_state, mujoco.mjtState.mjSTATE_INTEGRATION)
    runs = {
        "native_1_thread": batch_rate(built.model, control, state, simulations, 1),
        "native_2_threads": batch_rate(built.model, control, state, simulations, 2),
        "motors_1_thread": batch_rate(motors, replay, motor_state, simulations, 1),
        "motors_2_threads": batch_rate(motors, replay, motor_state, simulations, 2),
    }
    rates: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repeats):
        for name, once in runs.items():
            if name.startswith("native"):
                with native.installed():
                    rates[name].append(once())
            else:
                rates[name].append(once())
    middle = {name: float(np.median(values)) for name, values in rates.items()}
    middle["python_1_thread"] = python_rate(built, control[: min(steps, 1000)], state)

    def ratio(name: str, other: str) -> float:
        """Median over the rounds of the ratio within a round."""
        return round(float(np.median(np.divide(rates[name], rates[other]))), 3)

    return {
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "mujoco": mujoco.__version__,
        "simulations": simulations,
        "steps": steps,
        "steps_per_second": {name: round(rate) for name, rate in middle.items()},
        "callback_microseconds_per_step": round(
            1e6 / middle["native_1_thread"] - 1e6 / middle["motors_1_thread"], 3
        ),
        "native_to_motors_1_thread": ratio("native_1_thread", "motors_1_thread"),
        "native_to_motors_2_threads": ratio("native_2_threads", "motors_2_threads"),
        "native_to_python": round(middle["native_1_thread"] / middle["python_1_thread"], 1),
        "python_to_motors": round(middle["python_1_thread"] / middle["motors_1_thread"], 3),
        "native_2_threads_to_1": ratio("native_2_threads", "native_1_thread"),
        "cold_run_wall_seconds": round(cold_run(), 2),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--simulations", type=int, default=256)
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=9)
    options = parser.parse_args()
    print(json.dumps(measure(options.simulations, options.steps, options.repeats), indent=2))


if __name__ == "__main__":
    main()

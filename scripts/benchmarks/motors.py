"""The engine's own limit: the same bodies with motors that replay the recorded forces, without callbacks."""

import time
from collections.abc import Callable

import mujoco
import numpy as np
from measuring import Figure, figure, in_turn, ratio
from mujoco.batch import Batch

from afo_sim import native
from afo_sim.description import load
from afo_sim.model import PASSIVE, Built, equilibrium, get_state, muscle_names
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import Recording
from afo_sim.simulation.run import run

PYTHON_STEPS = 500


def motor_model(built: Built) -> mujoco.MjModel:
    """The same bodies, joints and tendons, with a motor for every muscle and for the passive ankle."""
    spec = mujoco.MjSpec.from_string(built.xml)
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    spec.nuserdata = 0
    spec.compiler.discardvisual = True  # as the model that is stepped
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
    model: mujoco.MjModel, control: np.ndarray, state: np.ndarray, simulations: int, threads: int
) -> Callable[[], float]:
    """A measurement: steps per second of a batch that starts afresh each time it is called."""
    batch = Batch(model, nsim=simulations, nthread=threads)
    control = np.ascontiguousarray(np.broadcast_to(control, (simulations, *control.shape)))

    def measure() -> float:
        batch.state[:] = state
        with native.installed(), native.without_clock():
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


def against_motors(simulations: int, steps: int, repeats: int) -> list[Figure]:
    """Figures of `seated`: native muscles, motors and Python callbacks, on one thread and on two."""
    built = build(load("scenario", "seated"))
    control, motors = schedule.controls(built, steps), motor_model(built)
    recording = run("seated", {"duration": f"{1e3 * steps * built.scenario.timestep:g} ms"})
    replay = motor_controls(built, recording, motors)
    with native.installed():
        state = equilibrium(built, control[0])
    data = mujoco.MjData(motors)
    data.qpos[built.index.ankle_qpos] = recording["ankle/angle"][0]
    start = get_state(motors, data)
    rates = in_turn(
        {
            **{f"native {n}": batch_rate(built.model, control, state, simulations, n) for n in (1, 2)},
            **{f"motors {n}": batch_rate(motors, replay, start, simulations, n) for n in (1, 2)},
            "python 1": lambda: python_rate(built, control[:PYTHON_STEPS], state),
        },
        repeats,
    )
    return [
        *(
            figure(f"{name} thread{'s' * (name[-1] == '2')}", "steps/s", "higher", v)
            for name, v in rates.items()
        ),
        # "" as a direction: a faster engine lowers this ratio while the callbacks stay what they are
        ratio("native over motors, 1 thread", rates["native 1"], rates["motors 1"], ""),
        ratio("native over motors, 2 threads", rates["native 2"], rates["motors 2"], ""),
        ratio("native over Python callbacks", rates["native 1"], rates["python 1"], ""),
        ratio("native, 2 threads over 1", rates["native 2"], rates["native 1"], "higher"),
        ratio("motors, 2 threads over 1", rates["motors 2"], rates["motors 1"], ""),
    ]

"""The seated leg in OpenSim 4.6, beside this project's own roll-out: wall time of 16 s, measured in turn.

    pip install opensim
    python scripts/benchmarks/opensim_seated.py [--accuracy 1e-3] [--repeats 7]

The foot hangs on the same pin joint, with the same mass, inertia, damping, passive moment and weight. Five
`McKibbenActuator`s of the same braid pull between the same points. OpenSim has no air: pressures are
prescribed, as tables of time at which a rigidly mounted braid pulls at the recorded angle as our muscle did.
So the two feet move alike, and the script says how far they are apart.
Where the wheel is missing the script says so and ends.
"""

import argparse
import functools
import importlib
import importlib.util
import math
import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from measuring import figure, in_turn, ratio, table

from afo_sim.common import GRAVITY
from afo_sim.description import load
from afo_sim.model import Built, muscle_names
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.physics import Braid
from afo_sim.simulation import Recording
from afo_sim.simulation.run import run
from afo_sim.simulation.simulate import simulate

ROW = 0.02  # between two pressures of a table [s]
DIFFERENCES = """What differs: OpenSim is given the pressures, so that it computes no air, no valves and no
own lengths. Its muscles have no bladder, damping, cable or cuff; its joint has no stops. It chooses its steps
by its accuracy and keeps their states. This project computes all of that, at a fixed step, and keeps forces
and states of every step. The error of each is against its own fine steps."""
STEPS = "2 ms", "5 ms", "10 ms"  # of ours
FINER = 1.0, 0.1, 0.01  # OpenSim's accuracies, of the one that is asked for
FINE = {"timestep": "0.05 ms", "record_rate": "10 kHz"}
FINE_ACCURACY, FINE_STEP = 1e-9, 1e-3  # OpenSim's [-], [s]

Motion = tuple[np.ndarray, np.ndarray]  # times [s] and angles of the ankle [rad]


def foot_of(built: Built) -> tuple[float, np.ndarray, float]:
    """Mass of all that turns about the ankle [kg], its centre [m], inertia about the centre [kg·m²]."""
    model, data = built.model, _straight(built)
    foot = model.body("foot").id
    mass, centre = float(model.body_subtreemass[foot]), data.subtree_com[foot]
    inertia = 0.0
    for body in range(model.nbody):
        if foot in (body, model.body_parentid[body]):
            axes, place = data.ximat[body].reshape(3, 3), data.xipos[body] - centre
            own = (axes * model.body_inertia[body]) @ axes.T
            inertia += own[1, 1] + model.body_mass[body] * (place[0] ** 2 + place[2] ** 2)
    return mass, centre - data.xanchor[0], float(inertia)


def points_of(built: Built, name: str) -> list[np.ndarray]:
    """Origin and insertion of a muscle at angle zero, from the ankle [m]."""
    data = _straight(built)
    return [data.site(f"{name}_{end}").xpos - data.xanchor[0] for end in ("origin", "insertion")]


def _straight(built: Built) -> mujoco.MjData:
    data = mujoco.MjData(built.model)
    mujoco.mj_kinematics(built.model, data)
    mujoco.mj_comPos(built.model, data)
    return data


def pressures(built: Built, recording: Recording, name: str) -> np.ndarray:
    """Pressure at which a rigidly mounted braid pulls as hard as our muscle at the recorded angles [Pa]."""
    group = built.scenario.orthosis.muscle[name.rpartition("_")[0]]
    length = recording[f"muscle/{name}/path_length"] - group.series_length
    return recording[f"muscle/{name}/force"] / braid_area(group.type.braid, length)


def braid_area(braid: Braid, length: np.ndarray) -> np.ndarray:
    """Force per pressure of OpenSim's muscle, (3 L² − B²)/(4 π N²) [m²]."""
    return (3.0 * length**2 - braid.thread_length**2) / (4.0 * math.pi * braid.turns**2)


def passive_expression(built: Built) -> str:
    """Damping and passive moment of the ankle as OpenSim reads them (`riener_edrich_1999`, −40…20°)."""
    leg, knee = built.scenario.leg, math.degrees(built.scenario.shank.knee_angle or 0.0)
    angle = f"({180.0 / math.pi!r}*(q-({leg.passive.offset!r})))"
    dorsal = f"exp({-7.9763 + 0.0008 * knee!r}-0.1949*{angle})"
    plantar = f"exp({2.1016 - 0.0176 * knee!r}+0.0843*{angle})"
    passive = f"{leg.passive.scale!r}*({dorsal}-{plantar}+1.792)"
    return f"{passive}-{leg.damping!r}*qdot-({built.scenario.load_moment!r})"


def leg_in(osim: Any, built: Built, recording: Recording) -> Any:
    """The OpenSim model, whose pressures move its foot as ours moved."""
    model = osim.Model()
    model.setGravity(osim.Vec3(0.0, 0.0, -GRAVITY))
    mass, centre, inertia = foot_of(built)
    foot = osim.Body("foot", mass, osim.Vec3(*centre), osim.Inertia(inertia, inertia, inertia))
    upright = osim.Vec3(0.5 * math.pi, 0.0, 0.0)  # a pin turns about z, the ankle about −y
    here = osim.Vec3(0.0)
    joint = osim.PinJoint("ankle", model.getGround(), here, upright, foot, here, upright)
    joint.updCoordinate().setName("angle")
    model.addBody(foot)
    model.addJoint(joint)
    model.addForce(osim.ExpressionBasedCoordinateForce("angle", passive_expression(built)))
    valves = osim.PrescribedController()
    valves.setName("valves")
    rows = np.arange(0.0, recording["time"][-1] + ROW, ROW)
    for name in muscle_names(built.scenario.orthosis):
        muscle = _muscle(osim, model, foot, built, name)
        valves.addActuator(muscle)
        pressure = np.interp(rows, recording["time"], pressures(built, recording, name))
        points = osim.PiecewiseLinearFunction()
        for moment, value in zip(rows, pressure, strict=True):
            points.addPoint(float(moment), float(value))
        valves.prescribeControlForActuator(name, points)
    model.addController(valves)
    return model


def _muscle(osim: Any, model: Any, foot: Any, built: Built, name: str) -> Any:
    group = built.scenario.orthosis.muscle[name.rpartition("_")[0]]
    braid, (origin, insertion) = group.type.braid, points_of(built, name)
    muscle = osim.McKibbenActuator(name, braid.turns, braid.thread_length)
    muscle.set_cord_length(group.series_length)
    muscle.addNewPathPoint(f"{name}_origin", model.getGround(), osim.Vec3(*origin))
    muscle.addNewPathPoint(f"{name}_insertion", foot, osim.Vec3(*insertion))
    model.addForce(muscle)
    return muscle


def integrated(
    osim: Any, model: Any, recording: Recording, accuracy: float, step: float
) -> tuple[float, Any]:
    """Wall time of the integration alone [s], and the states at its steps of `step` at most [s]."""
    state = model.initSystem()
    coordinate = model.getCoordinateSet().get("angle")
    coordinate.setValue(state, float(recording["ankle/angle"][0]))
    coordinate.setSpeedValue(state, 0.0)
    manager = osim.Manager(model)
    manager.setIntegratorAccuracy(accuracy)
    manager.setIntegratorMaximumStepSize(step)
    manager.initialize(state)
    begun = time.perf_counter()
    manager.integrate(float(recording["time"][-1]))
    return time.perf_counter() - begun, manager.getStatesTable()


def motion(states: Any) -> Motion:
    """The motion at OpenSim's steps."""
    angle = states.getDependentColumn("/jointset/ankle/angle/value").to_numpy()
    return np.array(states.getIndependentColumn()), angle


def recorded(recording: Recording) -> Motion:
    """The motion at our steps."""
    return recording["time"], recording["ankle/angle"]


def apart(one: Motion, other: Motion) -> float:
    """Greatest difference of the two angles at the steps of the first [deg]."""
    return math.degrees(np.abs(one[1] - np.interp(one[0], *other)).max())


def measured(osim: Any, accuracy: float, repeats: int) -> str:
    """Both programs in turn, as a table in words."""
    built, recording = build(load("scenario", "seated")), run("seated")
    leg, duration = leg_in(osim, built, recording), built.scenario.duration
    variants = {f"OpenSim, accuracy {part * accuracy:g}": part * accuracy for part in FINER}
    measures: dict[str, Callable[[], float]] = {}
    lines, ours = [], recorded(run("seated", FINE))
    for step in STEPS:
        own = build(load("scenario", "seated", {"timestep": step}))
        measures[f"afo-sim, steps of {step}"] = functools.partial(_rolled_out, own, schedule.controls(own))
        error = apart(recorded(run("seated", {"timestep": step})), ours)
        lines.append(f"afo-sim, steps of {step}: {own.scenario.n_step} steps, error {error:.2g} deg")
    fine = motion(integrated(osim, leg, recording, FINE_ACCURACY, FINE_STEP)[1])
    for name, asked in variants.items():
        moved = motion(integrated(osim, leg, recording, asked, duration)[1])
        error, far = apart(moved, fine), apart(moved, ours)
        lines.append(f"{name}: {len(moved[0]) - 1} steps, error {error:.2g} deg, {far:.2g} deg from afo-sim")
        measures[name] = functools.partial(_seconds, osim, leg, recording, asked, duration)
    seconds = in_turn(measures, repeats)
    first = next(iter(measures))
    figures = [
        *(figure(name, "s", "lower", values) for name, values in seconds.items()),
        *(ratio(f"{name}, over {first}", seconds[name], seconds[first], "") for name in variants),
    ]
    return "\n".join([*lines, "", table(f"{duration:g} s of `seated`", figures)])


def _rolled_out(built: Built, control: np.ndarray) -> float:
    begun = time.perf_counter()
    simulate(built, control)
    return time.perf_counter() - begun


def _seconds(osim: Any, model: Any, recording: Recording, accuracy: float, step: float) -> float:
    return integrated(osim, model, recording, accuracy, step)[0]


def main() -> None:
    """Measure where the wheel is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--accuracy", type=float, default=1e-3, help="of OpenSim's integrator")
    parser.add_argument("--repeats", type=int, default=7)
    options = parser.parse_args()
    if importlib.util.find_spec("opensim") is None:
        print("skipped: the wheel `opensim` is not installed (pip install opensim)")
        return
    osim = importlib.import_module("opensim")
    osim.Logger.setLevelString("Error")
    print(
        f"OpenSim {osim.GetVersion()}\n{DIFFERENCES}\n\n{measured(osim, options.accuracy, options.repeats)}"
    )


if __name__ == "__main__":
    main()

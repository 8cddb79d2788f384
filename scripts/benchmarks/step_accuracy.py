"""What accuracy costs: errors of walking against a step of 10 µs, and the largest step that will do."""

import functools
import itertools
import json
import pathlib
import time
from dataclasses import dataclass

import mujoco
import numpy as np
from designs import SCENARIO, WALKED
from measuring import Figure, figure, in_turn

from afo_sim.common import InputError, code_fingerprint
from afo_sim.description import load
from afo_sim.model import supply_and_timer as schedule
from afo_sim.model.build import build
from afo_sim.simulation import simulate_together
from afo_sim.simulation.examine import examine

REFERENCE = "0.01 ms"
STEPS = (0.25, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)  # ms
DEFAULT = "IMPLICITFAST"
OTHERS = ("EULER", "IMPLICIT", "RK4")  # integrators, tried at 1 ms
WATCHED, STRIDES = "3.6 s", 3  # two of them counted
ANGLE, TORQUE = 0.1, 1.0  # errors that will do [deg], [%]
PEAK, CLEARANCE = "orthosis_peak_dorsiflexion_torque_10ms", "toe_clearance"


@dataclass(frozen=True)
class Walked:
    """Angle over time [s], [rad], peak torque of 10 ms [N·m] and toe clearance [mm] of a run."""

    time: np.ndarray
    angle: np.ndarray
    torque: float
    clearance: float


@dataclass(frozen=True)
class Errors:
    """Greatest error of the angle [deg], error of the 10 ms torque [%] and of the toe clearance [mm]."""

    angle: float
    torque: float
    clearance: float

    @property
    def will_do(self) -> bool:
        """Whether angle and torque are as good as asked for."""
        return self.angle <= ANGLE and self.torque <= TORQUE


def walked(step: str, integrator: str = DEFAULT) -> tuple[Walked, float]:
    """A run, and what roll-out and metrics took [s]."""
    built = build(load("scenario", SCENARIO, {"timestep": step, "duration": WATCHED, **WALKED}))
    built.model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    control = schedule.controls(built)
    begun = time.perf_counter()
    (rollout,) = simulate_together([built], [control])
    if rollout.failure is not None:
        raise rollout.failure
    columns, found = examine(built, rollout, transient=False)
    seconds = time.perf_counter() - begun
    totals = found.totals
    angle = np.array(columns["ankle/angle"])
    return Walked(np.array(columns["time"]), angle, totals[PEAK].value, totals[CLEARANCE].value), seconds


def reference(file: pathlib.Path | None) -> Walked:
    """The run at a step of 10 µs: from a file that holds it, else computed and kept there."""
    described = load("scenario", SCENARIO, {"timestep": REFERENCE, "duration": WATCHED, **WALKED}).resolved()
    words = json.dumps(described, sort_keys=True, default=str)
    if file is not None and file.exists():
        with np.load(file) as kept:
            if str(kept["scenario"]) != words:
                raise SystemExit(f"{file} holds the reference of another scenario: remove it")
            if str(kept["code"]) != code_fingerprint():
                print(f"{file} was computed by other code: remove it where results have changed")
            return Walked(kept["time"], kept["angle"], float(kept["torque"]), float(kept["clearance"]))
    found, _ = walked(REFERENCE)
    if file is not None:
        np.savez(file, scenario=words, code=code_fingerprint(), **vars(found))
    return found


def errors_of(run: Walked, fine: Walked) -> Errors:
    """Errors of a run."""
    exact = np.interp(run.time, fine.time, fine.angle)
    return Errors(
        angle=float(np.degrees(np.abs(run.angle - exact).max())),
        torque=100.0 * abs(run.torque / fine.torque - 1.0),
        clearance=abs(run.clearance - fine.clearance),
    )


def _tried(fine: Walked) -> dict[str, Errors]:
    """Errors of each step, and of other integrators at 1 ms."""
    found = {_name(step): errors_of(walked(_name(step))[0], fine) for step in STEPS}
    for integrator in OTHERS:
        try:
            found[f"1 ms {integrator.lower()}"] = errors_of(walked("1 ms", integrator)[0], fine)
        except InputError as error:
            print(f"{integrator.lower()}: {error}")
    return found


def _largest(errors: dict[str, Errors]) -> float | None:
    """The largest step [ms] that will do, with all that are smaller."""
    enough = list(itertools.takewhile(lambda step: errors[_name(step)].will_do, STEPS))
    return enough[-1] if enough else None


def accuracy(repeats: int, file: pathlib.Path | None) -> list[Figure]:
    """Errors and costs of steps and integrators.

    Parameters
    ----------
    repeats : rounds of the costs
    file : the reference is kept here
    """
    errors = _tried(reference(file))
    seconds = in_turn({_name(step): functools.partial(_cost, step) for step in STEPS}, repeats)
    units = {"angle": "deg", "torque": "%", "clearance": "mm"}
    figures = [
        *(
            figure(f"error of the {quantity}, {name}", unit, "", getattr(found, quantity))
            for quantity, unit in units.items()
            for name, found in errors.items()
        ),
        *(figure(f"cost of a stride, {name}", "ms", "lower", values) for name, values in seconds.items()),
    ]
    largest, words = _largest(errors), f"within {ANGLE:g} deg and {TORQUE:g} %"
    if largest is not None:
        figures.append(figure(f"largest step {words}", "ms", "higher", largest))
        figures.append(figure(f"cost of a stride {words}", "ms", "lower", seconds[_name(largest)]))
    return figures


def _name(step: float) -> str:
    return f"{step:g} ms"


def _cost(step: float) -> float:
    """Of a stride [ms]."""
    return 1e3 * walked(_name(step))[1] / STRIDES

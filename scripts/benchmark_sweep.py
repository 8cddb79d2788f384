"""Speed, memory and accuracy of sweeps, as ratios measured in one run on one machine; prints tables.

    python scripts/benchmark_sweep.py [--cases 96] [--repeats 5] [--parts speed,memory,accuracy] [--many]

`--many` also runs 100 000 short cases for their memory (about half an hour).
"""

import argparse
import pathlib
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch

from afo_sim import native
from afo_sim.common.errors import InputError
from afo_sim.description.reader import load
from afo_sim.model import controls as schedule
from afo_sim.model.build import build
from afo_sim.model.start import walking_start
from afo_sim.simulation.examine import make_recording
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.simulate import simulate
from afo_sim.study import design, engine, runner, sweep_file

WALK = """
scenario = "walk-dropfoot-afo"
design = "sobol"
cases = {cases}
[set]
timestep = "{step}"
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "5 bar"
[parameters.start]
key = "phases.dorsiflexor.inlet[0][0]"
from = 0.45
to = 0.6
[parameters.mass]
key = "patient.body_mass"
from = "60 kg"
to = "90 kg"
"""
SHORT = """
scenario = "seated"
design = "random"
cases = {cases}
[set]
duration = "0.5 s"
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "4 bar"
"""
REFERENCE = "0.01 ms"
STEPS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0)  # ms
INTEGRATORS = ("EULER", "IMPLICITFAST", "IMPLICIT", "RK4")
WATCHED = "3.6 s"  # two counted strides
PEAK, CLEARANCE = "orthosis_peak_dorsiflexion_torque", "toe_clearance"


def store_of(text: str, folder: pathlib.Path) -> runner.Store:
    """A sweep that has not begun."""
    file = folder / "sweep.toml"
    file.write_text(text, encoding="utf-8")
    chosen = sweep_file.read(file)
    return runner.open_store(chosen, design.cases_of(chosen), folder / "out")


def bare_seconds(cases: list[engine.Prepared], threads: int) -> float:
    """Of Batch.rollout alone, on the same models, per case."""
    with native.installed():
        batch = Batch(cases[0].built.model, nsim=len(cases), nthread=threads)
        batch.set_models([case.built.model for case in cases])
        batch.state[:] = [walking_start(case.built, case.control[0]) for case in cases]
        controls = np.stack([case.control for case in cases])
        begun = time.perf_counter()
        batch.rollout(controls.shape[1], controls, record=["qpos"])
        return (time.perf_counter() - begun) / len(cases)


def speed(count: int, repeats: int, step: str) -> None:
    """Whole sweeps, with metrics and files, against the bare roll-out of the same models."""
    seconds: dict[str, list[float]] = {f"{what} {n}": [] for n in (1, 2) for what in ("bare", "sweep")}
    for _ in range(repeats):
        for threads in (1, 2):
            with tempfile.TemporaryDirectory() as name:
                store = store_of(WALK.format(cases=count, step=step), pathlib.Path(name))
                sets = [store.cases.sets(case) for case in range(min(count, 16))]
                found = [engine.prepare("walk-dropfoot-afo", k, s) for k, s in enumerate(sets)]
                prepared = [case for case in found if isinstance(case, engine.Prepared)]
                seconds[f"bare {threads}"].append(bare_seconds(prepared, threads))
                begun = time.perf_counter()
                runner.run(store, threads=threads)
                seconds[f"sweep {threads}"].append((time.perf_counter() - begun) / count)
    walk = prepared[0].built.walk
    assert walk is not None
    strides = float(walk.phase[-1] - walk.phase[0])
    print(f"step {step}, {count} cases of {strides:.1f} strides, median of {repeats}")
    print("threads  bare [strides/s]  sweep [strides/s]  sweep/bare")
    for threads in (1, 2):
        bare, sweep = (seconds[f"{what} {threads}"] for what in ("bare", "sweep"))
        ratio = float(np.median(np.divide(bare, sweep)))
        rates = [strides / float(np.median(values)) for values in (bare, sweep)]
        print(f"{threads:7d}  {rates[0]:16.1f}  {rates[1]:17.1f}  {ratio:10.2f}")
    print(f"2 threads to 1: {float(np.median(np.divide(seconds['sweep 1'], seconds['sweep 2']))):.2f}\n")


def memory(counts: list[int]) -> None:
    """Peak memory of whole sweeps of short cases, each in a process of its own."""
    print("cases    peak [MB]  cases/s")
    for count in counts:
        command = [sys.executable, __file__, "--memory-of", str(count)]
        said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        print(said, end="", flush=True)
    print()


def memory_of(count: int) -> None:
    """One line of `memory`."""
    with tempfile.TemporaryDirectory() as name:
        store = store_of(SHORT.format(cases=count), pathlib.Path(name))
        begun = time.perf_counter()
        runner.run(store)
        seconds = time.perf_counter() - begun
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"{count:7d}  {peak:9.0f}  {count / seconds:7.1f}")


def recorded(integrator: str, step: str) -> Recording:
    """The walk of the accuracy table."""
    sets: Mapping[str, Any] = {"timestep": step, "duration": WATCHED}
    built = build(load("scenario", "walk-dropfoot-afo", sets))
    built.model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    control = schedule.controls(built)
    return make_recording(built, simulate(built, control))


def accuracy(repeats: int) -> None:
    """Errors against a fine reference, and what a stride costs."""
    fine = recorded("IMPLICITFAST", REFERENCE)
    rows: list[tuple[str, float, float, Recording]] = []
    refused: list[str] = []
    for integrator in INTEGRATORS:
        for step in STEPS:
            try:
                runs = [recorded(integrator, f"{step:g} ms") for _ in range(repeats)]
            except InputError as error:
                refused.append(f"{integrator.lower()} {step:g} ms: {error.problem}; {error.allowed}")
                continue
            seconds = min(run.timing["wall_seconds"] for run in runs)
            rows.append((integrator, step, seconds, runs[0]))
    cheapest = min(seconds for _, _, seconds, run in rows if run.ok)
    print(f"against {REFERENCE}, {WATCHED} of walk-dropfoot-afo")
    print("integrator    step [ms]  angle [deg]  peak torque [%]  clearance [mm]  cost")
    for integrator, step, seconds, run in rows:
        name = f"{integrator.lower():12s}  {step:9g}  "
        if not run.ok:
            print(name + run.status)
        else:
            every = round(step) if step > 1.0 else 1
            angle = np.degrees(np.abs(run["ankle/angle"] - fine["ankle/angle"][::every]).max())
            torque = run.metrics[PEAK].value / fine.metrics[PEAK].value - 1.0
            height = run.metrics[CLEARANCE].value - fine.metrics[CLEARANCE].value
            errors = f"{angle:11.3f}  {100.0 * torque:15.2f}  {height:14.3f}"
            print(f"{name}{errors}  {seconds / cheapest:4.1f}")
    print("refused:", *refused, sep="\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=96)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--parts", default="speed,memory,accuracy")
    parser.add_argument("--many", action="store_true")
    parser.add_argument("--memory-of", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.memory_of:
        memory_of(options.memory_of)
        return
    parts = options.parts.split(",")
    for step in ("0.25 ms", "1 ms") if "speed" in parts else ():
        speed(options.cases, options.repeats, step)
    if "memory" in parts:
        memory([1000, 10_000, *([100_000] if options.many else [])])
    if "accuracy" in parts:
        accuracy(options.repeats)


if __name__ == "__main__":
    main()

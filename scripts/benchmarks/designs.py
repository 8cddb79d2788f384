"""Designs per second, of cases that differ in pressure, valve phase and body mass."""

import json
import pathlib
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from unittest import mock

import numpy as np
from measuring import Figure, figure, in_turn, ratio, spent
from mujoco.batch import Batch

from afo_sim import native
from afo_sim.common import names
from afo_sim.description import expand, load
from afo_sim.simulation import EVERYTHING, Asked
from afo_sim.simulation.simulate import begun_case
from afo_sim.simulation.stepping import BatchStepper, Rows, Stop
from afo_sim.study import design, engine, sweep_plan
from afo_sim.study.processes import Processes

By = Callable[..., Iterator[tuple[int, engine.Outcome]]]  # as engine.outcomes
SCENARIO = "walk-dropfoot-afo"
SWEEP = """
scenario = "{scenario}"
design = "sobol"
cases = {cases}
[set]
{sets}
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
STEPS = ("1 ms", "2 ms", "3 ms")
THREADS = (1, 2)
WALKED = {"gait.settled": "walked"}  # overrides with which a case walks all its strides
NUMBERS = frozenset({"toe_clearance", "air_per_stride", "orthosis_peak_dorsiflexion_torque"})
WAYS: dict[str, tuple[dict[str, str], Asked]] = {  # what is set, and asked of each case
    "settled designs": ({}, Asked(NUMBERS)),
    "settled designs, first stride": ({}, Asked(NUMBERS | {"toe_clearance_stride_1"})),
    "settled designs, all metrics": ({}, EVERYTHING),  # ten strides from the start beside the settled one
    "settled designs, walked": (WALKED, EVERYTHING),
}
SOLVED = 4  # times as many designs where strides are solved: they take a quarter of the time


def cases_of(count: int, sets: Mapping[str, str]) -> list[dict[str, object]]:
    """The overrides of each case of a sweep."""
    lines = "\n".join(f'{key} = "{value}"' for key, value in sets.items())
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "sweep.toml")
        file.write_text(SWEEP.format(scenario=SCENARIO, cases=count, sets=lines), encoding="utf-8")
        cases = design.cases_of(sweep_plan.read(file))
        return [cases.sets(case) for case in range(count)]


def outcomes_of(
    name: str,
    cases: Sequence[Mapping[str, object]],
    threads: int,
    asked: Asked,
    by: By = engine.outcomes,
) -> Callable[[], float]:
    """A measurement: cases of a scenario per second."""
    scenario = json.loads(json.dumps(expand("scenario", name)))  # as a sweep holds it

    def measure() -> float:
        begun = time.perf_counter()
        found = [outcome for _, outcome in by(scenario, enumerate(cases), threads, asked=asked)]
        seconds = time.perf_counter() - begun
        bad = [outcome.reason for outcome in found if outcome.status != engine.OK]
        if bad:
            raise SystemExit(f"{len(bad)} of {len(cases)} cases of {name} do not run: {bad[0]}")
        return len(cases) / seconds

    return measure


def bare(cases: list[engine.Prepared], steps: int) -> Callable[[], float]:
    """A measurement: processor time of as many steps by `mujoco.batch` alone, on the same models [s]."""
    batch = Batch(cases[0].built.model, nsim=len(cases), nthread=1)
    batch.set_models([case.built.model for case in cases])
    with native.installed():
        first = np.array([begun_case(case.built, case.control).state for case in cases])
    controls = np.stack([case.control for case in cases])
    controls = np.resize(controls.swapaxes(0, 1), (steps, *controls.shape[::2])).swapaxes(0, 1)
    inputs = np.ascontiguousarray(controls)

    def once() -> None:
        batch.state[:] = first
        with native.installed(), native.without_clock():
            batch.rollout(inputs.shape[1], inputs, record=["qpos"])

    return _processor_of(once)


def design_rates(count: int, repeats: int) -> list[Figure]:
    """Settled designs per second, as a scenario settles them by default, and walked beside."""
    processor: dict[str, list[float]] = {}  # time of each design [ms]: what else runs disturbs it least

    def watched(name: str, cases: int, once: Callable[[], float]) -> Callable[[], float]:
        def measure() -> float:
            with spent() as took:
                rate = once()
            processor.setdefault(name, []).append(1e3 * took.processor / cases)
            return rate

        return measure

    names = {
        f"{way}, {step}": ({"timestep": step, **sets}, asked)
        for way, (sets, asked) in WAYS.items()
        for step in STEPS
    }
    measures = {}
    with Processes(1, patience=0.0) as beside:
        for name, (sets, asked) in names.items():
            cases = cases_of(count if "gait.settled" in sets else SOLVED * count, sets)
            for n in THREADS:
                once = outcomes_of(SCENARIO, cases, n, asked)
                measures[f"{name}, threads {n}"] = watched(name, len(cases), once) if n == 1 else once
            measures[f"{name}, processes 2"] = outcomes_of(SCENARIO, cases, 1, asked, beside.outcomes)
        told = _told(measures, "designs/s", repeats)
    return [
        *told,
        *(figure(f"{name}, processor time of each", "ms", "lower", v[1:]) for name, v in processor.items()),
    ]


def overheads(count: int, repeats: int) -> list[Figure]:
    """Processor time of designs over that of the engine alone for as many steps of the same models."""
    ways = {way: (SCENARIO, {"timestep": "2 ms", **WAYS[way][0]}, WAYS[way][1]) for way in list(WAYS)[::2]}
    ways |= {f"{name}, all metrics": (name, {}, EVERYTHING) for name in sorted(names("scenario"))}
    found: list[Figure] = []
    for way, (scenario, sets, asked) in ways.items():
        cases = cases_of(count, sets) if sets else alike_cases(scenario, count)
        once = outcomes_of(scenario, cases, 1, asked)
        once()
        with steps_counted() as counted:
            once()
        steps = round(sum(counted) / count)
        models = [_ready(scenario, k, case) for k, case in enumerate(cases)]
        times = in_turn({way: _processor_of(once), "engine": bare(models, steps)}, repeats)
        found += [
            figure(f"{way}, steps of each", "", "lower", steps),
            figure(f"{way}, Python calls of each", "", "lower", python_calls(once) / count),
            figure(f"{way}, processor time of each", "ms", "lower", 1e3 / count * np.array(times[way])),
            figure("…of which the engine's steps", "ms", "lower", 1e3 / count * np.array(times["engine"])),
            ratio(f"{way}, overhead factor", times[way], times["engine"], "lower"),
        ]
    return found


def alike_cases(scenario: str, count: int) -> list[dict[str, object]]:
    """Cases of a scenario that differ in the supply's pressure, or without one in the person's mass."""
    described = load("scenario", scenario)
    shares = np.linspace(0.8, 1.0, count)
    if described.orthosis.chamber:
        return [{"supply.pressure": f"{share * described.supply.pressure} Pa"} for share in shares]
    return [{"patient.body_mass": f"{70.0 * share} kg"} for share in shares]


def python_calls(once: Callable[[], float]) -> int:
    """Calls of Python functions while something runs."""
    calls = 0

    def watch(frame: object, event: str, _: object) -> None:
        nonlocal calls
        calls += event == "call"

    sys.setprofile(watch)
    try:
        once()
    finally:
        sys.setprofile(None)
    return calls


def _processor_of(once: Callable[[], object]) -> Callable[[], float]:
    """A measurement of the processor time of another [s]."""

    def measure() -> float:
        with spent() as took:
            once()
        return took.processor

    return measure


@contextmanager
def steps_counted() -> Iterator[list[int]]:
    """A block in which each stretch of steps notes how many steps it takes, over all simulations."""
    counted: list[int] = []
    own = BatchStepper.advance

    def noted(self: BatchStepper, alive: Sequence[int], inputs: np.ndarray, out: Rows) -> dict[int, Stop]:
        counted.append(len(alive) * inputs.shape[1])
        return own(self, alive, inputs, out)

    with mock.patch.object(BatchStepper, "advance", noted):
        yield counted


def _ready(scenario: str, number: int, sets: Mapping[str, object]) -> engine.Prepared:
    case = engine.prepare(scenario, number, sets)
    if isinstance(case, engine.Outcome):
        raise SystemExit(f"case {number} does not run: {case.reason}")
    return case


def _told(measures: Mapping[str, Callable[[], float]], unit: str, repeats: int) -> list[Figure]:
    """Rates, and what two threads or processes are to one."""
    rates = in_turn(measures, repeats)
    one = [name for name in rates if name.endswith("threads 1")]
    return [
        *(figure(name, unit, "higher", values) for name, values in rates.items()),
        *(
            ratio(f"{name.removesuffix('threads 1')}{two} over 1", rates[both], rates[name], "higher")
            for name in one
            for two in ("threads 2", "processes 2")
            if (both := name.removesuffix("threads 1") + two) in rates
        ),
    ]

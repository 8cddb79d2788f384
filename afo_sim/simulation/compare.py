"""One scenario with several muscle laws, side by side: runs, differences, tables."""

import itertools
import os
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from afo_sim.common import InputError, JsonMapping, unknown
from afo_sim.description import Scenario, load
from afo_sim.metrics import number, unit
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.run import run_at_step

ANGLE = "ankle/angle"

Report = Callable[[int, int, str], None]


def common_laws(scenario: Scenario) -> list[str]:
    """The laws that every muscle of a scenario has parameters for."""
    groups = list(scenario.orthosis.muscle.values())
    return [law for law in groups[0].type.laws if all(law in group.type.laws for group in groups)]


def compare_laws(
    scenario: str | os.PathLike[str] | JsonMapping,
    laws: Sequence[str] = (),
    sets: Mapping[str, object] | None = None,
    *,
    report: Report | None = None,
) -> dict[str, Recording]:
    """Run a scenario once with each law in all its muscles."""
    for key in sets or {}:
        if key.endswith(".type.law"):
            raise InputError("is what the comparison varies", field="sets", value=key, allowed="`laws`")
    plain = load("scenario", scenario, sets)
    known = common_laws(plain)
    for law in laws:
        if law not in known:
            problem = "is not a law that all muscles of the scenario have parameters for"
            raise unknown(law, known, field="laws", problem=problem)
    runs = {}
    for law in dict.fromkeys(laws or known):

        def tell(done: int, total: int, what: str, law: str = law) -> None:
            if report is not None:
                report(done, total, f"{law}, {what}")

        chosen = {f"orthosis.muscle.{group}.type.law": law for group in plain.orthosis.muscle}
        runs[law] = run_at_step(load("scenario", scenario, {**(sets or {}), **chosen}), report=tell)
    return runs


def angle_differences(runs: Mapping[str, Recording]) -> dict[tuple[str, str], float]:
    """Root mean square of the angle between every two runs, over the time that both have [rad]."""
    found = {}
    for a, b in itertools.combinations(runs, 2):
        rows = min(len(runs[a][ANGLE]), len(runs[b][ANGLE]))
        difference = runs[a][ANGLE][:rows] - runs[b][ANGLE][:rows]
        found[a, b] = float(np.sqrt(np.mean(difference**2))) if rows else float("nan")
    return found


def tables(runs: Mapping[str, Recording]) -> list[tuple[str, list[str], list[list[str]]]]:
    """(title, header, rows): every run's metrics, and the angle between every two."""
    names = list(dict.fromkeys(name for run in runs.values() for name in run.metrics))
    metrics = []
    for name in names:
        found = [run.metrics.get(name) for run in runs.values()]
        known = next(m for m in found if m is not None)
        metrics.append([name, unit(known), *("" if m is None else number(m.value, m.unit) for m in found)])
    apart = angle_differences(runs)
    apart |= {(b, a): angle for (a, b), angle in apart.items()}
    pairs = [[a, *(f"{np.degrees(apart.get((a, b), 0.0)):.3f}" for b in runs)] for a in runs]
    return [
        ("metrics", ["metric", "unit", *runs], metrics),
        ("angle between two runs, RMS [deg]", ["", *runs], pairs),
    ]

"""The tables of docs/accuracy.md on time steps: walked strides, settled strides, and drawn cases.

Errors are against a step of 10 µs (seated 50 µs), of drawn cases against 0.25 ms. The shipped scenarios'
walker is `bovi2011_natural`.

    python scripts/accuracy_tables.py [--part walked|settled|drawn]
"""

import argparse
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import afo_sim as afo
from afo_sim.common import assets
from afo_sim.study import cases_of, sweep_plan

Sets = Mapping[str, Any]
PLAIN, SHORT, SEATED = "walk-dropfoot-afo", "walk-dropfoot-afo-short", "seated"
FINE = {"timestep": "0.01 ms", "record_rate": "10 kHz"}
WALKED = {"gait.settled": "walked", "duration": "6.6 s"}  # six strides, from full muscles on
BRIEF = {"duration": "2.6 s"}  # hardly more than the settled strides
GROUPS = "dorsiflexor", "plantarflexor"
CABLES = tuple(f"orthosis.muscle.{name}.cable.stiffness" for name in GROUPS)
RIGID = {**dict.fromkeys(CABLES, "1e6 N/m"), "orthosis.anchor": {}}
OTHER = {"gait.cycle": "gatk_stride1"}
CASES: dict[str, tuple[str, Sets]] = {  # title: scenario, what it sets
    "S1's device": (PLAIN, {}),
    "S1's device, gatk_stride1": (PLAIN, OTHER),
    "shorter links": (SHORT, {}),
    "S1's device, rigid cables, cuff and plate": (PLAIN, RIGID),
}
PEAK, CLEARANCE = "orthosis_peak_dorsiflexion_torque_10ms", "toe_clearance"


@dataclass(frozen=True)
class Errors:
    """Greatest error of the angle [deg], error of the toe clearance [mm] and of the 10 ms torque [%]."""

    angle: float
    clearance: float = float("nan")
    torque: float = float("nan")


def row(title: str, values: list[float]) -> str:
    """A line of a table, two digits each."""
    return f"| {title} | {' | '.join(f'{value:.2g}' for value in values)} |"


def differences(
    run: afo.Recording, fine: afo.Recording, column: str, one: np.ndarray, other: np.ndarray
) -> Errors:
    """Errors of rows of a run.

    Parameters
    ----------
    run, fine : of one scenario
    column : of place in the run, rising over the rows
    one, other : masks of the rows of the run and of the fine one
    """
    exact = np.interp(run[column][one], fine[column][other], fine["ankle/angle"][other])
    angle = np.degrees(np.abs(run["ankle/angle"][one] - exact).max())
    if PEAK not in run.metrics or CLEARANCE not in run.metrics:
        return Errors(float(angle))
    (clearance, exact_clearance), (torque, exact_torque) = (
        (float(run.metrics[name]), float(fine.metrics[name])) for name in (CLEARANCE, PEAK)
    )
    return Errors(float(angle), abs(clearance - exact_clearance), 100.0 * abs(torque / exact_torque - 1.0))


def solved(run: afo.Recording) -> np.ndarray:
    """Mask of the rows of the last settled stride."""
    stride = run["gait/stride"]
    return (run["gait/solved"] == 1.0) & (stride == max(run.strides))


def settled(scenario: str, sets: Sets, step: float, fine: afo.Recording) -> Errors:
    """Errors of the settled stride at a step [ms]."""
    run = afo.run(scenario, {**BRIEF, **sets, "timestep": f"{step} ms"})
    return differences(run, fine, "gait/phase", solved(run), solved(fine))


def of_walked() -> Iterator[str]:
    """From the start: the first stride, and those after it."""
    steps = (2.0, 1.0, 0.5, 0.25)
    yield row("greatest error of the angle [°], step [ms]", list(steps))
    fine = afo.run(SEATED, {"timestep": "0.05 ms", "record_rate": "1 kHz"})
    seated = [afo.run(SEATED, {"timestep": f"{step} ms"}) for step in steps]
    yield row(
        "seated", [differences(r, fine, "time", r["time"] >= 0.0, fine["time"] >= 0.0).angle for r in seated]
    )
    long = {step: afo.run(SEATED, {"timestep": f"{step} ms"}) for step in (4.0, 5.0, 8.0, 10.0)}
    yield row(
        f"seated, {', '.join(f'{step:g}' for step in long)} ms",
        [differences(r, fine, "time", r["time"] >= 0.0, fine["time"] >= 0.0).angle for r in long.values()],
    )
    for title, (scenario, sets) in CASES.items():
        fine = afo.run(scenario, {**WALKED, **sets, **FINE})
        runs = [afo.run(scenario, {**WALKED, **sets, "timestep": f"{step} ms"}) for step in steps]
        for part, first in ((f"{title}, first stride", True), ("later strides", False)):
            found = [
                differences(run, fine, "time", (run["gait/stride"] < 1.0) == first, fine["time"] >= 0.0)
                for run in runs
            ]
            yield row(part, [errors.angle for errors in found])
        yield row("torque of 10 ms [%]", [errors.torque for errors in found])
        yield row("toe clearance [mm]", [errors.clearance for errors in found])
    for friction in afo.load("scenario", PLAIN).orthosis.muscle["dorsiflexor"].type.frictions:
        rubbing = {**WALKED, **{f"orthosis.muscle.{name}.type.friction": friction for name in GROUPS}}
        fine = afo.run(PLAIN, {**rubbing, **FINE})
        runs = [afo.run(PLAIN, {**rubbing, "timestep": f"{step} ms"}) for step in steps]
        found = [differences(run, fine, "time", run["time"] >= 0.0, fine["time"] >= 0.0) for run in runs]
        yield row(f"S1's device, {friction}", [errors.angle for errors in found])


def of_settled() -> Iterator[str]:
    """Solved for."""
    steps = (1.0, 2.0, 3.0, 4.0)
    yield row("settled stride, step [ms]", list(steps))
    for title, (scenario, sets) in CASES.items():
        fine = afo.run(scenario, {**BRIEF, **sets, **FINE})
        found = [settled(scenario, sets, step, fine) for step in steps]
        yield row(f"{title}: angle [°]", [errors.angle for errors in found])
        yield row("toe clearance [mm]", [errors.clearance for errors in found])
        yield row("torque of 10 ms [%]", [errors.torque for errors in found])


def drawn(kind: str, name: str, count: int) -> tuple[str, list[dict[str, Any]]]:
    """Scenario of a shipped sweep or search, and what some cases set that are drawn within its ranges."""
    file = assets.find(kind, name)
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    kept: dict[str, Any] = {
        key: table[key] for key in ("scenario", "constraints", "set", "parameters") if key in table
    }
    plan = sweep_plan.of_table(file, {**kept, "design": "random", "cases": count, "seed": 1})
    cases = cases_of(plan)
    return table["scenario"], [dict(cases.sets(case)) for case in range(count)]


def of_drawn() -> Iterator[str]:
    """The largest error of all cases."""
    steps = (2.0, 3.0, 4.0)
    yield row("drawn cases, step [ms]", list(steps))
    for title, kind, name, count in (
        ("37 designs of the search", "search", "least-air", 37),
        ("37 designs of the sweep", "sweep", "pressure-and-timing", 37),
    ):
        scenario, cases = drawn(kind, name, count)
        found: dict[float, list[Errors]] = {step: [] for step in steps}
        for sets in cases:
            fine = afo.run(scenario, {**BRIEF, **sets, "timestep": "0.25 ms", "record_rate": "4 kHz"})
            for step in steps:
                found[step].append(settled(scenario, sets, step, fine))
        for quantity in ("angle", "clearance", "torque"):
            worst = [max(getattr(errors, quantity) for errors in found[step]) for step in steps]
            yield row(f"{title}: {quantity}", worst)
    scenario, cases = drawn("sweep", "patients", 20)
    pairs = [
        [afo.run(scenario, {**sets, "timestep": step}).metrics for step in ("0.25 ms", "2 ms")]
        for sets in cases
    ]
    yield row(
        "20 patients at 2 ms: clearance, torque",
        [
            max(abs(coarse[CLEARANCE] - fine[CLEARANCE]) for fine, coarse in pairs),
            max(100.0 * abs(coarse[PEAK] / fine[PEAK] - 1.0) for fine, coarse in pairs),
        ],
    )


PARTS: dict[str, Callable[[], Iterator[str]]] = {
    "walked": of_walked,
    "settled": of_settled,
    "drawn": of_drawn,
}


def main() -> None:
    """Print the parts that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--part", choices=PARTS, action="append")
    for part in parser.parse_args().part or PARTS:
        for line in PARTS[part]():
            print(line, flush=True)
        print()


if __name__ == "__main__":
    main()

"""What static torques tell of each parameter: an interval, or the reason why there is none.

A parameter is refused where the linearised model refuses it (correlation, width, bound), or where a fit
without it predicts as well what it has not seen. Where groups fitted one by one contradict each other, their
scatter is the interval, which may be too wide.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import t

from afo_sim.lab.fitting.identifiability import Estimate, refused, verdict
from afo_sim.lab.fitting.torque_held_out import Alternative, Apart, HeldOut
from afo_sim.lab.fitting.torque_search import AT_BOUND, Solution, bounds, levels

TIGHT = 0.2  # half an interval, in a parameter's size or as a ratio, that tells even what nothing needs
CONTRADICT = 0.05  # chance that groups share a value, below which their scatter is the interval
TOO_FEW = "independent errors"


def scattered(solution: Solution, groups: Apart | None) -> tuple[Solution, list[str]]:
    """The solution with intervals as wide as contradicting groups make them, and a sentence on each."""
    if groups is None:
        return solution, []
    half, said = solution.half.copy(), []
    count = len(groups.x)
    scatter = t.ppf(0.975, count - 1) * np.std(groups.x, axis=0, ddof=1) / np.sqrt(count)
    for k, p in enumerate(solution.problem.free):
        if groups.chance[p.name] < CONTRADICT and scatter[k] > half[k]:
            half[k] = scatter[k]
            own = [values[p.name] for values in groups.values.values()]
            said.append(
                f"{p.name}: the groups contradict each other, {p.text(min(own))} to {p.text(max(own))} one "
                "by one; the interval is their scatter"
            )
    return replace(solution, half=half), said


def judged(
    solution: Solution, kind: str, others: Sequence[Alternative], found: dict[str, HeldOut]
) -> list[str]:
    """Lines "names: reason" on the parameters that the readings do not tell."""
    lines = _as_well_without(solution, kind, others, found)
    lines += _own(solution)
    lines += _one_pressure(solution, refused(lines))
    return lines


def interval_of(solution: Solution, k: int) -> tuple[float, float]:
    """95 % interval of a parameter [SI], within what it can be."""
    p, x, half = solution.problem.free[k], float(solution.x[k]), float(solution.half[k])
    return max(p.value(x - half), p.lower), min(p.value(x + half), p.upper)


def _own(solution: Solution) -> list[str]:
    """What the linearised model says."""
    free = solution.problem.free
    lower, upper = bounds(free)
    size = [1.0 if p.logarithmic else max(abs(float(x)), 1.0) for p, x in zip(free, solution.x, strict=True)]
    shown = []
    for k, p in enumerate(free):
        low, high = interval_of(solution, k)
        value = p.text(p.value(float(solution.x[k])))
        wide = np.isfinite(solution.half[k])
        shown.append(
            f"{value}, and as well {p.text(low)} to {p.text(high)}"
            if wide
            else f"{value}, anything else as well"
        )
    found = Estimate(
        solution.problem.names,
        solution.x,
        solution.half,
        np.array(size),
        lower,
        upper,
        shown,
        AT_BOUND,
        TOO_FEW,
    )
    lines = list(verdict(found, solution.correlation, int(solution.independent)))
    if not solution.settled:
        lines.insert(0, f"{', '.join(solution.problem.names)}: not identifiable: the search did not settle")
    return lines


def _as_well_without(
    solution: Solution, kind: str, others: Sequence[Alternative], found: dict[str, HeldOut]
) -> list[str]:
    """Parameters that do not lower the error of what was left out, with those whose value they change."""
    lines = []
    for other in others:
        if not other.beaten or solution.half[solution.problem.names.index(other.dropped)] <= TIGHT:
            continue
        names = [
            name for name in solution.problem.names if name == other.dropped or _moved(solution, other, name)
        ]
        rest = ", ".join(
            f"{p.name} {p.text(other.values[p.name])}"
            for p in solution.problem.free
            if p.name != other.dropped
        )
        words = "not identifiable one by one" if len(names) > 1 else "not identifiable"
        lines.append(
            f"{', '.join(names)}: {words}: without {other.dropped} ({rest}) the {kind} that is left out is "
            f"predicted as well, to {other.rms:.3g} N·m against {found[kind].rms:.3g} N·m with it, which is "
            "within the scatter"
        )
    return lines


def _moved(solution: Solution, other: Alternative, name: str) -> bool:
    """Whether a parameter moves by over half its interval to one side when another is taken out."""
    if name == other.dropped:
        return False
    k = solution.problem.names.index(name)
    x = solution.problem.free[k].coordinate(other.values[name])
    return bool(abs(x - solution.x[k]) > 0.5 * solution.half[k])


def _one_pressure(solution: Solution, already: set[str]) -> list[str]:
    """At one pressure a law's strength and its dependence on pressure are one, and so is what gives way."""
    law = [p.name for p in solution.problem.free if p.of_law]
    if not law or len(np.unique(levels(solution.problem))) > 1:
        return []
    if set(solution.problem.names) <= already:
        return []
    names = ", ".join(solution.problem.names)
    return [
        f"{names}: not identifiable one by one: the readings are at one pressure, where the law's strength "
        "passes for stiffness"
    ]

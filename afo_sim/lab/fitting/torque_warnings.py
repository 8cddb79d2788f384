"""Reasons to look twice at a torque fit, each a sentence."""

from collections.abc import Iterator, Sequence

import numpy as np

from afo_sim.lab.fitting.torque_data import WITHOUT_AIR
from afo_sim.lab.fitting.torque_problem import errors, predict
from afo_sim.lab.fitting.torque_search import Solution, levels

COARSE = 0.3  # of the mean torque: errors larger than this leave little of the model
AIRLESS = 0.1  # of the largest torque: more without air is the limb's own
RIGID = 0.5  # of the stiffest that is searched: beyond, nothing gives
PULL = 0.02  # of the largest torque: more than this, and than scatter, is a pull
HANGING_TOGETHER = 0.5  # correlation of neighbouring errors that is no scatter


def warnings_of(solution: Solution, added: Sequence[str] = ()) -> list[str]:
    """Warnings of a fit; `added` are parameters that were fitted without being asked for."""
    return list(_warnings(solution, added))


def _warnings(solution: Solution, added: Sequence[str]) -> Iterator[str]:
    problem = solution.problem
    for name in added:
        yield f"{name} is fitted too: a column `cuff` tells it"
    angle = np.degrees(problem.column("angle"))
    pressure, torque = problem.column("pressure"), problem.column("torque")
    lower, upper = np.degrees(np.array([g.orthosis.range_of_motion for g in problem.groups])).T
    if angle.min() < lower.min() - 0.1 or angle.max() > upper.max() + 0.1:
        yield (
            f"angles go from {angle.min():.3g} to {angle.max():.3g} deg, beyond the orthosis' "
            "range_of_motion: are unit and zero right?"
        )
    yield from _beyond_the_law(solution)
    yield from _held_soft(solution)
    if len(np.unique(levels(problem))) == 1:
        yield (
            "the readings are at one pressure: an error of the law's force passes for stiffness or offset; "
            "readings at three pressures tell them apart"
        )
    missed = errors(problem, solution.values)["torque"]
    share = float(np.sqrt(np.mean(missed**2)) / np.abs(torque).mean())
    if share > COARSE:
        yield (
            f"the errors are {100 * share:.0f} % of the mean torque: the model misses something, such as "
            "friction, a moment arm or the angle's zero"
        )
    if solution.memory > HANGING_TOGETHER:
        yield (
            f"errors of neighbouring angles hang together (correlation {solution.memory:.2f}): they are the "
            "model's, not the gauge's; the intervals count them as fewer"
        )
    airless = (pressure <= WITHOUT_AIR) & (np.abs(missed) > AIRLESS * np.abs(torque).max())
    if airless.any() and not problem.difference:
        yield (
            f"without air the torque reads up to {np.abs(torque[pressure <= WITHOUT_AIR]).max():.3g} N·m: "
            "the limb's weight or tissue is in it; take it out, or fit with torque = difference"
        )


def _beyond_the_law(solution: Solution) -> Iterator[str]:
    problem = solution.problem
    for name, group in problem.groups[0].orthosis.muscles_of(problem.chamber).items():
        low, high = group.type.law_set.pressure_range
        pressure = problem.column("pressure")
        filled = pressure[pressure > WITHOUT_AIR]
        if len(filled) and (filled.min() < 0.98 * low or filled.max() > 1.02 * high):
            yield (
                f"{name}: pressures go from {filled.min() * 1e-5:.3g} to {filled.max() * 1e-5:.3g} bar, and "
                f"{group.type.law} holds from {low * 1e-5:.3g} to {high * 1e-5:.3g} bar"
            )
    found, torque = predict(problem, solution.values)["torque"], problem.column("torque")
    taut = found != 0.0
    scatter = float(np.sqrt(np.mean((found - torque)[taut] ** 2))) if taut.any() else 0.0
    slack = int(np.sum(~taut & (np.abs(torque) > max(PULL * np.abs(found).max(), 4.0 * scatter))))
    if slack:
        settings = "1 setting" if slack == 1 else f"{slack} settings"
        yield f"at {settings} the fitted muscle hangs slack where a torque was read"


def _held_soft(solution: Solution) -> Iterator[str]:
    """Cables that end rigid, and a model that still is too weak: what is held gives more than the device."""
    problem, orthosis = solution.problem, solution.problem.groups[0].orthosis
    free = next((p for p in problem.free if p.name == "series_stiffness"), None)
    missed, torque = errors(problem, solution.values)["torque"], problem.column("torque")
    weaker = float(np.nansum(missed * np.sign(torque))) < 0.0  # errors are predicted less measured
    held = [f"{name}_stiffness" for name in ("cuff", "plate") if f"{name}_stiffness" not in problem.names]
    if free is None or not weaker or not held or not orthosis.anchored:
        return
    if solution.values[free.name] > RIGID * free.upper:
        yield (
            "the cables end rigid, and the readings are stronger still: what is held gives more in the "
            f"orthosis' file than on the device, or an anchor is elsewhere: try --fit {held[0]}"
        )

"""How far the force law moves what static torques determine: the same fit with every law of the muscle.

Intervals are widened to the hull over the laws that fit comparably: whose mean squared error is above the
least by no more than chance allows, each on as many errors as are independent, unpaired,

    S/S_least ≤ F(0.95; n, n_least): the test of two variances, Snedecor & Cochran 1989, chapter 6.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import f

from afo_sim.common import Notice
from afo_sim.lab.identifiability import refused
from afo_sim.lab.solution import FitParameter, HeldOut, Progress, Solution, held_out, verdict
from afo_sim.lab.torque_belief import beyond_law, scattered
from afo_sim.lab.torque_problem import Group, TorqueProblem
from afo_sim.lab.torque_solution import apart, from_start, mean_square, solve

CHANCE = 0.95  # up to which a ratio of mean squared errors is chance


@dataclass(frozen=True, eq=False)
class OfLaw:
    """A fit with one law."""

    law: str  # name
    solution: Solution  # where its search ended
    rms_held_out: float | None  # of what was left out [N·m]
    comparable: bool  # lies as close as the closest, as far as chance allows
    beyond: tuple[Notice, ...]  # where the law is asked beyond its range

    def ends(self, name: str) -> tuple[float, float] | None:
        """95 % interval [SI] about this law, twice the value where it is refused; None if not fitted."""
        if name not in self.solution.problem.names:
            return None
        if name in refused(verdict(self.solution)):
            return (self.solution.values[name],) * 2
        return self.solution.interval(self.solution.problem.names.index(name))


def of_laws(solution: Solution, held: dict[str, HeldOut], report: Progress) -> tuple[OfLaw, ...]:
    """Fits with each law that all filled muscles have parameters for, the one in use first."""
    problem, kind = solution.problem, next(iter(held), "")
    muscles = [m.type for g in problem.groups for m in g.orthosis.muscles_of(problem.chamber).values()]
    shared = [law for law in muscles[0].laws if all(law in m.laws for m in muscles)]
    if len(shared) < 2 or len({m.law for m in muscles}) > 1 or all(p.of_law for p in problem.free):
        return ()
    fits, left = {muscles[0].law: solution}, {muscles[0].law: held}
    for law in (law for law in shared if law not in fits):
        report(f"fitting with the law {law}")
        fitted = solve(_with(problem, law))
        fits[law] = scattered(fitted, apart(fitted))[0]
        left[law] = held_out(fitted.problem, [kind] if kind else [], from_start(fitted.x))
    least = min(fits.values(), key=mean_square)
    square = mean_square(least)
    result = []
    for law, each in fits.items():
        alike = bool(mean_square(each) <= f.ppf(CHANCE, each.independent, least.independent) * square)
        rms = left[law][kind].rms if kind in left[law] else None
        result.append(OfLaw(law, each, rms, alike, tuple(beyond_law(each))))
    return tuple(result)


def _with(problem: TorqueProblem, law: str) -> TorqueProblem:
    def using(group: Group) -> Group:
        orthosis, filled = group.orthosis, group.orthosis.muscles_of(problem.chamber)
        other = {n: m.model_copy(update={"type": m.type.using(law=law)}) for n, m in filled.items()}
        return replace(group, orthosis=orthosis.model_copy(update={"muscle": orthosis.muscle | other}))

    free = tuple(p for p in problem.free if not p.of_law)
    return replace(problem, groups=tuple(map(using, problem.groups)), free=free)


def widened(own: tuple[float, float], laws: Sequence[OfLaw], name: str) -> tuple[float, float]:
    """The hull [SI] of an interval and of those of the laws that fit comparably."""
    hull = [own, *(ends for each in laws[1:] if each.comparable and (ends := each.ends(name)))]
    return min(low for low, _ in hull), max(high for _, high in hull)


def moves(laws: Sequence[OfLaw], free: Sequence[FitParameter]) -> Iterator[Notice]:
    """A sentence on how far the law moves each parameter; a warning where it is beyond one law's interval."""
    fitting = [each for each in laws if each.comparable]
    if fitting and laws[0] not in fitting:
        closer = ", ".join(each.law for each in fitting)
        text = "{subject} fits worse than chance allows; {closer} fit better"
        yield Notice("law-fits-worse", text, subject=laws[0].law, closer=closer)
    for p in free if laws else ():
        counted = [each for each in laws if each.ends(p.name) and each in (laws[0], *fitting)]
        value = sorted((each.solution.values[p.name], each.law) for each in counted)
        low, high = laws[0].ends(p.name) or (-np.inf, np.inf)
        beyond = value[0][0] < low or value[-1][0] > high
        text = "{subject}: depending on the law it is {least} to {most}; {count} of {all} laws fit comparably"
        text = text if len(value) > 1 else "{subject}: no other of {all} laws fits comparably"
        least, most = (f"{p.text(number)} ({law})" for number, law in (value[0], value[-1]))
        data = {"least": least, "most": most, "count": len(fitting), "all": len(laws)}
        yield Notice("law-moves", text, subject=p.name, severity="warning" if beyond else "note", **data)

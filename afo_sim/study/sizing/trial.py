"""Runs of candidates side by side, and what each comes to."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from afo_sim.common import InputError, with_code
from afo_sim.description import Scenario
from afo_sim.metrics import is_filling
from afo_sim.model import check_air
from afo_sim.simulation import Asked
from afo_sim.study.effects import SHARES, beyond_limit
from afo_sim.study.engine import INFEASIBLE, OK, UNSETTLED, Outcome
from afo_sim.study.pool import Pool
from afo_sim.study.sizing.requirement import Candidate, Requirement, Status, Tried, shown

Report = Callable[[int, int, str], None]
_HALVINGS = 4  # of the scenario's time step, at most
_STRETCHED = 1.001  # a step is adjusted to a stride by less
FULL = 100.5  # share of a limit from which on it is reported as beyond it [percent]


@dataclass(frozen=True)
class Trials:
    """What candidates are run with: the scenario, what is wanted, who computes, and who hears how far
    it is."""

    scenario: Scenario
    requirements: tuple[Requirement, ...]
    who: Pool
    report: Report | None = None
    doing: str = "trying"
    beside: frozenset[str] = frozenset()

    @property
    def air(self) -> str:
        """The metric of the air that it takes."""
        return "air_per_stride" if self.scenario.walking else "air_per_cycle"

    @property
    def metrics(self) -> frozenset[str]:
        """All metrics that are asked of a run."""
        return frozenset({self.air, *SHARES, *self.beside, *(each.metric for each in self.requirements)})

    def run(self, candidates: Sequence[Candidate], beyond: int = 0) -> list[Tried]:
        """Run candidates that are not excluded."""
        candidates = [each if each.excluded else _with_fine_step(self.scenario, each) for each in candidates]
        cases = [dict(each.sets) for each in candidates if not each.excluded]
        asked = Asked(self.metrics, doubts=False)

        def progress(done: int, count: int) -> None:
            if self.report is not None:
                self.report(beyond + done, beyond + count, self.doing)

        outcomes = iter(self.who.in_order(self.scenario, cases, asked, progress))
        tried = [
            Tried(each, "excluded", each.excluded) if each.excluded else self.judged(each, next(outcomes))
            for each in candidates
        ]
        self._check_told(tried)
        return tried

    def judged(self, candidate: Candidate, outcome: Outcome) -> Tried:
        """What an outcome means for its candidate."""
        if outcome.status != OK:
            status: Status = "refused" if outcome.status == INFEASIBLE else "failed"
            return Tried(candidate, status, outcome.reason)
        values = {name: float(outcome.metrics.get(name, math.nan)) for name in self.metrics}
        return self.of_values(candidate, values, outcome.warnings)

    def of_values(
        self, candidate: Candidate, values: Mapping[str, float], warnings: Sequence[str] = ()
    ) -> Tried:
        """What the metrics of a run mean for its candidate."""
        short = {
            each.label: shortfall(each, values.get(each.metric, math.nan))
            for each in self.requirements
            if not each.met(values.get(each.metric, math.nan))
        }
        beyond = [beyond_limit(name, values[name]) for name in SHARES if values.get(name, 0.0) > FULL]
        notes = (*candidate.notes, *beyond, *with_code(warnings, UNSETTLED))
        return Tried(candidate, "run", values=values, short=short, notes=notes)

    def _check_told(self, tried: Sequence[Tried]) -> None:
        """Refuse a metric that no run has; a time to fill may simply not be reached."""
        ran = [each for each in tried if each.status == "run"]
        for requirement in self.requirements:
            name = requirement.metric
            if not ran or is_filling(name) or any(not math.isnan(t.values[name]) for t in ran):
                continue
            problem = "is reported by no run of this scenario"
            allowed = "a metric that `afo-sim run --numbers` of it prints"
            raise InputError(problem, field="limit", value=str(requirement), allowed=allowed)


def _with_fine_step(scenario: Scenario, candidate: Candidate) -> Candidate:
    """The candidate with half the time step, or half of that, where its air is coarse; else as it is."""
    try:
        orthosis = scenario.set(candidate.sets).orthosis
    except InputError:  # the case's own trouble, which its run reports
        return candidate
    for halving in range(_HALVINGS + 1):
        step = scenario.timestep / 2**halving
        _, coarse = check_air(orthosis, _STRETCHED * step)
        if coarse and halving < _HALVINGS:
            continue
        if halving == 0:
            break
        note = f"run with a time step of {1e3 * step:.3g} ms"
        sets = {**candidate.sets, "timestep": f"{step!r} s"}
        return dataclasses.replace(candidate, sets=sets, notes=(*candidate.notes, note))
    return candidate


def shortfall(requirement: Requirement, value: float) -> str:
    """Why a value does not meet a limit, in words."""
    label = requirement.label[0].lower() + requirement.label[1:]
    if math.isnan(value):
        reached = "is not reached" if is_filling(requirement.metric) else "is not defined"
        return f"{label} {reached}"
    way = "short of" if requirement.at_least else "beyond"
    by = shown(abs(requirement.margin(value)), requirement.unit)
    return f"{label} {by} {way} {requirement.wanted[2:]}"


def _value_with_limit(requirement: Requirement, value: float) -> str:
    """A value and its limit, as part of a sentence."""
    label = requirement.label[0].lower() + requirement.label[1:]
    undefined = "not reached" if is_filling(requirement.metric) else "not defined"
    reached = undefined if math.isnan(value) else shown(value, requirement.unit)
    return f"{label} {reached} (wanted {requirement.wanted})"


def sentence_of(requirements: Sequence[Requirement], values: Mapping[str, Any]) -> str:
    """All values with their limits."""
    return ", ".join(_value_with_limit(each, values.get(each.metric, math.nan)) for each in requirements)

"""One component that is tried, and what came of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from afo_sim.study.sizing.requirement import Requirement

Status = Literal["run", "excluded", "refused", "failed"]


@dataclass(frozen=True)
class Candidate:
    """A component, or a pressure, that a scenario is tried with.

    name : as the catalogue or the user calls it
    size : by which candidates are ordered and drawn [SI]
    sets : that lay it over the scenario
    facts : what the table tells of it, by column
    excluded : why it is not run; "" where it is
    notes : what to mind of it
    doubt : why one that is surer goes before it, such as "not measured"; "" where there is no reason
    """

    name: str
    size: float
    sets: Mapping[str, Any] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    excluded: str = ""
    notes: tuple[str, ...] = ()
    doubt: str = ""


@dataclass(frozen=True)
class Tried:
    """A candidate, and what the run with it told.

    status : "run", or "excluded" before it, "refused" by the description, "failed"
    reason : of that, in words
    values : of each metric that is asked for [its unit]; NaN where the run does not tell it
    short : {what it does not meet: by how much, in words}; empty where it meets all
    notes : what to mind
    """

    candidate: Candidate
    status: Status
    reason: str = ""
    values: Mapping[str, float] = field(default_factory=dict)
    short: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Of the candidate."""
        return self.candidate.name

    @property
    def meets(self) -> bool:
        """Whether it was run and meets all limits."""
        return self.status == "run" and not self.short

    @property
    def why(self) -> str:
        """Why it does not meet what is wanted, in words."""
        return ", ".join(self.short.values()) if self.status == "run" else f"{self.status}: {self.reason}"

    def margin(self, requirement: Requirement) -> float:
        """By how much it keeps a limit [the metric's unit]; NaN where that is not known."""
        return requirement.margin(self.values.get(requirement.metric, math.nan))


def closeness(tried: Tried, requirements: Sequence[Requirement]) -> float:
    """How far a run is from what is wanted: its largest shortfall as a share of the bound; inf if untold."""
    if tried.status != "run":
        return math.inf
    found = [0.0]
    for each in requirements:
        margin = tried.margin(each)
        found.append(math.inf if math.isnan(margin) else max(-margin, 0.0) / (abs(each.bound) or 1.0))
    return max(found)

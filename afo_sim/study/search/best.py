"""The best design of a search, as Python users see it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.metrics.metric import Metric
from afo_sim.simulation.display_hooks import shown
from afo_sim.study.search.plan import SearchPlan
from afo_sim.study.words import human_scale

SIGNS = {"least": ">=", "most": "<="}


@dataclass(frozen=True, repr=False)
class BestDesign:
    """The best design of a search, and how sure that is.

    parameters : {name: value with its unit}
    objective, goal : name of the metric, and "lowest" or "highest"
    metrics : {name: value with its unit} of objective and limits; NaN where a run has none
    limits : {limit: True where it is kept}; without any, empty
    feasible : True where every limit and constraint is kept
    converged : True where more generations would find nothing better
    starts : objective that each start of the search has ended with
    scenario : with the best parameters, ready to run
    summary : everything that best.json holds
    """

    parameters: dict[str, Metric]
    objective: str
    goal: str
    metrics: dict[str, Metric]
    limits: dict[str, bool]
    feasible: bool
    converged: bool
    starts: tuple[Metric, ...]
    scenario: Scenario
    summary: dict[str, Any]

    def __repr__(self) -> str:
        """One line: objective, parameters, limits."""
        values = ", ".join(f"{name} = {value}" for name, value in self.parameters.items())
        broken = [limit for limit, kept in self.limits.items() if not kept]
        limits = f"; not kept: {', '.join(broken)}" if broken else "; limits kept" if self.limits else ""
        open_ended = "" if self.converged else "; not converged"
        best = f"{self.goal} {self.objective} = {self.metrics[self.objective]}"
        return f"<BestDesign: {best} with {values}{limits}{open_ended}>"

    def _repr_html_(self) -> str:  # asked for by Jupyter
        return shown().html(self)


def best_design(search: SearchPlan, summary: Mapping[str, Any]) -> BestDesign:
    """The best design of a finished search."""
    goal, limits = summary["objective"], summary["limits"]
    return BestDesign(
        parameters={p["name"]: _parameter(p) for p in summary["parameters"]},
        objective=goal["metric"],
        goal=goal["goal"],
        metrics={one["metric"]: _metric(one["level"], one["unit"]) for one in limits}
        | {goal["metric"]: _metric(goal["value"], goal["unit"])},
        limits={_limit_text(one): one["short"] == 0.0 for one in limits},
        feasible=summary["feasible"],
        converged=summary["converged"],
        starts=tuple(_metric(start["objective"], goal["unit"]) for start in summary["starts"]),
        scenario=load("scenario", search.designs.scenario, summary["sets"]),
        summary=dict(summary),
    )


def _parameter(found: Mapping[str, Any]) -> Metric:
    """A parameter's value in the unit in which people read it."""
    factor, unit = human_scale(found["unit"], np.array([found["from"], found["to"]]))
    return Metric(factor * found["value"], unit)


def _metric(value: float | None, unit: str) -> Metric:
    return Metric(math.nan if value is None else value, unit)


def _limit_text(limit: Mapping[str, Any]) -> str:
    """A limit as `optimise` takes it: "toe_clearance >= 10 mm in 95 %"."""
    bound = Metric(limit["bound"], limit["unit"])
    share = "" if limit["share"] == 1.0 else f" in {100.0 * limit['share']:g} %"
    return f"{limit['metric']} {SIGNS[limit['at']]} {bound}{share}"

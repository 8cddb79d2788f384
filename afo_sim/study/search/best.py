"""The best design of a search: as Python users see it, and in words and tables."""

from dataclasses import dataclass

import numpy as np

from afo_sim.common import JsonDict, JsonMapping, Shown
from afo_sim.description import Scenario, load
from afo_sim.metrics import Metric, metric_words
from afo_sim.study.effect import number
from afo_sim.study.scales import human_scale
from afo_sim.study.search.plan import SearchPlan

Table = tuple[str, list[str], list[list[str]]]  # title, header, rows
_SIGNS = {"least": ">=", "most": "<="}


def tables(best: JsonMapping) -> list[Table]:
    """Tables of best.json: the design, and its objective and limits."""
    kind = "best design" if best["feasible"] else "the design that violates least"
    rows = []
    for p in best["parameters"]:
        factor, human = human_scale(p["unit"], np.array([p["from"], p["to"]]))
        value, low, high = (factor * p[key] for key in ("value", "from", "to"))
        shown = [f"{value:.4g} {human}".strip(), f"{low:.4g} to {high:.4g} {human}".strip()]
        rows.append([p["name"], *shown, ", ".join(p["keys"])])
    found = [(kind, ["parameter", "value", "searched", "sets"], rows)]
    fresh = best["fresh_patients"]
    many = best["patients"]
    header = ["", "asked for", f"{many} patients searched with" if many > 1 else "found"]
    again = [(f"{fresh['patients']} fresh patients", fresh, fresh["patients"])] if fresh else []
    if half := best.get("half_step"):
        again.append(("at half the step", half, many))
    header += [title for title, _, _ in again]
    goal = best["objective"]
    label = metric_words.words(goal["metric"]).label
    over = f", {goal['over']}" if many > 1 else ""
    rows = [[f"{label}{over}", goal["goal"], _value_text(goal["value"], goal["unit"])]]
    rows[0] += [_value_text(one["objective"], goal["unit"]) for _, one, _ in again]
    for k, limit in enumerate(best["limits"]):
        wanted = f"{'≥' if limit['at'] == 'least' else '≤'} {_value_text(limit['bound'], limit['unit'])}"
        wanted += f" in {_percent(limit['share'])}" if many > 1 else ""
        line = [metric_words.words(limit["metric"]).label, wanted, _kept(limit, limit, many)]
        rows.append(line + [_kept(one["limits"][k], limit, count) for _, one, count in again])
    return [*found, ("objective and limits", header, rows)]


def statement(best: JsonMapping) -> list[str]:
    """Lines on a result: is it feasible, what do the limits lack if not, how much was searched."""
    tried = f"{best['designs']} designs in {best['generations']} generations"
    patients = f"{best['patients']} patient{'s' if best['patients'] > 1 else ''}"
    patients = f"the patients of {best['walkers']}" if "walkers" in best else patients
    tried += f", {best['simulated']} of them simulated with {patients} each"
    tried += f", {best['runs']} runs by {best['method']}" if "runs" in best else ""
    further = "the search has not converged: more generations may find a better design"
    how = "the search has converged" if best["converged"] else further
    lines = []
    if best["feasible"]:
        lines.append(f"design {best['design']} meets every limit, as do {best['feasible_designs']} designs")
    else:
        lines.append(f"no design meets every limit; design {best['design']} comes closest: {_lacks(best)}")
    lines.append(f"{tried}; {how}")
    lines += spread_over_starts(best)
    if best.get("mixed"):
        lines.append("the designs were computed by more than one version of the code")
    ends = []
    for p in best["parameters"]:
        if min(p["value"] - p["from"], p["to"] - p["value"]) < 0.01 * (p["to"] - p["from"]):
            ends.append(p["name"])
    if ends:
        lines.append(f"at an end of its range: {', '.join(ends)}; a wider range may contain a better design")
    half = best.get("half_step")
    if best["feasible"] and half and _fails(half):
        lines.append("at half the time step it does not meet every limit: search again with that step")
    fresh = best["fresh_patients"]
    if fresh is None:
        lines.append("not tested on fresh patients: the search draws none")
    elif best["feasible"] and _fails(fresh):
        lines.append("with fresh patients it does not meet every limit: add a margin to the limits")
    return lines


def _fails(again: JsonMapping) -> bool:
    return bool(again["lacking"] or any(limit["short"] != 0.0 for limit in again["limits"]))


def spread_over_starts(best: JsonMapping) -> list[str]:
    """The distance between the ends of the starts; nothing of a single one."""
    starts, goal = best["starts"], best["objective"]
    if len(starts) < 2:
        return []
    values = [start["objective"] for start in starts if start["feasible"]]
    lacking = f", and {len(starts) - len(values)} found none that meets every limit"
    if not values:
        return [f"none of {len(starts)} starts found a design that meets every limit"]
    if len(values) == 1:  # there is nothing to compare it with
        return [f"only one of {len(starts)} starts found designs that meet every limit: use more starts"]
    low, high = min(values), max(values)
    label = metric_words.words(goal["metric"]).label
    size = max(-low, high)
    share = f", {100.0 * (high - low) / size:.2g} % apart" if size else ""
    text = f"{len(starts)} starts from different seeds: {_value_text(low, goal['unit'])} to "
    text += f"{_value_text(high, goal['unit'])} of {label[:1].lower() + label[1:]}{share}"
    return [text + (lacking if len(values) < len(starts) else "")]


def _lacks(best: JsonMapping) -> str:
    """The shortfalls of the least violating design."""
    if best["outside"]:
        return "no design satisfied the constraints on the parameters"
    each = []
    for limit in (limit for limit in best["limits"] if limit["short"]):
        by, bound = (_value_text(limit[key], limit["unit"]) for key in ("short", "bound"))
        side = "below" if limit["at"] == "least" else "above"
        each.append(f"{metric_words.words(limit['metric']).label} is {by} {side} the limit of {bound}")
    if best["lacking"]:
        why = f" ({best['reason']})" if best["reason"] else ""
        each.insert(0, f"{best['lacking']} values of objective and limits are missing{why}")
    return "; ".join(each)


def _value_text(value: float | None, unit: str) -> str:
    if value is None:
        return "–"
    return f"{metric_words.number(value, unit)} {metric_words.UNITS.get(unit, unit)}".strip()


def _kept(found: JsonMapping, limit: JsonMapping, patients: int) -> str:
    level = _value_text(found["level"], limit["unit"])
    if patients == 1:
        return level
    return f"{level}; met by {_percent(found['kept'])}"


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.3g} %"


@dataclass(frozen=True, repr=False)
class BestDesign(Shown):
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
    summary: JsonDict

    def __repr__(self) -> str:
        """One line: objective, parameters, limits."""
        values = ", ".join(f"{name} = {value}" for name, value in self.parameters.items())
        broken = [limit for limit, kept in self.limits.items() if not kept]
        limits = f"; not met: {', '.join(broken)}" if broken else "; limits met" if self.limits else ""
        open_ended = "" if self.converged else "; not converged"
        best = f"{self.goal} {self.objective} = {self.metrics[self.objective]}"
        return f"<BestDesign: {best} with {values}{limits}{open_ended}>"


def best_design(search: SearchPlan, summary: JsonMapping) -> BestDesign:
    """The best design of a finished search."""
    goal, limits = summary["objective"], summary["limits"]
    parameters, kept = {}, {}
    for one in summary["parameters"]:
        factor, unit = human_scale(one["unit"], np.array([one["from"], one["to"]]))
        parameters[one["name"]] = Metric(factor * one["value"], unit)
    for one in limits:
        share = "" if one["share"] == 1.0 else f" in {100.0 * one['share']:g} %"
        text = f"{one['metric']} {_SIGNS[one['at']]} {Metric(one['bound'], one['unit'])}{share}"
        kept[text] = one["short"] == 0.0
    metrics = {one["metric"]: Metric(number(one["level"]), one["unit"]) for one in limits}
    metrics |= {goal["metric"]: Metric(number(goal["value"]), goal["unit"])}
    return BestDesign(
        parameters=parameters,
        objective=goal["metric"],
        goal=goal["goal"],
        metrics=metrics,
        limits=kept,
        feasible=summary["feasible"],
        converged=summary["converged"],
        starts=tuple(Metric(number(start["objective"]), goal["unit"]) for start in summary["starts"]),
        scenario=load("scenario", search.designs.scenario, summary["sets"]),
        summary=dict(summary),
    )

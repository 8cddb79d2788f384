"""A search's result in words: tables for the terminal, and whether any design keeps all limits."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from afo_sim.metrics import metric_words
from afo_sim.study.words import human_scale

Table = tuple[str, list[str], list[list[str]]]  # title, header, rows


def tables(best: Mapping[str, Any]) -> list[Table]:
    """Tables of best.json: the design, and its objective and limits."""
    kind = "best design" if best["feasible"] else "the design that violates least"
    rows = [[p["name"], *_quantity(p), ", ".join(p["keys"])] for p in best["parameters"]]
    found = [(kind, ["parameter", "value", "searched", "sets"], rows)]
    fresh = best["fresh_patients"]
    many = best["patients"]
    header = ["", "asked for", f"{many} patients searched with" if many > 1 else "found"]
    header += [f"{fresh['patients']} fresh patients"] if fresh else []
    goal = best["objective"]
    label = metric_words.words(goal["metric"]).label
    over = f", {goal['over']}" if many > 1 else ""
    rows = [[f"{label}{over}", goal["goal"], _metric(goal["value"], goal["unit"])]]
    rows[0] += [_metric(fresh["objective"], goal["unit"])] if fresh else []
    for k, limit in enumerate(best["limits"]):
        asked = f"{'≥' if limit['at'] == 'least' else '≤'} {_metric(limit['bound'], limit['unit'])}"
        asked += f" in {_percent(limit['share'])}" if many > 1 else ""
        line = [metric_words.words(limit["metric"]).label, asked, _kept(limit, limit, many)]
        rows.append(line + ([_kept(fresh["limits"][k], limit, fresh["patients"])] if fresh else []))
    return [*found, ("objective and limits", header, rows)]


def statement(best: Mapping[str, Any]) -> list[str]:
    """Lines on a result: is it feasible, what do the limits lack if not, how much was searched."""
    tried = f"{best['designs']} designs in {best['generations']} generations"
    patients = f"{best['patients']} patient{'s' if best['patients'] > 1 else ''}"
    tried += f", {best['simulated']} of them simulated with {patients} each"
    how = (
        "the search has converged"
        if best["converged"]
        else "the search has not converged: more generations may find better"
    )
    lines = []
    if best["feasible"]:
        lines.append(f"design {best['design']} keeps every limit, as {best['feasible_designs']} designs do")
    else:
        lines.append(f"no design keeps every limit; design {best['design']} violates least: {_lacks(best)}")
    lines.append(f"{tried}; {how}")
    lines += spread_over_starts(best)
    if best.get("mixed"):
        lines.append("the designs were computed by more than one version of the code")
    ends = [p["name"] for p in best["parameters"] if _at_an_end(p)]
    if ends:
        lines.append(f"at an end of its range: {', '.join(ends)}; a wider range may hold better")
    fresh = best["fresh_patients"]
    if fresh is None:
        lines.append("not tried on fresh patients: the search tells no patients to draw from")
    elif best["feasible"] and not _holds(fresh):
        lines.append("with fresh patients it does not keep every limit: take the limits with a margin")
    return lines


def spread_over_starts(best: Mapping[str, Any]) -> list[str]:
    """The distance between the ends of the starts; nothing of a single one."""
    starts, goal = best["starts"], best["objective"]
    if len(starts) < 2:
        return []
    values = [start["objective"] for start in starts if start["feasible"]]
    lacking = f", and {len(starts) - len(values)} found none that keeps every limit"
    if not values:
        return [f"none of {len(starts)} starts found a design that keeps every limit"]
    if len(values) == 1:  # there is nothing to compare it with
        return [f"only one of {len(starts)} starts found designs that keep every limit: take more starts"]
    low, high = min(values), max(values)
    label = metric_words.words(goal["metric"]).label
    size = max(abs(low), abs(high))
    share = f", {100.0 * (high - low) / size:.2g} % apart" if size else ""
    return [
        f"{len(starts)} starts from different seeds: {_metric(low, goal['unit'])} to "
        f"{_metric(high, goal['unit'])} of {label[:1].lower() + label[1:]}{share}"
        f"{lacking if len(values) < len(starts) else ''}"
    ]


def _at_an_end(parameter: Mapping[str, Any]) -> bool:
    """True where a value is within a hundredth of its range from either end."""
    low, high = parameter["from"], parameter["to"]
    return bool(min(parameter["value"] - low, high - parameter["value"]) < 0.01 * (high - low))


def _holds(fresh: Mapping[str, Any]) -> bool:
    return not fresh["lacking"] and all(limit["short"] == 0.0 for limit in fresh["limits"])


def _lacks(best: Mapping[str, Any]) -> str:
    """The shortfalls of the least violating design."""
    if best["outside"]:
        return "no design was within the constraints on the parameters"
    each = [
        f"{metric_words.words(limit['metric']).label} is {_metric(limit['short'], limit['unit'])} short"
        for limit in best["limits"]
        if limit["short"]
    ]
    if best["lacking"]:
        why = f" ({best['reason']})" if best["reason"] else ""
        each.insert(0, f"{best['lacking']} values of objective and limits are missing{why}")
    return "; ".join(each)


def _quantity(parameter: Mapping[str, Any]) -> list[str]:
    """[value, range] in the unit in which people read them."""
    unit = parameter["unit"]
    factor, human = human_scale(unit, np.array([parameter["from"], parameter["to"]]))
    value, low, high = (factor * parameter[key] for key in ("value", "from", "to"))
    return [f"{value:.4g} {human}".strip(), f"{low:.4g} to {high:.4g} {human}".strip()]


def _metric(value: float | None, unit: str) -> str:
    if value is None:
        return "–"
    return f"{metric_words.number(value, unit)} {metric_words.UNITS.get(unit, unit)}".strip()


def _kept(found: Mapping[str, Any], limit: Mapping[str, Any], patients: int) -> str:
    level = _metric(found["level"], limit["unit"])
    if patients == 1:
        return level
    return f"{level}; kept by {_percent(found['kept'])}"


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100.0 * share:.3g} %"

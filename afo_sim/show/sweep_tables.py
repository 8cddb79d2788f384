"""Tables of a sweep for the terminal: status, warnings, metrics, effects, indices, best cases, fronts."""

import numpy as np

from afo_sim.study import Findings, analysis, scale, varied

_EFFECTS = "main effects: share of the variance, mean from low to high"
_NEGLIGIBLE = 0.01  # second-order index below which a pair is not listed

_Table = tuple[str, list[str], list[list[str]]]  # title, header, rows


def tables(findings: Findings, best: int) -> list[_Table]:
    """(title, header, rows) to print."""
    results = findings.results
    whole, count = len(results), int(results.ok.sum())
    rows = [["ok", str(count), f"{100.0 * count / whole:.3g} %", ""]]
    for status, reason, n in analysis.failures(results["status"], results["reason"]):
        rows.append([status, str(n), f"{100.0 * n / whole:.3g} %", reason])
    shown = [(f"{whole} cases, {results.design}", ["status", "cases", "share", "reason"], rows)]
    header = ["metric", "unit", "cases", "mean", "SD", "lowest", "5 %", "median", "95 %", "highest"]
    spreads = []
    for metric in findings.objectives:
        look = scale(results, metric)
        there, *numbers = analysis.spread(look.factor * results[metric])
        spreads.append([metric, look.unit, str(there), *map(_number, numbers)])
    shown.append(("metrics", header, spreads))
    if warned := analysis.warned(results.warnings, results.notices):
        heading = "warnings, by the numbers of the first case with each"
        told = [[str(count), text] for text, count in warned]
        shown.insert(1, (heading, ["cases", "warning"], told))
    if findings.effects:
        shown.append(_effect_table(findings))
    header = ["parameter", "alone (95 % interval)", "total (95 % interval)"]
    for metric, each in findings.indices.items():
        rows = []
        for k, name in enumerate(each.parameters):
            first = f"{_number(each.first[k])} ± {_number(each.first_interval[k])}"
            rows.append([name, first, f"{_number(each.total[k])} ± {_number(each.total_interval[k])}"])
        for one, other, index, interval in each.pairs():
            if index - interval > _NEGLIGIBLE:
                rows.append([f"{one} × {other}", f"{_number(index)} ± {_number(interval)}", ""])
        shown.append((f"Sobol' indices: {metric}", header, rows))
    for metric in findings.effects if best > 0 else ():
        end = findings.objectives[metric]
        cases = analysis.best(results[metric], best, end == "lowest")
        shown.append(_case_table(findings, cases, f"best cases: {end} {_lower(findings, metric)}"))
    if len(findings.effects) > 1 and best > 0:
        # cases evenly along the Pareto front of the first two metrics
        two = list(findings.effects)[:2]
        ends = [findings.objectives[name] for name in two]
        points = np.column_stack([results[name] for name in two])
        front = analysis.pareto_front(points, (ends[0] == "lowest", ends[1] == "lowest"))
        front = front[np.argsort(points[front, 0], kind="stable")]
        some = front[np.unique(np.linspace(0, len(front) - 1, min(best, len(front))).round().astype(int))]
        title = " and ".join(f"{end} {_lower(findings, name)}" for name, end in zip(two, ends, strict=True))
        of = "" if len(some) == len(front) else f", {len(some)} of {len(front)} cases"
        shown.append(_case_table(findings, some, f"Pareto front: {title}{of}"))
    return shown


def _lower(findings: Findings, metric: str) -> str:
    label = scale(findings.results, metric).label
    return label[:1].lower() + label[1:]


def _effect_table(findings: Findings) -> _Table:
    results = findings.results
    rows = []
    for parameter in varied(results):
        row = [_named(findings, parameter)]
        for metric, effects in findings.effects.items():
            effect, look = effects[parameter], scale(results, metric)
            share = f"{100.0 * max(effect.share, 0.0):.0f} %" if np.isfinite(effect.share) else "–"
            text, ordered = effect.places.dtype.kind in "US", np.sort(effect.means)
            ends, arrow = (ordered, "…") if text else (effect.means, "→")
            row.append(f"{share:>5}   {look.text(ends[0])} {arrow} {look.text(ends[-1])}")
        rows.append(row)
    return _EFFECTS, ["parameter", *(_named(findings, metric) for metric in findings.effects)], rows


def _case_table(findings: Findings, cases: np.ndarray, title: str) -> _Table:
    results = findings.results
    names = [*varied(results), *findings.objectives]
    looks = [scale(results, name) for name in names]
    columns = [results[name][cases] for name in names]
    rows = [
        [str(case), *(look.text(column[k].item()) for look, column in zip(looks, columns, strict=True))]
        for k, case in enumerate(results["case"][cases])
    ]
    return title, ["case", *(_named(findings, name) for name in names)], rows


def _named(findings: Findings, name: str) -> str:
    unit = scale(findings.results, name).unit
    return f"{name} [{unit}]" if unit else name


def _number(value: float) -> str:
    return f"{value:.3g}".replace("-", "−") if np.isfinite(value) else "–"

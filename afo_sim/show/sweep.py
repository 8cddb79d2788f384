"""A sweep looked at: tables for the terminal, figures as PNG."""

import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.writing import check_writable, together
from afo_sim.show import sweep_figures as figures
from afo_sim.show.figure import RESOLUTION, STYLE
from afo_sim.study import analysis, pareto, sobol
from afo_sim.study.analysis import Effect
from afo_sim.study.results import Results
from afo_sim.study.sobol import Indices
from afo_sim.study.words import Better, chosen, scale

FIGURES = "figures"  # the folder in a sweep's own
IN_ONE = 3  # metrics in one figure
PANEL = (2.5, 2.3)  # [inch]
NEGLIGIBLE = 0.01  # second-order index below which a pair is not listed

EFFECTS = "main effects: share of the variance, mean from low to high"
BINNED = (
    "shares of the variance lie between the means of bins: what a metric does within a bin is not counted, "
    "so they are at most the first-order Sobol' indices, which the design saltelli tells"
)
EXACT = "shares of the variance are first-order Sobol' indices, as in the tables below"

Table = tuple[str, list[str], list[list[str]]]  # title, header, rows


@dataclass(frozen=True)
class Findings:
    """What a sweep's cases say of the chosen metrics, computed once for tables and figures.

    objectives : {metric: which end is good}
    effects : {metric: {parameter: main effect}}, of the metrics that any case has
    indices : {metric: Sobol' indices}, where the design gives them
    remarks : what could not be computed and why, what was left out
    """

    results: Results
    objectives: dict[str, Better]
    effects: dict[str, dict[str, Effect]]
    indices: dict[str, Indices] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


def findings(results: Results, objectives: Mapping[str, Better]) -> Findings:
    """Analyse the cases of a sweep.

    Parameters
    ----------
    results : of the sweep
    objectives : {metric: "lowest" or "highest"}, whichever is good

    Returns
    -------
    Findings
    """
    remarks = _remarks(results, objectives)
    known = [name for name in objectives if np.isfinite(results[name]).any()]
    found = {}
    for name in known if results.design == sobol.DESIGN else ():
        try:
            found[name] = sobol.indices(results, name)
        except InputError as error:
            remarks.append(error.problem)
            continue
        if left_out := found[name].left_out:
            of = f"{left_out} of {found[name].blocks} base samples"
            remarks.append(f"Sobol' indices leave out {of}, of which a case has no {name}")
    effects = {name: effects_of(results, name, found.get(name)) for name in known}
    if effects:
        whole = results.levels() is not None and not any(map(results.lacking, known))
        remarks += [] if whole else [EXACT if set(found) == set(known) else BINNED]
    if any(not np.isfinite(effect.share) for each in effects.values() for effect in each.values()):
        remarks.append("–: too few cases at each value, or nothing that varies, to tell a share of variance")
    return Findings(results, dict(objectives), effects, found, tuple(dict.fromkeys(remarks)))


def _remarks(results: Results, objectives: Mapping[str, Better]) -> list[str]:
    """What to know of the cases before anything is computed from them."""
    remarks = []
    if results.unfinished:
        remarks.append(f"unfinished: {len(results)} of {results.planned} cases are computed so far")
    if others := [name for name in results.metrics if name not in objectives]:
        remarks.append(f"{len(others)} more metrics are shown by --metric, such as {others[0]}")
    if results.sweep.get("mixed"):
        remarks.append("the cases were computed by more than one version of the code")
    for name in objectives:
        lacking = results.lacking(name)
        if not np.isfinite(results[name]).any():
            remarks.append(f"no case has a value of {name}")
        elif lacking and results.levels() is not None:
            of = f"{lacking} of {results.planned} cells of the grid"
            remarks.append(f"{of} have no {name}: its main effects are those of the others, by chance uneven")
    return remarks


def effects_of(results: Results, metric: str, indices: Indices | None = None) -> dict[str, Effect]:
    """{parameter: its main effect on a metric}, as the sweep's design allows.

    Where there are Sobol' indices, the first-order one is the share that is told: two estimates of one
    quantity would differ, the binned one being low by what the metric does within a bin.
    """
    saltelli = results.design == sobol.DESIGN
    blocks = results["case"] // sobol.block_size(results) if saltelli else None
    grid = results.levels() is not None and not results.lacking(metric)
    found = {
        name: analysis.effect(results[name], results[metric], blocks=blocks, grid=grid)
        for name in sobol.varied(results)
    }
    if indices is None:
        return found
    first = dict(zip(indices.parameters, indices.first.tolist(), strict=True))
    return {name: replace(effect, share=first[name]) for name, effect in found.items()}


def show(
    results: Results,
    out_dir: pathlib.Path,
    metrics: Sequence[str] | None = None,
    objectives: Mapping[str, Better] | None = None,
) -> list[pathlib.Path]:
    """Write the figures of a sweep as PNG, each whole or not at all.

    Parameters
    ----------
    results : of the sweep
    out_dir : made if need be
    metrics : names, with ":lowest" or ":highest" after them where need be; those that matter most if None
    objectives : {metric: "lowest" or "highest"} of which Pareto fronts are drawn; `metrics` if None

    Returns
    -------
    the files

    Raises
    ------
    InputError
        A metric that the sweep has not, or a folder that cannot be written to.
    """
    found = findings(results, chosen(results, list(metrics or ())))
    asked = [f"{name}:{end}" for name, end in (objectives or {}).items()]
    return write_figures(found, out_dir, chosen(results, asked) if asked else found.objectives)


def write_figures(
    found: Findings, folder: pathlib.Path, objectives: Mapping[str, Better]
) -> list[pathlib.Path]:
    """Write every figure that the findings have something for; parameters as in `show`."""
    check_writable(folder)
    names = []
    with together(folder) as scratch:
        for name, size, fill in [*_of_metrics(found), *_of_fronts(found.results, objectives)]:
            names.append(f"{name}.png")
            _draw(scratch / names[-1], size, fill)
    return [folder / name for name in names]


Drawing = tuple[str, tuple[float, float], Callable[[Any], None]]  # name, size [inch], what draws it


def _of_metrics(found: Findings) -> Iterator[Drawing]:
    results, count = found.results, len(sobol.varied(found.results))
    across = min(count, figures.MOST_PARAMETERS)
    for suffix, names in _batches(list(found.effects)):
        high = len(names)
        some = {name: found.effects[name] for name in names}
        draw: Callable[[Any], None] = partial(figures.draw_distributions, results=results, metrics=names)
        yield f"distributions{suffix}", (PANEL[0] * high + 0.4, PANEL[1] + 0.2), draw
        draw = partial(figures.draw_effects, results=results, effects=some)
        yield f"main_effects{suffix}", (0.85 * PANEL[0] * across + 1.0, 1.9 * high + 0.8), draw
        if count > 1:
            draw = partial(figures.draw_maps, results=results, effects=some)
            yield f"maps{suffix}", (3.2 * high + 0.2, 3.3), draw
        if indices := {name: found.indices[name] for name in names if name in found.indices}:
            draw = partial(figures.draw_sobol, results=results, found=indices)
            yield f"sobol{suffix}", (2.6 * len(indices) + 1.2, 0.42 * count + 1.2), draw


def _of_fronts(results: Results, objectives: Mapping[str, Better]) -> Iterator[Drawing]:
    known = [name for name in objectives if np.isfinite(results[name]).any()]
    for suffix, names in _batches(known):
        if len(names) > 1:
            ends = {name: objectives[name] for name in names}
            pairs = len(names) * (len(names) - 1) // 2
            draw = partial(figures.draw_fronts, results=results, objectives=ends)
            yield f"pareto{suffix}", (3.3 * pairs + 0.2, 3.4), draw


def _batches(names: list[str]) -> Iterator[tuple[str, list[str]]]:
    """As many metrics as one figure takes, and what its name ends with."""
    for k in range(0, len(names), IN_ONE):
        yield f"_{k // IN_ONE + 1}" if k else "", names[k : k + IN_ONE]


def _draw(path: pathlib.Path, size: tuple[float, float], fill: Callable[[Any], None]) -> None:
    import matplotlib
    from matplotlib.figure import Figure  # and not pyplot: no display, nothing global

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        fill(figure)
        figure.savefig(path, format="png", dpi=RESOLUTION)


def tables(found: Findings, best: int) -> list[Table]:
    """(title, header, rows) to print.

    Parameters
    ----------
    found : of the sweep
    best : how many of the best cases are listed for each metric
    """
    shown = [_status_table(found.results), *_warning_table(found.results), _metric_table(found)]
    if found.effects:
        shown.append(_effect_table(found))
    shown += [_index_table(found.results, name, each) for name, each in found.indices.items()]
    for metric in found.effects if best > 0 else ():
        end = found.objectives[metric]
        rows = analysis.best(found.results[metric], best, end == "lowest")
        shown.append(_case_table(found, rows, f"best cases: {end} {_lower(found, metric)}"))
    if len(found.effects) > 1 and best > 0:
        shown.append(_front_table(found, best))
    return shown


def _lower(found: Findings, metric: str) -> str:
    label = scale(found.results, metric).label
    return label[:1].lower() + label[1:]


def _status_table(results: Results) -> Table:
    count = int(results.ok.sum())
    rows = [["ok", str(count), f"{100.0 * count / len(results):.3g} %", ""]]
    for status, reason, n in analysis.failures(results["status"], results["reason"]):
        rows.append([status, str(n), f"{100.0 * n / len(results):.3g} %", reason])
    return f"{len(results)} cases, {results.design}", ["status", "cases", "share", "reason"], rows


def _warning_table(results: Results) -> Iterator[Table]:
    rows = [[str(count), text] for text, count in analysis.warned(results.warnings)]
    if rows:
        yield "warnings, by the numbers of the first case with each", ["cases", "warning"], rows


def _metric_table(found: Findings) -> Table:
    rows = []
    for metric in found.objectives:
        look = scale(found.results, metric)
        s = analysis.spread(look.factor * found.results[metric])
        numbers = (s.mean, s.deviation, s.lowest, s.low_5, s.median, s.high_95, s.highest)
        rows.append([metric, look.unit, str(s.count), *map(_number, numbers)])
    header = ["metric", "unit", "cases", "mean", "SD", "lowest", "5 %", "median", "95 %", "highest"]
    return "metrics", header, rows


def _effect_table(found: Findings) -> Table:
    results = found.results
    rows = []
    for parameter in sobol.varied(results):
        row = [_named(found, parameter)]
        for metric, effects in found.effects.items():
            effect, look = effects[parameter], scale(results, metric)
            share = f"{100.0 * max(effect.share, 0.0):.0f} %" if np.isfinite(effect.share) else "–"
            text, ordered = effect.places.dtype.kind in "US", np.sort(effect.means)
            ends, arrow = (ordered, "…") if text else (effect.means, "→")
            row.append(f"{share:>5}   {look.text(ends[0])} {arrow} {look.text(ends[-1])}")
        rows.append(row)
    return EFFECTS, ["parameter", *(_named(found, metric) for metric in found.effects)], rows


def _index_table(results: Results, metric: str, found: Indices) -> Table:
    rows = []
    for k, name in enumerate(found.parameters):
        first = f"{_number(found.first[k])} ± {_number(found.first_interval[k])}"
        rows.append([name, first, f"{_number(found.total[k])} ± {_number(found.total_interval[k])}"])
    for one, other, index, interval in found.pairs():
        if index - interval > NEGLIGIBLE:
            rows.append([f"{one} × {other}", f"{_number(index)} ± {_number(interval)}", ""])
    return f"Sobol' indices: {metric}", ["parameter", "alone (95 % interval)", "total (95 % interval)"], rows


def _case_table(found: Findings, cases: np.ndarray, title: str) -> Table:
    results = found.results
    names = [*sobol.varied(results), *found.objectives]
    looks = [scale(results, name) for name in names]
    columns = [results[name][cases] for name in names]
    rows = [
        [str(case), *(look.text(column[k].item()) for look, column in zip(looks, columns, strict=True))]
        for k, case in enumerate(results["case"][cases])
    ]
    return title, ["case", *(_named(found, name) for name in names)], rows


def _front_table(found: Findings, count: int) -> Table:
    """Cases evenly along the Pareto front of the first two metrics."""
    two = list(found.effects)[:2]
    ends = [found.objectives[name] for name in two]
    points = np.column_stack([found.results[name] for name in two])
    front = np.flatnonzero(pareto.ranks(points, tuple(end == "lowest" for end in ends)) == 0)
    front = front[np.argsort(points[front, 0], kind="stable")]
    some = front[np.unique(np.linspace(0, len(front) - 1, min(count, len(front))).round().astype(int))]
    title = " and ".join(f"{end} {_lower(found, name)}" for name, end in zip(two, ends, strict=True))
    of = "" if len(some) == len(front) else f", {len(some)} of {len(front)} cases"
    return _case_table(found, some, f"Pareto front: {title}{of}")


def _named(found: Findings, name: str) -> str:
    unit = scale(found.results, name).unit
    return f"{name} [{unit}]" if unit else name


def _number(value: float) -> str:
    return f"{value:.3g}".replace("-", "−") if np.isfinite(value) else "–"

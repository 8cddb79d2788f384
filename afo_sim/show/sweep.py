"""Findings of a sweep, and its figures as PNG."""

import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.writing import check_writable, together
from afo_sim.show import sweep_figures as figures
from afo_sim.show.style import write_figure
from afo_sim.study import analysis, sobol
from afo_sim.study.analysis import Effect
from afo_sim.study.results import Results
from afo_sim.study.sobol import Indices
from afo_sim.study.words import Better, chosen

FIGURES = "figures"  # the folder in a sweep's own
IN_ONE = 3  # metrics in one figure
PANEL = (2.5, 2.3)  # [inch]

EFFECTS = "main effects: share of the variance, mean from low to high"
BINNED = (
    "shares of the variance lie between the means of bins: what a metric does within a bin is not counted, "
    "so they are at most the first-order Sobol' indices, which the design saltelli tells"
)
EXACT = "shares of the variance are first-order Sobol' indices, as in the tables below"


@dataclass(frozen=True)
class Findings:
    """Effects and indices of the chosen metrics, computed once for tables and figures.

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
        remarks.append(f"{len(others)} more metrics can be shown, such as {others[0]}")
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
            write_figure(scratch / names[-1], size, fill)
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

"""Findings of a sweep: main effects and Sobol' indices of the chosen metrics, with remarks."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.study import analysis, sobol
from afo_sim.study.analysis import Effect
from afo_sim.study.results import Results
from afo_sim.study.sobol import Indices
from afo_sim.study.words import Better

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
    """Remarks on the cases: unfinished, failed, mixed."""
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

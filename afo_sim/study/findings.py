"""Findings of a sweep: main effects and Sobol' indices of the chosen metrics, with remarks."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from afo_sim.common import InputError, optional
from afo_sim.study import analysis, time_step
from afo_sim.study.analysis import Effect
from afo_sim.study.results import OWN_SEED, Results
from afo_sim.study.scales import Better

_DESIGN = "saltelli"
_MOST_FAILED = 0.01  # of the cases
_FEWEST_BLOCKS = 8
_RESAMPLES = 500  # of the bootstrap
_SEED = 1  # of the bootstrap, so that a figure drawn twice is the same; SALib takes 0 for no seed
_OF_SALIB = {"first": "S1", "total": "ST", "second": "S2"}
_OF_SALIB |= {f"{name}_interval": f"{key}_conf" for name, key in _OF_SALIB.items()}
_BINNED = (
    "shares of variance are between the means of bins: variation within a bin is not counted, "
    "so they are at most the first-order Sobol' indices, which the saltelli design gives"
)
EXACT = "shares of variance are first-order Sobol' indices, as in the tables below"


@dataclass(frozen=True, eq=False)
class Indices:
    """Sobol' indices of one metric, and the half-widths of their 95 % intervals."""

    parameters: tuple[str, ...]
    first: np.ndarray
    first_interval: np.ndarray
    total: np.ndarray
    total_interval: np.ndarray
    second: np.ndarray
    second_interval: np.ndarray
    blocks: int
    left_out: int

    def pairs(self) -> list[tuple[str, str, float, float]]:
        """[(parameter, parameter, second-order index, half-width)], the strongest first."""
        names = self.parameters
        upper = sorted(combinations(range(len(names)), 2), key=lambda ij: -self.second[ij])
        return [
            (names[i], names[j], float(self.second[i, j]), float(self.second_interval[i, j]))
            for i, j in upper
        ]


def varied(results: Results) -> tuple[str, ...]:
    """The parameters that the design varies: every case's own seed is none of them."""
    seeds = {p["name"] for p in results.sweep["parameters"] if p.get("distribution") == OWN_SEED}
    return tuple(name for name in results.parameters if name not in seeds)


def _block_size(results: Results) -> int:
    return 2 * len(varied(results)) + 2


def indices(results: Results, metric: str) -> Indices:
    """First-order, second-order and total Sobol' indices, with intervals by bootstrap of base samples."""
    size = _block_size(results)
    if results.design != _DESIGN:
        text = "Sobol' indices need another design of the sweep"
        raise InputError(text, file=results.folder, field="design", value=results.design, allowed=_DESIGN)
    if results.unfinished or len(results) % size:
        there = f"{len(results)} of {results.planned} are here"
        raise InputError(f"Sobol' indices need every case of the sweep, but {there}", file=results.folder)
    values = results[metric].reshape(-1, size)  # a row for each base sample (N, 2d + 2)
    whole = np.isfinite(values).all(axis=1)
    failed = 1.0 - float(np.isfinite(values).mean())
    if failed >= _MOST_FAILED or whole.sum() < _FEWEST_BLOCKS:
        text = f"{100.0 * failed:.2g} % of the cases have no {metric}, and {whole.sum()} base samples are "
        allowed = f"less than {100.0 * _MOST_FAILED:g} %, and at least {_FEWEST_BLOCKS}"
        raise InputError(f"{text}whole: too few for Sobol' indices", file=results.folder, allowed=allowed)
    kept = values[whole].ravel()
    if np.ptp(kept) <= 1e-12 * np.abs(kept).max():
        raise InputError(f"{metric} does not vary: it has no Sobol' indices", file=results.folder)
    names = varied(results)
    problem = {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}
    # Saltelli et al. 2010, doi 10.1016/j.cpc.2009.09.018; 2002, doi 10.1016/S0010-4655(02)00280-1
    sobol, options = optional("SALib.analyze.sobol"), {"num_resamples": _RESAMPLES, "seed": _SEED}
    found = sobol.analyze(problem, kept, calc_second_order=True, **options)
    arrays = {name: np.asarray(found[key]) for name, key in _OF_SALIB.items()}
    return Indices(names, **arrays, blocks=len(whole), left_out=int((~whole).sum()))


@dataclass(frozen=True)
class Findings:
    """Effects and indices of the chosen metrics, computed once for tables and figures."""

    results: Results
    objectives: dict[str, Better]
    effects: dict[str, dict[str, Effect]]
    indices: dict[str, Indices] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


def findings(results: Results, objectives: Mapping[str, Better]) -> Findings:
    """Analyse the cases of a sweep."""
    remarks = _remarks(results, objectives)
    known = [name for name in objectives if np.isfinite(results[name]).any()]
    found = {}
    for name in known if results.design == _DESIGN else ():
        try:
            found[name] = indices(results, name)
        except InputError as error:
            remarks.append(error.problem)
            continue
        if left_out := found[name].left_out:
            of = f"{left_out} of {found[name].blocks} base samples"
            remarks.append(f"Sobol' indices leave out {of} in which a case has no {name}")
    effects = {name: effects_of(results, name, found.get(name)) for name in known}
    if effects:
        whole = results.levels() is not None and not any(map(results.lacking, known))
        remarks += [] if whole else [EXACT if set(found) == set(known) else _BINNED]
    if any(not np.isfinite(effect.share) for each in effects.values() for effect in each.values()):
        remarks.append("–: too few cases per value, or no variation, to estimate a share of variance")
    return Findings(results, dict(objectives), effects, found, tuple(dict.fromkeys(remarks)))


def _remarks(results: Results, objectives: Mapping[str, Better]) -> list[str]:
    """Remarks on the cases: unfinished, failed, mixed."""
    remarks = []
    if results.unfinished:
        remarks.append(f"unfinished: {len(results)} of {results.planned} cases are computed so far")
    if others := [name for name in results.metrics if name not in objectives]:
        remarks.append(f"{len(others)} more metrics can be shown with --metric, such as {others[0]}")
    if results.sweep.get("mixed"):
        remarks.append("the cases were computed by different versions of the code")
    remarks += [of_step] if (of_step := time_step.remark(results.folder)) else []
    for name in objectives:
        lacking = results.lacking(name)
        if not np.isfinite(results[name]).any():
            remarks.append(f"no case has a value of {name}")
        elif lacking and results.levels() is not None:
            of = f"{lacking} of {results.planned} cells of the grid"
            remarks.append(
                f"{of} have no {name}: its main effects are from the others, which may be unbalanced"
            )
    return remarks


def effects_of(results: Results, metric: str, indices: Indices | None = None) -> dict[str, Effect]:
    """{parameter: its main effect on a metric}, as the sweep's design allows."""
    blocks = results["case"] // _block_size(results) if results.design == _DESIGN else None
    grid = results.levels() is not None and not results.lacking(metric)
    found = {}
    for name in varied(results):
        found[name] = analysis.effect(results[name], results[metric], blocks=blocks, grid=grid)
    if indices is None:
        return found
    first = dict(zip(indices.parameters, indices.first.tolist(), strict=True))
    return {name: replace(effect, share=first[name]) for name, effect in found.items()}

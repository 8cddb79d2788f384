"""Sobol' indices of a Saltelli design: how much of a metric's variance each parameter answers for."""

from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.study.results import OWN_SEED, Results, optional

DESIGN = "saltelli"
MOST_FAILED = 0.01  # of the cases
FEWEST_BLOCKS = 8
RESAMPLES = 500  # of the bootstrap
SEED = 1  # of the bootstrap, so that a figure drawn twice is the same; SALib takes 0 for no seed


@dataclass(frozen=True, eq=False)
class Indices:
    """Sobol' indices of one metric, and the half-widths of their 95 % intervals.

    first : share of the variance that a parameter explains alone (d,)
    total : share that it has any part in (d,)
    second : share that two explain together beyond both alone (d, d), above the diagonal, NaN elsewhere
    left_out : base samples left out, because one of their cases failed; of `blocks`
    """

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
        names, d = self.parameters, len(self.parameters)
        upper = [(i, j) for i in range(d) for j in range(i + 1, d)]
        upper.sort(key=lambda ij: -self.second[ij])
        return [
            (names[i], names[j], float(self.second[i, j]), float(self.second_interval[i, j]))
            for i, j in upper
        ]


def varied(results: Results) -> tuple[str, ...]:
    """The parameters that the design varies: every case's own seed is none of them."""
    seeds = {p["name"] for p in results.sweep["parameters"] if p.get("distribution") == OWN_SEED}
    return tuple(name for name in results.parameters if name not in seeds)


def block_size(results: Results) -> int:
    """Cases of one base sample."""
    return 2 * len(varied(results)) + 2


def indices(results: Results, metric: str) -> Indices:
    """First-order, second-order and total Sobol' indices of a metric, by SALib.

    References
    ----------
    Saltelli et al. 2010, doi 10.1016/j.cpc.2009.09.018; second order: Saltelli 2002,
    doi 10.1016/S0010-4655(02)00280-1. Intervals by bootstrap of the base samples, as normal ones.
    """
    values = _blocks(results, metric)
    whole = np.isfinite(values).all(axis=1)
    failed = 1.0 - float(np.isfinite(values).mean())
    if failed >= MOST_FAILED or whole.sum() < FEWEST_BLOCKS:
        raise InputError(
            f"{100.0 * failed:.2g} % of the cases have no {metric}, and {whole.sum()} base samples are "
            "whole: too few for Sobol' indices",
            file=results.folder,
            allowed=f"less than {100.0 * MOST_FAILED:g} %, and at least {FEWEST_BLOCKS}",
        )
    kept = values[whole].ravel()
    if np.ptp(kept) <= 1e-12 * np.abs(kept).max():
        raise InputError(f"{metric} does not vary: it has no Sobol' indices", file=results.folder)
    names = varied(results)
    problem = {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}
    found = optional("SALib.analyze.sobol").analyze(
        problem, kept, calc_second_order=True, num_resamples=RESAMPLES, seed=SEED
    )
    return Indices(
        parameters=names,
        first=np.asarray(found["S1"]),
        first_interval=np.asarray(found["S1_conf"]),
        total=np.asarray(found["ST"]),
        total_interval=np.asarray(found["ST_conf"]),
        second=np.asarray(found["S2"]),
        second_interval=np.asarray(found["S2_conf"]),
        blocks=len(whole),
        left_out=int((~whole).sum()),
    )


def _blocks(results: Results, metric: str) -> np.ndarray:
    """The metric, one row for each base sample (N, 2d + 2)."""
    size = block_size(results)
    if results.design != DESIGN:
        raise InputError(
            "Sobol' indices need a sweep of another design",
            file=results.folder,
            field="design",
            value=results.design,
            allowed=DESIGN,
        )
    if results.unfinished or len(results) % size:
        raise InputError(
            f"Sobol' indices need every case of the sweep, and {len(results)} of {results.planned} are here",
            file=results.folder,
        )
    return results[metric].reshape(-1, size)

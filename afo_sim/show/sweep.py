"""Figures of a sweep as PNG."""

import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from afo_sim.common.writing import check_writable, together
from afo_sim.show import sweep_figures as figures
from afo_sim.show.style import write_figure
from afo_sim.study.findings import Findings, findings, varied
from afo_sim.study.results import Results
from afo_sim.study.scales import Better, chosen

FIGURES = "figures"  # the folder in a sweep's own
IN_ONE = 3  # metrics in one figure
PANEL = (2.5, 2.3)  # [inch]


def show(
    results: Results,
    out_dir: pathlib.Path,
    metrics: Sequence[str] | None = None,
    objectives: Mapping[str, Better] | None = None,
) -> list[pathlib.Path]:
    """Write the figures of a sweep as PNG, each whole or not at all."""
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
    results, count = found.results, len(varied(found.results))
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

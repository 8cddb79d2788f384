"""A search at one glance: objective, limits and parameters of all designs, generation by generation."""

import pathlib
from collections.abc import Mapping

import numpy as np

from afo_sim.common import Keywords
from afo_sim.metrics import metric_words
from afo_sim.show.panels import legend
from afo_sim.show.style import BLUE, RED, Axes, new_figure, plain, wrapped
from afo_sim.study import OBJECTIVE, Columns, Problem, best_of, human_scale

_ACROSS = 3  # panels side by side
_PANEL = (2.5, 2.0)  # [inch]
_NOT = {"color": "0.55", "marker": "o", "mfc": "none", "ls": "", "ms": 3.0, "mew": 0.7}
_KEEPS = {"color": BLUE, "marker": "o", "ls": "", "ms": 3.4, "mew": 0.0}
BEST = {"color": RED, "lw": 1.4, "drawstyle": "steps-mid"}
_FACTS: Keywords = {"loc": "left", "fontsize": 8.0, "color": "0.3"}  # of a panel's title
_BOUND = {"color": "0.25", "lw": 0.9, "ls": "--"}


def draw_search(problem: Problem, units: Mapping[str, str], columns: Columns, path: pathlib.Path) -> None:
    """Draw all designs over the generations, with the best so far."""
    aim = problem.aim
    count = 1 + len(aim.limits) + len(problem.parameters)
    rows, across = -(-count // _ACROSS), min(count, _ACROSS)
    with new_figure(path, (_PANEL[0] * across, _PANEL[1] * rows + 0.5)) as figure:
        axes = figure.subplots(rows, across, sharex=True, squeeze=False).ravel()
        ends = np.append(np.flatnonzero(np.diff(columns["generation"])) + 1, len(columns["generation"]))
        so_far = np.array([best_of(problem.aim, {n: c[:end] for n, c in columns.items()}) for end in ends])
        goal = columns[OBJECTIVE]
        kept = np.where(aim.feasible(columns)[so_far], goal[so_far], np.nan)
        _dots(axes[0], problem, columns, goal, kept)
        axes[0].set_ylabel(_title(aim.objective.metric, units))
        axes[0].set_title(f"{aim.objective.goal}, {aim.objective.over} of patients", **_FACTS)
        for axis, limit in zip(axes[1:], aim.limits, strict=False):
            level = columns[f"{limit.name}_level"]
            _dots(axis, problem, columns, level, level[so_far])
            axis.axhline(limit.bound, zorder=1, **_BOUND)
            axis.set_ylabel(_title(limit.metric, units))
            axis.set_title(f"kept by {100.0 * limit.share:.3g} %; limit dashed", **_FACTS)
        for k, axis in enumerate(axes[1 + len(aim.limits) : count]):
            _parameter(axis, problem, k, columns, so_far)
        for axis in axes[count:]:
            axis.set_visible(False)
        for axis in axes[max(count - across, 0) : count]:
            axis.set_xlabel("generation")
            axis.tick_params(labelbottom=True)
        legend(figure, axes[count - 1 : count], columns=4)


def _dots(axis: Axes, problem: Problem, columns: Columns, values: np.ndarray, best: np.ndarray) -> None:
    """All designs' values; grey those that violate something, a line along the best so far."""
    generation, keeps = columns["generation"] + 1, problem.aim.feasible(columns)
    axis.plot(generation[~keeps], values[~keeps], label="violates a limit or constraint", zorder=2, **_NOT)
    axis.plot(generation[keeps], values[keeps], label="feasible", zorder=3, **_KEEPS)
    axis.plot(np.arange(1, len(best) + 1), best, label="best so far", zorder=4, **BEST)
    axis.set_xlim(0.5, len(best) + 0.5)
    axis.locator_params(axis="x", integer=True, nbins=6)
    axis.margins(y=0.08)


def _parameter(axis: Axes, problem: Problem, number: int, columns: Columns, so_far: np.ndarray) -> None:
    parameter = problem.parameters[number]
    ends = np.array([parameter.range.lower, parameter.range.upper])
    factor, unit = human_scale(parameter.unit, ends)
    values = factor * columns[parameter.name]
    _dots(axis, problem, columns, values, values[so_far])
    if parameter.range.logarithmic:
        axis.set_yscale("log")
    low, high = factor * ends
    pad = 0.04 * (high - low)
    axis.set_ylim((low / 1.05, high * 1.05) if axis.get_yscale() == "log" else (low - pad, high + pad))
    name = plain(parameter.name.replace("_", " "))
    axis.set_ylabel(f"{name} [{unit}]" if unit else name)


def _title(metric: str, units: Mapping[str, str]) -> str:
    label, unit = metric_words.words(metric).label, metric_words.UNITS.get(units[metric], units[metric])
    return wrapped(f"{label} [{unit}]" if unit else label, 24)

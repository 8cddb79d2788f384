"""Figures of a sweep as PNG."""

import pathlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations

import numpy as np

from afo_sim.common import Foreign, JsonDict, check_writable, together
from afo_sim.show.panels import legend
from afo_sim.show.style import BLUE, RED, Axes, Figure, plain, wrapped, write_figure
from afo_sim.study import Better, Findings, Indices, Results, pareto_front, scale, spread, varied
from afo_sim.study.analysis import Effect, levels_of

FIGURES = "figures"  # the folder in a sweep's own
_IN_ONE = 3  # metrics in one figure
_PANEL = (2.5, 2.3)  # [inch]
_Drawing = tuple[str, tuple[float, float], Callable[[Figure], None]]  # name, size [inch], what draws it
_CASE = {"color": "0.5", "marker": "o", "ls": "", "mew": 0.0, "alpha": 0.75}
MOST_DOTS = 3000  # cases drawn as dots
_MOST_PARAMETERS = 6  # side by side
_MOST_LABELS = 9  # cases of a front that have their number written
_LABEL = 0.14, 0.06  # width and height of a case's number, as a share of what all cases span
_MOST_NUMBERS = 64  # cells of a heat map up to which the value is written into each
_FULL, _PALE = BLUE, "#a9cfe8"


def write_figures(found: Findings, folder: pathlib.Path) -> list[pathlib.Path]:
    """Write every figure that the findings have something for as PNG, each whole or not at all."""
    check_writable(folder)
    names = []
    with together(folder) as scratch:
        for name, size, fill in [*drawings(found), *fronts(found.results, found.objectives)]:
            names.append(f"{name}.png")
            write_figure(scratch / names[-1], size, fill)
    return [folder / name for name in names]


def drawings(findings: Findings) -> Iterator[_Drawing]:
    """The figures of metrics: name, size [inch], what draws it."""
    results, count = findings.results, len(varied(findings.results))
    across = min(count, _MOST_PARAMETERS)
    for suffix, names in _batches(list(findings.effects)):
        high = len(names)
        some = {name: findings.effects[name] for name in names}
        draw: Callable[[Figure], None] = partial(draw_distributions, results=results, metrics=names)
        yield f"distributions{suffix}", (_PANEL[0] * high + 0.4, _PANEL[1] + 0.5), draw
        draw = partial(draw_effects, results=results, effects=some)
        yield f"main_effects{suffix}", (0.85 * _PANEL[0] * across + 1.0, 1.9 * high + 0.8), draw
        if count > 1:
            draw = partial(draw_maps, results=results, effects=some)
            yield f"maps{suffix}", (3.2 * high + 0.2, 3.3), draw
        if indices := {name: findings.indices[name] for name in names if name in findings.indices}:
            draw = partial(_draw_sobol, results=results, found=indices)
            yield f"sobol{suffix}", (2.6 * len(indices) + 1.2, 0.42 * count + 1.2), draw


def fronts(results: Results, objectives: Mapping[str, Better]) -> Iterator[_Drawing]:
    known = [name for name in objectives if np.isfinite(results[name]).any()]
    for suffix, names in _batches(known):
        if len(names) > 1:
            ends = {name: objectives[name] for name in names}
            pairs = len(names) * (len(names) - 1) // 2
            draw = partial(_draw_fronts, results=results, objectives=ends)
            yield f"pareto{suffix}", (3.3 * pairs + 0.2, 3.4), draw


def _batches(names: list[str]) -> Iterator[tuple[str, list[str]]]:
    for k in range(0, len(names), _IN_ONE):
        yield f"_{k // _IN_ONE + 1}" if k else "", names[k : k + _IN_ONE]


def draw_distributions(figure: Figure, results: Results, metrics: Sequence[str]) -> None:
    """A histogram for each metric, with its median and the middle 90 % of the cases."""
    axes = figure.subplots(1, len(metrics), squeeze=False)[0]
    for axis, metric in zip(axes, metrics, strict=True):
        look = scale(results, metric)
        values = look.factor * results[metric]
        count, *_, low, median, high, _ = spread(values)
        bars = int(np.clip(2.0 * count ** (1.0 / 3.0), 5, 40))  # Rice's rule
        bins = np.histogram_bin_edges(values[np.isfinite(values)], bins=bars)
        axis.axvspan(low, high, color="0.94", lw=0.0, zorder=0)
        axis.hist(values, bins=bins, color=_PALE, edgecolor=_FULL, lw=0.6)
        axis.axvline(median, color=_FULL, lw=1.3)
        axis.margins(x=0.02)
        axis.set_xlabel(wrapped(look.title))
        axis.locator_params(axis="x", nbins=5)
        title = f"median {median:.3g}\n90 % in {low:.3g} to {high:.3g}"
        axis.set_title(title.replace("-", "−"), loc="left", fontsize=8.0, color="0.3")
    axes[0].set_ylabel("cases")
    figure.get_layout_engine().set(wspace=0.05)


def draw_effects(figure: Figure, results: Results, effects: Mapping[str, Mapping[str, Effect]]) -> None:
    """One row for each metric, one panel for each parameter: all cases, and the mean along the parameter."""
    parameters = most_influential(effects, _MOST_PARAMETERS)
    axes = figure.subplots(len(effects), len(parameters), sharex="col", sharey="row", squeeze=False)
    rows = _some(len(results))
    for row, (metric, found) in zip(axes, effects.items(), strict=True):
        of_metric = scale(results, metric)
        for axis, parameter in zip(row, parameters, strict=True):
            of_parameter = scale(results, parameter)
            _effect(axis, results, (parameter, metric), found[parameter], rows)
            share = found[parameter].share
            if np.isfinite(share):
                text = f"{100.0 * max(share, 0.0):.0f} % of variance"
                axis.set_title(text, loc="left", fontsize=8.0, color="0.3")
            if axis in axes[-1]:
                axis.set_xlabel(wrapped(of_parameter.title))
        row[0].set_ylabel(wrapped(of_metric.title, 22))
    figure.align_ylabels(axes[:, 0])
    figure.get_layout_engine().set(wspace=0.05)
    legend(figure, axes[0, :1], columns=2)


def _effect(axis: Axes, results: Results, names: tuple[str, str], effect: Effect, rows: np.ndarray) -> None:
    of_parameter, of_metric = (scale(results, name) for name in names)
    values = results[names[0]]
    text = values.dtype.kind in "US"
    if text:
        labels = list(map(str, effect.places))
        places = np.arange(len(labels), dtype=float)
        x = np.array([labels.index(v) if v in labels else np.nan for v in map(str, values)], float)
        axis.set_xticks(places, [plain(label) for label in labels])
    else:
        places, x = of_parameter.factor * effect.places, of_parameter.factor * values
    y = of_metric.factor * results[names[1]]
    axis.plot(x[rows], y[rows], zorder=1, label="a case", **_dots(len(rows)))
    means, errors = of_metric.factor * effect.means, of_metric.factor * effect.errors
    line = "" if text else "-"
    look = {"color": _FULL, "ecolor": _FULL, "ls": line, "marker": "o", "ms": 3.4, "elinewidth": 1.0}
    grid = results.levels() is not None and not results.lacking(names[1])  # no cases at random: no error
    label = "mean over the other parameters" if grid else "mean and its standard error"
    bars = None if grid else np.where(np.isfinite(errors), errors, 0.0)
    axis.errorbar(places, means, bars, zorder=3, label=label, **look)
    axis.margins(x=0.25 if text else 0.04)


def most_influential(effects: Mapping[str, Mapping[str, Effect]], count: int) -> list[str]:
    """Parameters by the largest share that they explain of any metric; as they come where shares agree."""
    shares: dict[str, float] = {}
    for found in effects.values():
        known = all(np.isfinite(effect.share) for effect in found.values())
        weight = {name: effect.share for name, effect in found.items()}
        if not known:  # by the variance of the bins' means
            for name, effect in found.items():
                middle = np.average(effect.means, weights=effect.counts) if effect.means.size else 0.0
                apart = (effect.means - middle) ** 2
                weight[name] = float(np.average(apart, weights=effect.counts)) if apart.size else 0.0
        most = 1.0 if known else max(weight.values(), default=0.0) or 1.0
        for name in found:
            shares[name] = max(shares.get(name, -np.inf), weight[name] / most)
    return sorted(shares, key=lambda name: -shares[name])[:count]


def draw_maps(figure: Figure, results: Results, effects: Mapping[str, Mapping[str, Effect]]) -> None:
    """For each metric its mean over the two parameters that it depends on most."""
    axes = figure.subplots(1, len(effects), squeeze=False)[0]
    hatched = False
    for axis, (metric, found) in zip(axes, effects.items(), strict=True):
        across, up = most_influential({metric: found}, 2)
        x, y = (_Cells(results, name) for name in (across, up))
        look = scale(results, metric)
        values, size = look.factor * results[metric], (len(x.centres), len(y.centres))
        known = np.isfinite(values)
        flat = x.cell[known] * size[1] + y.cell[known]
        counts = np.bincount(flat, minlength=size[0] * size[1])
        sums, none = np.bincount(flat, values[known], minlength=len(counts)), np.full(len(counts), np.nan)
        means = np.divide(sums, counts, out=none, where=counts > 0).reshape(size)  # or NaN
        axis.set_facecolor("0.9")
        axis.patch.set(hatch="////", edgecolor="white", lw=0.0)
        shown = axis.pcolormesh(x.edges, y.edges, means.T, cmap="viridis", lw=0.0)
        for cells, labels in ((x, axis.set_xticks), (y, axis.set_yticks)):
            if cells.ticks is not None:
                labels(*cells.ticks)
        if x.discrete and y.discrete and means.size <= _MOST_NUMBERS:
            _numbers(axis, x, y, means, shown)
        axis.set(xlabel=wrapped(x.look.title), ylabel=wrapped(y.look.title))
        label = wrapped(look.title + (", mean" if len(results.parameters) > 2 else ""), 30)
        bar = figure.colorbar(shown, ax=axis, location="top", aspect=30.0, pad=0.02, label=label)
        bar.outline.set_visible(False)
        axis.spines[:].set_visible(False)
        hatched |= bool(np.isnan(means).any())
    if hatched:
        figure.supxlabel("hatched: no case there has a value", fontsize=8.0, color="0.3", x=0.01, ha="left")
    figure.get_layout_engine().set(wspace=0.07)


class _Cells:
    """The cells of a heat map along one parameter: edges, where they are labelled, and each case's cell."""

    def __init__(self, results: Results, name: str):
        values, self.look = results[name], scale(results, name)
        levels = results.levels()
        self.ticks: tuple[np.ndarray, list[str]] | None = None
        text = values.dtype.kind in "US"
        if levels is None:
            distinct, self.cell = np.unique(values, return_inverse=True)
        else:
            distinct, self.cell = levels_of(values)
        self.discrete = text or levels is not None or len(distinct) <= 6
        if not self.discrete:
            numbers = self.look.factor * values
            count = int(np.clip(np.sqrt(len(values) / 8.0), 3, 24))
            self.edges = np.linspace(numbers.min(), numbers.max(), count + 1)
            self.cell = np.clip(np.searchsorted(self.edges, numbers, side="right") - 1, 0, count - 1)
            self.centres = 0.5 * (self.edges[1:] + self.edges[:-1])
            return
        # cells of one size: values that are not evenly spaced stand by their number, not by their place
        even = not text and len(distinct) > 2 and np.ptp(np.diff(distinct)) <= 1e-6 * np.ptp(distinct)
        self.centres = self.look.factor * distinct if even else np.arange(len(distinct), dtype=float)
        between = 0.5 * (self.centres[1:] + self.centres[:-1])
        half = 0.5 * (self.centres[1] - self.centres[0]) if len(distinct) > 1 else 0.5
        self.edges = np.r_[self.centres[0] - half, between, self.centres[-1] + half]
        if not even or len(distinct) <= 8:
            self.ticks = self.centres, [plain(self.look.text(v.item())) for v in distinct]


def _numbers(axis: Axes, x: _Cells, y: _Cells, means: np.ndarray, shown: Foreign) -> None:
    largest = np.nanmax(np.abs(means))
    decimals = int(np.clip(2 - np.floor(np.log10(largest)), 0, 6)) if largest > 0.0 else 0
    for i, j in np.ndindex(means.shape):
        if np.isfinite(means[i, j]):
            dark = shown.norm(means[i, j]) < 0.6
            text = f"{round(float(means[i, j]), decimals) + 0.0:.{decimals}f}".replace("-", "−")
            place = (x.centres[i], y.centres[j])
            look = {"ha": "center", "va": "center", "fontsize": 7.0}
            axis.annotate(text, place, color="white" if dark else "black", **look)


def _draw_fronts(figure: Figure, results: Results, objectives: Mapping[str, Better]) -> None:
    """For each two metrics all cases, and the front of those that no other case is better than in both."""
    pairs = list(combinations(objectives, 2))
    for axis, names in zip(figure.subplots(1, len(pairs), squeeze=False)[0], pairs, strict=True):
        lowest = objectives[names[0]] == "lowest", objectives[names[1]] == "lowest"
        looks = [scale(results, name) for name in names]
        points = np.column_stack([look.factor * results[n] for look, n in zip(looks, names, strict=True)])
        front = pareto_front(points, lowest)
        front = front[np.lexsort((points[front, 1], points[front, 0]))]
        rest = np.setdiff1d(_some(len(points)), front)
        axis.plot(*points[rest].T, zorder=1, **_dots(len(rest)))
        step = "steps-post" if lowest[0] else "steps-pre"  # around what a case of the front dominates
        axis.plot(*points[front].T, color=RED, lw=0.9, drawstyle=step, zorder=2)
        size, rim = (4.6, 0.5) if len(front) <= 60 else (2.6, 0.0)
        axis.plot(*points[front].T, "o", ms=size, color=RED, mec="white", mew=rim, zorder=3)
        _case_numbers(axis, results["case"], points, front, lowest)
        axis.margins(0.13)
        for label, look, low in zip((axis.set_xlabel, axis.set_ylabel), looks, lowest, strict=True):
            label(f"{wrapped(look.title)}\n{'lower' if low else 'higher'} is better")
        axis.locator_params(axis="x", nbins=5)
        title = f"red: Pareto front, {len(front)} of {np.isfinite(points).all(axis=1).sum()} cases;"
        title += "\nnumbers are those of cases"
        axis.set_title(title, loc="left", fontsize=8.0, color="0.3")
    figure.get_layout_engine().set(wspace=0.05)


def _case_numbers(
    axis: Axes, cases: np.ndarray, points: np.ndarray, front: np.ndarray, lowest: tuple[bool, ...]
) -> None:
    """Numbers of cases spread evenly along the front, on the side where no case is."""
    if not len(front):
        return
    size = np.ptp(points[np.isfinite(points).all(axis=1)], axis=0)
    places = points[front] / np.where(size > 0.0, size, 1.0)
    way = np.r_[0.0, np.cumsum(np.hypot(*np.diff(places, axis=0).T))]
    marks = np.linspace(0.0, way[-1], min(_MOST_LABELS, len(front)))
    near: list[int] = []
    for row in np.unique([int(np.abs(way - mark).argmin()) for mark in marks]):
        if not near or (np.abs(places[row] - places[near]) > _LABEL).any(axis=1).all():
            near.append(int(row))
    shift = [-4.0 if low else 4.0 for low in lowest]
    look = {"ha": "right" if lowest[0] else "left", "va": "top" if lowest[1] else "bottom"}
    for row in front[near]:
        where = {"xytext": shift, "textcoords": "offset points"}
        axis.annotate(f"{cases[row]}", points[row], fontsize=7.0, color=RED, **where, **look)


def _draw_sobol(figure: Figure, results: Results, found: Mapping[str, Indices]) -> None:
    """For each metric the first-order and total index of each parameter, with 95 % intervals."""
    axes = figure.subplots(1, len(found), sharex=True, sharey=True, squeeze=False)[0]
    first = next(iter(found.values()))
    order = np.argsort(-np.max([each.total for each in found.values()], axis=0), kind="stable")
    rows = np.arange(len(order))
    for axis, (metric, each) in zip(axes, found.items(), strict=True):
        bars = (
            (-0.18, each.first, each.first_interval, _FULL, "alone (first order)"),
            (0.18, each.total, each.total_interval, _PALE, "with interactions (total)"),
        )
        for shift, values, intervals, colour, label in bars:
            look = {"error_kw": {"lw": 0.9, "ecolor": "0.25"}, "color": colour, "label": label}
            axis.barh(rows + shift, values[order], 0.34, xerr=intervals[order], **look)
        axis.axvline(0.0, color="0.4", lw=0.6)
        axis.set_xlabel("share of variance")
        axis.set_title(plain(scale(results, metric).label), loc="left")
    axes[0].set_yticks(rows, [plain(first.parameters[k].replace("_", " ")) for k in order])
    axes[0].invert_yaxis()
    for axis in axes:
        axis.tick_params(axis="y", length=0.0)
    highest = max(float((each.total + each.total_interval).max()) for each in found.values())
    highest = max(highest, *(float((each.first + each.first_interval).max()) for each in found.values()))
    lowest = min(float((each.first - each.first_interval).min()) for each in found.values())
    axes[0].set_xlim(min(1.05 * lowest, -0.02), max(1.02 * highest, 1.0))
    legend(figure, axes[:1], columns=2)


def _some(count: int) -> np.ndarray:
    """Rows to draw; of very many a random part: one in so many would beat with the steps of a grid."""
    return np.sort(np.random.default_rng(0).permutation(count)[:MOST_DOTS])


def _dots(count: int) -> JsonDict:
    return _CASE | {"ms": float(np.clip(8.0 * max(count, 1) ** -0.18, 2.2, 4.2))}

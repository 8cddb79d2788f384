"""Cases of a sweep → results: spread of a metric, best cases and fronts, effect of each parameter."""

import re
from collections import Counter
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

_NUMBERS = re.compile(r"[-+−]?\d+(\.\d+)?(e[-+]?\d+)?")
_FEWEST_IN_BIN = 20  # cases, where there are enough for bins at all
_FEWEST_FOR_SHARE = 5  # cases in a bin on average, below which a share is little but chance
_BINS = (4, 12)  # at least, at most
_LEVELS = 12  # distinct values up to which each is a bin of its own, if it has two cases on average


@dataclass(frozen=True, eq=False)
class Effect:
    """The mean of a metric over one parameter, all other parameters varying as they do in the sweep."""

    places: np.ndarray
    means: np.ndarray
    errors: np.ndarray
    counts: np.ndarray
    share: float


def spread(values: np.ndarray) -> tuple[float, ...]:
    """Count, mean, standard deviation, lowest, 5 %, median, 95 % and highest of a metric's known values."""
    values = values[np.isfinite(values)]
    if not len(values):
        return 0, *[np.nan] * 7
    deviation = float(values.std(ddof=1)) if len(values) > 1 else np.nan
    levels = np.percentile(values, (0.0, 5.0, 50.0, 95.0, 100.0)).tolist()
    return len(values), float(values.mean()), deviation, *levels


def failures(status: np.ndarray, reason: np.ndarray) -> list[tuple[str, str, int]]:
    """[(status, reason, number of cases)], the most frequent first; "ok" is none of them."""
    failed = [(s, r) for s, r in zip(status.tolist(), reason.tolist(), strict=True) if s != "ok"]
    found = Counter((s, _kind(r)) for s, r in failed)
    texts = {(s, _kind(r)): r for s, r in reversed(failed)}
    return [(s, texts[s, kind], count) for (s, kind), count in found.most_common()]


def warned(warnings: np.ndarray, notices: np.ndarray) -> list[tuple[str, int]]:
    """[(warning, number of cases)], the most frequent first, of cases' warnings with a line each (n,)."""
    cases = [
        {about or _kind(line): line for line, about in reversed([*zip_longest(*lines, fillvalue="")])}
        for lines in ((a.splitlines(), b.splitlines()) for a, b in zip(warnings, notices, strict=True))
    ]
    found = Counter(kind for case in cases for kind in reversed(case))
    texts = {kind: line for case in reversed(cases) for kind, line in case.items()}
    return [(texts[kind], count) for kind, count in found.most_common()]


def _kind(text: str) -> str:
    return _NUMBERS.sub("#", text)


def best(values: np.ndarray, count: int, lowest: bool) -> np.ndarray:
    """Rows of the best cases, best first; of equal ones the earlier. A case without the metric is none."""
    order = np.argsort(values if lowest else -values, kind="stable")
    return order[np.isfinite(values[order])][:count]


def effect(
    parameter: np.ndarray, metric: np.ndarray, *, bins: int | None = None, blocks: np.ndarray | None = None,
    grid: bool = False,
) -> Effect:  # fmt: skip
    """Main effect of a parameter on a metric: the mean in bins of equally many cases, or at each value.

    The share is (Σ n_k (ȳ_k − ȳ)² − Σ n_k (1 − n_k/n) e_k²) / Σ (y − ȳ)², with e_k the standard error of
    the bin's mean; the second sum is what chance alone would give. With independent cases and one
    variance this is ε² (Kelley 1935, doi 10.1073/pnas.21.9.554). A slope within a bin counts as
    unexplained: of a linear effect in k bins 1/k². Errors are those of cluster-robust regression on the
    bins (Liang & Zeger 1986, doi 10.1093/biomet/73.1.13), with m/(m − 1) for m blocks.
    """
    known = np.isfinite(metric)
    parameter, metric = parameter[known], metric[known]
    blocks = np.arange(len(metric)) if blocks is None else blocks[known]
    if not len(metric):
        nothing = np.full(0, np.nan)
        return Effect(nothing, nothing, nothing, np.zeros(0, int), np.nan)
    places, bin_of = levels_of(parameter)
    if not (parameter.dtype.kind in "US" or grid or len(places) <= min(_LEVELS, len(parameter) // 2)):
        wanted = bins or int(np.clip(len(parameter) // _FEWEST_IN_BIN, *_BINS))
        edges = np.unique(np.quantile(parameter, np.linspace(0.0, 1.0, wanted + 1)[1:-1]))
        # equal values are never parted
        _, bin_of = np.unique(np.searchsorted(edges, parameter, side="right"), return_inverse=True)
        places = np.bincount(bin_of, parameter) / np.bincount(bin_of)
    counts = np.bincount(bin_of)
    means = np.bincount(bin_of, metric) / counts
    # standard error of each bin's mean, NaN where the bin is a single block
    pairs, member = np.unique(blocks * len(counts) + bin_of, return_inverse=True)
    sums, of_bin = np.bincount(member, metric - means[bin_of]), pairs % len(counts)
    m = np.bincount(of_bin)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.bincount(of_bin, sums**2) / counts**2 * (m / (m - 1.0))
    errors = np.where(m > 1, np.sqrt(variance), np.nan)
    total = float(np.sum((metric - metric.mean()) ** 2))
    explained = counts * (means - metric.mean()) ** 2
    chance = 0.0 if grid else counts * (1.0 - counts / len(metric)) * errors**2
    few = not grid and counts.mean() < _FEWEST_FOR_SHARE
    if few or len(counts) < 2 or total <= 1e-24 * float(np.sum(metric**2)):
        return Effect(places, means, errors, counts, np.nan)
    # a bin of a single block has no error to estimate chance by: its share is not known
    return Effect(places, means, errors, counts, float(np.sum(explained - chance)) / total)


def levels_of(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Different values, ascending, or words in the order they come; and the place of each case there (n,)."""
    levels, first, places = np.unique(values, return_index=True, return_inverse=True)
    if values.dtype.kind in "US":
        order = np.argsort(first)
        return levels[order], np.argsort(order)[places]
    return levels, places


def pareto_front(points: np.ndarray, lowest: tuple[bool, bool]) -> np.ndarray:
    """Rows of the cases (n, 2) that no other one is as good as in both metrics and better than in one."""
    rows = np.flatnonzero(np.isfinite(points).all(axis=1))
    costs = np.where(lowest, points, -points)[rows]
    distinct, member = np.unique(costs, axis=0, return_inverse=True)  # sorted by the first metric, then on
    before = np.append(np.inf, np.minimum.accumulate(distinct[:, 1]))[:-1]
    return rows[(distinct[:, 1] < before)[member.ravel()]]

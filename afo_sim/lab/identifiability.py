"""95 % intervals and correlations of fitted parameters, and a verdict that refuses what data do not tell."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t

CORRELATED = 0.98  # two parameters with more are not told apart
VAGUE = 0.5  # a half-interval of more than this share of the parameter's size tells nothing
AT_BOUND = 1e-6  # share of a parameter's range that counts as being at its bound
POINTS_PER_PARAMETER = 2.0  # with fewer no interval is given


@dataclass(frozen=True)
class Estimate:
    """The end of a search, parameter by parameter, in any unit that is the same in all arrays.

    `size` is what an uncertainty is held against, often the value itself; `shown` is the value and its
    half-interval in words; `near` is the share of the range that counts as being at a bound; `counted`
    says what the points are.
    """

    names: Sequence[str]
    values: np.ndarray
    half: np.ndarray
    size: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    shown: Sequence[str]
    near: float = AT_BOUND
    counted: str = "points"


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def intervals(jacobian: np.ndarray, variance: float, freedom: float) -> tuple[np.ndarray, np.ndarray]:
    """Half-widths of the 95 % intervals, and correlations, of linearised least squares.

    Units: jacobian (n, k), freedom [-].
    """
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0.0] = 1e-300
    _, singular, rows = np.linalg.svd(jacobian / norms, full_matrices=False)
    inverse = (rows.T / np.maximum(singular, 1e-15) ** 2) @ rows
    spread = np.sqrt(np.diag(inverse))
    with np.errstate(over="ignore"):  # a parameter without any effect
        half = t.ppf(0.975, freedom) * np.sqrt(variance) * spread / norms
    return half, inverse / np.outer(spread, spread)


def verdict(found: Estimate, correlation: np.ndarray, points: int) -> Iterator[str]:
    """Lines "names: reason" on the parameters that the data do not identify.

    Units: correlation (k, k).
    """
    names = found.names
    if points < POINTS_PER_PARAMETER * len(names):
        without = [
            n for n, half in zip(names, found.half, strict=True) if not np.isfinite(half) or half > 1e100
        ]
        yield from (f"{name}: not identifiable: {found.shown[list(names).index(name)]}" for name in without)
        rest = [name for name in names if name not in without]
        if rest:
            wanted = f"{len(names)} parameter{'s' if len(names) > 1 else ''}"
            yield f"{', '.join(rest)}: not identifiable: {points} {found.counted} for {wanted}"
        return
    margin = found.near * (found.upper - found.lower)
    for i, name in enumerate(names):
        for j in range(i):
            if abs(correlation[i, j]) > CORRELATED:
                yield (
                    f"{names[j]}, {name}: not identifiable one by one: correlation {correlation[i, j]:.3f}; "
                    "use them together"
                )
        if min(found.values[i] - found.lower[i], found.upper[i] - found.values[i]) <= margin[i]:
            yield f"{name}: not identifiable: it ends at its bound"
        elif found.half[i] > VAGUE * found.size[i]:
            yield f"{name}: not identifiable: {found.shown[i]}"


def refused(lines: Sequence[str]) -> set[str]:
    """The names that a verdict is about."""
    return {name for line in lines for name in line.split(":")[0].split(", ")}

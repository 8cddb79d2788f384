"""95 % intervals and correlations of fitted parameters, and a verdict that refuses what data lack."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t

from afo_sim.common import Notice

CORRELATED = 0.98  # two parameters with more are not told apart
VAGUE = 0.5  # a half-interval of more than this share of the parameter's size tells nothing
AT_BOUND = 1e-6  # share of a parameter's range that counts as being at its bound
POINTS_PER_PARAMETER = 2.0  # with fewer no interval is given


@dataclass(frozen=True)
class Estimate:
    """The end of a search, parameter by parameter, in any unit that is the same in all arrays."""

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
    """Half-widths of the 95 % intervals, and correlations, of linearised least squares."""
    norms = np.linalg.norm(jacobian, axis=0)
    norms[norms == 0.0] = 1e-300
    _, singular, rows = np.linalg.svd(jacobian / norms, full_matrices=False)
    inverse = (rows.T / np.maximum(singular, 1e-15) ** 2) @ rows
    spread = np.sqrt(np.diag(inverse))
    with np.errstate(over="ignore"):  # a parameter without any effect
        half = t.ppf(0.975, freedom) * np.sqrt(variance) * spread / norms
    return half, inverse / np.outer(spread, spread)


def verdict(found: Estimate, correlation: np.ndarray, points: int) -> Iterator[Notice]:
    """A notice for each group of parameters that the data do not identify."""
    names = found.names
    if points < POINTS_PER_PARAMETER * len(names):
        yield from _too_few(found, points)
        return
    margin = found.near * (found.upper - found.lower)
    for i, name in enumerate(names):
        for j in range(i):
            if abs(correlation[i, j]) > CORRELATED:
                problem = (
                    f"not identifiable one by one: correlation {correlation[i, j]:.3f}; use them together"
                )
                yield unidentified("correlated", [names[j], name], problem)
        if min(found.values[i] - found.lower[i], found.upper[i] - found.values[i]) <= margin[i]:
            yield unidentified("at-bound", [name], "not identifiable: it ends at its bound")
        elif found.half[i] > VAGUE * found.size[i]:
            yield unidentified("vague", [name], f"not identifiable: {found.shown[i]}")


def _too_few(found: Estimate, points: int) -> Iterator[Notice]:
    """Parameters without any effect, one by one, and the others together."""
    names, without = found.names, []
    for name, half, shown in zip(names, found.half, found.shown, strict=True):
        if not np.isfinite(half) or half > 1e100:
            without.append(name)
            yield unidentified("no-effect", [name], f"not identifiable: {shown}")
    if rest := [name for name in names if name not in without]:
        wanted = f"{len(names)} parameter{'s' if len(names) > 1 else ''}"
        yield unidentified("too-few", rest, f"not identifiable: {points} {found.counted} for {wanted}")


def unidentified(code: str, names: Sequence[str], reason: str) -> Notice:
    """A notice on parameters whose intervals are refused; `data` has their names and the reason."""
    together = ", ".join(names)
    return Notice(code, "{subject}: {reason}", subject=together, names=tuple(names), reason=reason)


def refused(verdict: Iterable[Notice]) -> set[str]:
    """The names that a verdict is about."""
    return {name for notice in verdict for name in notice.data["names"]}


def refusal_of(verdict: Iterable[Notice], name: str) -> Notice | None:
    """The first notice about a parameter."""
    return next((notice for notice in verdict if name in notice.data["names"]), None)

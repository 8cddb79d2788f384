"""What draws say: quantiles, share of strides that trip, and how much of the variance each group explains."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

QUANTILES = (0.05, 0.5, 0.95)
ROWS_PER_TERM = 2.0  # draws that a regression needs for each of its terms


@dataclass(frozen=True)
class Explained:
    """Share of a metric's variance that each group explains by itself [-], and what none of them does.

    `shares` are in the order of the groups; a small one may be estimated below zero.
    """

    shares: tuple[float, ...]
    rest: float


def quantiles(values: np.ndarray) -> list[float]:
    """5, 50 and 95 % quantiles (3,) of values (n,), or of each column of curves, then (3, m), as lists."""
    found: list[float] = np.quantile(values, QUANTILES, axis=0).tolist()
    return found


def share_below(heights: np.ndarray, limit: float) -> float:
    """Share of strides whose foot comes to a height [m] or lower [-], of their least heights (n,)."""
    return float(np.mean(heights <= limit))


def shares_of_one(heights: np.ndarray, path: np.ndarray, limit: float) -> np.ndarray:
    """Share of one wearer's strides that come to a height or lower [-] (n,), one for each draw.

    Units: heights [m] (n,), path [m] (m,), limit [m].
    """
    return np.asarray((heights[:, None] + path[None, :] <= limit).mean(axis=1))


def explained(groups: Sequence[np.ndarray], metric: np.ndarray) -> Explained | None:
    """First-order shares of a metric's variance, by a regression on linear and quadratic terms.

    All groups' terms z, z² − 1 and z_i z_j of their own deviates are fitted at once, so that what one group
    does is no noise to another. The groups are independent, so the variance of y is the sum of the variances
    V_g of the groups' parts f_g of the fit, and of what is left, σ²:

        V_g = mean(f_g²) − σ² tr(X_gᵀ X_g C_gg) / n,   C = (XᵀX)⁻¹,   σ² = RSS / (n − 1 − p)
        S_g = V_g / (Σ V + σ²)

    The second term of V_g is what chance alone would give, as in an adjusted R². What a group does only
    together with another, and what is not quadratic, is in no share but in the rest.

    Units: groups (n, k_g), metric (n,).
    """
    blocks = [_terms(deviates) for deviates in groups]
    n, spread = len(metric), metric - metric.mean()
    if n < fewest(groups) or np.abs(spread).max() <= 1e-12 * np.abs(metric).max():
        return None
    blocks = [block - block.mean(axis=0) for block in blocks]
    design = np.hstack(blocks)
    inverse = np.linalg.pinv(design.T @ design)
    weights = inverse @ design.T @ spread
    noise = float(np.sum((spread - design @ weights) ** 2)) / (n - 1 - design.shape[1])
    ends = np.cumsum([0, *(block.shape[1] for block in blocks)])
    parts = []
    for block, a, b in zip(blocks, ends, ends[1:], strict=False):
        chance = noise * float(np.trace(block.T @ block @ inverse[a:b, a:b])) / n
        parts.append(float(np.mean((block @ weights[a:b]) ** 2)) - chance)
    whole = sum(parts) + noise
    return Explained(tuple(part / whole for part in parts), noise / whole)


def fewest(groups: Sequence[np.ndarray]) -> int:
    """Draws that `explained` needs for such groups."""
    return int(ROWS_PER_TERM * sum(_terms(deviates[:1]).shape[1] for deviates in groups)) + 2


def _terms(deviates: np.ndarray) -> np.ndarray:
    """Linear and quadratic terms of standard normal deviates (n, k): z_i, z_i² − 1, z_i z_j."""
    pairs = itertools.combinations(range(deviates.shape[1]), 2)
    products = [deviates[:, i] * deviates[:, j] for i, j in pairs]
    return np.column_stack([deviates, deviates**2 - 1.0, *products])

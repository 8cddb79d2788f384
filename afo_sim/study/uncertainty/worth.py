"""How much of a metric each group of uncertain inputs explains, and what measuring it would gain."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

_ROWS_PER_TERM = 2.0  # draws that a regression needs for each of its terms
_BLOCKS = 20  # of the draws, each left out once for a standard error
_MOST = 1.0 - 1e-9  # share of a variance: what is left is above zero [-]


@dataclass(frozen=True, eq=False)
class Explained:
    """Share of a metric's variance that each group explains by itself [-], and what none of them does."""

    shares: tuple[float, ...]
    rest: float
    left: np.ndarray  # what `_left` tells, and its standard errors (4, 1 + groups)


class _Fit(NamedTuple):
    """A regression: variance of each group's part and of what is left, and each part by draw (groups, n)."""

    variances: np.ndarray
    noise: float
    parts: np.ndarray


def explained(groups: Sequence[np.ndarray], metric: np.ndarray, wanted: float = 0.0) -> Explained | None:
    """First-order shares of a metric's variance, by a regression on linear and quadratic terms; None of few.

    All groups' terms z, z² − 1 and z_i z_j of their own deviates are fitted at once, so that what one group
    does is no noise to another. The groups are independent, so the variance of y is the sum of the variances
    V_g of the groups' parts f_g of the fit, and of what is left, σ²:

        V_g = mean(f_g²) − σ² tr(X_gᵀ X_g C_gg) / n,   C = (XᵀX)⁻¹,   σ² = RSS / (n − 1 − p)
        S_g = V_g / (Σ V + σ²)

    The second term of V_g is what chance alone would give, as in an adjusted R². What a group does only
    together with another, and what is not quadratic, is in no share but in the rest. Standard errors leave
    out a twentieth of the draws at a time (jackknife).

    Units: groups (n, k_g), metric (n,), and `wanted` of it.
    """
    if len(metric) < fewest(groups) or np.ptp(metric) <= 1e-12 * np.abs(metric).max():
        return None
    number, fit = np.arange(len(metric)) % _BLOCKS, _fitted(groups, metric)
    without = [number != block for block in range(_BLOCKS)]
    parts = [_left(_fitted([z[k] for z in groups], metric[k]), metric[k], wanted) for k in without]
    left = np.vstack([_left(fit, metric, wanted), np.sqrt((_BLOCKS - 1) * np.var(parts, axis=0))])
    whole = fit.variances.sum() + fit.noise
    return Explained(tuple((fit.variances / whole).tolist()), float(fit.noise / whole), left)


def _fitted(groups: Sequence[np.ndarray], metric: np.ndarray) -> _Fit:
    n, spread = len(metric), metric - metric.mean()
    blocks = [block - block.mean(axis=0) for block in map(_terms, groups)]
    design = np.hstack(blocks)
    inverse = np.linalg.pinv(design.T @ design)
    weights = inverse @ design.T @ spread
    noise = float(np.sum((spread - design @ weights) ** 2)) / (n - 1 - design.shape[1])
    ends = np.cumsum([0, *(block.shape[1] for block in blocks)])
    variances, parts = [], []
    for block, a, b in zip(blocks, ends, ends[1:], strict=False):
        parts.append(block @ weights[a:b])
        chance = noise * float(np.trace(block.T @ block @ inverse[a:b, a:b])) / n
        variances.append(float(np.mean(parts[-1] ** 2)) - chance)
    return _Fit(np.array(variances), noise, np.array(parts))


def _left(fit: _Fit, metric: np.ndarray, wanted: float) -> np.ndarray:
    """The band's width over that of now, and how probably the better guess of two is wrong (2, 1 + groups).

    The guess is whether the metric reaches `wanted`. With a group known the metric is taken as normal about
    its mean and what the group does, with the variance that the others leave (`explained`):

        √(1 − S_g),   E min(P_g, 1 − P_g) with P_g = Φ[(mean + f_g − wanted)/√(V − V_g)]

    f_g is drawn in until its variance is V_g. (Expected value of partial perfect information: Strong et al.
    2014, doi 10.1177/0272989X13505910.)
    """
    whole = max(fit.variances.sum() + fit.noise, 1e-300)  # nothing varies where one draw alone differs
    known = np.clip([0.0, *fit.variances], 0.0, _MOST * whole)
    parts = np.vstack([np.zeros(len(metric)), fit.parts])
    squares = np.mean(parts**2, axis=1)
    parts *= np.sqrt(known / np.where(squares > 0.0, squares, 1.0))[:, None]
    reached = ndtr((metric.mean() + parts - wanted) / np.sqrt(whole - known)[:, None])
    wrong = np.minimum(reached, 1.0 - reached).mean(axis=1)
    return np.array([np.sqrt(1.0 - known / whole), np.minimum(wrong, wrong[0])])  # knowing never harms


def fewest(groups: Sequence[np.ndarray]) -> int:
    """Draws that `explained` needs for such groups."""
    return int(_ROWS_PER_TERM * sum(_terms(deviates[:1]).shape[1] for deviates in groups)) + 2


def _terms(deviates: np.ndarray) -> np.ndarray:
    """Linear and quadratic terms of standard normal deviates (n, k): z_i, z_i² − 1, z_i z_j."""
    pairs = itertools.combinations(range(deviates.shape[1]), 2)
    products = [deviates[:, i] * deviates[:, j] for i, j in pairs]
    return np.column_stack([deviates, deviates**2 - 1.0, *products])

"""Ranges of ankle angles in which a muscle hangs through, is stretched, or cannot shorten further."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

Span = tuple[float, float]  # from, to [rad]
TOLERANCE = 1e-9  # of an angle [rad]


def spans_above(angles: np.ndarray, values: np.ndarray, of: Callable[[float], float]) -> tuple[Span, ...]:
    """Ranges of angles in which a function is positive.

    Units: angles [rad] (n,), values (n,).
    """
    above = np.r_[False, values > 0.0, False]
    found = []
    for start, stop in np.flatnonzero(above[1:] != above[:-1]).reshape(-1, 2):
        low = float(angles[0]) if start == 0 else _root(of, angles[start - 1], angles[start])
        high = float(angles[-1]) if stop == len(angles) else _root(of, angles[stop - 1], angles[stop])
        found.append((low, high))
    return tuple(found)


def _root(of: Callable[[float], float], low: float, high: float) -> float:
    if of(low) == 0.0:
        return float(low)
    if of(high) == 0.0:
        return float(high)
    return float(brentq(of, low, high, xtol=TOLERANCE))


def in_words(spans: tuple[Span, ...], angles: np.ndarray) -> str:
    """Ranges as people say them: "below −15.5 deg", "above 3 deg", "nowhere", "everywhere"."""
    if not spans:
        return "nowhere"
    return " and ".join(_words(span, float(angles[0]), float(angles[-1])) for span in spans)


def _words(span: Span, first: float, last: float) -> str:
    low, high = (f"{degrees(angle)} deg" for angle in span)
    if span == (first, last):
        return "everywhere"
    if span[0] == first:
        return f"below {high}"
    return f"above {low}" if span[1] == last else f"{low} to {high}"


def degrees(angle: float) -> str:
    """An angle [rad] in degrees with at most one decimal, and a minus sign of the width of a plus."""
    shown = f"{np.degrees(angle):.1f}".removesuffix(".0")
    return ("0" if shown == "-0" else shown).replace("-", "−")

"""The root of a function between two places, as `scipy.optimize.brentq` finds it, to the bit.

To import that takes 0.35 s, half of what a short run takes.
"""

import math
from collections.abc import Callable

_LAST = 4.0 * math.ulp(1.0)
_MOST = 100  # iterations; halving alone takes 60 to the last bit


def root(of: Callable[[float], float], low: float, high: float, tolerance: float = 2e-12) -> float:
    """Where a function is zero, by inverse quadratic interpolation, and by halving where that is slow.

    Parameters
    ----------
    of : a continuous function whose values at `low` and `high` differ in sign
    low, high : between which the root lies, in any order
    tolerance : of the root, beside four units in its last place

    Returns
    -------
    float : the root, in the unit of `low`

    Raises
    ------
    ValueError
        The signs at `low` and `high` are alike, or a value is not a number.

    Source
    ------
    Brent 1973, Algorithms for Minimization without Derivatives, chapter 4.
    """
    before, here = float(low), float(high)
    at_before, at_here = of(before), of(here)
    across, at_across = before, at_before  # the latest place on the other side
    last = step = here - before
    if at_before == 0.0:
        return before
    if not at_before * at_here <= 0.0:
        raise ValueError(f"is {at_before:g} at {low:g} and {at_here:g} at {high:g}: no change of sign")
    for _ in range(_MOST):
        if (at_before < 0.0) != (at_here < 0.0):
            across, at_across = before, at_before
            last = step = here - before
        if abs(at_across) < abs(at_here):
            before, here, across = here, across, here
            at_before, at_here, at_across = at_here, at_across, at_here
        least, half = 0.5 * (tolerance + _LAST * abs(here)), 0.5 * (across - here)
        if at_here == 0.0 or abs(half) < least:
            return here
        wanted = math.inf
        if abs(last) > least and abs(at_here) < abs(at_before):
            if before == across:  # a straight line through two places
                wanted = -at_here * (here - before) / (at_here - at_before)
            else:  # a parabola on its side through three
                m, n = (at_before - at_here) / (before - here), (at_across - at_here) / (across - here)
                wanted = -at_here * (at_across * n - at_before * m) / (n * m * (at_across - at_before))
        if 2.0 * abs(wanted) < min(abs(last), 3.0 * abs(half) - least):
            last, step = step, wanted
        else:
            last = step = half
        before, at_before = here, at_here
        here += step if abs(step) > least else math.copysign(least, half)
        at_here = of(here)
    raise ValueError(f"is {at_here:g} at {here:g} after {_MOST} steps: no root is found")

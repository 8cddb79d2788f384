"""Functions that keep a law bounded beyond the range it was measured in.

A law holds where it was measured, and a simulation may leave that range. The force may be a little wrong
there, and must not become absurd: an exponential continues along its tangent (`bounded_exp`), and a
polynomial never rises again (`descending`).
"""

import math

from afo_sim.physics.jitable import register_jitable

BAR = 1e5  # [Pa]
SMALLEST_SINE = 0.05  # of the braid angle in the terms of a wall: 2.9°, flatter than any braid
_LARGEST_EXPONENT = 3.0  # an exponential continues along its tangent from there
STEEPEST = math.exp(_LARGEST_EXPONENT)  # the slope of `bounded_exp` is its value, and at most this
SPAN = 0.5  # contraction ratio up to which a polynomial is followed; constant beyond
_CELLS = 16  # of the search for the first minimum over the span


@register_jitable
def bounded_exp(x: float) -> float:
    """e^x up to x = 3, and its tangent beyond: finite and smooth for every finite x."""
    if x <= _LARGEST_EXPONENT:
        return math.exp(x)
    return math.exp(_LARGEST_EXPONENT) * (1.0 + x - _LARGEST_EXPONENT)  # a NaN comes out here


Quintic = tuple[float, float, float, float, float, float]  # coefficients by ascending power


@register_jitable
def _quintic(x: float, q: Quintic) -> float:
    return q[0] + x * (q[1] + x * (q[2] + x * (q[3] + x * (q[4] + x * q[5]))))


@register_jitable
def _quintic_slope(x: float, q: Quintic) -> float:
    return q[1] + x * (2.0 * q[2] + x * (3.0 * q[3] + x * (4.0 * q[4] + x * 5.0 * q[5])))


@register_jitable
def descending(x: float, span: float, q: Quintic, by: Quintic) -> tuple[float, float, float]:
    """The least value of a quintic between 0 and x: the quintic itself as long as it falls.

    Beyond its first minimum a polynomial rises again, and a slack muscle would start to pull. Below
    zero it continues along the tangent, falling or level; beyond `span` it is constant.

    Parameters
    ----------
    x : argument
    span : up to which it is followed
    q : coefficients
    by : their slopes by another quantity

    Returns
    -------
    (value, its slope by x, its slope by the other quantity)
    """
    if x < 0.0 and q[1] < 0.0:
        return q[0] + q[1] * x, q[1], by[0] + by[1] * x
    if x < 0.0:
        return q[0] + 0.0 * q[1], 0.0, by[0]
    inside = x <= span
    if x > span:
        x = span
    value = _quintic(x, q)
    if value != value:
        return value, value, value
    least, place, low, slope = q[0], 0.0, 0.0, q[1]
    while low < x:
        high = low + span / _CELLS
        if high > x:
            high = x
        next_slope = _quintic_slope(high, q)
        if slope < 0.0 and next_slope > 0.0:
            left, right = low, high
            for _ in range(50):
                middle = 0.5 * (left + right)
                if _quintic_slope(middle, q) < 0.0:
                    left = middle
                else:
                    right = middle
            turn = _quintic(left, q)
            if turn < least:
                least, place = turn, left
        there = _quintic(high, q)
        if there < least:
            least, place = there, high
        low, slope = high, next_slope
    falls = min(_quintic_slope(x, q), 0.0) if inside and place == x else 0.0
    return least, falls, _quintic(place, by)

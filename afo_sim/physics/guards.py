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
SPAN = 0.5  # contraction ratio up to which a polynomial is followed; constant beyond
_CELLS = 16  # of the search for the first minimum over the span


@register_jitable
def bounded_exp(x: float) -> float:
    """e^x up to x = 3, and its tangent beyond: finite and smooth for every finite x."""
    if x <= _LARGEST_EXPONENT:
        return math.exp(x)
    return math.exp(_LARGEST_EXPONENT) * (1.0 + x - _LARGEST_EXPONENT)  # a NaN comes out here


@register_jitable
def _quintic(x: float, q0: float, q1: float, q2: float, q3: float, q4: float, q5: float) -> float:
    return q0 + x * (q1 + x * (q2 + x * (q3 + x * (q4 + x * q5))))


@register_jitable
def _quintic_slope(x: float, q1: float, q2: float, q3: float, q4: float, q5: float) -> float:
    return q1 + x * (2.0 * q2 + x * (3.0 * q3 + x * (4.0 * q4 + x * 5.0 * q5)))


@register_jitable
def descending(
    x: float, span: float, q0: float, q1: float, q2: float, q3: float, q4: float, q5: float
) -> float:
    """The least value of a quintic between 0 and x: the quintic itself as long as it falls.

    Beyond its first minimum a polynomial rises again, and a slack muscle would start to pull. Below
    zero it continues along the tangent, falling or level; beyond `span` it is constant.

    Parameters
    ----------
    x : argument
    span : up to which it is followed
    q0…q5 : coefficients by ascending power

    Returns
    -------
    float
    """
    if x < 0.0:
        return q0 + (q1 * x if q1 < 0.0 else 0.0 * q1)
    if x > span:
        x = span
    value = _quintic(x, q0, q1, q2, q3, q4, q5)
    if value != value:
        return value
    least, low, slope = q0, 0.0, q1
    while low < x:
        high = low + span / _CELLS
        if high > x:
            high = x
        next_slope = _quintic_slope(high, q1, q2, q3, q4, q5)
        if slope < 0.0 and next_slope > 0.0:
            left, right = low, high
            for _ in range(50):
                middle = 0.5 * (left + right)
                if _quintic_slope(middle, q1, q2, q3, q4, q5) < 0.0:
                    left = middle
                else:
                    right = middle
            turn = _quintic(left, q0, q1, q2, q3, q4, q5)
            if turn < least:
                least = turn
        there = _quintic(high, q0, q1, q2, q3, q4, q5)
        if there < least:
            least = there
        low, slope = high, next_slope
    return least

"""Coefficients of a stabilised explicit Runge–Kutta–Chebyshev step of second order.

    Y1 = Y0 + b1 w1 h F0
    Yj = (1 − μ − ν) Y0 + μ Y(j−1) + ν Y(j−2) + μ' h F(j−1) + γ' h F0

Its stable range of rate × step grows as 0.65 (s² − 1) with the number s of its stages, so that stiff air
costs the square root of what short steps would. What decays fast it damps without changing its sign: flow
between small volumes does not chatter.

Source
------
Sommeijer, Shampine & Verwer 1998, RKC: an explicit solver for parabolic PDEs, J. Comput. Appl. Math. 88: 315,
doi 10.1016/S0377-0427(97)00219-7, equations 2.2 to 2.7, with ε = 2/13.
"""

import math

from afo_sim.physics.jitable import register_jitable

DAMPING = 2.0 / 13.0
FEWEST, MOST = 3, 200  # stages


@register_jitable
def stages(number: float) -> int:
    """Stages that are stable at a rate × step (source, after equation 2.7)."""
    needed = 1 + int(math.sqrt(1.54 * number + 1.0))
    return min(max(needed, FEWEST), MOST)


@register_jitable
def following(
    x: float, t0: float, t1: float, d0: float, d1: float, s0: float, s1: float
) -> tuple[float, float, float]:
    """Chebyshev's next polynomial and its two derivatives at x, from those of the two degrees before."""
    return 2.0 * x * t1 - t0, 2.0 * t1 + 2.0 * x * d1 - d0, 4.0 * d1 + 2.0 * x * s1 - s0


@register_jitable
def origin(count: int) -> tuple[float, float]:
    """w0 = 1 + ε/s² and w1 = T'(w0)/T''(w0) of a step of s stages, T of degree s."""
    x = 1.0 + DAMPING / (count * count)
    t0, t1, d0, d1, s0, s1 = 1.0, x, 0.0, 1.0, 0.0, 0.0
    for _ in range(1, count):
        t2, d2, s2 = following(x, t0, t1, d0, d1, s0, s1)
        t0, t1, d0, d1, s0, s1 = t1, t2, d1, d2, s1, s2
    return x, d1 / s1

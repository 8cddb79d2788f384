"""Force laws whose numbers come from measured characteristics, not from the braid.

Signed forces, as in `braid_laws`. Such a law holds where it was measured. Beyond that the kernels keep
to two rules, so that a simulation that strays there is wrong by a little and never absurd: an
exponential continues along its tangent (`bounded_exp`), and a polynomial never rises again
(`descending`).
"""

import math

from numba.extending import register_jitable

BAR = 1e5  # [Pa]
LARGEST_EXPONENT = 3.0  # an exponential continues along its tangent from there
SPAN = 0.5  # contraction ratio up to which a polynomial is followed; constant beyond
CELLS = 16  # of the search for the first minimum over the span
LEAST_PRESSURE = 0.05  # [bar] below which n(p) and a(p) of Takosoglu's law are held


@register_jitable
def bounded_exp(x: float) -> float:
    """e^x up to x = 3, and its tangent beyond: finite and smooth for every finite x."""
    if x <= LARGEST_EXPONENT:
        return math.exp(x)
    return math.exp(LARGEST_EXPONENT) * (1.0 + x - LARGEST_EXPONENT)  # a NaN comes out here


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
        high = low + span / CELLS
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


@register_jitable
def kerscher_2006(
    contraction: float,
    pressure: float,
    nominal_radius: float,
    b: float,
    a_epsilon: float,
    b_epsilon: float,
    a_kappa: float,
    b_kappa: float,
    c_kappa: float,
) -> float:
    """Braid with two corrections: F = μ(κ) π r0² p [a (1 − ε(p) κ)² − b].

    μ = a_κ e^(−c_κ κ) − b_κ, ε = a_ε e^(−p) − b_ε with p in bar, a = 3 (b − 1). Beyond the zero,
    where the muscle is slack, μ is left out: it would let the force rise again.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_radius : r0 [m]
    b : 1/sin²α0 [-]
    a_epsilon, b_epsilon, a_kappa, b_kappa, c_kappa : [-]; b_ε and b_κ come out negative in every fit

    Returns
    -------
    float : signed force [N]

    Source
    ------
    Kerscher et al. 2006, in the form of Piteľ & Tóthová 2016 (S2), eq. 3–7, whose minus signs are kept.
    """
    epsilon = a_epsilon * bounded_exp(-pressure / BAR) - b_epsilon
    x = 1.0 - epsilon * contraction
    if x < 0.0:
        x = 0.0
    force = math.pi * nominal_radius * nominal_radius * pressure * (3.0 * (b - 1.0) * x * x - b)
    mu = a_kappa * bounded_exp(-c_kappa * contraction) - b_kappa
    if force <= 0.0:
        return force + 0.0 * mu  # a NaN stays one
    return mu * force


@register_jitable
def maximum_force(
    contraction: float,
    pressure: float,
    maximum_pressure: float,
    b0: float,
    b1: float,
    b2: float,
    b3: float,
    b4: float,
    a0: float,
    a1: float,
    a2: float,
) -> float:
    """Maximum-force approximation: F = F_max(κ) − (p_max − p) g(κ).

    F_max = b0 + b1 κ + b2 κ² + b3 κ³ + b4 κ⁴ is the force at p_max, g = a0 + a1 κ + a2 κ² its slope
    by pressure.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    maximum_pressure : p_max [Pa]
    b0…b4 : [N]
    a0, a1, a2 : [N/Pa]

    Returns
    -------
    float : signed force [N]

    Source
    ------
    Piteľ & Tóthová 2016 (S2), eq. 8–9, doi 10.1051/matecconf/20167602015. The bracket g cannot be
    recovered from the text; this form is derived here: on the maker's characteristics ∂F/∂p is
    independent of p and a parabola in κ.
    """
    missing = maximum_pressure - pressure
    return descending(contraction, SPAN, b0 - missing * a0, b1 - missing * a1, b2 - missing * a2, b3, b4, 0.0)


@register_jitable
def sarosi_2012(
    contraction: float,
    pressure: float,
    a1: float,
    a2: float,
    a3: float,
    a4: float,
    a5: float,
    a6: float,
) -> float:
    """Exponential law: F = (a1 p + a2) e^(a3 κ) + a4 κ p + a5 p + a6, κ in per cent and p in bar.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    a1, a2, a3, a4, a5, a6 : [N/bar, N, 1/%, N/(%·bar), N/bar, N], as they are published

    Returns
    -------
    float : signed force [N]

    Source
    ------
    Sárosi 2012; Piteľ & Tóthová 2016 (S2), eq. 10; grouping of terms as in public code.
    """
    kappa, bar = 100.0 * contraction, pressure / BAR
    weight = a1 * bar + a2
    if weight < 0.0:  # at pressures far beyond any muscle's; the exponential would turn over
        weight = 0.0
    return weight * bounded_exp(a3 * kappa) + a4 * kappa * bar + a5 * bar + a6


@register_jitable
def polynomial(contraction: float, pressure: float, *a: float) -> float:
    """Polynomial of fifth order: F = Σ a_ij x^i y^j over i + j ≤ 5, with x = 10 κ and y = p/(6 bar).

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    a : 21 coefficients a00, a01, …, a05, a10, …, a50 [N]

    Returns
    -------
    float : signed force [N]

    Source
    ------
    Piteľ & Tóthová 2016 (S2), eq. 11; scaled here, so that the coefficients are of one size.
    """
    y = pressure / (6.0 * BAR)
    q0 = a[0] + y * (a[1] + y * (a[2] + y * (a[3] + y * (a[4] + y * a[5]))))
    q1 = a[6] + y * (a[7] + y * (a[8] + y * (a[9] + y * a[10])))
    q2 = a[11] + y * (a[12] + y * (a[13] + y * a[14]))
    q3 = a[15] + y * (a[16] + y * a[17])
    q4 = a[18] + y * a[19]
    return descending(10.0 * contraction, 10.0 * SPAN, q0, q1, q2, q3, q4, a[20])


@register_jitable
def takosoglu_2016(
    contraction: float,
    pressure: float,
    nominal_radius: float,
    a0: float,
    a1: float,
    b: float,
    n0: float,
    n1: float,
) -> float:
    """Braid with a free exponent: F = π r0² p [a(p) (1 − κ)^n(p) − b], a = a0 + a1/p, n = n0 + n1/p.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]; in bar within a(p) and n(p), where it is held below 0.05 bar
    nominal_radius : r0 [m]
    a0, a1 : [-, bar]; with a1 = 0, a is constant
    b : [-], a free number here
    n0, n1 : [-, bar]; with n1 = 0, n is constant

    Returns
    -------
    float : signed force [N]

    Source
    ------
    Takosoglu et al. 2016 (S3), eq. 5, doi 10.1177/0020294016629176. The paper's own n(p) and a(p) (eq.
    6–9) are lost from its text; 1/p is the form derived here on independent 10 mm characteristics.
    """
    bar = pressure / BAR
    if bar < LEAST_PRESSURE:
        bar = LEAST_PRESSURE
    a, n = a0 + a1 / bar, n0 + n1 / bar
    if a < 0.0:
        a = 0.0
    x = 1.0 - contraction
    power = 0.0 * (a + n)
    if x > 0.0:
        power = bounded_exp(n * math.log(x))
    elif x != x:
        power = x
    return math.pi * nominal_radius * nominal_radius * pressure * (a * power - b)


@register_jitable
def bolen_2026(
    contraction: float,
    pressure: float,
    force_620: float,
    contraction_620: float,
    c0: float,
    c1: float,
    c2: float,
) -> float:
    """Normalised law: F = F620 [c0 (e^(−c1 ε) − 1) + P e^(−c2 ε²)], ε = κ/κ620, P = p/620 kPa.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    force_620 : F620(L0) [N], the force at 620 kPa and no contraction
    contraction_620 : κ620 [-], the contraction at 620 kPa without load
    c0, c1, c2 : [-]

    Returns
    -------
    float : signed force [N]

    Source
    ------
    Bolen, Elzein, Pang & Hunt, Actuators 2026, accepted manuscript.
    """
    x = contraction / contraction_620
    square = x * x if x > 0.0 else 0.0 * x  # a stretched muscle is not weaker
    return force_620 * (c0 * (bounded_exp(-c1 * x) - 1.0) + pressure / 620e3 * bounded_exp(-c2 * square))


@register_jitable
def three_element(
    contraction: float,
    pressure: float,
    nominal_length: float,
    f0: float,
    f1: float,
    switch_pressure: float,
    k0: float,
    k1: float,
    k2: float,
    k3: float,
) -> float:
    """Static part of the three-element model: F = F_ce(p) − K(p) x, with x = κ L0.

    F_ce = f0 + f1 p; K = k0 + k1 p below the switch pressure and k2 + k3 p from there.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_length : L0 [m]
    f0, f1 : [N, N/Pa]
    switch_pressure : [Pa]
    k0, k1, k2, k3 : [N/m, N/(m·Pa), N/m, N/(m·Pa)]

    Returns
    -------
    float : signed force [N]

    Source
    ------
    Reynolds et al. 2003, Ann. Biomed. Eng. 31, doi 10.1114/1.1554921; S0.
    """
    stiffness = k0 + k1 * pressure if pressure < switch_pressure else k2 + k3 * pressure
    if stiffness < 0.0:
        stiffness = 0.0
    unknown = 0.0 * (switch_pressure + k0 + k1 + k2 + k3)  # a NaN stays one
    return f0 + f1 * pressure - stiffness * nominal_length * contraction + unknown

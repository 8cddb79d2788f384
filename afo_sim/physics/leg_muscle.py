"""A muscle of a leg: a fibre with pennation behind an elastic tendon, its activation and its energy."""

import math

from afo_sim.physics.jitable import register_jitable

WIDTH = 0.45  # of the force–length curve [-]
PASSIVE_STRAIN, PASSIVE_SHAPE = 0.6, 4.0
TOE_FORCE, TOE_SHAPE = 1.0 / 3.0, 3.0  # of the tendon's toe region
TOE_STRAIN, LINEAR = 0.609, 1.712  # its end, and the slope behind it, over and by the strain at full force
CURVATURE, LENGTHENING = 0.25, 1.4  # of the force–velocity curve; most force in lengthening [-]
STEEP = (1.0 + 1.0 / CURVATURE) / (LENGTHENING - 1.0)  # so that its slope is one at rest
LEAST_ACTIVATION = 0.01
ACTIVATION_TIME, DEACTIVATION_TIME = 0.010, 0.040  # [s]
SHORTEST_FIBRE = 0.2  # projection of the fibre on the tendon from which on it is not shorter [-]
NEWTON, NEAR = 12, 1e-6  # steps at most; change of the length from which on the rest is of second order [-]


@register_jitable
def tendon_force(strain: float, full: float) -> tuple[float, float]:
    """Force of a tendon over the greatest force, and its slope.

    f = f_t (e^{3 ε/ε_t} − 1)/(e³ − 1) below ε_t = 0.609 ε_0, a straight line of slope 1.712/ε_0 beyond.

    Parameters
    ----------
    strain : ε [-]
    full : ε_0, strain at the muscle's greatest force [-]

    Source
    ------
    Thelen 2003, J. Biomech. Eng. 125(1), doi 10.1115/1.1531112.
    """
    if strain <= 0.0:
        return 0.0, 0.0
    toe = TOE_STRAIN * full
    if strain < toe:
        scale = TOE_FORCE / (math.exp(TOE_SHAPE) - 1.0)
        rising = math.exp(TOE_SHAPE * strain / toe)
        return scale * (rising - 1.0), scale * rising * TOE_SHAPE / toe
    return TOE_FORCE + LINEAR / full * (strain - toe), LINEAR / full


@register_jitable
def active_force(length: float) -> tuple[float, float]:
    """Force–length factor of a fibre, exp(−(l − 1)²/0.45), and its slope; l over the optimal length [-].

    Source
    ------
    Thelen 2003.
    """
    off = length - 1.0
    factor = math.exp(-off * off / WIDTH)
    return factor, -2.0 * off / WIDTH * factor


@register_jitable
def passive_force(length: float) -> tuple[float, float]:
    """Force of a fibre at rest over the greatest force, (e^{4 (l − 1)/0.6} − 1)/(e⁴ − 1), and its slope.

    Source
    ------
    Thelen 2003.
    """
    if length <= 1.0:
        return 0.0, 0.0
    scale = 1.0 / (math.exp(PASSIVE_SHAPE) - 1.0)
    rising = math.exp(PASSIVE_SHAPE * (length - 1.0) / PASSIVE_STRAIN)
    return scale * (rising - 1.0), scale * rising * PASSIVE_SHAPE / PASSIVE_STRAIN


@register_jitable
def velocity_factor(velocity: float) -> tuple[float, float]:
    """Force–velocity factor of a fibre, and its slope.

    Hill's hyperbola (1 + v)/(1 − 4 v) in shortening, (1 + 1.4 c v)/(1 + c v) in lengthening, with the same
    slope at rest.

    Parameters
    ----------
    velocity : over the greatest, lengthening positive [-]

    Source
    ------
    Hill 1938, doi 10.1098/rspb.1938.0050; curvature and 1.4 as Thelen 2003.
    """
    if velocity <= -1.0:
        return 0.0, 0.0
    if velocity <= 0.0:
        below = 1.0 - velocity / CURVATURE
        return (1.0 + velocity) / below, (1.0 + 1.0 / CURVATURE) / (below * below)
    below = 1.0 + STEEP * velocity
    return (1.0 + LENGTHENING * STEEP * velocity) / below, (LENGTHENING - 1.0) * STEEP / (below * below)


@register_jitable
def activated(activation: float, excitation: float, step: float) -> float:
    """The activation one step on: a first-order lag of 10 ms up and 40 ms down, exact over a step [-].

    Source
    ------
    Time constants: Zajac 1989 and Thelen 2003 (10 and 40 ms of young adults).
    """
    constant = ACTIVATION_TIME if excitation > activation else DEACTIVATION_TIME
    return excitation + (activation - excitation) * math.exp(-step / constant)


@register_jitable
def fibre_force(
    activation: float, length: float, velocity: float, fastest: float, damping: float, passive: float
) -> tuple[float, float, float]:
    """Force along a fibre over the greatest force, and its slopes by length and by velocity [-], [s].

    Parameters
    ----------
    activation : times the strength that is left [-]
    length, velocity : over the optimal length [-], lengthening positive [1/s]
    fastest : greatest shortening velocity [1/s]
    damping : of the fibre, over the greatest force at the greatest velocity [-]
    passive : factor on the force at rest [-]
    """
    by_length, length_slope = active_force(length)
    by_velocity, velocity_slope = velocity_factor(velocity / fastest)
    at_rest, rest_slope = passive_force(length) if passive > 0.0 else (0.0, 0.0)
    return (
        activation * by_length * by_velocity + passive * at_rest + damping * velocity / fastest,
        activation * length_slope * by_velocity + passive * rest_slope,
        (activation * by_length * velocity_slope + damping) / fastest,
    )


@register_jitable
def balanced_fibre(
    path: float, last: float, last_velocity: float, activation: float, step: float, optimal: float,
    slack: float, width: float, strain: float, fastest: float, damping: float, passive: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """The fibre at which tendon and fibre pull alike at the end of a step, by the trapezoidal rule.

    F_T((x − l_o √(l² − w²))/l_s − 1) = F_M(a, l, v) √(l² − w²)/l,  l = l_last + h/2 (v_last + v)

    Parameters
    ----------
    path : x, length of muscle and tendon [m]
    last, last_velocity : of the step before [-], [1/s]
    activation : times the strength that is left [-]
    step : h [s]; 0 for a fibre that rests
    optimal, slack : l_o, l_s [m]
    width : w, sine of the pennation at the optimal length [-]
    strain, fastest, damping, passive : as above

    Returns
    -------
    length [-], velocity [1/s], tension over the greatest force [-], force along the fibre [-]
    """
    half = 0.5 * step
    shortest = math.sqrt(SHORTEST_FIBRE * SHORTEST_FIBRE + width * width)
    length = last + step * last_velocity
    if length < shortest:
        length = shortest
    velocity = tension = along = 0.0
    for _ in range(NEWTON if step > 0.0 else 5 * NEWTON):
        if step > 0.0:
            velocity = (length - last) / half - last_velocity
        straight = math.sqrt(length * length - width * width)
        tension, slope = tendon_force((path - optimal * straight) / slack - 1.0, strain)
        along, by_length, by_velocity = fibre_force(activation, length, velocity, fastest, damping, passive)
        cosine = straight / length
        off = along * cosine - tension
        rate = by_velocity / half if step > 0.0 else 0.0
        turning = width * width / (length * length * straight)  # of the cosine by the length
        total = (by_length + rate) * cosine + along * turning + slope * optimal / slack * length / straight
        change = -off / max(total, 1e-3)
        if change > 0.1:
            change = 0.1
        elif change < -0.1:
            change = -0.1
        change = max(length + change, shortest) - length
        length += change
        if abs(change) < NEAR:  # where one step on would find them, to what is of second order in it
            tension -= slope * optimal / slack * (length - change) / straight * change
            along += (by_length + rate) * change
            break
    if step > 0.0:
        velocity = (length - last) / half - last_velocity
    return length, velocity, tension, along


@register_jitable
def muscle_power(
    excitation: float, activation: float, length: float, velocity: float, total: float, active: float,
    slow: float,
) -> tuple[float, float]:  # fmt: skip
    """Metabolic power of a muscle: heat that goes with its mass, and with its force and shortening.

    40 s sin(π u/2) + 133 (1 − s)(1 − cos(π u/2)) + g(l)[74 s sin(π a/2) + 111 (1 − s)(1 − cos(π a/2))] per
    mass; ¼ F v + F_active v of shortening alone.

    Parameters
    ----------
    excitation, activation : u, a [-]
    length, velocity : of the fibre, over its optimal length [-], lengthening positive [1/s]
    total, active : F, F_active of the fibre over the greatest force [-]
    slow : s, share of slow fibres [-]

    Returns
    -------
    [W/kg of muscle]; over greatest force × optimal length [1/s]

    Source
    ------
    Wang et al. 2012, ACM Trans. Graph. 31(4), doi 10.1145/2185520.2185521, after Bhargava et al. 2004, doi
    10.1016/S0021-9290(03)00239-2.
    """
    quick = 1.0 - slow
    u, a = math.sin(0.5 * math.pi * excitation), math.sin(0.5 * math.pi * activation)
    if length < 0.5:
        kept = 0.5
    elif length < 1.0:
        kept = length
    elif length < 1.5:
        kept = max(3.0 - 2.0 * length, 0.0)
    else:
        kept = 0.0
    heat = 40.0 * slow * u + 133.0 * quick * (1.0 - math.sqrt(1.0 - u * u))
    heat += kept * (74.0 * slow * a + 111.0 * quick * (1.0 - math.sqrt(1.0 - a * a)))
    shortening = max(-velocity, 0.0)
    return heat, (0.25 * max(total, 0.0) + max(active, 0.0)) * shortening

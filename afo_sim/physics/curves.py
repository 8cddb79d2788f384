"""A law's curve, forwards and backwards, over arrays: force by contraction, contraction by force."""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit

from afo_sim.physics.law import MAX_COEFFICIENTS
from afo_sim.physics.static_force import static_force

STRETCHED, CONTRACTED = -0.2, 0.7  # contraction ratios between which a load's is looked for


def forces(
    native_id: int, coefficients: Sequence[float], contraction: np.ndarray, pressure: np.ndarray
) -> np.ndarray:
    """Signed force of a law at contractions [-] and gauge pressures [Pa], shape (n,) [N]."""
    return _compiled()[0](float(native_id), _padded(coefficients), contraction, pressure)


def contractions(
    native_id: int, coefficients: Sequence[float], force: np.ndarray, pressure: np.ndarray
) -> np.ndarray:
    """Contraction ratio at which a law carries forces [N] at gauge pressures [Pa], shape (n,).

    By bisection between −0.2 and 0.7, so that a muscle too weak for its load is found stretched.
    """
    return _compiled()[1](float(native_id), _padded(coefficients), force, pressure)


def _padded(coefficients: Sequence[float]) -> np.ndarray:
    row = np.zeros(MAX_COEFFICIENTS)
    row[: len(coefficients)] = coefficients
    return row


@functools.cache
def _compiled() -> tuple[Any, Any]:
    @njit
    def force_curve(law: float, c: np.ndarray, contraction: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        out = np.empty(len(contraction))
        for k in range(len(contraction)):
            out[k] = static_force(law, contraction[k], pressure[k], c, 0)
        return out

    @njit
    def contraction_curve(law: float, c: np.ndarray, force: np.ndarray, pressure: np.ndarray) -> np.ndarray:
        out = np.empty(len(force))
        for k in range(len(force)):
            low, high = STRETCHED, CONTRACTED
            for _ in range(60):
                middle = 0.5 * (low + high)
                if static_force(law, middle, pressure[k], c, 0) > force[k]:
                    low = middle
                else:
                    high = middle
            out[k] = 0.5 * (low + high)
        return out

    return force_curve, contraction_curve

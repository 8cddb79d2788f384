"""A law's curve, forwards and backwards, over arrays: force by contraction, contraction by force."""

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import ArrayLike

from afo_sim.physics.law import MAX_COEFFICIENTS
from afo_sim.physics.static_force import static_force

STRETCHED, CONTRACTED = -0.2, 0.7  # contraction ratios between which that of a force is looked for
HALVINGS = 60  # of that interval


@register_jitable(inline="always")
def crossing(
    falling: Callable[..., float], arguments: tuple[Any, ...], low: float, high: float, halvings: int
) -> float:
    """Zero of a function that falls from low to high, by bisection.

    Parameters
    ----------
    falling : f(x, *arguments)
    arguments : beside x
    low, high : interval of x; its end where f has one sign throughout
    halvings : of the interval; 52 leave a double nothing to gain

    Returns
    -------
    float : x
    """
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        if falling(middle, *arguments) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def forces(
    native_id: int, coefficients: Sequence[float], contraction: ArrayLike, pressure: ArrayLike
) -> np.ndarray:
    """Signed force of a law.

    Parameters
    ----------
    native_id, coefficients : of the law
    contraction : κ [-]
    pressure : gauge [Pa]; broadcasts with κ

    Returns
    -------
    force [N], in their common shape
    """
    return _over(0, native_id, coefficients, contraction, pressure)


def contractions(
    native_id: int, coefficients: Sequence[float], force: ArrayLike, pressure: ArrayLike
) -> np.ndarray:
    """Contraction ratio at which a law carries a force.

    It lies between −0.2 and 0.7, so that a muscle too weak for its load is found stretched.

    Parameters
    ----------
    native_id, coefficients : of the law
    force : [N]
    pressure : gauge [Pa]; broadcasts with the force

    Returns
    -------
    κ [-], in their common shape
    """
    return _over(1, native_id, coefficients, force, pressure)


def _over(
    which: int, native_id: int, coefficients: Sequence[float], given: ArrayLike, pressure: ArrayLike
) -> np.ndarray:
    row = np.zeros(MAX_COEFFICIENTS)
    row[: len(coefficients)] = coefficients
    first, second = np.broadcast_arrays(np.asarray(given, float), np.asarray(pressure, float))
    curve = _compiled()[which](float(native_id), row, first.flatten(), second.flatten())
    return curve.reshape(first.shape)


@functools.cache
def _compiled() -> tuple[Any, Any]:
    @register_jitable
    def excess(x: float, force: float, law: float, pressure: float, c: np.ndarray) -> float:
        return static_force(law, x, pressure, c, 0) - force

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
            arguments = (force[k], law, pressure[k], c)
            out[k] = crossing(excess, arguments, STRETCHED, CONTRACTED, HALVINGS)
        return out

    return force_curve, contraction_curve

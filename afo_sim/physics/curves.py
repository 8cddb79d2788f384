"""A law's curve, forwards and backwards, over arrays: force by contraction, contraction by force."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from afo_sim.physics.jitable import kernels, register_jitable
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
    out = np.empty(first.shape)
    arrays = (row, np.ascontiguousarray(first), np.ascontiguousarray(second), out)
    compiled_curves()[which](native_id, *(array.ctypes.data for array in arrays), out.size)
    return out


@register_jitable
def _excess(contraction: float, force: float, law: float, pressure: float, c: Any) -> float:
    return static_force(law, contraction, pressure, c, 0) - force


def _force_curve(law: float, c: Any, contraction: Any, pressure: Any, out: Any, size: int) -> float:
    for k in range(size):
        out[k] = static_force(law, contraction[k], pressure[k], c, 0)
    return 0.0


def _contraction_curve(law: float, c: Any, force: Any, pressure: Any, out: Any, size: int) -> float:
    for k in range(size):
        out[k] = crossing(_excess, (force[k], law, pressure[k], c), STRETCHED, CONTRACTED, HALVINGS)
    return 0.0


compiled_curves = kernels("curves", _force_curve, _contraction_curve)

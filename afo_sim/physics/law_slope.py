"""Slopes of a force law by contraction and pressure: its kernel's own, or difference quotients."""

from collections.abc import Callable

from afo_sim.physics.jitable import register_jitable

Slopes = tuple[float, float, float]  # a force and its slopes: F [N], ∂F/∂κ [N], ∂F/∂p [N/Pa]
CONTRACTION_STEP, PRESSURE_STEP = 1e-7, 1.0  # of the difference quotients of a law without slopes [-], [Pa]


def with_slopes(slopes: Callable[..., Slopes]) -> Callable[..., float]:
    """Mark a function that compiled code may call: the kernel of its force, whose `slopes` it is itself."""

    def kernel(contraction: float, pressure: float, *coefficients: float) -> float:
        return slopes(contraction, pressure, *coefficients)[0]

    kernel.__name__, kernel.__doc__ = slopes.__name__, slopes.__doc__
    kernel.slopes = register_jitable(slopes)  # type: ignore[attr-defined]  # for `slopes_of` and compiled code
    jitable: Callable[..., float] = register_jitable(kernel)
    return jitable


def slopes_of(kernel: Callable[..., float]) -> Callable[..., Slopes]:
    """The force of a kernel with its slopes: its own, or difference quotients."""

    def quotients(contraction: float, pressure: float, *coefficients: float) -> Slopes:
        force = kernel(contraction, pressure, *coefficients)
        moved = kernel(contraction + CONTRACTION_STEP, pressure, *coefficients)
        pressed = kernel(contraction, pressure + PRESSURE_STEP, *coefficients)
        return force, (moved - force) / CONTRACTION_STEP, (pressed - force) / PRESSURE_STEP

    found: Callable[..., Slopes] = getattr(kernel, "slopes", None) or register_jitable(quotients)
    return found

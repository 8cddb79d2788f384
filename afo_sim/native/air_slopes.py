"""Slopes of the air over one stride: how what a chamber ends with follows from what it begins with.

    d(ln m)/dt = ṁ/m                ṁ = Σ w          w: flow into the chamber through a valve
    d(ln σ)/dt = E/(p V)            E = γ R Σ w T_w + (γ − 1) hA (T_a − T)

are linearised along the rows of a stride that was walked, and their steps multiplied. The chamber's volume
follows its pressure by `giving`, d ln V/d ln p, which two strides tell that differ in their air. The slopes
serve a search, whose result does not depend on them.
"""

import math
from typing import Any

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
from afo_sim.physics import iso_6358_slope, register_jitable

GIVING = 0.3  # where no two strides tell it yet [-]
MOST_GIVING = 0.6  # more would be a chamber that hardly resists [-]
TOLD = 5e-4  # change of ln p from which on two strides tell it [-]


@register_jitable
def giving(
    pressure: float, volume: float, pressure_before: float, volume_before: float, known: float
) -> float:
    """d ln V/d ln p in a row of two strides; what is known where they tell nothing of it."""
    pressed = math.log(pressure / pressure_before)
    if not abs(pressed) > TOLD:
        return known
    return min(max(math.log(volume / volume_before) / pressed, 0.0), MOST_GIVING)


@register_jitable
def rates(
    mass: float, pressure: float, volume: float, inlet: float, outlet: float, supply: float,
    inlet_ratio: float, outlet_ratio: float, wall: float, give: float, gas: float, gamma: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Slopes of the rates of (ln m, ln σ) by these two in a row [1/s]: of ln m by both, of ln σ by both."""
    temperature = pressure * volume / (mass * gas)
    # by ln σ: of ln p, ln V and ln T; by ln m only ln T moves, by −1
    of_p = 1.0 / (1.0 + gamma * give)
    of_v, of_t = give * of_p, (1.0 + give) * of_p
    heat = (gamma - 1.0) * wall
    enthalpy, enthalpy_by_p, enthalpy_by_t = (
        heat * (AMBIENT_TEMPERATURE - temperature),
        0.0,
        -heat * temperature,
    )
    flow, flow_by_p, flow_by_t = 0.0, 0.0, 0.0
    for inward, other, critical in (
        (inlet, supply, inlet_ratio),
        (-outlet, AMBIENT_PRESSURE, outlet_ratio),
    ):
        if inward >= 0.0:
            by_p, by_t, warm = inward * iso_6358_slope(pressure / other, critical), 0.0, AMBIENT_TEMPERATURE
        else:
            by_p = inward * (1.0 - iso_6358_slope(other / pressure, critical))
            by_t, warm = -0.5 * inward, temperature
        carried = gamma * gas * warm
        flow, flow_by_p, flow_by_t = flow + inward, flow_by_p + by_p, flow_by_t + by_t
        enthalpy += carried * inward
        enthalpy_by_p += carried * by_p
        enthalpy_by_t += carried * (by_t if inward >= 0.0 else by_t + inward)
    by_sigma = enthalpy_by_p * of_p + enthalpy_by_t * of_t + enthalpy * ((gamma - 1.0) * of_v - 1.0)
    energy = pressure * volume
    return (
        (-flow_by_t - flow) / mass,
        (flow_by_p * of_p + flow_by_t * of_t) / mass,
        -enthalpy_by_t / energy,
        by_sigma / energy,
    )


@register_jitable
def step_on(s: Any, at: int, width: int, a: float, b: float, c: float, d: float) -> None:
    """Multiply the slopes [2, 2] at `at` by those of a step, (1 − z/2)⁻¹ (1 + z/2), z = [[a, b], [c, d]].

    Stable however fast a chamber fills. Rows of the slopes are `width` apart.
    """
    a, b, c, d = 0.5 * a, 0.5 * b, 0.5 * c, 0.5 * d
    scale = 1.0 / ((1.0 - a) * (1.0 - d) - b * c)
    for k in range(at, at + 2):
        m, sigma = s[k], s[k + width]
        to_m, to_sigma = m + a * m + b * sigma, sigma + c * m + d * sigma
        s[k] = scale * ((1.0 - d) * to_m + b * to_sigma)
        s[k + width] = scale * (c * to_m + (1.0 - a) * to_sigma)

"""Slopes of the air over one stride: how what a chamber ends with follows from what it begins with.

    d(ln m)/dt = ṁ/m                ṁ = Σ w          w: flow into the chamber through a valve
    d(ln σ)/dt = E/(p V)            E = γ R Σ w T_w + (γ − 1) hA (T_a − T)

are linearised along the rows of a stride that was walked, and their steps multiplied. The chamber's volume
follows its pressure by `giving`, d ln V/d ln p, which two strides tell that differ in their air. The slopes
serve a search, whose result does not depend on them.
"""

from dataclasses import dataclass

import numpy as np

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.physics import iso_6358_slope
from afo_sim.simulation.network_slopes import NetworkRows

GIVING = 0.3  # where no two strides tell it yet [-]
MOST_GIVING = 0.6  # more would be a chamber that hardly resists [-]
TOLD = 5e-4  # change of ln p from which on two strides tell it [-]


@dataclass(frozen=True)
class AirRows:
    """Air of c chambers in n rows that are `step` apart."""

    mass: np.ndarray
    pressure: np.ndarray
    volume: np.ndarray
    inlet: np.ndarray
    outlet: np.ndarray
    supply: np.ndarray
    inlet_ratio: np.ndarray
    outlet_ratio: np.ndarray
    wall: np.ndarray
    step: float


Rows = AirRows | NetworkRows


def giving(rows: Rows, before: Rows | None, known: np.ndarray | float = GIVING) -> np.ndarray:
    """d ln V/d ln p of each row (c, n)."""
    found = np.broadcast_to(known, rows.volume.shape)
    if before is None:
        return found
    pressed = np.log(rows.pressure / before.pressure)
    told = np.abs(pressed) > TOLD
    widened = np.log(rows.volume / before.volume)
    return np.where(told, np.clip(widened / np.where(told, pressed, 1.0), 0.0, MOST_GIVING), found)


def air_slopes(rows: AirRows, giving: np.ndarray) -> np.ndarray:
    """∂(ln m, ln σ) at the end of a stride by (ln m, ln σ) at its start, of each chamber."""
    rates = _rates(rows, giving)
    half = 0.5 * rows.step * rates
    one = np.eye(2)
    matrices = one - half
    # Inverses of matrices (…, 2, 2)
    a, b, c, d = (matrices[..., i, j] for i in (0, 1) for j in (0, 1))
    found = np.empty_like(matrices)
    found[..., 0, 0], found[..., 0, 1], found[..., 1, 0], found[..., 1, 1] = d, -b, -c, a
    found /= (a * d - b * c)[..., np.newaxis, np.newaxis]
    steps = found @ (one + half)  # stable however fast a chamber fills
    while steps.shape[1] > 1:
        if steps.shape[1] % 2:
            steps = np.concatenate([steps, np.broadcast_to(one, (len(steps), 1, 2, 2))], axis=1)
        steps = steps[:, 1::2] @ steps[:, 0::2]
    return steps[:, 0]


def _rates(rows: AirRows, giving: np.ndarray) -> np.ndarray:
    """Slopes of the rates of (ln m, ln σ) by these two, in each row [1/s] (c, n, 2, 2)."""
    p, gamma = rows.pressure, HEAT_CAPACITY_RATIO
    temperature = p * rows.volume / (rows.mass * GAS_CONSTANT)
    # by ln σ: of ln p, ln V and ln T; by ln m only ln T moves, by −1
    of_p = 1.0 / (1.0 + gamma * giving)
    of_v, of_t = giving * of_p, (1.0 + giving) * of_p
    heat = (gamma - 1.0) * rows.wall
    enthalpy = heat * (AMBIENT_TEMPERATURE - temperature)
    enthalpy_by_p, enthalpy_by_t = np.zeros_like(p), -heat * temperature
    flow, flow_by_p, flow_by_t = np.zeros_like(p), np.zeros_like(p), np.zeros_like(p)
    for inward, other, critical in (
        (rows.inlet, rows.supply, rows.inlet_ratio),
        (-rows.outlet, np.full_like(p, AMBIENT_PRESSURE), rows.outlet_ratio),
    ):
        enters = inward >= 0.0
        down = iso_6358_slope(np.where(enters, p / other, other / p), critical)
        by_p = inward * np.where(enters, down, 1.0 - down)
        by_t = np.where(enters, 0.0, -0.5 * inward)
        carried = gamma * GAS_CONSTANT * np.where(enters, AMBIENT_TEMPERATURE, temperature)
        flow, flow_by_p, flow_by_t = flow + inward, flow_by_p + by_p, flow_by_t + by_t
        enthalpy = enthalpy + carried * inward
        enthalpy_by_p = enthalpy_by_p + carried * by_p
        enthalpy_by_t = enthalpy_by_t + carried * (by_t + np.where(enters, 0.0, inward))
    found = np.empty((*p.shape, 2, 2))
    found[..., 0, 0] = (-flow_by_t - flow) / rows.mass
    found[..., 0, 1] = (flow_by_p * of_p + flow_by_t * of_t) / rows.mass
    energy = p * rows.volume
    found[..., 1, 0] = -enthalpy_by_t / energy
    by_sigma = enthalpy_by_p * of_p + enthalpy_by_t * of_t + enthalpy * ((gamma - 1.0) * of_v - 1.0)
    found[..., 1, 1] = by_sigma / energy
    return found

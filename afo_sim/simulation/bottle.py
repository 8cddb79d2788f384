"""Air that a bottle gives, and how long walking lasts on it."""

from collections.abc import Mapping

import numpy as np

from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT, STANDARD_DENSITY
from afo_sim.metrics.bottle import bottle_metrics as metrics_of
from afo_sim.metrics.metric import Metric
from afo_sim.model.build import Built

NEEDED = {
    "free_air_per_minute": frozenset({"free_air_per_stride", "stride_time"}),
    "strides_per_bottle": frozenset({"free_air_per_stride", "stride_time"}),
}
# Dry air at 20 °C, computed with CoolProp 8.0 from the equation of state of Lemmon, Jacobsen, Penoncello and
# Friend 2000 (J. Phys. Chem. Ref. Data 29: 331).
COMPRESSIBILITY = {  # by absolute pressure [bar]
    0: 1.0, 50: 0.9879, 100: 0.9881, 150: 1.001, 200: 1.026, 250: 1.0612, 300: 1.1043, 400: 1.2056,
    500: 1.3183, 600: 1.436, 700: 1.5557, 800: 1.6758, 900: 1.7956, 1000: 1.9146, 1100: 2.0325,
}  # fmt: skip


def bottle_metrics(built: Built, totals: Mapping[str, Metric]) -> dict[str, Metric]:
    """Metrics of a run's air against the bottle of the scenario's limits.

    Parameters
    ----------
    built : compiled scenario
    totals : of the walk; without air or strides there are none
    """
    limits = built.scenario.limits
    if limits is None or not NEEDED["strides_per_bottle"] <= totals.keys():
        return {}
    mass = air_given(limits.bottle_volume, limits.bottle_pressure, built.scenario.supply.pressure)
    litres = 1e3 * mass / STANDARD_DENSITY
    return metrics_of(totals["free_air_per_stride"].value, totals["stride_time"].value, litres)


def air_given(volume: float, pressure: float, supply: float) -> float:
    """Air that a full bottle gives until it is down to the supply's pressure [kg].

    Parameters
    ----------
    volume : of the bottle [m³]
    pressure : gauge, of the full bottle [Pa]; up to 1000 bar
    supply : gauge, before the valves [Pa]

    Returns
    -------
    0 where the bottle is not above the supply

    Notes
    -----
    m = V/(R T) · (p₁/Z(p₁) − p₂/Z(p₂)), absolute pressures, at 20 °C: it is emptied slowly enough to stay
    warm.
    """
    full, left = (p / compressibility(p) for p in (pressure + AMBIENT_PRESSURE, supply + AMBIENT_PRESSURE))
    return max(0.0, volume / (GAS_CONSTANT * AMBIENT_TEMPERATURE) * (full - left))


def compressibility(pressure: float) -> float:
    """Z = p V/(m R T) of dry air at 20 °C [-], within 0.2 %.

    Parameters
    ----------
    pressure : absolute [Pa], 0 to 1100 bar
    """
    return float(np.interp(1e-5 * pressure, list(COMPRESSIBILITY), list(COMPRESSIBILITY.values())))

"""Flow laws of an air path: their numbers, and seats that a pressure opens: check valve, quick exhaust.

Regulators, reliefs and compressors are in `feeding`.
"""

from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.pneumatics import iso_6358_flow, valve_flow

# ISO 6358 both ways; a check valve, beside a throttle or alone; a quick exhaust's way out; a regulator with
# droop; a relief; a compressor
TWO_WAY, ONE_WAY, QUICK_EXHAUST, REGULATED, RELIEF, COMPRESSOR = 0, 1, 2, 3, 4, 5


@register_jitable
def ramp(excess: float, band: float) -> float:
    """Opening of a spring-loaded seat [-]: 0 below zero excess pressure, 1 beyond the band.

    Parameters
    ----------
    excess : pressure beyond the one that cracks it [Pa]
    band : over which it opens, above 0 [Pa]
    """
    if excess <= 0.0:
        return 0.0
    if excess >= band:
        return 1.0
    return excess / band


@register_jitable
def one_way_flow(
    pressure_1: float,
    temperature_1: float,
    pressure_2: float,
    temperature_2: float,
    conductance: float,
    critical: float,
    free: float,
    free_critical: float,
    cracking: float,
    band: float,
) -> float:
    """Mass flow of a throttle with a check valve beside it; free from side 1 to side 2 [kg/s].

    Parameters
    ----------
    conductance, critical : of the throttle, open both ways; C = 0 for a check valve alone
    free, free_critical : C and b of the open check valve, which lets air from 1 to 2
    cracking, band : pressure difference that begins to open it, and over which it opens [Pa]
    """
    flow = 0.0
    if conductance > 0.0:
        flow = valve_flow(pressure_1, temperature_1, pressure_2, temperature_2, 1.0, conductance, critical)
    opening = ramp(pressure_1 - pressure_2 - cracking, band)
    if opening > 0.0:
        flow += iso_6358_flow(pressure_1, pressure_2, temperature_1, opening * free, free_critical)
    return flow

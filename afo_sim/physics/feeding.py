"""What feeds a pneumatic circuit: a compressor that switches on and off, a pressure regulator."""

from afo_sim.common.units import STANDARD_DENSITY
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.pneumatics import iso_6358_flow


@register_jitable
def compressor_flow(
    pressure: float, delivery: float, delivery_pressure: float, stall_pressure: float
) -> float:
    """Mass flow of a running compressor, falling linearly with the pressure that it works against [kg/s].

    ṁ = ρ0 Q (p_stall − p)/(p_stall − p_Q), none above p_stall

    Parameters
    ----------
    pressure : gauge, behind the compressor [Pa]
    delivery : free air delivery Q [m³/s] (ANR)
    delivery_pressure : gauge pressure p_Q at which it delivers Q [Pa]
    stall_pressure : gauge pressure at which it delivers nothing [Pa], above p_Q
    """
    share = (stall_pressure - pressure) / (stall_pressure - delivery_pressure)
    return STANDARD_DENSITY * delivery * max(0.0, share)


@register_jitable
def compressor_runs(runs: float, pressure: float, switch_on: float, switch_off: float) -> float:
    """Whether a compressor runs, 1 or 0: on up to one pressure, off from another, between them as before.

    Parameters
    ----------
    runs : whether it ran before, 1 or 0
    pressure : gauge, in its tank [Pa]
    switch_on, switch_off : gauge [Pa], the first below the second
    """
    if pressure <= switch_on:
        return 1.0
    if pressure >= switch_off:
        return 0.0
    return runs + 0.0 * pressure  # a NaN stays one


@register_jitable
def regulator_flow(
    upstream: float,
    downstream: float,
    temperature: float,
    setpoint: float,
    gain: float,
    conductance: float,
    critical: float,
) -> float:
    """Mass flow through a pressure regulator with droop: it opens as the outlet's pressure falls [kg/s].

    ṁ = the lesser of k (p_set − p) and the flow of the fully open seat (ISO 6358); none at p ≥ p_set, and
    none back

    Parameters
    ----------
    upstream, downstream : absolute, before and behind it [Pa]
    temperature : before it [K]
    setpoint : p_set, absolute [Pa]
    gain : k [kg/(s·Pa)], flow by droop
    conductance, critical : C [m³/(s·Pa)] and b [-] of the fully open seat
    """
    if downstream >= setpoint or upstream <= downstream:
        return 0.0
    most = iso_6358_flow(upstream, downstream, temperature, conductance, critical)
    return min(gain * (setpoint - downstream), most)


@register_jitable
def relief_flow(
    downstream: float,
    ambient: float,
    temperature: float,
    opens: float,
    gain: float,
    conductance: float,
    critical: float,
) -> float:
    """Mass flow that a relieving regulator lets out of its outlet to the ambient [kg/s].

    ṁ = the lesser of k (p − p_opens) and the flow of the fully open relief; none at p ≤ p_opens

    Parameters
    ----------
    downstream : absolute, behind the regulator [Pa]
    ambient : absolute [Pa]
    temperature : behind it [K]
    opens : absolute pressure at which it opens [Pa]: the set pressure and the relief's distance from it
    gain, conductance, critical : as in `regulator_flow`, of the relief
    """
    if downstream <= opens or downstream <= ambient:
        return 0.0
    most = iso_6358_flow(downstream, ambient, temperature, conductance, critical)
    return min(gain * (downstream - opens), most)

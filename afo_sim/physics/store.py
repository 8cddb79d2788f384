"""A rigid store of real gas, with or without liquid below it: pressure and temperature from its mass.

States are the mass m [kg] and the temperature T [K] of what is in it. The gas obeys

    p = ρ R [T (1 + b0 ρ + c0 ρ²) + b1 ρ + c1 ρ²],    ρ = m/V,

which is p = ρ R T (1 + B ρ + C ρ²) with B = b0 + b1/T and C = c0 + c1/T. Its pressure is linear in the
temperature at each density, so that c_v depends on no density: u = c_v T + R (b1 ρ + c1 ρ²/2), as
∂u/∂ρ = (p − T ∂p/∂T)/ρ² demands. Where there is liquid, the pressure is that of saturation.

A bottle of air at 300 bar that is emptied at once is 2 K too cold when a fifth is out and 6 K when half is:
the heat capacity of dense air is the larger one.
"""

import math

from afo_sim.physics.gas import Row
from afo_sim.physics.jitable import register_jitable

# Carbon dioxide, Span & Wagner 1996, doi 10.1063/1.555991
CRITICAL_TEMPERATURE = 304.1282  # [K]
CRITICAL_PRESSURE = 7.3773e6  # [Pa]
TRIPLE_TEMPERATURE = 216.592  # [K]: below it there is dry ice and no liquid
STRAIGHT_FROM = 303.0  # [K]: from here on the saturation pressure goes on as its tangent
# ∂(U/m)/∂T of a two-phase store besides V T p″, at 273.15 K, and its slope: see `store_heat_capacity`
LIQUID_HEAT, LIQUID_SLOPE = 1635.0, -3.0  # [J/(kg·K)], [J/(kg·K²)]
LIQUID_AT = 273.15  # [K]


@register_jitable
def gas_pressure(density: float, temperature: float, gas: Row) -> float:
    """Pressure of a real gas, p = ρ R [T (1 + b0 ρ + c0 ρ²) + b1 ρ + c1 ρ²] [Pa], absolute.

    Parameters
    ----------
    density : ρ [kg/m³]
    temperature : T [K]
    gas : (R [J/(kg·K)], c_v [J/(kg·K)], b0 [m³/kg], b1 [m³·K/kg], c0 [m⁶/kg²], c1 [m⁶·K/kg²], whether it
        liquefies, 1 of carbon dioxide), as `Gas` has them; with all of b and c 0 an ideal gas
    """
    constant, _, b0, b1, c0, c1, _ = gas
    warm = temperature * (1.0 + density * (b0 + c0 * density))
    return density * constant * (warm + density * (b1 + c1 * density))


@register_jitable
def saturation(temperature: float) -> tuple[float, float, float]:
    """Saturation pressure of carbon dioxide and its first and second derivative by the temperature.

    ln(p/p_c) = (T_c/T) (−7.0602087 θ + 1.9391218 θ^1.5 − 1.6463597 θ² − 3.2995634 θ⁴), θ = 1 − T/T_c

    Parameters
    ----------
    temperature : T [K], 216.6 to 304.1; from 303 K on the pressure goes on as its tangent, and below 216.6 K
        the formula as it is, which is above that of dry ice

    Returns
    -------
    (p [Pa], dp/dT [Pa/K], d²p/dT² [Pa/K²])

    Source
    ------
    Span & Wagner 1996, eq. 3.13, doi 10.1063/1.555991; from memory, and within 0.01 % of CoolProp 8.0, which
    has the whole equation of state.
    """
    t = min(temperature, STRAIGHT_FROM)
    theta = 1.0 - t / CRITICAL_TEMPERATURE
    root = math.sqrt(theta)
    s = theta * (-7.0602087 + 1.9391218 * root - 1.6463597 * theta - 3.2995634 * theta**3)
    first = -7.0602087 + 1.5 * 1.9391218 * root - 2.0 * 1.6463597 * theta - 4.0 * 3.2995634 * theta**3
    second = 0.75 * 1.9391218 / root - 2.0 * 1.6463597 - 12.0 * 3.2995634 * theta * theta
    p = CRITICAL_PRESSURE * math.exp(CRITICAL_TEMPERATURE / t * s)
    # y = ln p: dθ/dT = −1/T_c
    y1 = -CRITICAL_TEMPERATURE / (t * t) * s - first / t
    y2 = 2.0 * CRITICAL_TEMPERATURE / t**3 * s + 2.0 * first / (t * t) + second / (t * CRITICAL_TEMPERATURE)
    if temperature > STRAIGHT_FROM:
        return p * (1.0 + y1 * (temperature - t)), p * y1, 0.0
    return p, p * y1, p * (y2 + y1 * y1)


@register_jitable
def vapour_density(temperature: float, gas: Row) -> float:
    """Density at which carbon dioxide's vapour is saturated [kg/m³]: a store of a greater one holds liquid.

    It is where the gas' pressure reaches that of saturation, by Newton's method, so that a store's pressure
    does not jump when its last liquid evaporates. Near the critical point, above 301 K, the gas' pressure has
    its maximum below that of saturation; its place is the density then.

    Parameters
    ----------
    temperature : T [K]
    gas : as in `gas_pressure`

    Source
    ------
    Within 0.5 % of Span & Wagner's from 220 to 298 K.
    """
    constant, _, b0, b1, c0, c1, _ = gas
    wanted = saturation(temperature)[0]
    most = math.inf
    linear, square = b0 * temperature + b1, 3.0 * (c0 * temperature + c1)
    under = linear * linear - square * temperature
    if linear < 0.0 and under > 0.0:  # ∂p/∂ρ = R (T + 2 linear ρ + square ρ²) falls to 0
        most = temperature / (-linear + math.sqrt(under))
        if gas_pressure(most, temperature, gas) <= wanted:
            return most
    density = wanted / (constant * temperature)
    for _ in range(30):  # the pressure is concave up to `most`: each step stays below the root
        slope = constant * (temperature + density * (2.0 * linear + square * density))
        step = (wanted - gas_pressure(density, temperature, gas)) / slope
        density += step
        if step < 1e-12 * density:
            break
    return density


@register_jitable
def store_pressure(mass: float, temperature: float, volume: float, gas: Row) -> float:
    """Absolute pressure of a store [Pa]: that of the gas, or of saturation while there is liquid.

    Parameters
    ----------
    mass : m of gas and liquid [kg]
    temperature : T [K]
    volume : V [m³]
    gas : as in `gas_pressure`
    """
    density = mass / volume
    if gas[-1] != 0.0:
        density = min(density, vapour_density(temperature, gas))
    return gas_pressure(density, temperature, gas)


@register_jitable
def store_heat_capacity(mass: float, temperature: float, volume: float, gas: Row) -> float:
    """Heat capacity of what is in a store, at constant mass and volume [J/K].

    Of a gas m c_v. Of liquid and vapour together U = m e(T) + V (T p′ − p), as U is linear in m and V at each
    temperature and −p is its part by V: m e′ + V T p″, p being that of saturation.

    Parameters
    ----------
    mass, temperature, volume, gas : as in `store_pressure`

    Source
    ------
    e′ = 1635 − 3.0 (T − 273.15) J/(kg·K), fitted here to CoolProp 8.0 (Span & Wagner 1996) within 1 % from
    220 to 298 K.
    """
    if gas[-1] != 0.0 and mass > volume * vapour_density(temperature, gas):
        own = LIQUID_HEAT + LIQUID_SLOPE * (temperature - LIQUID_AT)
        return mass * own + volume * temperature * saturation(temperature)[2]
    return mass * gas[1]


@register_jitable
def heat_taken(mass: float, temperature: float, volume: float, gas: Row) -> float:
    """Heat that the gas that leaves takes out of what stays, by its mass [J/kg]: (T/ρ) ∂p/∂T.

    From d(m u)/dt = −ṁ h of a store of constant volume, with ∂u/∂ρ = (p − T ∂p/∂T)/ρ². Of an ideal gas R T.
    Of liquid and vapour (T/ρ_v) p′, which is the latent heat times ρ_l/(ρ_l − ρ_v): the space of the liquid
    that evaporates is filled with vapour too.

    Parameters
    ----------
    mass, temperature, volume, gas : as in `store_pressure`
    """
    constant, _, b0, _, c0, _, liquefies = gas
    density = mass / volume
    if liquefies != 0.0:
        most = vapour_density(temperature, gas)
        if density > most:
            return temperature / most * saturation(temperature)[1]
    return temperature * constant * (1.0 + density * (b0 + c0 * density))


@register_jitable
def store_temperature_rate(
    mass: float, temperature: float, volume: float, inflow: float, outflow: float, shell: float,
    conductance: float, ambient: float, gas: Row,
) -> float:  # fmt: skip
    """Rate of a store's temperature from its energy balance [K/s].

    (C + K) Ṫ = −ṁ_out q + ṁ_in [(c_v + R) T_a − u − ρ ∂u/∂ρ] + hA (T_a − T)

    with q of `heat_taken`, C of `store_heat_capacity` and u of the module. What comes in brings the enthalpy
    of the ideal gas at ambient temperature.

    Parameters
    ----------
    mass, temperature, volume : m [kg], T [K], V [m³]; m above 0
    inflow, outflow : ṁ_in of gas at ambient temperature, ṁ_out, both ≥ 0 [kg/s]; a store with liquid is not
        filled
    shell : heat capacity K of the shell, which is as warm as what is in it [J/K]
    conductance : hA to the surroundings [W/K]
    ambient : T_a [K]
    gas : as in `gas_pressure`

    Returns
    -------
    float : Ṫ [K/s]
    """
    constant, heat, _, b1, _, c1, _ = gas
    capacity = shell + store_heat_capacity(mass, temperature, volume, gas)
    taken = heat_taken(mass, temperature, volume, gas)
    density = mass / volume
    # h_in − u − ρ ∂u/∂ρ of the gas within, ∂u/∂ρ = R (b1 + c1 ρ)
    brought = (heat + constant) * ambient - heat * temperature
    brought -= constant * density * (2.0 * b1 + 1.5 * c1 * density)
    warming = conductance * (ambient - temperature)
    return (warming + inflow * brought - outflow * taken) / capacity

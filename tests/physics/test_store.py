"""Stores of gas and liquid: pressure against tables, temperature against balances of mass and energy."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from afo_sim.metrics import air_given
from afo_sim.metrics.bottle import COMPRESSIBILITY
from afo_sim.physics import (
    AIR,
    CO2,
    Gas,
    compressor_flow,
    compressor_runs,
    gas_mass,
    mass_given,
    saturation,
    store_pressure,
    store_temperature_rate,
)
from afo_sim.physics.flow_edge import regulator_flow, relief_flow
from afo_sim.physics.store import gas_pressure, store_heat_capacity, vapour_density

WARM = 293.15
ATM = 101_325.0
BOTTLE, CARTRIDGE = 0.5e-3, 23.5e-6
# Carbon dioxide by T [K], from CoolProp 8.0 (Span & Wagner 1996): saturated vapour and liquid [kg/m³],
# latent heat [J/kg], heat capacity at constant volume of 0.68 kg/l liquid and vapour [J/(kg·K)].
SATURATED = {
    230.0: (23.27, 1129.0, 328.0e3, 2078.0),
    250.0: (46.64, 1046.0, 289.3e3, 2182.0),
    263.15: (71.18, 982.9, 258.6e3, 2273.0),
    273.15: (97.65, 927.4, 230.9e3, 2359.0),
    283.15: (135.2, 861.1, 197.2e3, 2472.0),
    293.15: (194.2, 773.4, 152.0e3, 2658.0),
    298.15: (242.7, 710.5, 119.6e3, 2826.0),
}


def pressure(gas: Gas, density: float, temperature: float) -> float:
    return gas_pressure(density, temperature, gas.row)


def of_store(gas: Gas, mass: float, temperature: float, volume: float) -> float:
    return store_pressure(mass, temperature, volume, gas.row)


def saturated(temperature: float) -> float:
    return vapour_density(temperature, CO2.row)


def rate(
    gas: Gas, mass: float, temperature: float, volume: float, into: float, out: float, *around: float
) -> float:
    return store_temperature_rate(mass, temperature, volume, into, out, *around, gas.row)


def warmth(gas: Gas, volume: float, first: float, last: float, into: float = 0.0, out: float = 0.0) -> float:
    """Temperature of a store without heat whose mass goes from one to another, by the kernel's rate."""

    def by_mass(mass: float, state: np.ndarray) -> list[float]:
        return [(into - out) * rate(gas, mass, state[0], volume, into, out, 0.0, 0.0, WARM)]

    return float(solve_ivp(by_mass, (first, last), [WARM], rtol=1e-9).y[0, -1])


def test_air_has_the_compressibility_of_the_table() -> None:
    for bar, z in COMPRESSIBILITY.items():
        if 0 < bar <= 300:
            density = bar * 1e5 / (z * AIR.constant * WARM)
            assert pressure(AIR, density, WARM) == pytest.approx(bar * 1e5, rel=0.0025)
    assert pressure(AIR, 1.0, WARM) == pytest.approx(AIR.constant * WARM, rel=1e-3)


def test_cold_dense_air() -> None:
    """CoolProp 8.0 (Lemmon et al. 2000): densities at 240 K of 50, 150 and 300 bar."""
    for bar, density in ((50.0, 76.27), (150.0, 235.32), (300.0, 410.99)):
        assert pressure(AIR, density, 240.0) == pytest.approx(bar * 1e5, rel=0.02)


@pytest.mark.parametrize(("share", "kelvin", "bar"), [(0.8, 255.9, 184.6), (0.5, 198.8, 77.2)])
def test_a_bottle_emptied_at_once_is_as_cold_as_real_air(share: float, kelvin: float, bar: float) -> None:
    """From 301 bar and 20 °C without heat: the first law with CoolProp 8.0's u and h of air, 400 steps."""
    first = gas_mass(AIR, BOTTLE, 301e5)
    found = warmth(AIR, BOTTLE, first, share * first, out=1.0)
    assert found == pytest.approx(kelvin, rel=0.03)
    assert of_store(AIR, share * first, found, BOTTLE) == pytest.approx(bar * 1e5, rel=0.06)


def test_a_warm_bottle_gives_what_the_metric_says() -> None:
    for bar in (10.0, 50.0, 200.0, 300.0):
        full = gas_mass(AIR, BOTTLE, bar * 1e5 + ATM)
        given = mass_given(AIR, BOTTLE, full, 4e5 + ATM)
        assert given == pytest.approx(air_given(BOTTLE, bar * 1e5, 4e5), rel=0.005)
    assert mass_given(AIR, BOTTLE, gas_mass(AIR, BOTTLE, 3e5), 4e5) == 0.0


@pytest.mark.parametrize(("bar", "kelvin"), [(34.85, 273.15), (57.29, 293.15), (5.18, 216.592)])
def test_saturation_at_known_points(bar: float, kelvin: float) -> None:
    assert saturation(kelvin)[0] == pytest.approx(bar * 1e5, rel=1e-3)


def test_saturation_ends_at_the_critical_point() -> None:
    """73.77 bar at 30.98 °C; its tangent from 303 K on leads there within a thousandth."""
    assert saturation(304.1282)[0] == pytest.approx(73.77e5, rel=1e-3)
    low, high = (saturation(303.0 + d) for d in (-1e-9, 1e-9))
    assert low[:2] == pytest.approx(high[:2], rel=1e-6)


@pytest.mark.parametrize("kelvin", [200.0, 230.0, 260.0, 293.0, 302.0])
def test_slopes_of_saturation_are_its_own(kelvin: float) -> None:
    step = 1e-3
    left, here, right = (saturation(kelvin + d) for d in (-step, 0.0, step))
    assert here[1] == pytest.approx((right[0] - left[0]) / (2 * step), rel=1e-6)
    assert here[2] == pytest.approx((right[1] - left[1]) / (2 * step), rel=1e-5)


@pytest.mark.parametrize("kelvin", SATURATED)
def test_vapour_liquid_and_latent_heat(kelvin: float) -> None:
    """Clapeyron: L = T p′ (1/ρ_v − 1/ρ_l); the heat that leaving vapour takes is L ρ_l/(ρ_l − ρ_v)."""
    vapour, liquid, latent, capacity = SATURATED[kelvin]
    assert saturated(kelvin) == pytest.approx(vapour, rel=0.005)
    slope = saturation(kelvin)[1]
    assert kelvin * slope * (1.0 / saturated(kelvin) - 1.0 / liquid) == pytest.approx(latent, rel=0.01)
    mass = 680.0 * CARTRIDGE
    cold = -rate(CO2, mass, kelvin, CARTRIDGE, 0.0, 1e-4, 0.0, 0.0, WARM)
    own = store_heat_capacity(mass, kelvin, CARTRIDGE, CO2.row)
    assert own == pytest.approx(mass * capacity, rel=0.02)
    assert cold * own / 1e-4 == pytest.approx(latent * liquid / (liquid - vapour), rel=0.01)


def test_pressure_does_not_jump_as_the_last_liquid_goes() -> None:
    for kelvin in (220.0, 260.0, WARM, 300.0, 302.5, 304.5):
        last = saturated(kelvin) * CARTRIDGE
        above, below = (of_store(CO2, last * (1.0 + d), kelvin, CARTRIDGE) for d in (1e-9, -1e-9))
        assert above == pytest.approx(below, rel=1e-7)
    densities = np.linspace(1.0, 700.0, 500)
    along = np.array([of_store(CO2, d * CARTRIDGE, WARM, CARTRIDGE) for d in densities])
    assert np.all(np.diff(along) >= -1e-3)
    assert along[-1] == pytest.approx(57.29e5, rel=1e-3)


def test_16_grams_are_8_9_litres() -> None:
    """What is left at 4 bar gauge is the gas of 5.01 bar in 23.5 ml: ideal within 3 %."""
    assert 16.0 * CO2.litres_per_gram == pytest.approx(8.9, abs=0.05)
    given = mass_given(CO2, CARTRIDGE, 16e-3, 4e5 + ATM)
    left = 16e-3 - given
    assert left == pytest.approx((4e5 + ATM) * CARTRIDGE / (CO2.constant * WARM), rel=0.03)
    assert mass_given(CO2, CARTRIDGE, 16e-3, 60e5) == 0.0
    assert gas_mass(CO2, 1.0, 60e5) == saturated(WARM)


def inner_energy(gas: Gas, density: float, temperature: float) -> float:
    """u of a gas without liquid [J/kg]: c_v T + ∫ (p − T ∂p/∂T)/ρ² dρ, by quadrature and differences."""

    def attraction(r: float) -> float:
        slope = (pressure(gas, r, temperature + 0.5) - pressure(gas, r, temperature - 0.5)) / 1.0
        return (pressure(gas, r, temperature) - temperature * slope) / (r * r)

    return gas.heat_capacity * temperature + float(quad(attraction, 1e-3, density)[0])


@pytest.mark.parametrize(("gas", "start"), [(AIR, 340.0), (CO2, 60.0)])
def test_an_adiabatic_store_keeps_the_first_law(gas: Gas, start: float) -> None:
    """Mass and energy as states, d(m u) = −h dm, against the kernel's temperature as a state.

    What is given stays above the saturation of carbon dioxide, of which nothing freezes or rains here.
    """
    volume, first = 1e-3, 1e-3 * start

    def temperature_of(mass: float, energy: float) -> float:
        return float(brentq(lambda t: mass * inner_energy(gas, mass / volume, t) - energy, 100.0, 350.0))

    def balance(mass: float, state: np.ndarray) -> list[float]:
        t = temperature_of(mass, state[0])
        return [inner_energy(gas, mass / volume, t) + pressure(gas, mass / volume, t) * volume / mass]

    last = 0.75 * first
    energy = first * inner_energy(gas, start, WARM)
    truth = solve_ivp(balance, (first, last), [energy], rtol=1e-7, max_step=0.1 * first).y[0, -1]
    found = warmth(gas, volume, first, last, out=1.0)
    assert found == pytest.approx(temperature_of(last, truth), abs=0.01)
    assert found < WARM - 20.0


def test_an_ideal_bottle_follows_the_isentrope_and_fills_warm() -> None:
    """T ∝ m^(γ − 1) of what stays; an empty vessel filled from the ambient gets γ T_a."""
    ideal = Gas("ideal", 287.05, 1.4, 1.185)

    def kernel(into: float, out: float) -> Callable[[float, np.ndarray], list[float]]:
        return lambda _, s: [into - out, rate(ideal, s[0], s[1], 1e-3, into, out, 0.0, 0.0, WARM)]

    emptied = solve_ivp(kernel(0.0, 1e-3), (0.0, 5.0), [1e-2, WARM], rtol=1e-9).y[:, -1]
    assert emptied[1] == pytest.approx(WARM * 0.5**0.4, rel=1e-6)
    filled = solve_ivp(kernel(1e-3, 0.0), (0.0, 5.0), [1e-7, WARM], rtol=1e-9, atol=1e-12).y[:, -1]
    assert filled[1] == pytest.approx(1.4 * WARM, rel=1e-4)


def test_a_bottle_of_dense_air_is_filled_by_the_first_law() -> None:
    """d(m u) = (c_v + R) T_a dm: from 100 to 200 kg/m³ with the energy of the real gas."""
    volume, first, last = 1e-3, 0.1, 0.2
    enthalpy = (AIR.heat_capacity + AIR.constant) * WARM
    energy = first * inner_energy(AIR, first / volume, WARM) + enthalpy * (last - first)
    found = warmth(AIR, volume, first, last, into=1.0)
    assert last * inner_energy(AIR, last / volume, found) == pytest.approx(energy, rel=1e-6)
    assert found > WARM + 40.0


def two_phase_energy(mass: float, temperature: float) -> float:
    """Energy of liquid and vapour in the cartridge: m e(T) + V (T p′ − p)."""
    e = quad(lambda t: 1635.0 - 3.0 * (t - 273.15), 220.0, temperature)[0]
    p, slope, _ = saturation(temperature)
    return mass * float(e) + CARTRIDGE * (temperature * slope - p)


def test_a_cartridge_keeps_mass_and_energy_over_a_discharge() -> None:
    """Energy of liquid and vapour as a state, each at the saturation pressure, against the kernel.

    The vapour that leaves has h = e + T p′/ρ_v.
    """
    shell, conductance, flow, span = 20.0, 0.05, 5e-5, 150.0

    def temperature_of(mass: float, energy: float) -> float:
        return float(
            brentq(lambda t: two_phase_energy(mass, t) + shell * t - energy, 200.0, 300.0, xtol=1e-10)
        )

    def balance(_: float, state: np.ndarray) -> list[float]:
        mass, energy = state
        t = temperature_of(mass, energy)
        e = float(quad(lambda x: 1635.0 - 3.0 * (x - 273.15), 220.0, t)[0])
        enthalpy = e + t * saturation(t)[1] / saturated(t)
        return [-flow, -flow * enthalpy + conductance * (WARM - t)]

    def kernel(_: float, state: np.ndarray) -> list[float]:
        return [-flow, rate(CO2, state[0], state[1], CARTRIDGE, 0.0, flow, shell, conductance, WARM)]

    start = [16e-3, two_phase_energy(16e-3, WARM) + shell * WARM]
    truth = solve_ivp(balance, (0.0, span), start, rtol=1e-7, atol=1e-9, max_step=15.0).y[:, -1]
    found = solve_ivp(kernel, (0.0, span), [16e-3, WARM], rtol=1e-8, atol=1e-10).y[:, -1]
    assert found[0] == pytest.approx(16e-3 - flow * span, rel=1e-9)
    assert found[1] == pytest.approx(temperature_of(*truth), abs=0.01)
    assert found[0] > saturated(found[1]) * CARTRIDGE  # there is liquid left
    assert of_store(CO2, *found, CARTRIDGE) < 40e5  # cold: it began at 57 bar


def test_a_cartridge_runs_dry_and_warms_again() -> None:
    """Flow for 5 minutes, then none: it comes back to the ambient temperature as a gas of its mass."""

    def kernel(time: float, state: np.ndarray) -> list[float]:
        flow = 5e-5 if time < 300.0 else 0.0
        return [-flow, rate(CO2, state[0], state[1], CARTRIDGE, 0.0, flow, 20.0, 0.2, WARM)]

    run = solve_ivp(kernel, (0.0, 2000.0), [16e-3, WARM], rtol=1e-7, atol=1e-9, max_step=5.0)
    mass, kelvin = run.y[:, -1]
    assert mass == pytest.approx(1e-3, rel=1e-3)
    assert kelvin == pytest.approx(WARM, abs=0.1)
    assert np.all(np.isfinite(run.y)) and 217.0 < run.y[1].min() < 270.0
    assert of_store(CO2, mass, kelvin, CARTRIDGE) == pytest.approx(pressure(CO2, mass / CARTRIDGE, kelvin))


def test_compressor_and_regulator_by_hand() -> None:
    assert compressor_flow(1e5, 1e-4, 0.0, 2e5) == pytest.approx(1.185 * 0.5e-4)
    assert compressor_flow(3e5, 1e-4, 0.0, 2e5) == 0.0
    assert compressor_flow(1e5, 1e-4, 1e5, 2e5) == pytest.approx(1.185e-4)
    states = [1.0]
    for bar in (5.0, 6.5, 7.0, 6.5, 6.0, 6.5):
        states.append(compressor_runs(states[-1], bar * 1e5, 6e5, 7e5))
    assert states == [1.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0]
    assert math.isnan(compressor_runs(1.0, math.nan, 6e5, 7e5))
    gain, c = 1e-8, 0.4e-8
    assert regulator_flow(300e5, 4.8e5, WARM, 5e5, gain, c, 0.3) == pytest.approx(2e-4)
    assert regulator_flow(6e5, 1e5, WARM, 5e5, 1.0, c, 0.3) == pytest.approx(c * 1.185 * 6e5)
    assert regulator_flow(4e5, 4.5e5, WARM, 5e5, gain, c, 0.3) == 0.0
    assert regulator_flow(6e5, 5.1e5, WARM, 5e5, gain, c, 0.3) == 0.0
    assert relief_flow(5.4e5, ATM, WARM, 5.3e5, gain, c, 0.3) == pytest.approx(1e-4)
    assert relief_flow(5.2e5, ATM, WARM, 5.3e5, gain, c, 0.3) == 0.0

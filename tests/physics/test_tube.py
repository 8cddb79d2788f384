"""Tubes: flow against printed and separately computed numbers, the friction that the formula hides."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from afo_sim.physics import AIR, CO2, sound_delay, tube_conductance, tube_critical_ratio, tube_volume

UNIT = 1e-8  # dm³/(s·bar) in m³/(s·Pa)


def test_line_of_4_mm_and_10_m_is_the_printed_one() -> None:
    """C = 0.45 dm³/(s·bar) of doi 10.1109/IC2AI62984.2025.10932214; its b, 0.21, is not met."""
    assert tube_conductance(4e-3, 10.0) / UNIT == pytest.approx(0.45, rel=0.02)
    assert tube_critical_ratio(4e-3, 10.0) == pytest.approx(0.135, abs=0.001)


@pytest.mark.parametrize(
    ("bore", "length", "conductance", "critical", "per_metre"),
    [
        (2.0, 0.3, 0.332, 0.394, 3.14),
        (2.5, 0.8, 0.411, 0.312, 4.91),
        (2.6, 1.0, 0.417, 0.292, 5.31),
        (4.0, 2.0, 0.928, 0.275, 12.57),
        (6.0, 5.0, 1.76, 0.232, 28.27),
        (8.0, 0.3, 7.36, 0.545, 50.3),
    ],
)
def test_table_of_tubes(
    bore: float, length: float, conductance: float, critical: float, per_metre: float
) -> None:
    """A table that was computed apart from this code, mm, m, dm³/(s·bar), ml/m."""
    d = 1e-3 * bore
    assert tube_conductance(d, length) / UNIT == pytest.approx(conductance, rel=3e-3)
    assert tube_critical_ratio(d, length) == pytest.approx(critical, abs=1e-3)
    assert 1e6 * tube_volume(d, 1.0) == pytest.approx(per_metre, rel=2e-3)


def test_without_length_it_is_a_hole() -> None:
    """C = 0.128 d² of Gidlund's hole, mm; with a discharge coefficient below 1."""
    bores = np.array([1.0, 2.0, 4.0, 8.0])
    holes = np.array([tube_conductance(1e-3 * d, 0.0) for d in bores]) / UNIT
    assert holes == pytest.approx(0.128 * bores**2, rel=4e-3)
    ideal = 0.25 * math.pi * 1e-6 / 1.185 * math.sqrt(1.4 / (287.05 * 293.15)) / 1.2**3
    assert 0.75 < holes[0] * UNIT / ideal < 0.9
    assert tube_critical_ratio(1e-3, 0.0) == pytest.approx(0.61, abs=0.005)


def test_longer_is_less_and_wider_is_more() -> None:
    lengths = np.geomspace(0.01, 30.0, 60)
    along = [tube_conductance(2.5e-3, float(length)) for length in lengths]
    assert np.all(np.diff(along) < 0.0)
    assert np.all(np.diff([tube_conductance(float(d), 1.0) for d in np.linspace(1e-3, 12e-3, 60)]) > 0.0)
    ratios = [tube_critical_ratio(2.5e-3, float(length)) for length in lengths]
    assert np.all(np.diff(ratios) < 0.0) and 0.0 < ratios[-1] < ratios[0] < 0.61


def test_its_friction_is_that_of_isothermal_choked_flow() -> None:
    """A long line into vacuum, integrated along it: p dp = −f/(2 d) G² R T dx, G = ṁ/A, until p is 0."""
    d, length, p, rt = 3e-3, 400.0, 7e5, 287.05 * 293.15
    area = 0.25 * math.pi * d * d
    # C = 0.029 d²/√(L/d^1.25 + 510) is √((f L/d + 510 k)/k) with f = k d^(−1/4)
    k = (0.25 * math.pi / (0.029 * 1.185)) ** 2 / rt
    f, ends = k * d**-0.25, 510.0 * k
    flow = 1.185 * tube_conductance(d, length) * p
    x = np.linspace(0.0, length, 2001)
    squared = p * p - f / d * (flow / area) ** 2 * rt * x  # p² falls linearly
    left = squared[-1] / p**2
    assert 0.0 < left < 0.002  # what is left is for the ends
    assert left == pytest.approx(ends / (f * length / d + ends), rel=1e-9)
    assert f == pytest.approx(0.0062 * d**-0.25, rel=0.005)
    assert ends == pytest.approx(3.17, abs=0.01)


def adiabatic_flow(d: float, length: float, p0: float) -> float:
    """Choked adiabatic flow through a tube [kg/s]: Haaland's friction of 1.5 µm, 0.5 lost at the entry."""
    gamma, r, t0, viscosity = 1.4, 287.05, 293.15, 1.82e-5
    area = 0.25 * math.pi * d * d

    def entry(mach: float) -> float:
        warm = 1.0 + 0.2 * mach * mach
        p = p0 / (warm**3.5 + 0.5 * 0.5 * gamma * mach * mach)
        return area * p * mach * math.sqrt(gamma * warm / (r * t0))

    def left(mach: float) -> float:
        """Friction until it chokes (Fanno), less that of the tube."""
        square = mach * mach
        allowed = (1.0 - square) / (gamma * square)
        allowed += 1.2 / gamma * math.log(1.2 * square / (1.0 + 0.2 * square))
        reynolds = 4.0 * entry(mach) / (math.pi * d * viscosity)
        f = (-1.8 * math.log10((1.5e-6 / d / 3.7) ** 1.11 + 6.9 / reynolds)) ** -2
        return allowed - f * length / d

    return entry(float(brentq(left, 1e-3, 0.999)))


@pytest.mark.parametrize("bore", [2.0, 2.5, 4.0, 6.0])
@pytest.mark.parametrize("length", [0.3, 1.0, 3.0, 10.0])
def test_flow_is_near_that_with_smooth_friction(bore: float, length: float) -> None:
    """Within 7 % of adiabatic flow from 7 bar, which knows the Reynolds number."""
    flow = 1.185 * tube_conductance(1e-3 * bore, length) * 7e5
    assert flow == pytest.approx(adiabatic_flow(1e-3 * bore, length, 7e5), rel=0.075)


def test_sound_takes_3_ms_a_metre() -> None:
    assert 1e3 * sound_delay(1.0) == pytest.approx(2.91, abs=0.01)
    slow = sound_delay(2.0, gas_constant=CO2.constant, heat_capacity_ratio=CO2.heat_capacity_ratio)
    assert 1e3 * slow == pytest.approx(2 * 3.74, abs=0.01)


def test_gases() -> None:
    """By hand: √(1.29·287.05/(1.4·188.9)) by the ratio of (2/(γ+1))^((γ+1)/(2(γ−1)))."""
    assert AIR.flow_factor == 1.0
    assert CO2.flow_factor == pytest.approx(1.198, abs=5e-4)
    assert CO2.flow_factor * AIR.free_density / CO2.free_density == pytest.approx(0.788, abs=0.003)
    assert CO2.litres_per_gram == pytest.approx(0.554, abs=5e-4)
    assert AIR.litres_per_gram == pytest.approx(0.844, abs=5e-4)
    assert AIR.heat_capacity == pytest.approx(717.6, abs=0.1)

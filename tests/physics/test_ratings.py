"""Ratings of valves: what makers print beside C and b, conversions there and back, laws of nature."""

import math

import pytest

from afo_sim.common import (
    AMBIENT_TEMPERATURE,
    GAS_CONSTANT,
    HEAT_CAPACITY_RATIO,
    NORMAL_DENSITY,
    STANDARD_DENSITY,
)
from afo_sim.physics import ratings

ANR, DIN = STANDARD_DENSITY, NORMAL_DENSITY
UNIT = 1e-8  # dm³/(s·bar) in m³/(s·Pa)
MINUTE = 6e4  # m³/s in l/min


def printed(c: float, b: float, norm: float, high: float = 6e5, low: float = 5e5) -> float:
    """Flow [l/min] of a valve with C in dm³/(s·bar)."""
    return MINUTE * ratings.nominal_flow(c * UNIT, b, high, low, norm)


@pytest.mark.parametrize(
    ("c", "b", "flow"), [(1.1, 0.28, 276.0), (2.8, 0.37, 746.0), (4.5, 0.28, 1130.0), (10.0, 0.29, 2527.0)]
)
def test_sy_series_prints_c_b_and_flow_that_agree(c: float, b: float, flow: float) -> None:
    """SMC EUS11-83B-UK, p. 1: SY3000, 5000, 7000, 9000."""
    assert printed(c, b, ANR) == pytest.approx(flow, rel=2e-3)
    assert abs(printed(c, b, DIN) / flow - 1.0) > 0.08  # it is not DIN 1343
    assert abs(printed(c, b, ANR, 5e5, 4e5) / flow - 1.0) > 0.08  # nor 6 to 5 bar absolute
    found = ratings.conductance_of_nominal_flow(flow / MINUTE, b, 6e5, 5e5, ANR)
    assert found == pytest.approx(c * UNIT, rel=2e-3)


def test_smcs_worked_example() -> None:
    """C = 2, b = 0.3, from 0.4 to 0.3 MPa gauge at 20 °C: 420 l/min ANR."""
    assert printed(2.0, 0.3, ANR, 4e5, 3e5) == pytest.approx(420.0, rel=1e-3)


def test_mpye_prints_a_flow_of_din_1343() -> None:
    """Festo MPYE-5-1/4: C = 6.25, b = 0.23, 1400 l/min."""
    assert printed(6.25, 0.23, DIN) == pytest.approx(1400.0, rel=5e-3)
    assert printed(6.25, 0.23, ANR) > 1.08 * 1400.0


def test_vuvs_prints_a_flow_that_its_own_c_and_b_exceed() -> None:
    """Festo VUVS-LT25: C = 4.4, b = 0.4, 1000 l/min. Its flow is rounded down or guaranteed."""
    miss = 1000.0 / printed(4.4, 0.4, DIN) - 1.0
    assert -0.10 < miss < -0.08


@pytest.mark.parametrize(("pressure", "norm"), [(6e5, ANR), (6e5, DIN), (4e5, ANR)])
@pytest.mark.parametrize("b", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("drop", [0.05e5, 1e5, 4e5])  # laminar, elliptic, choked for low b
def test_flow_to_conductance_and_back(pressure: float, norm: float, b: float, drop: float) -> None:
    given = 100.0 / MINUTE
    c = ratings.conductance_of_nominal_flow(given, b, pressure, pressure - drop, norm)
    assert ratings.nominal_flow(c, b, pressure, pressure - drop, norm) == pytest.approx(given, rel=1e-14)


def test_choked_flow_is_conductance_times_pressure() -> None:
    """The definition of C: from 6 bar gauge into the open, 1/7 of its pressure, 7 bar times C."""
    for b in (0.15, 0.3, 0.5):
        assert printed(1.0, b, ANR, 6e5, 0.0) == pytest.approx(60.0 * 7.0, rel=1e-12)
    assert printed(1.0, 0.0, ANR, 6e5, 0.0) < 60.0 * 7.0


def test_a_litre_of_din_1343_is_more_air() -> None:
    """The norms count the same mass: volumes are as temperature over pressure, 0.3 % of humidity aside."""
    ratio = printed(1.0, 0.3, ANR) / printed(1.0, 0.3, DIN)
    assert ratio == pytest.approx(1.293 / 1.185, rel=1e-12)
    assert ratio == pytest.approx((293.15 / 273.15) * 1.01325, rel=4e-3)


@pytest.mark.parametrize(("b", "change"), [(0.2, 0.06), (0.5, -0.135)])
def test_what_an_assumed_critical_ratio_costs(b: float, change: float) -> None:
    c = [ratings.conductance_of_nominal_flow(1e-3, ratio, 6e5, 5e5, ANR) for ratio in (b, 0.3)]
    assert c[0] / c[1] - 1.0 == pytest.approx(change, abs=6e-3)


def test_makers_pairs_of_cv_are_within_its_spread() -> None:
    """SMC EUS11-83B-UK and CAT.ES11-107A; C = 0.62 Cv, which is printed too, is far outside."""
    pairs = {1.1: 0.29, 2.8: 0.90, 4.5: 1.4, 10.0: 2.5, 0.71: 0.19}
    for c, cv in pairs.items():
        assert ratings.conductance_of_cv(cv) == pytest.approx(c * UNIT, rel=ratings.CV_SPREAD)
        assert c / cv > 5.0 / 1.62
    assert ratings.conductance_of_kv(0.865) == pytest.approx(ratings.conductance_of_cv(1.0), rel=1e-14)


def ideal(area: float) -> float:
    """C of an ideal nozzle, from the choked flow of an ideal gas."""
    k = HEAT_CAPACITY_RATIO
    mass = math.sqrt(k / (GAS_CONSTANT * AMBIENT_TEMPERATURE)) * (2.0 / (k + 1.0)) ** (
        (k + 1.0) / (2.0 * k - 2.0)
    )
    return area * mass / STANDARD_DENSITY


def test_areas_stay_below_an_ideal_nozzles() -> None:
    sonic = ratings.conductance_of_sonic_area(20e-6)
    assert sonic == pytest.approx(4.0 * UNIT, rel=1e-12)  # S = 5.0 C
    assert sonic == pytest.approx(ideal(20e-6), rel=0.01)  # S is that of a nozzle without loss
    hole = ratings.conductance_of_orifice(1.02e-3)
    assert hole == pytest.approx(0.133 * UNIT, rel=2e-3)
    assert hole / ideal(math.pi / 4.0 * 1.02e-3**2) == pytest.approx(0.82, abs=5e-3)

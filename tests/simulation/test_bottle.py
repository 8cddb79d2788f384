"""Air of a bottle: mass of a real gas, against textbook numbers and the ideal gas."""

import math

import numpy as np
import pytest

import afo_sim
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.metrics import air_given
from afo_sim.metrics.bottle import COMPRESSIBILITY, bottle_metrics, compressibility

RT = GAS_CONSTANT * AMBIENT_TEMPERATURE


def test_a_half_litre_at_300_bar_holds_136_litres_of_free_air() -> None:
    """0.5 l · 301 bar / (Z R T) with Z some 1.1; 3.0 l of 10 bar gauge down to 4 bar gauge."""
    whole = air_given(0.5e-3, 300e5, -AMBIENT_PRESSURE)
    assert 1e3 * whole / 1.185 == pytest.approx(136.0, rel=0.01)
    assert 1e3 * air_given(0.5e-3, 10e5, 4e5) / 1.185 == pytest.approx(3.0, rel=0.02)


def test_at_low_pressure_air_is_an_ideal_gas_and_what_is_left_stays_in_the_bottle() -> None:
    """Gauge pressures' difference counts: ambient pressure falls out of an ideal gas."""
    assert air_given(1e-3, 3e5, 1e5) == pytest.approx(1e-3 * 2e5 / RT, rel=2e-3)
    assert air_given(1e-3, 4e5, 4e5) == air_given(1e-3, 2e5, 4e5) == 0.0


def test_compressibility_is_that_of_the_tables() -> None:
    """Perry's table for air, between its rows of 250 and 300 K (Z: 0.9411 and 0.9930 at 100 bar, 1.0702 and
    1.1089 at 300 bar, 1.3392 and 1.3163 at 500 bar); straight between these rows is 0.5 % at most off."""
    share = (293.15 - 250.0) / 50.0
    for bar, cold, warm in ((100.0, 0.9411, 0.9930), (300.0, 1.0702, 1.1089), (500.0, 1.3392, 1.3163)):
        assert compressibility(bar * 1e5) == pytest.approx(cold + share * (warm - cold), rel=0.005)
    assert compressibility(0.0) == 1.0
    assert max(COMPRESSIBILITY) * 1e5 >= 1e8 + AMBIENT_PRESSURE  # the highest pressure that limits allow


def test_more_pressure_is_always_more_air() -> None:
    given = [air_given(1e-3, p, 0.0) for p in np.linspace(0.0, 1e8, 400)]
    assert all(math.isfinite(mass) for mass in given) and np.all(np.diff(given) > 0.0)


def test_strides_are_the_bottles_litres_by_a_strides() -> None:
    found = dict(bottle_metrics(0.08, 1.2, 136.0))
    assert found["strides_per_bottle"] == pytest.approx(1700.0)
    assert found["free_air_per_minute"] == pytest.approx(0.08 * 50.0)  # 50 strides a minute
    assert set(dict(bottle_metrics(0.0, 1.2, 136.0))) == {"free_air_per_minute"}


@pytest.mark.slow
def test_a_run_tells_them_from_its_own_inlet_flow() -> None:
    """The mass through the inlet in the settled stride, integrated here."""
    run = afo_sim.run("walk-dropfoot-afo", {"record_rate": "1 kHz", "supply.pressure": "3 bar"})
    last = run["gait/stride"] == run["gait/stride"][-2]
    flow = np.maximum(run["valve/dorsiflexor_inlet/mass_flow"][last], 0.0)
    air = float(flow.sum()) * 1e-3  # [kg]
    kept = 0.5e-3 * (301.0 / 1.104 - 4.01) * 1e5 / RT
    assert run.metrics["strides_per_bottle"].value == pytest.approx(kept / air, rel=0.01)
    minutes = run.metrics["stride_time"].value / 60.0
    assert run.metrics["free_air_per_minute"].value == pytest.approx(1e3 * air / 1.185 / minutes, rel=0.01)

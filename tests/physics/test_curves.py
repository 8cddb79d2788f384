"""Curves over arrays, their inversion, and the slopes and limits that time steps are chosen by."""

import math

import numba
import numpy as np
import pytest

from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
from afo_sim.physics.curves import contractions, crossing, forces
from afo_sim.physics.jitable import register_all
from afo_sim.physics.law import Braid
from afo_sim.physics.laws import LAWS
from afo_sim.physics.pneumatics import braid_volume, laminar_slope, valve_flow
from afo_sim.physics.registry import typical_coefficients


def test_crossing_finds_the_zero() -> None:
    for zero in (-0.7, 0.0, 1e-3, 0.4):
        assert crossing(lambda x, a: a - x**3, (zero**3,), -1.0, 1.0, 60) == pytest.approx(zero, abs=1e-5)
        assert crossing(lambda x, a: a - x, (zero,), -1.0, 1.0, 60) == pytest.approx(zero, abs=1e-15)


def test_crossing_of_one_sign_is_the_end() -> None:
    assert crossing(lambda x: 1.0, (), -1.0, 2.0, 60) == pytest.approx(2.0, abs=1e-15)
    assert crossing(lambda x: -1.0, (), -1.0, 2.0, 60) == pytest.approx(-1.0, abs=1e-15)


def test_crossing_compiled_is_python() -> None:
    register_all()
    falling = numba.njit(lambda x, a, b: a - b * x)
    compiled = numba.njit(lambda a, b: crossing(falling, (a, b), -1.0, 2.0, 40))
    for a, b in ((0.3, 1.0), (1.0, 0.7), (-0.2, 3.0)):
        assert compiled(a, b) == crossing(falling.py_func, (a, b), -1.0, 2.0, 40)


def test_curves_broadcast() -> None:
    law = LAWS["tondu_lopez_2000"]
    c = typical_coefficients(law)
    kappa, pressure = np.linspace(0.0, 0.2, 5)[:, None], np.array([1e5, 3e5, 4e5])
    force = forces(law.native_id, c, kappa, pressure)
    assert force.shape == (5, 3)
    assert force[2, 1] == law.kernel(0.1, 3e5, *c)
    assert contractions(law.native_id, c, force, pressure) == pytest.approx(kappa + 0.0 * force, abs=1e-12)
    assert forces(law.native_id, c, 0.1, 3e5) == law.kernel(0.1, 3e5, *c)


def test_a_load_beyond_the_law_is_found_at_the_ends() -> None:
    law = LAWS["tondu_lopez_2000"]
    found = contractions(law.native_id, typical_coefficients(law), [1e9, -1e9], 3e5)
    assert found == pytest.approx([-0.2, 0.7], abs=1e-12)


@pytest.mark.parametrize("degrees", [15.0, 22.0, 37.0])
def test_a_locked_braid_encloses_nothing(degrees: float) -> None:
    braid = Braid(0.2, 0.01, math.radians(degrees))
    volume, slope = braid_volume(braid.lock, braid.nominal_length, braid.nominal_radius, braid.b)
    assert braid.lock < 0.0
    assert volume == pytest.approx(0.0, abs=1e-18)
    assert slope > 0.0


@pytest.mark.parametrize(("conductance", "critical"), [(5.5e-10, 0.3), (1e-9, 0.0), (2e-9, 0.9)])
def test_laminar_slope_is_the_flows_steepest(conductance: float, critical: float) -> None:
    def flow(difference: float) -> float:
        high, t = AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
        return valve_flow(high, t, high - difference, t, 1.0, conductance, critical)

    slope = laminar_slope(conductance, critical)
    assert flow(1.0) == pytest.approx(slope, rel=1e-9)
    differences = np.linspace(0.0, 0.99 * AMBIENT_PRESSURE, 3000)
    steps = np.diff([flow(d) for d in differences]) / np.diff(differences)
    assert steps.max() <= slope * (1.0 + 1e-9)

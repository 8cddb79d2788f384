"""Curves of laws, and a muscle behind what gives way: against scipy's root, in limits, compiled and not."""

import itertools
import math

import numba
import numpy as np
import pytest
from scipy.optimize import brentq

from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, names
from afo_sim.description import Muscle, at_rest, load
from afo_sim.physics import (
    LAWS,
    contractions,
    crossing,
    forces,
    laminar_slope,
    register_all,
    row,
    tension,
    tensions,
    valve_flow,
)


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
    c = law.typical
    kappa, pressure = np.linspace(0.0, 0.2, 5)[:, None], np.array([1e5, 3e5, 4e5])
    force = forces(law.native_id, c, kappa, pressure)
    assert force.shape == (5, 3)
    assert force[2, 1] == law.kernel(0.1, 3e5, *c)
    assert contractions(law.native_id, c, force, pressure) == pytest.approx(kappa + 0.0 * force, abs=1e-12)
    assert forces(law.native_id, c, 0.1, 3e5) == law.kernel(0.1, 3e5, *c)


def test_a_load_beyond_the_law_is_found_at_the_ends() -> None:
    law = LAWS["tondu_lopez_2000"]
    found = contractions(law.native_id, law.typical, [1e9, -1e9], 3e5)
    assert found == pytest.approx([-0.2, 0.7], abs=1e-12)


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


CUFF, STIFFENING = (4e3, 0.0, 0.0), (0.0, 33.0, 0.017)
CASES = [
    (20e3, 1.0, ()),
    (20e3, 3.0, (CUFF,)),
    (5e3, 2.0, (CUFF, STIFFENING)),
    (math.inf, 3.0, (STIFFENING,)),
]
PATH = np.linspace(-0.04, 0.3, 12)


def gives(pull: float, anchor: tuple[float, float, float]) -> float:
    """What an anchor gives, from its formula."""
    stiffness, force, length = anchor
    return pull / stiffness if stiffness else length * math.log(1.0 + pull / force)


def balanced(muscle: Muscle, path: float, gauge: float, k: float, count: float, anchors: tuple) -> float:  # type: ignore[type-arg]
    """Tension by a root in the tension, not in the contraction."""
    bare, length = at_rest(muscle), muscle.nominal_length

    def left(pull: float) -> float:
        given = pull / k + sum(gives(count * pull, anchor) for anchor in anchors)
        return bare.force(path + given / length, gauge) - pull

    most = bare.force(path, gauge)
    return float(brentq(left, 0.0, most, xtol=1e-12, rtol=1e-14)) if most > 0.0 else 0.0


@pytest.mark.parametrize("name", sorted(names("muscle")))
def test_tension_is_the_root_of_the_balance(name: str) -> None:
    muscle = load("muscle", name)
    for (k, count, anchors), gauge in itertools.product(CASES, (0.0, 0.6 * muscle.limits.pressure)):
        u = row(at_rest(muscle), k, count, anchors)
        found = tensions(PATH, np.full(len(PATH), gauge), u)
        expected = [balanced(muscle, float(x), gauge, k, count, anchors) for x in PATH]
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert found == pytest.approx([tension(float(x), gauge, u) for x in PATH], rel=1e-12, abs=1e-12)


def test_what_gives_way_lessens_the_tension_and_none_leaves_the_laws() -> None:
    muscle = load("muscle", "dmsp_20")
    bare = at_rest(muscle)
    own = np.array([bare.force(float(x), 3e5) for x in PATH])
    before = own
    for k in (1e9, 1e5, 1e4, 1e3):
        found = tensions(PATH, np.full(len(PATH), 3e5), row(bare, k))
        pulls = own > 1.0
        assert (found[pulls] < before[pulls]).all() and (found[~pulls] <= before[~pulls]).all()
        before = found
    rigid = tensions(PATH, np.full(len(PATH), 3e5), row(bare))
    assert rigid == pytest.approx(own, rel=1e-12)


def test_a_path_beyond_all_stroke_leaves_the_muscle_slack() -> None:
    u = row(at_rest(load("muscle", "dmsp_20")), 1e4)
    assert (tensions(np.array([0.5, 0.95, 3.0]), np.full(3, 3e5), u) == 0.0).all()


def test_what_is_not_a_number_comes_out() -> None:
    u = row(at_rest(load("muscle", "dmsp_20")), 1e4)
    assert np.isnan(tensions(np.array([np.nan]), np.array([3e5]), u)).all()

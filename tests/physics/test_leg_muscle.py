"""A leg's own muscle against its papers, and against an independent integration of its balance."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from afo_sim.physics import (
    activated,
    active_force,
    balanced_fibre,
    muscle_power,
    passive_force,
    tendon_force,
    velocity_factor,
)

SOLEUS = {"optimal": 0.044, "slack": 0.248, "width": math.sin(0.4939), "strain": 0.049}
FIBRE = {"fastest": 10.0, "damping": 0.1, "passive": 1.0}


def test_curves_pass_through_their_papers_points() -> None:
    # Thelen 2003: full force at the stated strain, a third of it at 0.609 of that; 1.4 in fast lengthening
    assert tendon_force(0.049, 0.049)[0] == pytest.approx(1.0, abs=0.01)
    assert tendon_force(0.609 * 0.049, 0.049)[0] == pytest.approx(1.0 / 3.0, abs=1e-3)
    assert tendon_force(-0.01, 0.049) == (0.0, 0.0)
    assert active_force(1.0) == (1.0, 0.0)
    assert active_force(1.5)[0] == pytest.approx(math.exp(-0.25 / 0.45))
    assert passive_force(1.6)[0] == pytest.approx(1.0)  # at 60 % of strain
    assert velocity_factor(0.0)[0] == 1.0 and velocity_factor(-1.0)[0] == 0.0
    assert velocity_factor(1e6)[0] == pytest.approx(1.4, abs=1e-4)


@pytest.mark.parametrize(
    ("curve", "points"),
    [
        (lambda x: tendon_force(x, 0.049), (0.001, 0.02, 0.0298, 0.0299, 0.06)),
        (active_force, (0.4, 0.9, 1.0, 1.4)),
        (passive_force, (0.9, 1.05, 1.5)),
        (velocity_factor, (-1.5, -0.9, -0.01, 0.01, 0.8)),
    ],
)
def test_slopes_are_those_of_the_curves(curve, points) -> None:  # type: ignore[no-untyped-def]
    for x in points:
        h = 1e-6
        difference = (curve(x + h)[0] - curve(x - h)[0]) / (2.0 * h)
        assert curve(x)[1] == pytest.approx(difference, rel=2e-3, abs=1e-6)


def _path(time: float) -> float:
    return 0.29 + 0.01 * math.sin(12.0 * time)


def _lacking(velocity: float, length: float, time: float, activation: float) -> float:
    """Fibre less tendon, written anew from the formulas."""
    straight = math.sqrt(length**2 - SOLEUS["width"] ** 2)
    strain = (_path(time) - SOLEUS["optimal"] * straight) / SOLEUS["slack"] - 1.0
    toe = 0.609 * 0.049
    tendon = 0.0
    if strain > 0.0:
        tendon = (math.exp(3.0 * strain / toe) - 1.0) / (math.exp(3.0) - 1.0) / 3.0
    if strain > toe:
        tendon = 1.0 / 3.0 + 1.712 / 0.049 * (strain - toe)
    v = velocity / 10.0
    hill = (1.0 + v) / (1.0 - 4.0 * v) if v <= 0.0 else (1.0 + 17.5 * v) / (1.0 + 12.5 * v)
    rest = (math.exp(4.0 * (length - 1.0) / 0.6) - 1.0) / (math.exp(4.0) - 1.0) if length > 1.0 else 0.0
    along = activation * math.exp(-((length - 1.0) ** 2) / 0.45) * max(hill, 0.0) + rest + 0.1 * v
    return along * straight / length - tendon


def test_a_fibre_follows_an_independent_integration_to_second_order() -> None:
    activation, until = 0.4, 0.2

    def rate(time: float, length: np.ndarray) -> list[float]:
        return [brentq(_lacking, -60.0, 60.0, args=(float(length[0]), time, activation), xtol=1e-13)]

    begun = brentq(lambda length: _lacking(0.0, length, 0.0, activation), 0.6, 1.6)
    exact = solve_ivp(rate, (0.0, until), [begun], rtol=1e-10, atol=1e-12, method="LSODA").y[0, -1]
    errors = []
    for count in (200, 400):
        step, length = until / count, begun
        velocity = rate(0.0, np.array([begun]))[0]
        for k in range(count):
            length, velocity, tension, along = balanced_fibre(
                _path((k + 1) * step), length, velocity, activation, step, **SOLEUS, **FIBRE
            )
        assert along * math.sqrt(length**2 - SOLEUS["width"] ** 2) / length == pytest.approx(
            tension, abs=1e-8
        )
        errors.append(abs(length - exact))
    assert errors[0] < 2e-4
    assert 3.0 < errors[0] / errors[1] < 5.0


def test_activation_is_the_exact_lag() -> None:
    assert activated(0.2, 1.0, 0.01) == pytest.approx(1.0 - 0.8 * math.exp(-1.0))
    assert activated(1.0, 0.2, 0.04) == pytest.approx(0.2 + 0.8 * math.exp(-1.0))
    assert activated(activated(0.1, 0.7, 0.003), 0.7, 0.004) == pytest.approx(activated(0.1, 0.7, 0.007))


def test_muscle_power_by_hand() -> None:
    # full excitation and activation at the optimal length: 40 s + 133 (1 − s) + 74 s + 111 (1 − s)
    heat, moving = muscle_power(1.0, 1.0, 1.0, -2.0, 0.9, 0.8, 0.5)
    assert heat == pytest.approx(0.5 * (40.0 + 133.0 + 74.0 + 111.0))
    assert moving == pytest.approx((0.25 * 0.9 + 0.8) * 2.0)
    assert muscle_power(0.0, 0.0, 1.0, 3.0, 0.9, 0.8, 0.5) == (0.0, 0.0)  # lengthening gives nothing back

"""Cable, guides and anchor of a muscle: against formulas, their inverse, and their limits."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from afo_sim.physics import (
    anchor_displacement,
    anchor_energy,
    anchor_force,
    cable_tension,
    capstan,
)
from afo_sim.physics.series import CREEP, turn

LINEAR = (4e3, 33.0, 0.017)  # stiffness [N/m], force [N], length [m]
STIFFENING = (0.0, 33.0, 0.017)  # a cuff on soft tissue
every_anchor = pytest.mark.parametrize("anchor", [LINEAR, STIFFENING], ids=["linear", "stiffening"])


def test_a_cable_only_pulls() -> None:
    assert cable_tension(2e-3, 1e5) == (200.0, 1e5)
    for stretch in (0.0, -1e-12, -1.0):
        assert cable_tension(stretch, 1e5) == (0.0, 0.0)
    assert math.isnan(cable_tension(math.nan, 1e5)[0])
    assert math.isnan(cable_tension(1e-3, math.nan)[0])


def test_anchors_by_hand() -> None:
    # 150 N on 4 kN/m; ln(1 + 150/33) = 1.7130 lengths of 17 mm
    assert anchor_displacement(150.0, *LINEAR, 0.0, 0.0, 0.0, 1e-3) == (
        pytest.approx(0.0375),
        pytest.approx(2.5e-4),
    )
    z, slope = anchor_displacement(150.0, *STIFFENING, 0.0, 0.0, 0.0, 1e-3)
    assert z == pytest.approx(0.029121, abs=1e-6)
    assert slope == pytest.approx(0.017 / 183.0)


@every_anchor
def test_an_undamped_anchor_inverts_its_law(anchor: tuple[float, ...]) -> None:
    for pull in (0.0, 1e-9, 1.0, 150.0, 3e3):
        z, slope = anchor_displacement(pull, *anchor, 0.0, 0.02, 7.0, 1e-3)  # whatever its past
        assert anchor_force(z, *anchor) == pytest.approx(pull, rel=1e-12, abs=1e-12)
        ahead = anchor_displacement(pull + 1e-3, *anchor, 0.0, 0.0, 0.0, 1e-3)[0]
        assert slope == pytest.approx((ahead - z) / 1e-3, rel=1e-3)


@every_anchor
def test_energy_is_the_work_of_the_force(anchor: tuple[float, ...]) -> None:
    for z in (0.0, 1e-3, 0.03):
        work = quad(lambda x: anchor_force(x, *anchor), 0.0, z)[0]
        assert anchor_energy(z, *anchor) == pytest.approx(work, rel=1e-10, abs=1e-15)


def pulled(anchor: tuple[float, ...], damping: float, step: float, duration: float) -> float:
    """Displacement under P = 80 (1 − cos 30 t) N, step by step, as its states are kept in act."""
    z, move = 0.0, 0.0
    for k in range(1, round(duration / step) + 1):
        last, pull = z, 80.0 * (1.0 - math.cos(30.0 * k * step))
        z, _ = anchor_displacement(pull, *anchor, damping, last, move, step)
        move = z - last
    return z


@every_anchor
def test_a_damped_anchor_follows_its_equation_to_second_order(anchor: tuple[float, ...]) -> None:
    """c ż = P − S(z), by an ODE solver."""

    def rate(time: float, z: np.ndarray) -> list[float]:
        elastic = anchor[0] * z[0] if anchor[0] else anchor[1] * math.expm1(z[0] / anchor[2])
        return [(80.0 * (1.0 - math.cos(30.0 * time)) - elastic) / 200.0]

    exact = solve_ivp(rate, (0.0, 0.16), [0.0], method="Radau", rtol=1e-11, atol=1e-14).y[0, -1]
    errors = [abs(pulled(anchor, 200.0, step, 0.16) - exact) for step in (2e-3, 1e-3, 5e-4)]
    assert errors[0] < 1e-3 * exact
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


@every_anchor
@pytest.mark.parametrize("step", [1e-3, 2e-3])
@pytest.mark.parametrize("taut_in", [0.1, 0.5, 1.0])
def test_a_damper_that_becomes_taut_at_once_does_not_swing(
    anchor: tuple[float, ...], step: float, taut_in: float
) -> None:
    """Pulled at v through a stiff cable it resists with c v, and never with 2 c v and nothing in turn.

    Two steps back it stood still: BDF2 makes 3/2 c v of a whole step's way, and c v after that. What differs
    dies away, and changes sides once at most.
    """
    damping, cable, speed = 400.0, 2e6, 0.02
    z, move, pulls = 0.0, 0.0, []
    for k in range(12):
        way = speed * step * (k + taut_in)
        pull = brentq(
            lambda p, z=z, move=move, way=way: (
                p - cable * (way - anchor_displacement(p, *anchor, damping, z, move, step)[0])
            ),
            0.0,
            cable * way,
        )
        last, z = z, anchor_displacement(pull, *anchor, damping, z, move, step)[0]
        move = z - last
        pulls.append(pull - anchor_force(z, *anchor))
    found = np.array(pulls) / (damping * speed)
    assert found[-1] == pytest.approx(1.0, abs=3e-3)
    assert found.max() < 1.5
    beside = found[1:] - found[-1]  # the first step may be taut in part
    assert np.abs(beside[2:]).max() < 0.1
    sides = np.sign(beside[np.abs(beside) > 1e-4])
    assert np.count_nonzero(np.diff(sides)) <= 1


@every_anchor
def test_a_damped_anchor_at_any_step(anchor: tuple[float, ...]) -> None:
    """Its slope is its derivative; thrown or released it stays finite."""
    for pull in (0.0, 1.0, 1e3, 1e5):
        for last in (0.0, 0.05):
            for step in (1e-5, 1e-3, 1e-1):
                move = 0.1 * last
                z, slope = anchor_displacement(pull, *anchor, 200.0, last, move, step)
                ahead = anchor_displacement(pull + 1e-2, *anchor, 200.0, last, move, step)[0]
                behind = anchor_displacement(pull - 1e-2, *anchor, 200.0, last, move, step)[0]
                assert math.isfinite(z)
                assert slope == pytest.approx((ahead - behind) / 2e-2, rel=1e-4)
                elastic = anchor_force(z, *anchor)
                left = pull - elastic - 200.0 * (3.0 * (z - last) - move) / (2.0 * step)
                assert left == pytest.approx(0.0, abs=1e-6 * max(pull, elastic, 1.0))


@every_anchor
def test_nan_comes_out(anchor: tuple[float, ...]) -> None:
    stiffness, force, length = anchor
    for damping in (0.0, 200.0):
        good = [150.0, stiffness, force, length, damping, 0.01, 1e-4, 1e-3]
        assert math.isfinite(anchor_displacement(*good)[0])
        unused = {2, 3} if stiffness else set()
        unused |= set() if damping else {5, 6, 7}
        for i in set(range(8)) - unused:
            bad = [*good[:i], math.nan, *good[i + 1 :]]
            assert math.isnan(anchor_displacement(*bad)[0]), (i, damping)
    for i in {0, 1} if stiffness else {0, 2, 3}:
        bad = [0.01, stiffness, force, length]
        bad[i] = math.nan
        assert math.isnan(anchor_force(*bad)), i


FAST = 0.05  # [m/s]


@pytest.mark.parametrize("friction", [0.05, 0.2, 0.6])
@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0, 270.0])
def test_a_sliding_cable_has_the_ratio_of_euler_and_eytelwein(friction: float, angle: float) -> None:
    for sign in (1.0, -1.0):
        behind, _ = capstan(80.0, friction, math.radians(angle), sign * FAST)
        assert behind == pytest.approx(80.0 * math.exp(sign * friction * math.radians(angle)), rel=1e-12)


def test_friction_takes_and_never_gives_and_grows_with_speed() -> None:
    speeds = np.linspace(-5.0 * CREEP, 5.0 * CREEP, 401)
    found = [capstan(80.0, 0.3, 1.2, float(w)) for w in speeds]
    behind, secant = np.array(found).T
    assert np.all((behind - 80.0) * speeds >= 0.0)  # the power that is taken
    assert np.all(np.diff(behind) > 0.0)
    assert np.all(secant > 0.0)
    assert np.all(np.abs(80.0 + secant * speeds - behind) < 1e-9)


def test_the_secant_at_rest_is_the_slope() -> None:
    step = 1e-4 * CREEP
    slope = (capstan(80.0, 0.3, 1.2, step)[0] - capstan(80.0, 0.3, 1.2, -step)[0]) / (2.0 * step)
    assert capstan(80.0, 0.3, 1.2, 0.0)[1] == pytest.approx(slope, rel=1e-6)


def test_a_nan_stays_one() -> None:
    assert all(math.isnan(x) for x in capstan(math.nan, 0.3, 1.2, FAST))


def test_turn_is_the_angle_between_two_directions() -> None:
    for degrees in (0.0, 1e-4, 45.0, 90.0, 179.9):
        angle = math.radians(degrees)
        found = turn(2.0, 0.0, 0.0, 3.0 * math.cos(angle), 0.0, 3.0 * math.sin(angle))
        assert found == pytest.approx(angle, abs=1e-15)
    assert turn(2.0, 0.0, 0.0, -1.0, 0.0, 0.0) == pytest.approx(math.pi)
    draw = np.random.default_rng(3)
    for first, second in draw.normal(size=(20, 2, 3)):  # anywhere in space
        cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
        assert turn(*map(float, (*first, *second))) == pytest.approx(math.acos(cosine), rel=1e-9)

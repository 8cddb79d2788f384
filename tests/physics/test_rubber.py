"""A rubber tube inside a braid: its energy's derivative, closed forms at rest, and where it stays."""

import math

import numpy as np
import pytest

from afo_sim.common import InputError
from afo_sim.description import at_rest, load
from afo_sim.physics import LAWS, AtRest, rubber_force, turning

ANGLES = (6.0, 15.0, 22.0, 30.0, 45.0)  # [deg]
TUBE = {"tube": {"modulus": "1.2 MPa", "wall_thickness": "0.8 mm"}}
BARE = {"tube": None}


def b_of(degrees: float) -> float:
    return 1.0 / math.sin(math.radians(degrees)) ** 2


def energy(contraction: complex, degrees: float) -> complex:
    """W/μ of three principal stretches: along, around by the threads of constant length, and across."""
    angle, along = math.radians(degrees), 1.0 - contraction
    around = (1.0 - (along * math.cos(angle)) ** 2) ** 0.5 / math.sin(angle)
    across = 1.0 / (along * around)
    return 0.5 * (along**2 + around**2 + across**2 - 3.0)


@pytest.mark.parametrize("degrees", ANGLES)
def test_tension_is_the_derivative_of_the_energy(degrees: float) -> None:
    """T = A dW/dλ = −A dW/dκ, by a complex step, which takes no difference."""
    b = b_of(degrees)
    for kappa in np.linspace(0.0, turning(b), 23):
        expected = -7.0 * energy(complex(kappa, 1e-30), degrees).imag / 1e-30
        found = rubber_force(kappa, 7.0, b, turning(b))[0]
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * b * b)


@pytest.mark.parametrize("degrees", ANGLES)
def test_at_rest_it_pulls_not_and_has_the_slope_of_small_strains(degrees: float) -> None:
    """W = μ (ε1² + ε2² + ε3²) with ε = −κ, (b − 1) κ and −(b − 2) κ, so that T′ = −2 A μ Σ(ε/κ)²."""
    b = b_of(degrees)
    expected = -2.0 * 7.0 * (1.0 + (b - 1.0) ** 2 + (b - 2.0) ** 2)
    for kappa in (0.0, -1e-12):
        force, slope = rubber_force(kappa, 7.0, b, turning(b))
        assert force == pytest.approx(expected * kappa, abs=1e-12 * b)
        assert slope == pytest.approx(expected, rel=1e-9)
    assert rubber_force(-0.03, 7.0, b, turning(b))[0] == pytest.approx(-0.03 * expected, rel=1e-12)


@pytest.mark.parametrize("degrees", ANGLES)
def test_it_falls_and_its_slope_is_that_of_the_force(degrees: float) -> None:
    b, h = b_of(degrees), 1e-6
    turn = turning(b)
    kappa = np.linspace(-0.05, 0.95, 2001)
    force = np.array([rubber_force(each, 7.0, b, turn)[0] for each in kappa])
    assert (np.diff(force) <= 0.0).all() and (force[kappa > 0.0] < 0.0).all()
    for each in (-0.02, 0.01, 0.4 * turn, 0.9 * turn, turn + 0.02):
        around = [rubber_force(each + d, 7.0, b, turn)[0] for d in (-h, h)]
        slope = (around[1] - around[0]) / (2.0 * h)
        assert rubber_force(each, 7.0, b, turn)[1] == pytest.approx(slope, rel=1e-6, abs=1e-5)


def test_braids_of_26_degrees_and_more_never_turn() -> None:
    """There T falls up to where the braid cannot go; at 22° it would take 9 % less at 38 % than at 17 %."""
    assert turning(b_of(26.0)) > 0.89 and turning(b_of(25.0)) < 0.3
    turn = turning(b_of(22.0))
    held, free = (rubber_force(0.377, 1.0, b_of(22.0), end)[0] for end in (turn, 0.89))
    assert held / free == pytest.approx(1.0975, abs=1e-3)


NAMES = ("handmade_10mm", "dmsp_10", "pleated_110mm")
SETS = [(name, law) for name in NAMES for law in load("muscle", name).laws]


@pytest.mark.parametrize(("name", "law"), SETS)
def test_every_law_falls_with_a_tube_that_it_does_not_know(name: str, law: str) -> None:
    """Laws with a rubber of their own, or without a braid, are what they are without one."""
    with_tube, bare = (load("muscle", name, sets).using(law=law) for sets in (TUBE, BARE))
    forces = [at_rest(each).signed for each in (with_tube, bare)]
    if LAWS[law].rubber:
        assert law in ("tondu_lopez_2000_bladder", "martens_boblan_2017", "daerden_lefeber_2001")
        assert [forces[0](k, 2e5) for k in (-0.01, 0.1)] == [forces[1](k, 2e5) for k in (-0.01, 0.1)]
        return
    for pressure in (0.0, 3e4, 1.5e5, 4e5):
        force = np.array([forces[0](kappa, pressure) for kappa in np.linspace(-0.02, 0.5, 400)])
        assert (np.diff(force) < 1e-9).all()
    radius, wall, b = with_tube.bore / 2.0, 0.8e-3, with_tube.braid.b
    stiffness = math.pi * (radius**2 - (radius - wall) ** 2) * 1.2e6 / 3.0
    for kappa in (-0.01, 0.02, 0.1):
        taken = rubber_force(kappa, stiffness, b, turning(b))[0]
        assert forces[0](kappa, 2e5) - forces[1](kappa, 2e5) == pytest.approx(taken, rel=1e-9)


def test_a_law_that_is_fitted_in_a_device_is_fitted_with_the_rubber() -> None:
    """`at_rest` with other parameters, as fits of devices ask it: the tube takes what it took."""
    with_tube, bare = (at_rest(load("muscle", "handmade_10mm", s), {"k": 1.3}) for s in (TUBE, BARE))
    taken = rubber_force(0.1, *_of(with_tube))[0]
    assert with_tube.signed(0.1, 3e5) - bare.signed(0.1, 3e5) == pytest.approx(taken, rel=1e-9)
    assert taken < -10.0


def _of(bare: AtRest) -> tuple[float, float, float]:
    return bare.rubber[0], bare.braid.b, bare.rubber[1]


def test_a_soft_thin_tube_is_none() -> None:
    """The least that can be described, 0.1 mm of 0.05 MPa, takes next to nothing, in proportion."""
    found = []
    for modulus in ("0.05 MPa", "0.1 MPa"):
        tube = {"tube": {"modulus": modulus, "wall_thickness": "0.1 mm"}}
        found.append(load("muscle", "handmade_10mm", tube).force("2 bar", contraction=0.1))
    bare = load("muscle", "handmade_10mm", BARE).force("2 bar", contraction=0.1)
    assert 0.0 < bare - found[0] < 0.5
    assert bare - found[1] == pytest.approx(2.0 * (bare - found[0]), rel=1e-9)


def test_the_measured_free_contraction_includes_the_tube() -> None:
    """The whole muscle goes slack at its own free contraction, at the pressure of its test."""
    sets = {"free_contraction": 0.25, "test_pressure": "3 bar"}
    for tube in (BARE, TUBE):
        muscle = load("muscle", "handmade_10mm", sets | tube)
        assert muscle.contraction("3 bar", force=0.0) == pytest.approx(0.25, abs=1e-9)
    stiff = {"tube": {"modulus": "20 MPa", "wall_thickness": "3 mm"}}
    with pytest.raises(InputError) as refused:
        load("muscle", "handmade_10mm", sets | stiff)
    assert refused.value.field == "free_contraction"


@pytest.mark.parametrize("wall", ["5 mm", "6 mm"])
def test_a_tube_without_air_is_refused(wall: str) -> None:
    with pytest.raises(InputError) as refused:
        load("muscle", "handmade_10mm", {"tube": {"modulus": "1 MPa", "wall_thickness": wall}})
    assert refused.value.field == "tube.wall_thickness"


def test_volume_is_the_bores_and_stays_above_the_dead_volume() -> None:
    """π (r0 − t)² L0 at rest; where the braid squeezes the rubber, no air but the dead volume is left."""
    muscle = load("muscle", "handmade_10mm", TUBE)
    bore = math.pi * (5e-3 - 0.8e-3) ** 2 * muscle.nominal_length
    assert muscle.volume(contraction=0.0) == pytest.approx(bore + muscle.dead_volume, rel=1e-12)
    assert muscle.volume(contraction=muscle.braid.lock) == pytest.approx(muscle.dead_volume, rel=1e-9)
    assert (np.diff(muscle.volume(contraction=np.linspace(muscle.braid.lock, 0.3, 50))) >= 0.0).all()

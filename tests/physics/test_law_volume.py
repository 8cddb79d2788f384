"""Volume of a muscle by its law: Maxwell's relation, what is plausible, and the slopes that are said."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf

from afo_sim import load
from afo_sim.cli.doctor import parts as doctor
from afo_sim.common import names
from afo_sim.description import Muscle, at_rest
from afo_sim.physics import LAWS

BY_LAW = (
    *(("dmsp_10", law) for law in ("sarosi_2012", "tondu_lopez_2000", "maximum_force", "polynomial")),
    *(("dmsp_10", law) for law in ("martens_boblan_2017", "bolen_2026")),
    *(("dmsp_20", law) for law in ("sarosi_2012", "takosoglu_2016", "polynomial", "bolen_2026")),
)


def muscle(name: str, law: str) -> Muscle:
    return load("muscle", name).using(law=law)


def volume(of: Muscle, contraction: float, pressure: float) -> float:
    """Without its ends."""
    return float(of.volume(contraction=contraction, pressure=pressure)) - of.dead_volume


@pytest.mark.parametrize(("name", "law"), BY_LAW)
def test_volume_grows_as_the_force_grows_with_pressure(name: str, law: str) -> None:
    """∂V/∂κ = L0 ∂F/∂p, of the force as the muscle is asked for it, return force included."""
    of, h = muscle(name, law), 20.0
    force, length = at_rest(of).signed, of.nominal_length
    full = math.pi * of.bore**2 / 4.0 * length
    for pressure in (0.4e5, 1.5e5, 3e5, 5.5e5):
        slack = min(float(of.contraction(pressure, force=0.0)), 0.2)

        def rate(kappa: float, pressure: float = pressure) -> float:
            return (force(kappa, pressure + h) - force(kappa, pressure - h)) / (2.0 * h)

        for kappa in (0.3 * slack, 0.95 * slack):
            expected = full + length * quad(rate, 0.0, kappa, limit=200, epsrel=1e-6)[0]
            if pressure < of.law_set.pressure_range[0]:  # less what the clamp of low pressures takes
                assert volume(of, kappa, pressure) == pytest.approx(expected, rel=0.01)
            else:
                assert volume(of, kappa, pressure) == pytest.approx(expected, rel=2e-3)


def test_closed_forms() -> None:
    """Sárosi's exponential and Bolen's bell, integrated by hand."""
    of = muscle("dmsp_20", "sarosi_2012")
    a1, _, a3, a4, a5, _ = of.coefficients
    full, x = math.pi * of.bore**2 / 4.0 * of.nominal_length, 20.0  # contraction in per cent
    by_bar = a1 / a3 * math.expm1(a3 * x) + a4 * x * x / 2.0 + a5 * x
    assert volume(of, 0.2, 3e5) == pytest.approx(full + of.nominal_length * by_bar * 1e-2 * 1e-5, rel=1e-5)
    of = muscle("dmsp_20", "bolen_2026")
    force, most, _, _, c2 = of.coefficients
    bell = most * math.sqrt(math.pi / c2) / 2.0 * erf(math.sqrt(c2) * 0.2 / most) * force / 620e3
    assert volume(of, 0.2, 3e5) == pytest.approx(full + of.nominal_length * bell, rel=1e-5)


def test_volume_that_measured_forces_ask_for() -> None:
    """V/V0 from the force map of a DMSP-20-300: 21 pressures by 6 lengths, straight over the pressure.

    Measured by Martens & Boblan 2017, doi 10.3390/act6040033, as transcribed in public code.
    """
    measured = {0.05: 1.40, 0.10: 1.72, 0.15: 1.98, 0.20: 2.16}
    for law in ("sarosi_2012", "martens_boblan_2017", "polynomial", "maximum_force"):
        of = muscle("dmsp_20", law)
        full = math.pi * of.bore**2 / 4.0 * of.nominal_length
        for kappa, ratio in measured.items():
            assert volume(of, kappa, 4e5) / full == pytest.approx(ratio, rel=0.03), (law, kappa)


def test_implausible_volumes_are_the_braids_and_say_so() -> None:
    for name, law in (
        ("dmsp_10", "kerscher_2006"),
        ("dmsp_20", "takosoglu_2016_n"),
        ("dmsp_20", "takosoglu_2016_an"),
        ("reynolds_2003", "reynolds_2003"),
        ("serres_2009", "serres_2009"),
    ):
        of = muscle(name, law)
        assert of.law_volume.reason and not any(of.law_volume.numbers)
        assert dict(doctor.muscle(of))["volume"] == f"of the braid: {of.law_volume.reason}"
        braid, x = of.braid, 0.85
        full = math.pi * braid.nominal_radius**2 * braid.nominal_length
        assert volume(of, 0.15, 3e5) == pytest.approx(full * x * (braid.b - (braid.b - 1.0) * x * x))


def test_s1s_law_is_the_braids() -> None:
    """With an end correction of 1 both formulas are one, and nothing is fitted."""
    for name in names("muscle"):
        found = load("muscle", name)
        if LAWS[found.law].braids and found.law_set.parameters.get("k", 1.0) == 1.0:
            assert found.law_volume == ((0.0,) * len(found.law_volume.numbers), "")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "law"), BY_LAW)
def test_volume_has_no_jump_and_stays_positive(name: str, law: str) -> None:
    of = muscle(name, law)
    for pressure in (-2e4, 0.0, 1e5, 3e5, 2e6):
        kappas = np.linspace(0.999 * of.braid.lock, 0.9, 4001)
        found = np.array([volume(of, kappa, pressure) for kappa in kappas.tolist()])
        assert (found >= 0.0).all()
        assert np.abs(np.diff(found)).max() < 0.01 * found.max()


@pytest.mark.parametrize("stiffness", [20.0, 200.0, 1e3, 1e5])
def test_more_air_always_presses_more(stiffness: float) -> None:
    """σ = p V^γ rises with p at every contraction, however stiff the return force: there is one pressure."""
    of = load("muscle", "dmsp_20", {"return_stiffness": f"{stiffness} N"})
    gauges = np.linspace(-0.9e5, 3e5, 200)
    for kappa in np.linspace(-0.05, 0.25, 13).tolist():
        sigma = (gauges + 101_325.0) * of.volume(contraction=kappa, pressure=gauges) ** 1.4
        assert (np.diff(sigma) > 0.0).all()


def test_a_range_beyond_where_the_volume_falls_changes_nothing_within() -> None:
    """The law's force is the same; its volume ends where it would fall."""
    own = muscle("dmsp_20", "sarosi_2012")
    for end in (0.54, 0.55, 0.56, 0.58):
        wide = load("muscle", "dmsp_20", {"laws.sarosi_2012.contraction_range": [0.0, end]})
        assert not wide.law_volume.reason
        for kappa in (0.1, 0.25):
            assert volume(wide, kappa, 3e5) == pytest.approx(volume(own, kappa, 3e5), rel=1e-3)


@pytest.mark.parametrize("end", [-0.01, 0.0])
def test_a_range_without_contraction_has_the_braids_volume_and_says_so(end: float) -> None:
    sets = {"law": "tondu_lopez_2000", "laws.tondu_lopez_2000.contraction_range": [-0.05, end]}
    assert "range of contraction" in load("muscle", "dmsp_20", sets).law_volume.reason

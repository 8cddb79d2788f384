"""A muscle's own free contraction, blocked force, factors and ends: every law goes through them, and pays."""

import dataclasses

import numpy as np
import pytest

import afo_sim as afo
from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.lab.stand import stand
from afo_sim.physics import LAWS

ENDS = {"free_contraction": 0.165, "blocked_force": "420 N"}
LAWS_OF_10 = tuple(load("muscle", "dmsp_10").laws)


@pytest.mark.parametrize("law", LAWS_OF_10)
def test_every_law_goes_through_the_two_ends(law: str) -> None:
    muscle = load("muscle", "dmsp_10", ENDS | {"law": law})
    assert muscle.force("6.2 bar", contraction=0.0) == pytest.approx(420.0, rel=1e-9)
    assert muscle.contraction("6.2 bar", force=0.0) == pytest.approx(0.165, abs=1e-9)
    bare = load("muscle", "dmsp_10", {"law": law})
    free = bare.contraction("6.2 bar", force=0.0)
    strength = bare.force("6.2 bar", contraction=0.0)
    kappa = np.array([0.02, 0.08, 0.15])
    expected = bare.force("6.2 bar", contraction=kappa * free / 0.165) * 420.0 / strength
    assert muscle.force("6.2 bar", contraction=kappa) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("law", LAWS_OF_10)
def test_a_stretched_muscle_keeps_its_braid(law: str) -> None:
    """Stretch is not scaled by a free contraction: the braid carries it as before."""
    muscle = load("muscle", "dmsp_10", {"free_contraction": 0.165, "law": law})
    bare = load("muscle", "dmsp_10", {"law": law})
    assert (
        muscle.force("3 bar", contraction=[-0.02, -0.004]).tolist()
        == bare.force("3 bar", contraction=[-0.02, -0.004]).tolist()
    )


@pytest.mark.parametrize("law", ["sarosi_2012", "tondu_lopez_2000", "bolen_2026", "polynomial"])
def test_the_volume_is_the_scaled_laws(law: str) -> None:
    """Maxwell's relation ∂V/∂κ = L0 ∂F/∂p, by differences of two curves that do not know of each other."""
    muscle = load("muscle", "dmsp_10", {"law": law, "free_contraction": 0.165})
    assert not muscle.law_volume.reason
    for kappa in (0.02, 0.05, 0.07):
        volume = muscle.volume(contraction=[kappa - 1e-4, kappa + 1e-4], pressure=4e5)
        force = muscle.force([4e5 - 1e3, 4e5 + 1e3], contraction=kappa)
        by_pressure = (force[1] - force[0]) / 2e3
        strength = muscle.force(4e5, contraction=0.0)
        assert (volume[1] - volume[0]) / 2e-4 == pytest.approx(
            muscle.nominal_length * by_pressure, abs=0.01 * muscle.nominal_length * strength / 4e5
        )


def test_the_compiled_muscle_has_them_too() -> None:
    muscle = load("muscle", "dmsp_10", ENDS)
    (trial,) = stand("isometric", muscle, contraction=[0.05, 0.12], time="8 s").trials
    assert max(m["off_formula_share"].value for m in trial.metrics) < 0.5
    assert trial.curves[1]["force"].max() > 20.0


def test_a_run_honours_them_and_keeps_its_energy() -> None:
    key = "orthosis.muscle.dorsiflexor.type.free_contraction"
    found = [afo.run("seated", {"duration": "2 s"} | more) for more in ({}, {key: 0.2})]
    bare, own = (run.metrics["peak_dorsiflexion_angle"] for run in found)
    assert own < bare - 1.0  # less stroke, less angle [deg]
    assert abs(found[1].metrics["energy_error"]) < 1e-3  # [%]


def test_without_ends_nothing_is_scaled_and_they_are_written_and_read() -> None:
    bare = load("muscle", "dmsp_10")
    assert bare.contraction_scale == 1.0
    assert bare.coefficients == LAWS[bare.law].coefficients(bare.braid, bare.law_set.parameters)
    muscle = load("muscle", "dmsp_10", ENDS)
    again = load("muscle", muscle.model_dump(mode="json"))
    assert again == muscle and again.row == muscle.row
    assert muscle.contraction_range[1] == pytest.approx(0.25 / muscle.contraction_scale)


def test_an_end_that_a_law_cannot_have_is_refused() -> None:
    weak = {"laws.sarosi_2012.a6": -600.0, "test_pressure": "1 bar"}
    for end in ({"free_contraction": 0.2}, {"blocked_force": "300 N"}):
        with pytest.raises(InputError, match="does not pull at 1 bar"):
            load("muscle", "dmsp_10", weak | end)
    with pytest.raises(InputError, match=r"0\.6"):
        load("muscle", "dmsp_10", {"free_contraction": 0.7})


@pytest.mark.parametrize("law", LAWS_OF_10)
def test_a_factor_on_the_force_is_on_every_force(law: str) -> None:
    """At every contraction and pressure, also on a force that was measured."""
    bare, strong = (load("muscle", "dmsp_10", {"law": law, "force_factor": f}) for f in (1.0, 2.0))
    kappa = np.linspace(0.0, 0.12, 7)
    for pressure in ("3 bar", "6 bar"):
        expected = 2.0 * bare.force(pressure, contraction=kappa)
        assert strong.force(pressure, contraction=kappa) == pytest.approx(expected, rel=1e-9)
    with_blocked = load("muscle", "dmsp_10", {"law": law, "force_factor": 0.8, "blocked_force": "400 N"})
    assert with_blocked.force("6.2 bar", contraction=0.0) == pytest.approx(320.0, rel=1e-9)


def test_the_volume_of_a_stronger_muscle_pays_for_its_work() -> None:
    """ΔV = L0 ∫ ∂F/∂p dκ: what air gives goes with the factor, however far it is from 1."""
    kappa, gauges = np.linspace(0.0, 0.1, 401), (2.9e5, 3.1e5)
    for factor in (0.5, 0.85, 1.15, 2.0):
        muscle = load("muscle", "dmsp_20", {"law": "sarosi_2012", "force_factor": factor})
        assert not muscle.law_volume.reason
        grown = np.ptp(muscle.volume(contraction=[0.0, 0.1], pressure=3e5))
        low, high = (muscle.force(p, contraction=kappa) for p in gauges)
        work = muscle.nominal_length * np.trapezoid((high - low) / 2e4, kappa)
        assert grown == pytest.approx(work, rel=2e-3)


@pytest.mark.parametrize("law", LAWS_OF_10)
def test_a_factor_on_the_contraction_is_on_that_without_load(law: str) -> None:
    for ends in ({}, {"free_contraction": 0.165}):
        bare = load("muscle", "dmsp_10", ends | {"law": law})
        short = load("muscle", "dmsp_10", ends | {"law": law, "contraction_factor": 0.9})
        free = bare.contraction("6.2 bar", force=0.0)
        assert short.contraction("6.2 bar", force=0.0) == pytest.approx(0.9 * free, abs=1e-9)
        assert short.force("3 bar", contraction=0.0) == bare.force("3 bar", contraction=0.0)


def _pull(name: str, **sets: object) -> float:
    return float(load("muscle", name, sets).force("3 bar", contraction=0.05))


def test_ends_weaken_short_muscles_more() -> None:
    """By hand: F ∝ 1 − d/L0 of one piece, whose L0 is the braid between the fittings."""
    ends = {"end_loss": "15 mm"}
    for total, length in (("20 cm", 180.0), ("12 cm", 100.0)):  # 2 cm are clamps
        sets = {"tube": None, "total_length": total}  # which takes the same newtons of any length
        share = _pull("handmade_10mm", **sets, **ends) / _pull("handmade_10mm", **sets)
        assert share == pytest.approx(1.0 - 15.0 / length, rel=1e-12)
    # three pieces of 60 mm
    sets = {"tube": None, "pieces": 3}
    share = _pull("handmade_10mm", **sets, **ends) / _pull("handmade_10mm", **sets)
    assert share == pytest.approx(0.75, rel=1e-12)
    # a maker's curve has the maker's ends: others weaken it at its own length, too
    for total, left in (("30 cm", 0.95), ("15 cm", 0.9)):
        sets = {"total_length": total}
        share = _pull("dmsp_20", **sets, **ends) / _pull("dmsp_20", **sets)
        assert share == pytest.approx(left, rel=1e-12)


def test_ends_count_once() -> None:
    """Not beside a force that was measured with them, nor a law that knows the length, nor lengths.force."""
    ends = {"end_loss": "15 mm"}
    for name, wrong in (
        ("dmsp_20", ends | {"total_length": "15 cm", "blocked_force": "1200 N"}),
        ("dmsp_20", ends | {"law": "bolen_2026", "total_length": "35 cm"}),
        ("dmsp_10", ends),
        ("dmsp_20", {"total_length": "8 cm", "end_loss": "8 cm"}),
        ("handmade_10mm", {"pieces": 3, "end_loss": "61 mm"}),
    ):
        with pytest.raises(InputError) as refused:
            load("muscle", name, wrong)
        assert refused.value.field == "end_loss"


def test_force_and_ends_of_a_law_without_powers_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    bare = dataclasses.replace(LAWS["sarosi_2012"], force_powers=())
    monkeypatch.setitem(LAWS, "sarosi_2012", bare)
    for key, value in (("force_factor", 0.9), ("end_loss", "1 mm")):
        with pytest.raises(InputError) as refused:
            load("muscle", "dmsp_20", {key: value})
        assert refused.value.field == key
    assert load("muscle", "dmsp_20", {"force_factor": 1.0, "contraction_factor": 0.9}).contraction_scale > 1.0


def test_what_was_measured_on_this_very_muscle() -> None:
    """What states a source of the user's or a fit's; a number tried by hand, assumed or published is none."""

    def measured(**kinds: str) -> frozenset[str]:
        values = {"blocked_force": "400 N", "free_contraction": 0.2, "force_factor": 1.0}
        told = {k: {"value": values[k], "kind": kind, "source": "x"} for k, kind in kinds.items()}
        return load("muscle", "dmsp_10", told).measured

    assert measured() == load("muscle", "dmsp_10", ENDS | {"grade": "A"}).measured == frozenset()
    assert measured(blocked_force="user") == measured(force_factor="fitted") == {"force"}
    assert measured(free_contraction="user") == {"contraction"}
    for kind in ("published", "derived", "assumed"):
        assert measured(blocked_force=kind, free_contraction=kind) == frozenset()

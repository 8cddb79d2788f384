"""A muscle's own free contraction and blocked force: every law goes through them, and pays for its volume."""

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

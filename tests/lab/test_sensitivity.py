"""Sensitivity of a muscle to its braid, against the closed forms of the published geometric laws."""

import numpy as np
import pytest
from command import Call

from afo_sim.description import load
from afo_sim.lab.stand import sensitivity

PRESSURE = 3e5
SHARES = np.array([0.9, 1.0, 1.1])


def braid(length: np.ndarray, radius: np.ndarray, angle: np.ndarray, kappa: float) -> list[np.ndarray]:
    """Force, free contraction, stiffness of a thin braid, Chou & Hannaford 1996 and Tondu & Lopez 2000.

    F = π r0² p [a (1 − κ)² − b], a = 3/tan²α0, b = 1/sin²α0; it is zero at a braid angle of 54.74°,
    cos α = (1 − κ) cos α0 = 1/√3; dF/dL = 2 π r0² p a (1 − κ)/L0.
    """
    area, a, b = np.pi * radius**2 * PRESSURE, 3.0 / np.tan(angle) ** 2, 1.0 / np.sin(angle) ** 2
    free = 1.0 - 1.0 / (np.sqrt(3.0) * np.cos(angle))
    return [area * (a * (1.0 - kappa) ** 2 - b), free, 2.0 * area * a * (1.0 - kappa) / length]


@pytest.mark.parametrize("law", ["chou_hannaford_1996", "tondu_lopez_2000"])
@pytest.mark.parametrize("kappa", [0.0, 0.12])
def test_sensitivities_are_those_of_the_closed_form(law: str, kappa: float) -> None:
    """One of angle, length, bore at a time; with a thin wall and k = 1 both laws are the same curve."""
    sets = {"law": law, "tube": None, "laws.tondu_lopez_2000.k": 1.0}
    sets["laws.chou_hannaford_1996.wall_thickness"] = "0 mm"
    muscle = load("muscle", "handmade_10mm", sets)
    found, same = sensitivity(muscle, PRESSURE, kappa), np.ones(3)
    own = {
        "braid length": (muscle.total_length - muscle.end_length) * same,
        "bore": 0.5 * muscle.bore * same,
        "braid angle": muscle.braid_angle * same,
    }
    for changed, values in own.items():
        expected = braid(*(own | {changed: values * SHARES}).values(), kappa)
        for name, wanted in zip(
            ("force [N]", "free contraction [-]", "stiffness [N/m]"), expected, strict=True
        ):
            assert found[f"{name} by {changed}"] == pytest.approx(wanted * same, rel=1e-5), (name, changed)
    assert len(found) == 9


def test_bore_and_length_act_by_their_powers_and_the_bladder_beside_the_braid() -> None:
    """Force goes with bore², stiffness with 1/length; S1's bladder takes F0 + K_b κ newtons, of any bore."""
    muscle = load("muscle", "s1_215mm")
    found = sensitivity(muscle, PRESSURE)
    bare = sensitivity(load("muscle", "handmade_10mm", {"tube": None}), PRESSURE)
    assert bare["force [N] by bore"] / bare["force [N] by bore"][1] == pytest.approx(SHARES**2)
    wanted, *_ = braid(np.array(1.0), 0.5 * muscle.bore * SHARES, np.array(muscle.braid_angle), 0.0)
    assert found["force [N] by bore"] == pytest.approx(wanted - 136.0, rel=1e-9)
    for each in (found, bare):
        stiffness = each["stiffness [N/m] by braid length"]
        assert stiffness * SHARES == pytest.approx([stiffness[1]] * 3, rel=1e-6)
        assert np.ptp(each["force [N] by braid length"]) == pytest.approx(0.0, abs=1e-9)


def test_the_command_prints_the_numbers_and_refuses_what_does_not_act(call: Call) -> None:
    code, out, err = call("stand", "sensitivity", "s1_215mm", "dmsp_20", "--pressure", "2 bar")
    assert (code, err) == (0, "") and out.count("stiffness [N/m] by bore") == 2
    muscle = load("muscle", "s1_215mm")
    row = next(line.split() for line in out.splitlines() if line.startswith("force [N] by bore"))
    assert float(row[5]) == pytest.approx(muscle.force("2 bar", contraction=0.0), rel=1e-3)
    for options, says in ((("--load", "20 N"), "load"), (("--pressure", "9 bar"), "--pressure")):
        code, _, err = call("stand", "sensitivity", "s1_215mm", *options)
        assert code == 2 and says in err and len(err.splitlines()) == 1

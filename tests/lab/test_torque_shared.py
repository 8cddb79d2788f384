"""What no interval of a torque fit holds: shared errors, held stiffnesses, another fit's covariance."""

import numpy as np
import pytest
from campaign import size
from devices import device

from afo_sim.common import with_code
from afo_sim.description import reader
from afo_sim.lab import TorqueFit, fit_torque, paths, statics
from afo_sim.lab.torque_report import as_json, tables

ANGLE = np.tile(np.radians(np.linspace(-18.0, 12.0, 11)), 3)
GAUGE = np.repeat([2e5, 3e5, 4e5], 11)


def fitted(
    change: dict[str, float], fit: tuple[str, ...], name: str, chamber: str, noise: float = 0.0, seed: int = 1
) -> TorqueFit:
    orthosis = reader.load("orthosis", name)
    torque = statics(orthosis, paths(orthosis, ANGLE), chamber, GAUGE, change)[0]
    torque = torque + np.random.default_rng(seed).normal(0.0, noise, len(torque))
    data = {"angle [rad]": ANGLE, "pressure [Pa]": GAUGE, "torque [N*m]": torque}
    return fit_torque(data, name, fit, chamber=chamber, hold_out="none")


def test_an_angles_zero_passes_for_offset_over_a_pulley() -> None:
    """An angle δ and a length r δ are one: no residual tells them apart, so the fit says what it costs."""
    orthosis = reader.load("orthosis", "arm_s1")
    pulley = orthosis.muscle["flexor"].pulley
    assert pulley is not None
    found = fitted(device(20e3, 4e-3), ("series_stiffness", "offset"), "arm_s1", "flexor")
    moved = {each.cause: each.values for each in found.shared}["all angles 1 deg higher"]
    assert moved["offset"] == pytest.approx(4e-3 - pulley.moment_arm * np.radians(1.0), abs=1e-7)
    assert moved["series_stiffness"] == pytest.approx(20e3, rel=1e-3)
    assert as_json(found)["shared_errors"]["all angles 1 deg higher"] == moved
    (shown,) = [rows for title, _, rows in tables(found) if title.startswith("not in the intervals")]
    assert [row[0] for row in shown][:1] == ["all angles 1 deg higher"]


def test_a_stiffness_that_stands_on_an_assumed_cuff_is_warned_of() -> None:
    """Three muscles see 1/k + 3/k_cuff + 3/k_plate and no more: what the cuff gains, the cables lose."""
    fit = ("series_stiffness", "offset")
    found = fitted(device(40e3, 3e-3), fit, "s1", "dorsiflexor", noise=0.02)
    fit_of_cuff = {each.held: each for each in found.shared}["cuff_stiffness"]
    own = 4e3
    softer = 1.0 / found.parameters["series_stiffness"] + 3.0 / own - 3.0 / (1.1 * own)
    assert 1.0 / fit_of_cuff.values["series_stiffness"] == pytest.approx(softer, rel=1e-3)
    assert found.intervals["series_stiffness"] is not None
    assert any("series_stiffness depends on cuff_stiffness" in warning for warning in found.warnings)
    assert with_code(found.warnings, "depends-on-held")
    alone = fitted(
        device(offset=3e-3, cuff_stiffness=6e3), ("offset", "cuff_stiffness"), "s1", "dorsiflexor", 0.1
    )
    assert not any(warning.code == "depends-on-held" for warning in alone.warnings)
    assert "scatter alone" in alone.source(alone.problem.free[0])


def test_a_refitted_law_drops_the_covariance_of_the_fit_before() -> None:
    before = reader.load("orthosis", "arm_s1").muscle["flexor"].type
    assert before.covariance is not None
    found = fitted(device(20e3, bladder_force=170.0), ("bladder_force",), "arm_s1", "flexor")
    after = found.orthosis.muscle["flexor"].type
    assert after.law_set.parameters["bladder_force"] == pytest.approx(found.parameters["bladder_force"])
    assert after.covariance is None
    kept = fitted(device(20e3), ("series_stiffness",), "arm_s1", "flexor").orthosis
    assert kept.muscle["flexor"].type.covariance == before.covariance


def test_scatter_about_a_slack_muscle_is_no_pull() -> None:
    """Gaussian noise of 0.2 N·m where the muscle hangs slack is no torque that the model lacks."""
    for seed in range(size(3, 10)):
        found = fitted(device(offset=3e-3), ("offset",), "s1", "dorsiflexor", noise=0.2, seed=seed)
        assert not any("slack" in warning for warning in found.warnings)

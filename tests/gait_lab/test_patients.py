"""Patients are imported as rightly as the healthy: slow and short of step, children, lame, on their toes."""

import dataclasses
import pathlib
from typing import Any

import numpy as np
import pytest
from gait_lab.gait_truth import beyond, differences
from gait_lab.laboratory import Laboratory
from gait_lab.patients import Patient, laboratory
from gait_lab.trial_files import write_trc, write_trial

from afo_sim.common import with_code
from afo_sim.gait_lab import Choices, Imported, import_gait

SET = "opensim c3d"


def imported(folder: pathlib.Path, recorded: Laboratory, sides: str = "rl", **choices: Any) -> Imported:
    """The import of a trial; `sides` are those whose plate is there."""
    plates = [plate for plate in recorded.plates() if plate.name in sides]
    return import_gait(write_trial(folder, recorded, SET, plates), Choices(**choices))


@pytest.mark.parametrize("share, slower", [(0.7, 1.3), (0.6, 1.6), (0.5, 2.6)])
def test_short_and_slow_steps(tmp_path: pathlib.Path, share: float, slower: float) -> None:
    """At 0.5, 0.35 and 0.18 m/s the pressure of each foot passes near the other ankle all through stance."""
    patient = Patient(share=share, slower=slower)
    recorded = laboratory(patient)
    done = imported(tmp_path, recorded)
    assert beyond(differences(done, recorded, "right")) == {}
    assert [contact.plate for contact in done.grounds["right"].contacts] == ["ground_force_r"] * 3
    assert {contact.plate for contact in done.grounds["left"].contacts} == {"ground_force_l"}


def test_slow_walk_on_a_treadmill(tmp_path: pathlib.Path) -> None:
    patient = Patient(share=0.6, slower=1.6)
    recorded = laboratory(patient, strides=4.2, belt=patient.speed)
    done = imported(tmp_path, recorded, side="left")
    assert beyond(differences(done, recorded, "left")) == {}
    assert sum(stride.loaded for stride in done.strides) == len(done.strides)


@pytest.mark.parametrize("mass", [12.0, 20.0, 28.0])
def test_children_are_light(tmp_path: pathlib.Path, mass: float) -> None:
    """The centre of pressure must be known from a tenth of the weight on: 20 N of a child of 20 kg."""
    recorded = laboratory(Patient(mass=mass))
    assert beyond(differences(imported(tmp_path, recorded), recorded, "right")) == {}


def standing(folder: pathlib.Path, recorded: Laboratory) -> pathlib.Path:
    points = recorded.standing(SET)
    time = np.arange(len(next(iter(points.values())))) / recorded.rate
    return write_trc(folder / "standing.trc", time, points)


@pytest.mark.parametrize("degrees", [12.0, 25.0])
def test_toe_walker_keeps_the_equinus(tmp_path: pathlib.Path, degrees: float) -> None:
    """A foot that never lies flat in walking does so in standing, and that is the angle's zero."""
    recorded = laboratory(Patient(equinus=np.radians(degrees)))
    done = imported(tmp_path, recorded, static=standing(tmp_path, recorded))
    assert beyond(differences(done, recorded, "right")) == {}
    (told,) = (warning for warning in done.warnings if "the sole is pitched" in warning)
    pitch = float(told.split("by ")[1].split(" deg")[0])
    assert pitch == pytest.approx(-degrees, abs=0.5)
    assert any("cm above the floor" in warning for warning in done.warnings)  # the heel is raised


@pytest.mark.parametrize("walker", ["healthy", "patient", None])
def test_a_toe_walker_is_no_healthy_one(tmp_path: pathlib.Path, walker: Any) -> None:
    """Who is named stands in the cycle; a healthy walker whose ankle is 25° off is doubted."""
    recorded = laboratory(Patient(equinus=np.radians(25.0)))
    done = imported(tmp_path, recorded, static=standing(tmp_path, recorded), walker=walker)
    assert done.cycle.walker == walker
    assert ("walker-not-usual" in [each.code for each in done.warnings]) is (walker == "healthy")


def test_flat_foot_is_level_beside_a_standing_trial(tmp_path: pathlib.Path) -> None:
    recorded = laboratory(Patient())
    done = imported(tmp_path, recorded, static=standing(tmp_path, recorded))
    assert done.warnings == ()
    assert done.cycle.foot_pitch()[done.cycle.foot_flat()].mean() == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("load", [0.3, 1.7])
def test_one_plate_under_a_lame_leg_refuses_no_mass(tmp_path: pathlib.Path, load: float) -> None:
    """A leg that carries 41 or 59 % of the weight carries all of it while it stands alone."""
    patient = Patient(right_load=load)
    recorded = laboratory(patient)
    done = imported(tmp_path, recorded, sides="r", mass=patient.mass)
    assert beyond(differences(done, recorded, "right")) == {}
    assert done.mass.estimated == pytest.approx(patient.mass, rel=0.02)
    assert not with_code(done.warnings, "mass-differs")


def test_crutch_on_a_plate_of_its_own_is_no_foot(tmp_path: pathlib.Path) -> None:
    """A crutch 30 cm beside the foot and 15 cm ahead of it, with 120 N, in half of the stride."""
    recorded = laboratory(Patient())
    foot, other = recorded.plates()
    pressed = 120.0 * (recorded.walker.phase("right", foot.time) % 1.0 < 0.5)
    crutch = dataclasses.replace(
        foot,
        name="crutch",
        force=np.outer(pressed, [0.0, 1.0, 0.0]),
        place=foot.place + np.array([0.15, 0.0, 0.3]),
    )
    done = import_gait(write_trial(tmp_path, recorded, SET, [foot, other, crutch]), Choices())
    assert beyond(differences(done, recorded, "right")) == {}


def test_one_leg_alone_has_its_own_plate_at_short_steps(tmp_path: pathlib.Path) -> None:
    recorded = laboratory(Patient(share=0.6, slower=1.6))
    points = {n: p for n, p in recorded.markers(SET).items() if n[0] == "R" or n in ("LASI", "LPSI")}
    done = import_gait(write_trial(tmp_path, recorded, SET, points=points), Choices())
    assert beyond(differences(done, recorded, "right")) == {}

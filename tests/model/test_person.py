"""Whose leg walks: who is told, who was recorded, and whose leg it is."""

import dataclasses
import math
import pathlib
from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim.common import assets
from afo_sim.description import Scenario, body_height, body_mass, load
from afo_sim.gait import write
from afo_sim.gait.file import read
from afo_sim.model import Size, assemble, person_of, persons_stride, stride_time_of, with_person
from afo_sim.model.build import build
from afo_sim.model.person import Person
from afo_sim.physics.passive_ankle import riener_edrich_1999
from afo_sim.show import of_walker

LEG = (75.0, 1.75)  # mass [kg] and height [m] of the leg's own body
RECORDED = 67.2, 1.78  # body mass [kg] and height [m] in the shipped gait's header


def trial(folder: pathlib.Path, **changed: Any) -> str:
    """The shipped stride with other facts in its header."""
    file = folder / "trial.csv"
    write(file, dataclasses.replace(read(assets.find_gait("gatk_stride1")), **changed))
    return str(file)


def walk(**sets: Any) -> Scenario:
    own = {key.replace("__", "."): value for key, value in sets.items()}
    return load("scenario", "walk-healthy", {"gait.cycle": "gatk_stride1"} | own)


def test_the_recorded_walker_walks_where_nobody_else_is_told(tmp_path: pathlib.Path) -> None:
    assert person_of(walk()) == Person(*RECORDED)
    assert person_of(walk(gait__cycle=trial(tmp_path, body_height=None))) == Person(RECORDED[0], LEG[1])
    tall = walk(gait__cycle=trial(tmp_path, body_mass=85.0, body_height=1.9))
    assert person_of(tall) == Person(85.0, 1.9)
    assert person_of(tall.set({"gait.cycle": "gatk_stride1"})) == Person(*RECORDED)


def test_what_the_patient_is_told_to_be_counts_before_the_recorded_walker(tmp_path: pathlib.Path) -> None:
    gait = trial(tmp_path, body_mass=85.0, body_height=1.9)
    assert person_of(walk(gait__cycle=gait, patient__body_mass="50 kg")) == Person(50.0, 1.9)
    assert person_of(walk(gait__cycle=gait, patient__body_height="1.6 m")) == Person(85.0, 1.6)


def test_who_sits_is_the_legs_own_person() -> None:
    seated = load("scenario", "seated")
    assert person_of(seated) == Person(*LEG)
    assert Size.of(seated) == Size() and with_person(seated) == seated


def test_a_recording_holds_the_person_who_walked_and_walks_the_same_again(tmp_path: pathlib.Path) -> None:
    gait = trial(tmp_path, body_mass=85.0, body_height=None)
    first = afo_sim.run(walk(gait__cycle=gait, duration="3 s"))
    assert (body_mass(first.described), body_height(first.described)) == (85.0, LEG[1])
    sources = first.described["patient"]["provenance"]
    assert sources["body_mass"]["kind"] == "derived" and sources["body_height"]["kind"] == "assumed"
    again = afo_sim.run(load("scenario", first.scenario))
    assert again.scenario == first.scenario
    for name, column in first.columns.items():
        assert np.array_equal(column, again[name], equal_nan=True), name


def test_the_stride_is_that_of_the_persons_height_over_the_trials(tmp_path: pathlib.Path) -> None:
    """Froude: times with √l, lengths with l; a stride time that is told stays."""
    recorded = read(assets.find_gait("gatk_stride1"))
    gait = trial(tmp_path, body_height=1.6)
    taller = 1.8 / 1.6
    scenario = walk(gait__cycle=gait, patient__body_height="1.8 m")
    found = persons_stride(scenario)
    assert found.stride_time == pytest.approx(recorded.stride_time * math.sqrt(taller), rel=1e-5)
    assert np.ptp(found.ankle_x) == pytest.approx(np.ptp(recorded.ankle_x) * taller, rel=1e-5)
    assert found.ankle_angle == pytest.approx(recorded.ankle_angle, abs=1e-6)
    assert stride_time_of(scenario.set({"gait.stride_time": "1.1 s"})) == 1.1
    assert persons_stride(walk(gait__cycle=gait)).stride_time == pytest.approx(recorded.stride_time)


def test_a_walker_of_unknown_height_is_of_the_legs(tmp_path: pathlib.Path) -> None:
    gait = trial(tmp_path, body_height=None)
    found = persons_stride(walk(gait__cycle=gait, patient__body_height="1.4 m"))
    recorded = read(assets.find_gait("gatk_stride1"))
    assert found.stride_time == pytest.approx(recorded.stride_time * math.sqrt(1.4 / LEG[1]), rel=1e-5)


def test_another_mass_or_height_than_the_trials_is_said(tmp_path: pathlib.Path) -> None:
    def said(scenario: Scenario) -> str:
        return " | ".join(of_walker(with_person(scenario).resolved()))

    unknown = trial(tmp_path, body_height=None)
    assert said(walk()) == ""
    assert (
        said(walk(gait__cycle=unknown))
        == "the recorded walker is of unknown height (1.75 m is assumed), as of the leg"
    )
    assert "weighs 67.2 kg, the patient 90 kg" in said(walk(patient__body_mass="90 kg"))
    assert "(1.75 m is assumed): the stride is scaled to the patient's 1.60 m" in said(
        walk(gait__cycle=unknown, patient__body_height="1.6 m")
    )
    assert "is 1.78 m tall: the stride is scaled to the patient's 1.60 m" in said(
        walk(patient__body_height="1.6 m")
    )


def test_tissue_that_is_stiffer_and_shorter_is_missed_by_what_it_holds_back() -> None:
    """The device must give what this tissue takes beyond the healthy one: Riener & Edrich twice, by hand."""
    sets = {"patient.passive_scale": 1.5, "patient.passive_offset": "-9 deg", "duration": "1 s"}
    size = {"patient.body_mass": "60 kg", "patient.body_height": "1.6 m"}
    built = build(load("scenario", "walk-healthy", sets | size))
    share = 60.0 / LEG[0] * 1.6 / LEG[1]
    angle, knee = built.walk.ankle[1:-1], built.walk.knee[1:-1]
    for k in range(0, len(angle), 97):
        healthy = riener_edrich_1999(angle[k], knee[k])
        own = 1.5 * riener_edrich_1999(angle[k] + math.radians(9.0), knee[k])
        assert built.active.needed[k] == pytest.approx(-share * (own - healthy), abs=1e-9)


def test_cases_by_mass_share_what_is_compiled() -> None:
    build(walk(duration="0.1 s"))
    before = assemble._kept.cache_info().misses
    for mass in (50.0, 60.0, 95.0):
        build(walk(duration="0.1 s", patient__body_mass=f"{mass} kg"))
    assert assemble._kept.cache_info().misses == before


@pytest.mark.parametrize("name", assets.names("patient"))
def test_presets_say_where_each_number_comes_from(name: str) -> None:
    patient = load("patient", name)
    told = {"dorsiflexor_strength", "plantarflexor_strength"}
    told |= {key for key in type(patient).model_fields if key in patient.model_fields_set} - {"provenance"}
    assert told - {"name", "description"} == patient.provenance.keys()


def test_the_spastic_presets_tissue_has_the_published_torque_without_a_shift() -> None:
    """Chung et al. 2004: 6.21 and 9.51 N·m at 10 deg, 0.35 and 0.54 N·m/deg there; 20 and 10.8 deg at 10.

    A healthy ankle's exponential through torque and slope, times the preset's factor, gives the third pair.
    """
    factor = load("patient", "spastic").passive_scale
    assert factor == pytest.approx(0.54 / 0.35, abs=0.01) and factor == pytest.approx(9.51 / 6.21, abs=0.02)
    rate = 0.35 / 6.21

    def angle(scale: float) -> float:
        return 10.0 + math.log(10.0 / (scale * 6.21)) / rate

    assert angle(factor) == pytest.approx(10.8, abs=0.2)
    assert angle(1.0) == pytest.approx(20.0, abs=2.0)
    assert load("patient", "spastic").passive_offset == 0.0

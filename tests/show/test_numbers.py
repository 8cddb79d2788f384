"""Notes on a run's numbers: what a reader must know, and what is not measured."""

import dataclasses
import pathlib
from typing import Any

import numpy as np
import pytest

import afo_sim
from afo_sim.common import find_gait, with_code
from afo_sim.description import load
from afo_sim.gait import file
from afo_sim.metrics import Metric
from afo_sim.show import cautions, of_walker, unseen
from afo_sim.show.numbers import _FILLING, _HARM, _UNSEEN, doubts, of_leg


def told(totals: dict[str, Metric], strides: int) -> str:
    scenario = afo_sim.load("scenario", "walk-dropfoot").resolved()
    each = {k: {"toe_clearance": Metric(float(k), "mm")} for k in range(strides)}
    return cautions(scenario, {"toe_clearance": Metric(1.0, "mm"), **totals}, each)[0]


@pytest.mark.parametrize("imported", [False, True])
def test_a_cycle_that_no_import_wrote_is_warned_of_where_its_ends_are_apart(
    tmp_path: pathlib.Path, imported: bool
) -> None:
    cycle = file.read(find_gait("gatk_stride1"))
    knee = cycle.knee_angle + np.radians(7.0) * (cycle.phase - 0.5)
    notes = {"quality": "passed: all"} if imported else {}
    file.write(tmp_path / "mine.csv", dataclasses.replace(cycle, knee_angle=knee, notes=notes))
    scenario = afo_sim.load("scenario", "walk-dropfoot", {"gait.cycle": str(tmp_path / "mine.csv")})
    doubts_of_ends = with_code(of_walker(scenario.resolved()), "stride-open")
    assert [doubt.subject for doubt in doubts_of_ends] == ([] if imported else ["knee angle"])


def test_walked_strides_are_told_with_what_they_still_change() -> None:
    changes = {"walked_clearance_change": Metric(0.72, "mm"), "walked_air_change": Metric(-2.4, "percent")}
    said = told({"strides_counted": Metric(5.0, ""), **changes}, 11)
    assert (
        "means over strides 6 to 10, which still change by +0.7 mm of toe clearance and −2.4 % of air" in said
    )


def test_one_walked_stride_tells_no_change_and_a_solved_one_needs_none() -> None:
    counted = {"strides_counted": Metric(1.0, "")}
    assert "from stride 2 alone, which does not show whether it repeats" in told(counted, 3)
    assert "settled" in told({**counted, "strides_solved": Metric(4.0, "")}, 3)


def test_what_is_mirrored_is_told() -> None:
    walk = afo_sim.load("scenario", "walk-dropfoot-afo")
    both = "the left leg is simulated: leg file and orthosis of the right one are mirrored"
    for sets, said in (
        ({}, []),
        ({"side": "right"}, []),
        ({"side": "left"}, [both]),
        ({"leg.side": "left"}, ["the left leg is simulated: orthosis of the right one is mirrored"]),
        ({"orthosis.side": "left"}, ["the right leg is simulated: orthosis of the left one is mirrored"]),
    ):
        assert of_leg(walk.set(sets).resolved()) == said
    bare = afo_sim.load("scenario", "walk-dropfoot").set({"side": "left"})  # without an orthosis
    assert of_leg(bare.resolved()) == ["the left leg is simulated: leg file of the right one is mirrored"]
    assert of_leg(afo_sim.load("scenario", "seated").resolved()) == []


def test_an_imported_leg_tells_its_spring_and_its_sole(tmp_path: pathlib.Path) -> None:
    text = pathlib.Path(afo_sim.load("leg", "adult_75kg").file).read_text()
    sprung = text.replace('name="ankle" type="hinge"', 'name="ankle" type="hinge" stiffness="5"')
    (tmp_path / "body.xml").write_text(sprung)
    afo_sim.import_leg(tmp_path / "body.xml", tmp_path / "leg", side="right")
    walk = afo_sim.load("scenario", "walk-dropfoot-afo", {"leg": str(tmp_path / "leg")})
    said = of_leg(walk.resolved())
    assert any("spring of the leg's file" in note for note in said)
    assert any("toe clearance is that of its sole points" in note for note in said)
    seated = of_leg(afo_sim.load("scenario", "seated", {"leg": str(tmp_path / "leg")}).resolved())
    assert any("spring of the leg's file" in note for note in seated)
    assert not any("sole" in note for note in seated)
    assert of_leg(afo_sim.load("scenario", "walk-dropfoot-afo").resolved()) == []


GROUP = "orthosis.muscle.dorsiflexor"


@pytest.mark.parametrize(
    ("muscle", "own", "code"),
    [
        ("handmade_10mm", {"law": "chou_hannaford_1996", "tube": None}, "ideal-law"),
        ("handmade_10mm", {"tube": None}, "ideal-law"),
        ("handmade_10mm", {"law": "chou_hannaford_1996"}, "derived-force"),  # with its tube, no upper bound
        ("handmade_10mm", {}, "derived-force"),
        ("dmsp_40", {"law": "sarosi_2012"}, "derived-force"),
        ("s1_215mm", {"law": "tondu_lopez_2000_bladder"}, ""),
        ("dmsp_20", {"law": "sarosi_2012"}, ""),
    ],
)
def test_a_force_that_nobody_measured_is_told(muscle: str, own: dict[str, Any], code: str) -> None:
    sets = {f"{GROUP}.type": muscle} | {f"{GROUP}.type.{key}": value for key, value in own.items()}
    notes = [n for n in doubts(load("scenario", "seated", sets).resolved(), {}, {}) if "dorsiflexor's" in n]
    assert [note.code for note in notes] == [code] * bool(code)


WORN = {"gait": {"cycle": "x"}, "orthosis": {"muscle": {"dorsiflexor": {}}}}


@pytest.mark.parametrize(
    ("scenario", "metrics", "notes"),
    [
        (WORN, {"toe_clearance"}, [_UNSEEN, _HARM]),
        (WORN, {"air_per_stride", "air_first_stride"}, [_FILLING]),
        (WORN, {"air_per_stride", "air_before_first_step"}, []),
        (WORN, {"toe_clearance_stride_1"}, [_HARM]),
        (WORN, {"toe_clearance_stride_1", "cuff_skin_pressure"}, []),
        (WORN | {"orthosis": {}}, {"toe_clearance", "lowest_toe_clearance_first_ten"}, []),  # bare foot
        ({}, {"air_per_stride", "toe_clearance"}, []),  # nobody walks
    ],
)
def test_many_walks_name_what_nobody_has_asked(
    scenario: dict[str, Any], metrics: set[str], notes: list[str]
) -> None:
    assert unseen(scenario, metrics) == notes

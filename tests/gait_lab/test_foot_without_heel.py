"""A foot whose heel nobody marked in the walk: carried from standing, or level where the foot lies flat."""

import dataclasses
import pathlib

import numpy as np
import pytest
from gait_lab.laboratory import Laboratory
from gait_lab.trial_files import write_trc, write_trial
from kept_inputs import FOLDER, kept
from skin_markers import body, markers_of

from afo_sim.common import InputError
from afo_sim.gait_lab import Choices, Imported, Markers, import_gait
from afo_sim.gait_lab.trial.marker_legs import legs_from_markers

TIME, STAND = np.arange(0.0, 2.0, 0.01), np.arange(0.0, 1.5, 0.01)
NAMES = {
    "asis": "{S}ASI", "psis": "{S}PSI", "knee_lateral": "{S}KNE", "ankle_lateral": "{S}ANK",
    "heel": "{S}HEE", "metatarsal_2": "{S}TOE", "thigh_1": "{S}THI", "shank_2": "{S}TIB",
}  # fmt: skip
MEDIAL = {"knee_medial": "{S}KNEM", "ankle_medial": "{S}MED"}
KEPT = "heel_in_static_only"
LABORATORY = Laboratory(ideal=True)


def walk_without(*marks: str, more: dict[str, str] | None = None) -> Markers:
    names = {mark: name for mark, name in (NAMES | (more or {})).items() if mark not in marks}
    return markers_of(body(TIME), names, TIME)


def standing(more: dict[str, str] | None = None, without: str = "") -> Markers:
    names = {mark: name for mark, name in (NAMES | MEDIAL | (more or {})).items() if mark != without}
    return markers_of(body(STAND, walks=False), names, STAND)


@pytest.mark.parametrize("lost", ["heel", "metatarsal_2"])
@pytest.mark.parametrize(
    "more", [{}, {"metatarsal_1": "{S}MT1", "metatarsal_5": "{S}MT5"}], ids=["line", "body"]
)
def test_an_end_of_the_foot_is_carried_from_standing(lost: str, more: dict[str, str]) -> None:
    """By three points of the foot exactly; by the line from ankle to the other end, which turns with the
    shank, within 5 mm sideways and 0.5 mm in the plane of walking: the foot points 4 deg inward of it.
    """
    if lost == "metatarsal_2" and more:
        more = {"metatarsal_1": "{S}MT1"}
    true = body(TIME)
    worn = {} if lost == "metatarsal_2" else more
    legs = legs_from_markers(walk_without(lost, more=worn), Choices(), standing(worn))
    for side in ("right", "left"):
        role = "heel" if lost == "heel" else "toe"
        point = legs[side].points[role]
        assert "standing, carried by" in point.how and "the ankle centre" in point.how
        off = np.abs(point.path - true[side][lost]).max(axis=0)
        assert (off < (1e-6 if worn else np.array([5e-4, 5e-4, 5e-3]))).all(), point.how
        assert not legs[side].warnings


def test_a_heel_of_no_trial_is_level_in_standing() -> None:
    """The angle of the line heel–toe against the true one is fixed: the foot is a rigid body."""
    true = body(TIME)["right"]
    leg = legs_from_markers(walk_without("heel"), Choices(), standing(without="heel"))["right"]
    assert [warning.code for warning in leg.warnings] == ["heel-unmarked"]
    assert leg.sole == 0.0
    pitch = angle(leg.points["toe"].path - leg.points["heel"].path)
    off = pitch - angle(true["metatarsal_2"] - true["heel"])
    assert np.ptp(off) < np.radians(0.05)
    assert off[0] == pytest.approx(-np.arctan2(-0.005, 0.21), abs=1e-3)  # the toe's marker is 5 mm lower


def angle(way: np.ndarray) -> np.ndarray:
    return np.arctan2(way[:, 1], way[:, 0])


def imported(folder: pathlib.Path, heel: bool, still: bool) -> Imported:
    """Of the known walker's Plug-in Gait markers."""
    points = {n: p for n, p in LABORATORY.markers("plug-in gait").items() if heel or "HEE" not in n}
    files = write_trial(folder, LABORATORY, "plug-in gait", points=points)
    stood = LABORATORY.standing("plug-in gait")
    time = np.arange(len(stood["RASI"])) / LABORATORY.rate
    static = write_trc(folder / "still.trc", time, stood) if still else None
    return import_gait(files, Choices(walker="healthy", static=static))


def test_the_known_walkers_ankle_without_a_heel(tmp_path: pathlib.Path) -> None:
    """A rigid foot: with a standing trial that has the heel nothing changes, without one half a degree."""
    for still, bound in ((True, 0.05), (False, 0.5)):
        whole, without = (imported(tmp_path, heel, still) for heel in (True, False))
        off = np.degrees(without.cycle.ankle_angle - whole.cycle.ankle_angle)
        assert np.sqrt(np.mean(off**2)) < bound
        moved = without.cycle.ankle_moment - whole.cycle.ankle_moment
        assert np.nanmax(np.abs(moved)) < 0.002
        codes = [warning.code for warning in without.warnings]
        assert ("heel-unmarked" in codes) == (not still)
        assert "pressure-shifted" not in codes
        landing = next(check for check in without.checks if check.fault.startswith("pressure along"))
        assert still or landing.verdict.startswith("not checked")


def test_refusals_say_where_the_marker_is() -> None:
    """Forefoot and heel in standing only; a toe in no trial; nothing left that could be named."""
    with pytest.raises(InputError) as caught:
        legs_from_markers(walk_without("heel", "metatarsal_2"), Choices(), standing())
    assert "toe (no name is like it; the standing trial has RTOE, and the walk too little" in str(
        caught.value
    )
    assert "heel (no name is like it; the standing trial has RHEE" in str(caught.value)
    assert "marker=" not in caught.value.allowed and "none is left" in caught.value.allowed
    with pytest.raises(InputError) as caught:
        legs_from_markers(walk_without("metatarsal_2", more={"toe_tip": "M7"}), Choices())
    assert "standing" not in str(caught.value) and "`marker=toe=NAME`" in caught.value.allowed


def test_a_centre_far_from_its_joint_is_told_and_not_used() -> None:
    """A computed centre near its markers goes before regressions; one at another place does not."""
    centres = {"hip_centre": "{S}HJC", "knee_centre": "{S}KJC", "ankle_centre": "V_{S}.Ankle_JC"}
    right = walk_without(more=centres)
    leg = legs_from_markers(right, Choices())["right"]
    for role, name in (("hip", "RHJC"), ("knee", "RKJC"), ("ankle", "V_R.Ankle_JC")):
        assert leg.points[role].how == f"{name}, a centre given in the file"
    moved = {**right.positions, "RKJC": right.positions["RKJC"] + [0.0, 0.2, 0.0]}
    leg = legs_from_markers(dataclasses.replace(right, positions=moved), Choices())["right"]
    (warning,) = leg.warnings
    assert (warning.code, warning.subject) == ("centre-far", "RKJC")
    assert leg.points["knee"].source == "RKNE"


@kept(KEPT)
def test_the_kept_trial_whose_heel_is_worn_in_standing_only() -> None:
    static = FOLDER / KEPT / "standing.c3d"
    found = import_gait([FOLDER / KEPT / "walk.c3d"], Choices(walker="healthy", static=static))
    assert -found.cycle.ankle_moment.min() == pytest.approx(1.76, abs=0.01)
    assert found.cycle.body_mass == pytest.approx(67.2, abs=0.1)
    assert found.cycle.stride_time == pytest.approx(1.203, abs=0.002)
    assert "heel-unmarked" not in [warning.code for warning in found.warnings]

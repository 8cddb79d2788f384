"""Doubts about a stride: a sound one has none, and each fault has its sentence with its number."""

import dataclasses
import pathlib
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from analytic_walker import AnalyticWalker
from walking import known_walk, write_forces, write_trc

from afo_sim.common import InputError, Notice, with_code
from afo_sim.gait import GaitCycle
from afo_sim.gait_lab import Choices, import_gait
from afo_sim.gait_lab.trial.chosen_stride import take_stride
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.plausibility import _outline, doubts

TIME = np.arange(0.0, 3.0, 0.01)
FORCE_TIME = np.arange(0.0, 3.0, 0.001)
CYCLE = known_walk().cycle
POINTS = dataclasses.replace(
    AnalyticWalker(noise=0.002).legs(TIME)["right"], outline={"heel": -0.08, "toe": 0.20}
)


def motion(**fields: Any) -> Any:
    """What a leg's motion has for these checks: time, ankle, and heel and toe where they are known."""
    still = np.zeros_like(TIME)
    foot = {"heel": still[:, None] + [-0.07, 0.03], "toe": still[:, None] + [0.13, 0.03]}
    return SimpleNamespace(
        **{"time": TIME, "ankle_x": still, "pelvis_x": TIME, "hidden": (), **foot} | fields
    )


def ground(rate: float = 1000.0) -> Any:
    time = np.arange(0.0, 3.0, 1.0 / rate)
    return SimpleNamespace(plates={"1": (time, np.zeros_like(time))}, contacts=())


def told(
    cycle: GaitCycle = CYCLE,
    points: LegPoints = POINTS,
    *,
    zero: float = 0.0,
    reference: np.ndarray | None = None,
    leg: Any = None,
    plates: Any = None,
) -> tuple[Notice, ...]:
    return doubts(cycle, points, leg or motion(), plates or ground(), np.radians(zero), reference)


def changed(**fields: Any) -> GaitCycle:
    return dataclasses.replace(CYCLE, **fields)


def test_a_sound_stride_is_not_doubted() -> None:
    assert told() == ()
    assert told(reference=CYCLE.ankle_moment) == ()


def opened(degrees: float) -> GaitCycle:
    return changed(knee_angle=CYCLE.knee_angle + np.radians(degrees) * (CYCLE.phase - 0.5))


def test_a_stride_that_hardly_comes_back_is_doubted() -> None:
    """CYCLE's own knee ends 0.05 deg beside its beginning at most."""
    (warning,) = (notice for notice in told(opened(6.4)) if notice.code == "stride-open")
    assert warning.subject == "knee angle" and warning.data["off"] == pytest.approx(6.4, abs=0.1)


TWO: Any = [SimpleNamespace(side="right", start=float(k), loaded=True) for k in range(2)]


@pytest.mark.parametrize(
    "first, second, taken, remedy", [(6.4, 0.0, 1, ""), (6.4, 5.5, 1, ""), (6.4, -7.0, 0, "--stride mean")]
)
def test_the_stride_that_closes_best_is_taken_and_a_mean_is_named_where_it_closes(
    first: float, second: float, taken: int, remedy: str
) -> None:
    chosen, _, notices = take_stride(TWO, [opened(first), opened(second)], "known", Choices())
    assert chosen == (taken,)
    told = [notice.data["start"] for notice in notices if notice.code == "stride-not-taken"]
    assert told == [float(1 - taken)]
    assert [notice.subject for notice in notices if notice.code == "mean-closes"] == [remedy][: bool(remedy)]


@pytest.mark.parametrize("second, named", [(-11.0, True), (12.0, False)])
def test_a_refused_stride_names_a_mean_only_where_that_closes(second: float, named: bool) -> None:
    with pytest.raises(InputError, match=r"ends .* deg from where it began") as refused:
        take_stride(TWO, [opened(11.0), opened(second)], "known", Choices())
    assert ("--stride mean" in refused.value.allowed) is named


def test_a_stride_without_plates_is_not_doubted() -> None:
    nothing = np.full_like(CYCLE.phase, np.nan)
    bare = changed(grf_x=nothing, grf_z=nothing, cop_x=nothing, ankle_moment=nothing)
    assert doubts(bare, POINTS, motion(), None, 0.0, CYCLE.ankle_moment) == ()


@pytest.mark.parametrize(("zero", "count"), [(14.0, 0), (-14.0, 0), (357.0, 0), (22.0, 1), (-40.0, 1)])
def test_the_ankles_zero(zero: float, count: int) -> None:
    found = told(zero=zero)
    assert len(found) == count
    assert all(f"zero was moved by {-zero:+.0f} deg" in doubt for doubt in found)


@pytest.mark.parametrize("zero", [-184.0, 176.0, 90.0, -65.0])
def test_heel_and_toe_exchanged_are_refused(zero: float) -> None:
    with pytest.raises(InputError, match="heel and toe are exchanged, or the ankle angle uses another conv"):
        told(zero=zero)


@pytest.mark.parametrize(("shift", "count"), [(0.0, 0), (0.08, 1), (-0.05, 1)])
def test_the_ankles_height(shift: float, count: int) -> None:
    found = told(changed(ankle_z=CYCLE.ankle_z + shift), POINTS)
    assert len(found) == count
    assert all(
        f"{100.0 * (CYCLE.ankle_z[CYCLE.foot_flat()].min() + shift):.1f} cm" in doubt for doubt in found
    )


def test_a_childs_ankle_is_low() -> None:
    low = changed(ankle_z=CYCLE.ankle_z - CYCLE.ankle_z[CYCLE.foot_flat()].min() + 0.04)
    small = {role: dataclasses.replace(point, path=0.6 * point.path) for role, point in POINTS.points.items()}
    assert len(told(low)) == 1
    assert told(low, dataclasses.replace(POINTS, points=small)) == ()  # a shank of 0.25 m


@pytest.mark.parametrize(
    ("knee", "words"),
    [
        (lambda k: k, None),
        (lambda k: k - np.radians(15.0), None),  # back-knee of a patient
        (lambda k: k - np.radians(35.0), "backward by up to"),
        (lambda k: -k, "for most of the stride"),
    ],
)
def test_the_knee_bends_backward(knee: Any, words: str | None) -> None:
    found = told(changed(knee_angle=knee(CYCLE.knee_angle)))
    assert len(found) == (words is not None)
    assert words is None or words in found[0]


@pytest.mark.parametrize(
    ("shift", "words"), [(0.0, None), (0.15, "ahead of the toes"), (-0.25, "behind the heel")]
)
@pytest.mark.parametrize("by_markers", [False, True])
def test_the_centre_of_pressure_is_within_the_foot(shift: float, words: str | None, by_markers: bool) -> None:
    cycle = changed(cop_x=CYCLE.cop_x + shift)
    points = dataclasses.replace(POINTS, outline={}) if by_markers else POINTS
    height = np.where((TIME % 1.0) < 0.4, 0.03, 0.2)
    ends = {
        name: np.column_stack([np.full_like(TIME, x), height]) for name, x in (("heel", -0.07), ("toe", 0.13))
    }
    found = told(cycle, points, leg=motion(**ends))
    assert len(found) == (words is not None)
    assert words is None or (words in found[0] and "% of stance" in found[0])


@pytest.mark.parametrize(
    ("factor", "words"), [(1.0, None), (0.3, "weak push-off"), (2.0, "the ankle's place")]
)
def test_the_moments_peak(factor: float, words: str | None) -> None:
    found = told(changed(ankle_moment=factor * CYCLE.ankle_moment))
    assert len(found) == (words is not None)
    if words:
        assert words in found[0]
        assert f"{-factor * CYCLE.ankle_moment.min():.2f} N·m/kg" in found[0]


def late(seconds: float) -> np.ndarray:
    phase = CYCLE.phase - seconds / CYCLE.stride_time
    return np.interp(phase, CYCLE.phase, CYCLE.ankle_moment, period=1.0)


@pytest.mark.parametrize(
    ("reference", "words"),
    [
        (CYCLE.ankle_moment, None),
        (1.05 * CYCLE.ankle_moment, None),
        (-CYCLE.ankle_moment, "with the other sign"),
        (CYCLE.ankle_moment / 1.4, "times 1.40"),
        (CYCLE.ankle_moment + 0.3, "RMS away"),
        (0.01 * CYCLE.ankle_moment, "was it computed without ground forces?"),
    ],
)
def test_the_moment_agrees_with_the_reference(reference: np.ndarray, words: str | None) -> None:
    found = told(reference=reference)
    assert len(found) == (words is not None)
    assert words is None or words in found[0]


@pytest.mark.parametrize("seconds", [0.05, -0.05])
def test_a_reference_that_is_late_or_early(seconds: float) -> None:
    (doubt,) = told(reference=late(seconds))
    moved = re.search(r"within 0\.0[01] moved by ([-+]\d+) ms", doubt)
    assert moved is not None
    assert float(moved[1]) == pytest.approx(-1e3 * seconds, abs=2.0)


def test_the_references_rms_is_told() -> None:
    off = CYCLE.ankle_moment + 0.25
    off[:3] = np.nan
    assert "is 0.25 N·m/kg RMS away" in told(reference=off)[0]


def test_clocks() -> None:
    slow = POINTS.time[::5], {r: LegPoint(p.path[::5], p.source) for r, p in POINTS.points.items()}
    found = told(points=dataclasses.replace(POINTS, time=slow[0], points=slow[1], pelvis=None))
    assert found == ("the motion is sampled at only 20 Hz; 25 Hz or more are needed for the events",)
    assert told(plates=ground(50.0)) == (
        "plate 1 is sampled at only 50 Hz; 100 Hz or more are needed for the events",
    )
    lost = np.delete(np.arange(len(TIME)), [50, 120, 121])
    gone = {r: LegPoint(p.path[lost], p.source) for r, p in POINTS.points.items()}
    (doubt,) = told(points=dataclasses.replace(POINTS, time=TIME[lost], points=gone, pelvis=None))
    assert "2 of 296 steps of time that are not 10 ms, one of 30 ms" in doubt


def exchanged(one: str, other: str, frames: slice) -> LegPoints:
    points = dict(POINTS.points)
    first, second = points[one].path.copy(), points[other].path.copy()
    first[frames], second[frames] = second[frames].copy(), first[frames].copy()
    points |= {one: LegPoint(first, ""), other: LegPoint(second, "")}
    return dataclasses.replace(POINTS, points=points)


def test_markers_exchanged_for_some_frames() -> None:
    found = told(points=exchanged("hip", "knee", slice(120, 124)))
    assert any("the right shank, knee to ankle, changes its length" in doubt for doubt in found)
    assert any("in 4 frames of 1.20 to 1.23 s" in doubt for doubt in found)
    leaps = [re.search(r"the right knee leaps by (\d+) cm at 1\.20 s", doubt) for doubt in found]
    (leap,) = [match for match in leaps if match]
    assert float(leap[1]) == pytest.approx(42.0, abs=3.0)  # the thigh's length, and a frame's way of 1.2 cm


def test_a_point_of_the_other_leg_for_some_frames() -> None:
    path = POINTS.points["toe"].path.copy()
    path[200:205] = AnalyticWalker().legs(TIME)["left"].points["toe"].path[200:205]
    path[198:200] = np.nan  # lost first, as cameras do
    found = told(points=dataclasses.replace(POINTS, points={**POINTS.points, "toe": LegPoint(path, "")}))
    assert any("the right toe leaps by" in doubt and "at 2.00 s" in doubt for doubt in found)
    assert any("the right foot, heel to toe, changes" in doubt for doubt in found)


@pytest.mark.parametrize("rate", [25.0, 50.0, 100.0, 250.0])
@pytest.mark.parametrize("speed", [0.8, 1.4])
def test_no_rate_makes_a_foot_leap(rate: float, speed: float) -> None:
    time = np.arange(0.0, 3.0, 1.0 / rate)
    leg = AnalyticWalker(speed=speed, noise=0.002).legs(time)["left"]
    assert told(points=dataclasses.replace(leg, outline=POINTS.outline)) == ()


SLOW, FAST = np.arange(0.0, 3.2, 0.01), np.arange(0.0, 3.2, 0.001)


@pytest.mark.parametrize(("late", "word"), [(0.0, ""), (0.02, ""), (0.045, "late"), (-0.08, "early")])
def test_clocks_that_differ_are_told(tmp_path: pathlib.Path, late: float, word: str) -> None:
    walk = known_walk()
    forces = write_forces(tmp_path / "grf.mot", walk, FAST)
    lines = forces.read_text().splitlines()
    head = lines.index("endheader") + 2
    moved = []
    for line in lines[head:]:
        time, rest = line.split("\t", 1)
        moved.append(f"{float(time) + late:.6f}\t{rest}")
    forces.write_text("\n".join([*lines[:head], *moved]) + "\n")
    done = import_gait([write_trc(tmp_path / "walk.trc", walk, SLOW), forces], Choices(mass=67.2))
    told = with_code(done.warnings, "force-late")
    assert [notice.data["order"] for notice in told] == [word] * bool(word)
    for notice in told:
        assert notice.data["late"] == pytest.approx(1e3 * abs(late), abs=15.0)


def test_the_outline_is_of_samples_in_which_the_foot_is_seen() -> None:
    """Heel and toe that leave the view are held at their last place, while the ankle goes on."""
    flat = np.zeros_like(TIME)
    gone = TIME > 1.0
    foot = {
        end: np.column_stack([np.where(gone, ahead - 2.0, ahead), flat])
        for end, ahead in (("heel", -0.06), ("toe", 0.19))
    }
    seen = motion(**foot, hidden=(("toe (RTOE)", 1.0, 9.0),))
    behind, ahead = _outline(dataclasses.replace(POINTS, outline={}), seen)
    assert behind == pytest.approx(-0.06 - 0.03) and ahead >= 0.19 + 0.03

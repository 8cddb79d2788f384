"""The walker's frame, against walkers drawn by geometry."""

import dataclasses
import math
import re

import analytic_walker
import numpy as np
import pytest
from analytic_walker import PITCH, TOE_OFF, AnalyticWalker, changed
from kept_inputs import FOLDER, kept
from scipy.spatial.transform import Rotation

from afo_sim.common import InputError, with_code
from afo_sim.gait_lab import Choices, import_gait
from afo_sim.gait_lab.trial.leg_points import LegPoints, leg_length, unit_doubt
from afo_sim.gait_lab.trial.travel import heading, stride_period
from afo_sim.gait_lab.trial.walking_frame import find_frame

TIME = np.arange(0.0, 4.0, 0.01)
Z = (0.0, 0.0, 1.0)


def level(degrees: float) -> tuple[float, float, float]:
    angle = math.radians(degrees)
    return math.cos(angle), math.sin(angle), 0.0


def degrees_apart(one: np.ndarray, other: object) -> float:
    return math.degrees(math.acos(min(1.0, float(one @ np.array(other)))))


@pytest.mark.parametrize("angle", [0.0, 37.0, 90.0, 135.0, 180.0, 267.0])
@pytest.mark.parametrize("belt", [0.0, 1.2])
def test_any_direction_is_found(angle: float, belt: float) -> None:
    walker = AnalyticWalker(forward=level(angle), up=Z, belt=belt, noise=0.002, sway=0.04)
    frame = find_frame(walker.legs(TIME), Choices())
    assert degrees_apart(frame.forward, walker.forward) < 1.0
    assert list(frame.up) == [0.0, 0.0, 1.0]
    assert frame.belt_speed == pytest.approx(belt, rel=0.01)
    assert frame.warnings == ()
    assert frame.span is None


@pytest.mark.parametrize("start", [0.0, 0.3, 0.7])
@pytest.mark.parametrize("belt", [0.0, 1.2])
def test_one_stride_is_enough(start: float, belt: float) -> None:
    walker = AnalyticWalker(forward=level(37.0), up=Z, belt=belt, noise=0.001)
    frame = find_frame(walker.legs(np.arange(start, start + 1.1, 0.01)), Choices())
    assert degrees_apart(frame.forward, walker.forward) < 2.0
    assert frame.belt_speed == pytest.approx(belt, rel=0.02)


@pytest.mark.parametrize(
    ("forward", "up", "along", "upward"),
    [
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), "x", "y"),
        ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), "-z", "y"),
        ((0.0, 1.0, 0.0), (0.0, 0.0, -1.0), "y", "-z"),
        (level(-87.0), Z, "-y turned by 3 deg towards x", "z"),
    ],
)
def test_the_frame_is_told_in_words(
    forward: tuple[float, float, float], up: tuple[float, float, float], along: str, upward: str
) -> None:
    frame = find_frame(AnalyticWalker(forward=forward, up=up).legs(TIME), Choices())
    (told,) = frame.notices
    assert (told.code, told.subject, told.data["belt_speed"]) == ("direction", "overground", 0.0)
    assert (told.data["forward"], told.data["up"]) == (along, upward)
    assert told.data["speed"] == pytest.approx(1.2, abs=0.005)
    (words,) = frame.remarks
    assert along in words and upward in words and "overground at 1.20 m/s" in words


def test_plane_and_across() -> None:
    frame = find_frame(AnalyticWalker(forward=level(90.0), up=Z).legs(TIME), Choices())
    points = np.array([[0.0, 2.0, 3.0], [1.0, 0.0, 0.0]])
    np.testing.assert_allclose(frame.plane(points), [[2.0, 3.0], [0.0, 0.0]], atol=1e-3)
    np.testing.assert_allclose(frame.across(points), [0.0, 1.0], atol=3e-3)  # walking along y, x is right


@pytest.mark.parametrize("out", [-20.0, 30.0])
def test_feet_turned_out_do_not_matter(out: float) -> None:
    walker = AnalyticWalker(toe_out=math.radians(out))
    frame = find_frame(walker.legs(TIME), Choices())
    assert degrees_apart(frame.forward, walker.forward) < 0.5
    assert frame.warnings == ()


def test_a_foot_turned_far_out_is_told() -> None:
    frame = find_frame(AnalyticWalker(toe_out=math.radians(50.0)).legs(TIME), Choices())
    assert "the right foot points 50 deg away" in frame.warnings[0]


def test_one_leg_without_pelvis() -> None:
    legs = AnalyticWalker(forward=level(200.0), up=Z).legs(TIME)
    alone = {"left": dataclasses.replace(legs["left"], pelvis=None)}
    frame = find_frame(alone, Choices(side="left"))
    assert degrees_apart(frame.forward, level(200.0)) < 0.5
    assert frame.warnings == ()


def test_gaps_do_not_matter() -> None:
    def lose(path: np.ndarray) -> np.ndarray:
        lost = path.copy()
        lost[:30] = lost[120:150] = lost[-20:] = np.nan
        return lost

    frame = find_frame(changed(AnalyticWalker().legs(TIME), lose), Choices())
    assert degrees_apart(frame.forward, (1.0, 0.0, 0.0)) < 0.5
    assert frame.belt_speed == 0.0


def test_standing_before_the_walk_does_not_matter() -> None:
    for belt in (0.0, 1.2):
        legs = AnalyticWalker(belt=belt).legs(TIME)
        still = {
            side: dataclasses.replace(leg, time=np.arange(0.0, 8.0, 0.01))
            for side, leg in changed(legs, lambda p: np.vstack([np.repeat(p[30:31], 400, 0), p])).items()
        }
        frame = find_frame(still, Choices())
        assert degrees_apart(frame.forward, (1.0, 0.0, 0.0)) < 1.0
        assert frame.belt_speed == pytest.approx(belt, rel=0.02)


@pytest.mark.parametrize(("speed", "period"), [(0.3, 1.8), (0.6, 1.4), (2.0, 0.9)])
def test_slow_and_fast_belts(speed: float, period: float) -> None:
    walker = AnalyticWalker(speed=speed, period=period, belt=speed, noise=0.002)
    assert find_frame(walker.legs(TIME), Choices()).belt_speed == pytest.approx(speed, rel=0.01)


@pytest.mark.parametrize("speed", [0.3, 0.8, 1.2])
def test_a_shuffling_foot_shows_the_belt(speed: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """It turns by a tenth of what a foot usually does, 2 deg up and 6 deg down."""
    monkeypatch.setattr(analytic_walker, "PITCH", lambda phase: 0.1 * PITCH(phase))
    walker = AnalyticWalker(speed=speed, period=1.0 + 0.25 / speed, belt=speed, noise=0.002)
    frame = find_frame(walker.legs(TIME), Choices())
    assert frame.belt_speed == pytest.approx(speed, rel=0.01) and not frame.warnings


def test_a_walker_who_drifts_on_the_belt() -> None:
    walker = AnalyticWalker(speed=1.25, belt=1.2, noise=0.002)
    assert find_frame(walker.legs(TIME), Choices()).belt_speed == pytest.approx(1.2, rel=0.01)


def test_a_belt_that_changes_its_speed_is_told() -> None:
    steady = find_frame(AnalyticWalker(belt=1.15, drift=0.02).legs(TIME), Choices())
    assert steady.belt_speed == pytest.approx(1.15 + 0.02 * 2.0, rel=0.01)
    assert steady.warnings == ()
    walker = AnalyticWalker(belt=1.0, drift=0.1)
    assert "the belt's speed changes" in find_frame(walker.legs(TIME), Choices()).warnings[0]


@pytest.mark.parametrize(("given", "warns"), [(1.2, 0), (1.17, 0), (1.02, 1), (1.38, 1)])
def test_a_given_belt_speed_is_compared(given: float, warns: int) -> None:
    frame = find_frame(AnalyticWalker(belt=1.2, noise=0.002).legs(TIME), Choices(belt_speed=given))
    assert frame.belt_speed == given
    assert len(frame.warnings) == warns
    if warns:
        assert f"belt_speed = {given} m/s" in frame.warnings[0]
        assert f"({100.0 * (given / 1.2 - 1.0):+.0f} %)" in frame.warnings[0]


def test_a_belt_speed_overground_is_refused() -> None:
    with pytest.raises(InputError, match="the feet stand still") as caught:
        find_frame(AnalyticWalker().legs(TIME), Choices(belt_speed=1.2))
    assert caught.value.field == "belt_speed"
    assert find_frame(AnalyticWalker().legs(TIME), Choices(belt_speed=0.0)).belt_speed == 0.0


@pytest.mark.parametrize("turn", [17.0, 28.0])
def test_a_circle_is_told_with_its_radius(turn: float) -> None:
    walker = AnalyticWalker(radius=1.32 / math.radians(turn))
    legs = walker.legs(TIME)
    frame = find_frame(legs, Choices())
    told = next(w for w in frame.warnings if "circle" in w)
    assert f"turns by {turn:.0f} deg a stride, on a circle of radius {walker.radius:.1f} m" in told
    assert frame.span is not None
    assert frame.span[1] - frame.span[0] >= walker.period
    # what the sentence says of the shank's angle, against the shank in the walker's own turning plane
    stated = float(told.split("up to ")[1].split()[0])
    straight = dataclasses.replace(walker, radius=math.inf).legs(TIME)["right"].points
    lean = np.degrees(_lean(straight["knee"].path[:, :2] - straight["ankle"].path[:, :2]))
    seen = frame.plane(legs["right"].points["knee"].path - legs["right"].points["ankle"].path)
    in_span = (frame.span[0] <= TIME) & (frame.span[1] >= TIME)
    error = np.abs(np.degrees(_lean(seen)) - lean)[in_span]
    assert error.max() < stated * math.tan(math.radians(np.abs(lean).max())) / math.tan(math.radians(40.0))


def _lean(upward: np.ndarray) -> np.ndarray:
    return np.arctan2(upward[:, 0], upward[:, 1])


def test_a_tight_circle_is_refused() -> None:
    with pytest.raises(InputError, match=r"turns by 45 deg a stride, on a circle of radius 1\.7 m"):
        find_frame(AnalyticWalker(radius=1.32 / math.radians(45.0)).legs(TIME), Choices())


def test_of_a_walk_there_and_back_the_longer_way_counts() -> None:
    def there_and_back(path: np.ndarray) -> np.ndarray:
        return np.vstack([path, path[:200] * [-1.0, 1.0, -1.0] + [4.8, 0.0, 0.0]])

    legs = {
        side: dataclasses.replace(leg, time=np.arange(0.0, 6.0, 0.01))
        for side, leg in changed(AnalyticWalker().legs(TIME), there_and_back).items()
    }
    frame = find_frame(legs, Choices())
    assert degrees_apart(frame.forward, (1.0, 0.0, 0.0)) < 2.0
    assert frame.span is not None and 3.5 < frame.span[1] < 4.6
    assert "straight from" in frame.warnings[-1]


@pytest.mark.parametrize("one_leg", [False, True])
def test_left_handed_axes_and_exchanged_sides(one_leg: bool) -> None:
    legs = AnalyticWalker(left_handed=True).legs(TIME)
    straight = AnalyticWalker().legs(TIME)
    for odd in (legs, {"right": straight["left"], "left": straight["right"]}):
        frame = find_frame({"right": odd["right"]} if one_leg else odd, Choices())
        assert degrees_apart(frame.forward, (1.0, 0.0, 0.0)) < 0.5
        if one_leg:
            assert frame.warnings == ()
        else:
            (told,) = frame.warnings
            assert "18 cm to the left" in told
            assert "left-handed" in told and "exchanged" in told


def test_heel_and_toe_exchanged_or_walking_backward_is_refused() -> None:
    legs = AnalyticWalker().legs(TIME)
    points = dict(legs["left"].points)
    points["heel"], points["toe"] = points["toe"], points["heel"]
    wrong = {**legs, "left": dataclasses.replace(legs["left"], points=points)}
    with pytest.raises(InputError, match=r"the left toe is behind the heel.*or the person walks backward"):
        find_frame(wrong, Choices())
    for belt in (0.0, 1.2):
        backward = changed(AnalyticWalker(belt=belt).legs(TIME), lambda path: path[::-1])
        with pytest.raises(InputError, match="heel and toe are exchanged, or the person walks backward"):
            find_frame(backward, Choices())


def test_legs_that_are_never_seen_are_refused() -> None:
    legs = changed(AnalyticWalker().legs(TIME), lambda path: np.full_like(path, np.nan))
    with pytest.raises(InputError, match="hip and knee are never"):
        find_frame(legs, Choices())


def test_who_stands_is_refused() -> None:
    with pytest.raises(InputError, match=r"nobody walks: the pelvis moves at 0\.00 m/s"):
        find_frame(AnalyticWalker(speed=0.0, noise=0.001).legs(TIME), Choices())
    still = changed(AnalyticWalker(noise=0.001).legs(TIME), lambda path: np.repeat(path[:1], len(path), 0))
    with pytest.raises(InputError, match="nobody walks"):
        find_frame(still, Choices())


def test_a_given_axis_goes_first() -> None:
    legs = AnalyticWalker(forward=level(10.0), up=Z).legs(TIME)
    frame = find_frame(legs, Choices(forward="x", up="z"))
    assert list(frame.forward) == [1.0, 0.0, 0.0]
    assert frame.warnings == ()
    legs = AnalyticWalker(forward=level(30.0), up=Z).legs(TIME)
    frame = find_frame(legs, Choices(forward="x"))
    assert list(frame.forward) == [1.0, 0.0, 0.0]
    assert frame.warnings == ("forward = x is taken, but the walk goes 30 deg away from it",)
    with pytest.raises(InputError, match="the walk goes along x turned by 30 deg towards y") as caught:
        find_frame(legs, Choices(forward="-x"))
    assert caught.value.field == "forward"
    for across in ("y", "z"):  # z is up
        with pytest.raises(InputError, match="the walk goes along"):
            find_frame(AnalyticWalker(forward=level(10.0), up=Z).legs(TIME), Choices(forward=across))
    with pytest.raises(InputError, match="the legs stand along z"):
        find_frame(legs, Choices(up="y"))


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1000.0, "millimetres"), (100.0, "centimetres"), (0.001, "metres read as millimetres")],
)
def test_a_wrong_unit_is_told_with_its_factor(factor: float, unit: str) -> None:
    legs = changed(AnalyticWalker().legs(TIME), lambda path: path * factor)
    assert leg_length(legs["right"]) == pytest.approx(0.84 * factor, rel=1e-3)  # two segments of 0.42 m
    with pytest.raises(InputError, match=rf"{unit}\? divided by {factor:g} it is 0\.84 m") as caught:
        find_frame(legs, Choices())
    assert caught.value.field == "Units"


@pytest.mark.parametrize("length", [0.2, 0.4, 1.1])
def test_legs_of_children_and_giants_are_no_doubt(length: float) -> None:
    legs = changed(AnalyticWalker().legs(TIME), lambda path: path * length / 0.84)
    assert unit_doubt(legs["right"]) is None


def test_a_leg_of_no_unit_says_so() -> None:
    legs = changed(AnalyticWalker().legs(TIME), lambda path: path * 1.7)
    assert "no unit of length" in str(unit_doubt(legs["right"]))


@pytest.mark.parametrize("period", [0.7, 1.1, 2.3])
def test_the_stride_time_is_found(period: float) -> None:
    walker = AnalyticWalker(period=period, speed=1.2 * 1.1 / period, noise=0.001)
    legs = walker.legs(np.arange(0.0, 7.0, 0.01))
    up = np.array(walker.up)
    for some in (legs, {"left": legs["left"]}):
        assert stride_period(some, up) == pytest.approx(period, abs=0.02)
    assert stride_period(walker.legs(np.arange(0.0, 0.9 * period, 0.01)), up) is None


def test_heading_of_a_circle() -> None:
    angle = 0.3 * TIME
    path = 4.0 * np.column_stack([np.sin(angle), 1.0 - np.cos(angle)])
    found = heading(TIME, path, 1.0)
    assert found.turn == pytest.approx(0.3, abs=0.005)
    assert found.speed == pytest.approx(1.2, rel=0.01)
    # a run of strides within 15 deg, each 0.003 rad on; its ends turn by half a stride's turn more
    assert 2.0 * found.off - found.turn == pytest.approx(np.radians(15.0) // 0.003 * 0.003, abs=1e-6)
    straight = heading(TIME, np.column_stack([1.2 * TIME, 0.5 * TIME]), 1.0)
    assert straight.whole and straight.span == pytest.approx((TIME[0], TIME[-1]))
    assert (straight.off, straight.turn) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert straight.speed == pytest.approx(1.3) and straight.stride_length == pytest.approx(1.3)
    assert straight.direction == pytest.approx([12.0 / 13.0, 5.0 / 13.0])


# ---- slopes, stairs, chairs ------------------------------------------------------------------------------


def sloped(walker: AnalyticWalker, degrees: float) -> dict[str, LegPoints]:
    """The walker's paths tilted as on a ramp or an inclined belt; forward is x, up y."""
    turn = Rotation.from_rotvec([0.0, 0.0, math.radians(degrees)])
    return changed(walker.legs(TIME), lambda path: turn.apply(path))


def on_stairs(riser: float, tread: float, first: int = 0) -> dict[str, LegPoints]:
    """Up or down stairs, a step a foot: each foot rises by two risers in swing, the body evenly.

    Of the steps before `first` none rises.
    """
    walker = AnalyticWalker(speed=2.0 * tread / 1.3, period=1.3)
    found = walker.legs(TIME)
    body = 2.0 * riser * np.maximum(TIME / walker.period - first, 0.0)
    for side, leg in found.items():
        strides = TIME / walker.period + (0.0 if side == "right" else 0.5)
        share = np.clip((strides % 1.0 - TOE_OFF) / (1.0 - TOE_OFF), 0.0, 1.0)
        step = np.floor(strides) + share**2 * (3.0 - 2.0 * share)
        foot = 2.0 * riser * np.maximum(step - first, 0.0)
        rises = {"hip": body, "knee": 0.5 * (body + foot), "ankle": foot, "heel": foot, "toe": foot}
        points = {
            role: dataclasses.replace(leg.points[role], path=leg.points[role].path + np.outer(rise, Y))
            for role, rise in rises.items()
        }
        assert leg.pelvis is not None
        found[side] = dataclasses.replace(leg, points=points, pelvis=leg.pelvis + np.outer(body, Y))
    return found


Y = np.array([0.0, 1.0, 0.0])


@pytest.mark.parametrize("belt", [0.0, 1.2])
@pytest.mark.parametrize("degrees", [-15.0, -10.0, -5.0, -2.5, 2.5, 5.0, 10.0, 15.0])
def test_a_slope_is_refused_by_what_it_is(degrees: float, belt: float) -> None:
    with pytest.raises(InputError) as caught:
        find_frame(sloped(AnalyticWalker(belt=belt, noise=0.002), degrees), Choices())
    where, found = re.search(r"goes (\w+) by .*\((\S+) deg\)", caught.value.problem).groups()
    assert where == ("up" if degrees > 0.0 else "down")
    assert float(found) == pytest.approx(abs(degrees), abs=0.3)
    assert "level floor" in str(caught.value.allowed)


@pytest.mark.parametrize("belt", [0.0, 1.2])
@pytest.mark.parametrize("degrees", [-1.5, 1.5])
def test_a_ramp_is_told_and_read(degrees: float, belt: float) -> None:
    frame = find_frame(sloped(AnalyticWalker(belt=belt, noise=0.002), degrees), Choices())
    (told,) = with_code(frame.notices, "floor-slopes")
    assert told.severity == "warning" and told.data["tilt"] == pytest.approx(1.5, abs=0.3)
    assert frame.belt_speed == pytest.approx(belt, rel=0.02)


@pytest.mark.parametrize("riser", [-0.17, 0.17])
def test_stairs_are_refused(riser: float) -> None:
    with pytest.raises(InputError, match="stairs") as caught:
        find_frame(on_stairs(riser, 0.29), Choices())
    found = float(re.search(r"\((\S+) deg\)", caught.value.problem)[1])
    assert found == pytest.approx(math.degrees(math.atan(0.17 / 0.29)), abs=2.0)


def test_a_single_kerb_is_refused() -> None:
    with pytest.raises(InputError, match="stairs"):
        find_frame(on_stairs(0.06, 0.6, first=2), Choices())


@pytest.mark.parametrize("low", [0.4, -0.1])
def test_a_body_that_rises_over_a_level_floor_is_no_slope(low: float) -> None:
    """Who sits at first, or walks in a crouch at last, has the same ground under the feet."""
    fall = low * np.clip((1.5 - TIME) / 1.5, 0.0, 1.0)
    legs = {
        side: dataclasses.replace(
            leg,
            pelvis=leg.pelvis - np.outer(fall, Y),
            points={
                role: dataclasses.replace(point, path=point.path - np.outer(fall * (role == "hip"), Y))
                for role, point in leg.points.items()
            },
        )
        for side, leg in AnalyticWalker(noise=0.002).legs(TIME).items()
        if leg.pelvis is not None
    }
    assert not with_code(find_frame(legs, Choices()).notices, "floor-slopes")


@pytest.mark.parametrize("speed", [0.2, 0.5, 1.2, 2.0])
@pytest.mark.parametrize("belt", [False, True])
def test_a_level_floor_is_level_with_noise_too(speed: float, belt: bool) -> None:
    walker = AnalyticWalker(speed=speed, period=1.1 + 0.2 / speed, belt=belt * speed, noise=0.005)
    assert not with_code(find_frame(walker.legs(TIME), Choices()).notices, "floor-slopes")


@kept("slope_down")
def test_a_walk_down_a_slope() -> None:
    with pytest.raises(InputError, match=r"goes down by .* \(15.1 deg\): a slope"):
        import_gait([FOLDER / "slope_down" / "walk.c3d"], Choices())

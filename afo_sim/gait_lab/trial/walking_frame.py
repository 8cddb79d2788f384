"""The walker's frame in the laboratory: forward, up, to the right, and the speed of the treadmill's belt."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, Notice
from afo_sim.gait_lab.noted import Noted, note
from afo_sim.gait_lab.readers.signals import low_pass, stretches
from afo_sim.gait_lab.trial.choices import AXES, Choices, axis_vector, nearest_axis
from afo_sim.gait_lab.trial.leg_points import LegPoints, mean_place, unit_doubt
from afo_sim.gait_lab.trial.travel import SMOOTH, Heading, body_path, heading, seen, stride_period

_UPRIGHT = 30.0  # largest mean lean of the line from ankle to hip from up; assumed [deg]
_CROUCHED = 60.0  # likewise of shank and thigh, which lean in a crouched walk; assumed [deg]
_STANDING = 0.1  # speed that is no walking; slow patients walk at 0.2 m/s; assumed [m/s]
_ON_BELT = 0.3  # of the walking speed, from which on the standing foot's speed is a belt's; assumed [-]
_OFF_AXIS = 20.0  # between the given forward axis and travel [deg]
_ACROSS = 60.0  # likewise: beyond it less than half of each step is in the plane; derived [deg]
_TURN = 15.0  # of the direction over a stride from which on a walk is curved [deg]
_TURN_LIMIT = 30.0  # beyond it a stride's ends are seen more than 1 deg wrong; derived: a leg that leans by
# `_LEAN` is seen at tan(seen) = tan(_LEAN) cos(turn / 2) [deg]
_LEAN = 40.0  # of a shank at toe-off, about its largest in walking [deg]
_TURNED_OUT = 45.0  # of a foot [deg]
_APART = 0.02  # distance of the hips below which right and left are not told apart; assumed [m]

_TURNS, _MOVES = 0.3, 0.2  # of a foot's fastest turning and motion: below both it lies flat; assumed [-]
_RIPPLE = 0.01  # of the heel's height over the toe's while the foot lies flat; assumed [m]
_WAY = 0.2  # least way over which the feet show whether the ground is level; assumed [m]
# Tilt of the ground that is told, and refused [deg]: the ankle's zero is wrong by as much, which markers
# place to 2.2 RMS; level ones showed up to 0.3 (measured)
_RAMP, _SLOPE = 1.0, 2.0
_STEP = 0.05  # of the ground beside the line through it, that is no level floor; assumed [m]
_STEADY = 0.08  # shortest time of a foot's rest that shows its speed; assumed [s]
_BELT_ERROR = 0.05  # between the belt's speeds as given and as found
_BELT_SPREAD = 0.1  # of the belt's speed from step to step, or between the feet; assumed


@dataclass(frozen=True, eq=False)
class _StandingFoot:
    """What a foot does while it stands: nothing on a floor, a way back on a belt."""

    velocity: np.ndarray  # in the two level axes [m/s] (2,)
    speeds: np.ndarray  # of each time it stood [m/s] (k,)
    places: np.ndarray  # of its middle [m] (n, 3)


@dataclass(frozen=True, eq=False)
class WalkingFrame(Noted):
    """The directions in which a walk is looked at; unit vectors in the laboratory's axes."""

    forward: np.ndarray  # level, in the direction of travel (3,)
    up: np.ndarray  # an axis of the laboratory (3,)
    belt_speed: float  # of a treadmill, backward; 0 overground [m/s]
    notices: tuple[Notice, ...] = ()
    floor: float = 0.0  # height of the plates above the laboratory's zero, upward [m]
    span: tuple[float, float] | None = None  # the straight part of a walk that turns [s]; None: all of it

    def plane(self, points: np.ndarray) -> np.ndarray:
        """(…, 3) in the laboratory → (…, 2): forward, up."""
        return np.stack([points @ self.forward, points @ self.up], axis=-1)

    def over_floor(self, points: np.ndarray) -> np.ndarray:
        """Places (…, 3) in the laboratory → (…, 2): forward, and up from the floor."""
        return self.plane(points) - np.array([0.0, self.floor])

    def across(self, points: np.ndarray) -> np.ndarray:
        """(…, 3) in the laboratory → (…), to the walker's right in a right-handed laboratory."""
        return np.asarray(points @ np.cross(self.forward, self.up))

    def within(self, leg: LegPoints, values: np.ndarray) -> np.ndarray:
        """Those samples of a leg's values (n, …) that are of the straight part of the walk."""
        if self.span is None:
            return values
        return values[(leg.time >= self.span[0]) & (leg.time <= self.span[1])]


def find_frame(legs: Mapping[str, LegPoints], choices: Choices) -> WalkingFrame:
    """The walker's frame: up by the upright legs, forward by the travel of the body."""
    for doubt in filter(None, map(unit_doubt, legs.values())):
        raise InputError(doubt, field="Units")
    up = _up(legs, choices)
    level = [k for k in range(3) if up[k] == 0.0]
    period = stride_period(legs, up)
    time, path, what = body_path(legs)
    if len(time) < 3:
        raise InputError(
            "the walking direction cannot be determined: neither pelvis, hip nor ankle is visible"
        )
    body = heading(time, path[:, level], period)
    feet = {side: _standing_foot(leg, up, period) for side, leg in legs.items()}
    found = [foot.velocity for foot in feet.values() if len(foot.speeds)]
    under = np.mean(found, axis=0) if found else np.zeros(2)  # velocity of what is under the feet
    speed = float(np.linalg.norm(body.speed * body.direction - under))
    if speed < _STANDING:
        problem = f"nobody walks: the {what} moves at {speed:.2f} m/s over the ground under the feet"
        raise InputError(problem, allowed=f"a walking trial, of {_STANDING:g} m/s or faster")
    belt = bool(np.linalg.norm(under) > _ON_BELT * speed)
    flat = -under / np.linalg.norm(under) if belt else body.direction
    travel = np.zeros(3)
    travel[level] = flat
    sloping = _require_level(feet, travel, up)
    forward, off_axis = _forward(travel, choices)
    span, turns = (None, []) if belt else _span(body)
    belt_speed, belts = _belt_speed_of(feet, float(np.linalg.norm(under)) if belt else 0.0, choices)
    text = "walks along {forward}, up is {up}, "
    text += "belt {belt_speed:.2f} m/s" if belt else "overground at {speed:.2f} m/s"
    data = {"forward": _in_words(forward), "up": nearest_axis(up), "belt_speed": belt_speed, "speed": speed}
    walks = note("direction", text, subject="belt" if belt else "overground", **data)
    frame = WalkingFrame(forward, up, belt_speed, span=span)
    feet_ahead, sides = _require_feet_ahead(legs, frame), _exchanged_sides(legs, frame)
    notices = (walks, *sloping, *off_axis, *turns, *belts, *feet_ahead, *sides)
    return dataclasses.replace(frame, notices=notices)


def _up(legs: Mapping[str, LegPoints], choices: Choices) -> np.ndarray:
    """The axis in which hips are above knees, and knees above ankles."""
    parts = {}
    for upper, lower in (("hip", "knee"), ("knee", "ankle")):
        each = [leg.points[upper].path - leg.points[lower].path for leg in legs.values()]
        parts[upper, lower] = mean_place(np.concatenate(each))
        if np.isnan(parts[upper, lower]).any():
            raise InputError(f"{upper} and {lower} are never visible together")
    whole = sum(parts.values(), np.zeros(3))
    name = choices.up or nearest_axis(whole)
    up = axis_vector(name)
    for (upper, lower), part in {**parts, ("hip", "ankle"): whole}.items():
        lean = math.degrees(math.acos(np.clip(part @ up / np.linalg.norm(part), -1.0, 1.0)))
        limit = _UPRIGHT if (upper, lower) == ("hip", "ankle") else _CROUCHED
        if lean > limit:
            problem = f"the line from {lower} to {upper} leans {lean:.0f} deg from {name} on average"
            problem += f": {lower} and {upper} exchanged?" if lean > 90.0 else ""
            nearest = "" if choices.up is None else f"; the legs stand along {nearest_axis(whole)}"
            allowed = f"the axis upward, {', '.join(AXES)}, within {limit:.0f} deg{nearest}"
            raise InputError(problem, field="up", value=choices.up, allowed=allowed)
    return up


def _forward(travel: np.ndarray, choices: Choices) -> tuple[np.ndarray, list[Notice]]:
    """The direction of travel, or the axis that was chosen; warnings."""
    if choices.forward is None:
        return travel, []
    forward = axis_vector(choices.forward)
    off = math.degrees(math.acos(np.clip(forward @ travel, -1.0, 1.0)))
    if off > _ACROSS:
        problem = f"the walk goes along {_in_words(travel)}, {off:.0f} deg away"
        allowed = f"an axis within {_ACROSS:.0f} deg of the walk, or none"
        raise InputError(problem, field="forward", value=choices.forward, allowed=allowed)
    text = "forward = {subject} is taken, but the walk goes {off:.0f} deg away from it"
    doubt = Notice("forward-off-walk", text, subject=choices.forward, off=off)
    return forward, [doubt] if off > _OFF_AXIS else []


def _span(body: Heading) -> tuple[tuple[float, float] | None, list[Notice]]:
    """The straight part of a walk that turns, and warnings; a circle too tight for one plane is refused."""
    warnings = []
    turn = abs(math.degrees(body.turn))
    if turn > _TURN:
        radius = body.stride_length / (2.0 * math.sin(0.5 * abs(body.turn)))
        circle = "the walk turns by {turn:.0f} deg a stride, on a circle of radius {radius:.1f} m"
        if turn > _TURN_LIMIT:
            seen = circle.format(turn=turn, radius=radius)
            allowed = f"a walk that turns by at most {_TURN_LIMIT:.0f} deg a stride"
            raise InputError(
                f"{seen}: no single plane shows a stride's leg angles within 1 deg", allowed=allowed
            )
        error = _LEAN - math.degrees(math.atan(math.tan(math.radians(_LEAN)) * math.cos(body.off)))
        text = f"{circle}: a leg that leans {{lean:.0f}} deg is seen up to {{error:.1f}} deg wrong"
        warnings.append(Notice("walk-turns", text, turn=turn, radius=radius, lean=_LEAN, error=error))
    if body.whole:
        return None, warnings
    start, end = body.span
    text = "the walk is straight from {start:.2f} to {end:.2f} s only: strides are looked for there"
    warnings.append(Notice("walk-straight-in-part", text, start=start, end=end))
    return body.span, warnings


def _require_feet_ahead(legs: Mapping[str, LegPoints], frame: WalkingFrame) -> list[Notice]:
    """Refuse toes behind their heels; a warning on feet that are turned far out."""
    warnings = []
    for side, leg in legs.items():
        foot = mean_place(frame.within(leg, leg.points["toe"].path - leg.points["heel"].path))
        ahead, aside = float(foot @ frame.forward), float(frame.across(foot))
        if ahead < 0.0:
            travel = _in_words(frame.forward)
            problem = f"the {side} toe is behind the heel in the direction of travel, {travel}"
            if leg.by_angles:
                problem = f"by these joint angles {problem}: the person walks backward, or the model is "
                problem += "another person's, or the angles' unit is another"
                allowed = "joint angles of a walk forward, in their own unit, and that person's model"
                raise InputError(problem, field="angles", allowed=allowed)
            problem += ": heel and toe are exchanged, or the person walks backward"
            allowed = "a toe ahead of its heel in a walk forward"
            raise InputError(problem, field="marker.heel", allowed=allowed)
        out = math.degrees(math.atan2(abs(aside), ahead))
        if out > _TURNED_OUT:
            text = "the {subject} foot points {out:.0f} deg away from the direction of travel: its sagittal "
            text += "angle is not its joint angle"
            warnings.append(Notice("foot-turned-out", text, subject=side, out=out))
    return warnings


def _exchanged_sides(legs: Mapping[str, LegPoints], frame: WalkingFrame) -> list[Notice]:
    """The right leg is on the walker's right, unless the laboratory is left-handed or sides are exchanged."""
    if len(legs) < 2 or len(legs["right"].time) != len(legs["left"].time):
        return []
    for role in ("hip", "knee", "ankle"):
        apart = legs["right"].points[role].path - legs["left"].points[role].path
        right = float(frame.across(mean_place(frame.within(legs["right"], apart))))
        if abs(right) > _APART:
            break
    if not right < -_APART:
        return []
    text = "the right {subject} is {apart_cm:.0f} cm to the left of the left one: the laboratory's axes are "
    text += "left-handed (then all is well), or right and left are exchanged; sagittal angles are the same, "
    text += "but check which leg is which"
    return [Notice("sides-exchanged", text, subject=role, apart_cm=-100.0 * right)]


def _in_words(vector: np.ndarray) -> str:
    """A level direction as the nearest axis and the angle from there towards another axis."""
    axis = nearest_axis(vector)
    rest = vector - (vector @ axis_vector(axis)) * axis_vector(axis)
    turned = math.degrees(math.asin(min(1.0, float(np.linalg.norm(rest)))))
    return axis if turned < 0.5 else f"{axis} turned by {turned:.0f} deg towards {nearest_axis(rest)}"


def _standing_foot(leg: LegPoints, up: np.ndarray, period: float | None) -> _StandingFoot:
    """How a foot moves, and where, while it lies flat: both its ends go the same way, and no faster."""
    nothing = _StandingFoot(np.zeros(2), np.zeros(0), np.zeros((0, 3)))
    paths = np.hstack([leg.points["heel"].path, leg.points["toe"].path])
    time, ends = seen(leg.time, paths)
    if len(time) < 10:
        return nothing
    heel, toe = np.split(low_pass(time, ends, SMOOTH), 2, axis=1)
    middle, level = 0.5 * (heel + toe), np.eye(3)[up == 0.0].T
    speed, turning = np.gradient(middle @ level, time, axis=0), np.gradient(heel - toe, time, axis=0)
    turning = np.linalg.norm(turning, axis=1)
    swing = np.flatnonzero(turning > 0.5 * turning.max())
    reach = period or math.inf
    walks = (time >= time[swing[0]] - reach) & (time <= time[swing[-1]] + reach)
    walks &= np.interp(time, leg.time, np.isfinite(paths).all(axis=1)) > 0.9  # a bridged gap turns nowhere
    still = walks & (turning <= _TURNS * turning.max())
    if not still.any():
        return nothing
    moved = np.linalg.norm(speed - np.median(speed[still], axis=0), axis=1)
    pitch = np.abs((heel - toe) @ up - np.median((heel - toe)[still] @ up))
    flat = still & (moved < _MOVES * np.quantile(moved[walks], 0.98)) & (pitch < _RIPPLE)
    runs = stretches(flat)
    # before the first and after the last swing the walker may stand on a belt that stands
    between = [run for run in runs if swing[0] < run[0] and run[1] <= swing[-1]]
    found, weights = [], []
    for start, stop in between or runs:
        clock = time[start:stop] - time[start:stop].mean()
        if clock[-1] - clock[0] >= _STEADY:
            weights.append(float(clock @ clock))
            found.append(clock @ middle[start:stop] @ level / weights[-1])
    if not found:
        return nothing
    velocity = np.average(found, axis=0, weights=weights)
    return _StandingFoot(velocity, np.linalg.norm(found, axis=1), middle[flat])


def _require_level(feet: Mapping[str, _StandingFoot], travel: np.ndarray, up: np.ndarray) -> list[Notice]:
    """Refuse a slope or stairs, by where the feet lie flat; a warning on a ramp."""
    places = [foot.places for foot in feet.values()]
    way, height = (np.concatenate(places) @ axis for axis in (travel, up))
    if not len(way) or np.ptp(way) < _WAY:
        return []
    # a straight line; one foot's markers may sit higher than the other's, but by no more than they must
    foot = np.repeat([-0.5, 0.5][: len(places)], [len(own) for own in places])
    rows = np.vstack([np.column_stack([np.ones_like(way), way, foot]), [0.0, 0.0, 1.0]])
    line = np.linalg.lstsq(rows, np.append(height, 0.0))[0]
    tilt, uneven = math.degrees(math.atan(line[1])), np.ptp(height - rows[:-1] @ line)
    over, rise = np.ptp(way), np.ptp(height)
    if rise < _RIPPLE or (abs(tilt) < _RAMP and uneven < _STEP):
        return []
    text = "the ground underfoot goes {subject} by {rise:.2f} m over {over:.1f} m of way ({tilt:.1f} deg)"
    where = "up" if tilt > 0.0 else "down"
    found = Notice("floor-slopes", text, subject=where, rise=rise, over=over, tilt=abs(tilt))
    if abs(tilt) > _SLOPE or uneven > _STEP:
        raise InputError(f"{found}: a slope or stairs", allowed="a walk on a level floor")
    return [found]


def _belt_speed_of(
    feet: Mapping[str, _StandingFoot], found: float, choices: Choices
) -> tuple[float, list[Notice]]:
    """Speed of the belt under the chosen foot as given, or else as found [m/s], and warnings."""
    warnings = []
    speeds = {side: float(np.linalg.norm(foot.velocity)) for side, foot in feet.items() if len(foot.speeds)}
    if found and max(speeds.values()) - min(speeds.values()) > _BELT_SPREAD * found:
        each = ", ".join(f"{side} {speed:.2f}" for side, speed in speeds.items())
        text = "the belt speeds of the two feet differ: {each} m/s; the {subject} one is used"
        warnings.append(Notice("belts-differ", text, subject=choices.side, each=each))
        found = speeds.get(choices.side, found)
    steps = np.concatenate([foot.speeds for foot in feet.values()])
    if found and len(speeds) and np.ptp(steps) > 2.0 * _BELT_SPREAD * found:
        text = "the belt's speed changes from step to step, {low:.2f} to {high:.2f} m/s; its mean is used"
        warnings.append(Notice("belt-unsteady", text, low=float(steps.min()), high=float(steps.max())))
    given = choices.belt_speed
    if given is None:
        return found, warnings
    if given and not found:
        problem = "the feet stand still on the ground"
        allowed = "no belt speed for overground walking, or if the belt's travel is already added"
        raise InputError(problem, field="belt_speed", value=given, allowed=allowed)
    if abs(given - found) > _BELT_ERROR * found:
        text = "belt_speed = {given:.3g} m/s is taken, but the standing foot moves at {found:.3g} m/s "
        text += "({percent:+.0f} %)"
        percent = 100.0 * (given / found - 1.0)
        warnings.append(Notice("belt-speed-differs", text, given=given, found=found, percent=percent))
    return given, warnings

"""Plausibility of a stride that was cut from a trial: markers, clocks and curves that are odd."""

from collections.abc import Mapping

import numpy as np

from afo_sim import gait
from afo_sim.common import InputError, Keywords, Notice
from afo_sim.gait_lab.trial.ground_force import GroundForce
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.leg_points import LegPoints

_ADULT = 1.75  # height of a person of whom none is known; assumed [m]
_ZERO = (15.0, 60.0)  # of the ankle angle, moved by more than this: reported, refused; assumed [deg]
_ANKLE_HEIGHT = (0.05, 0.12)  # of an adult in shoes or without; 0.079–0.082 measured barefoot [m]
_ADULT_SHANK = 0.4  # knee to ankle; a shorter one makes the lower limit lower in proportion [m]
_PEAK = (0.6, 2.2)  # plantarflexor moment of weak push-off, and of runners [N·m/kg]; assumed
_MARGIN = 0.03  # of the centre of pressure beyond the sole's outline; assumed [m]
_TOES = 0.12  # beyond the metatarsal heads: 38 % of a foot of 24 cm lie ahead of the fifth; derived [m]
_ONE_POINT = 0.02  # of ankle and heel, below which they are one; an adult's is 7 to 10 cm; assumed [m]
_WHOLE_FOOT = 0.25  # heel to toe of an adult; what is shorter ends at the metatarsal heads; assumed [m]
_TRAVEL = 0.01  # least way of the centre of pressure in a stance; a toe walker's is some cm; assumed [m]
_NO_MOMENT = 0.05  # plantarflexor peak that no stance is without; assumed [N·m/kg]
_OUTSIDE = 0.1  # share of stance with the centre of pressure outside; assumed
_BEHIND = 0.05  # likewise behind the heel, where it is for its first instants alone; assumed
_HYPEREXTENSION = 20.0  # of the knee [deg]
_MOTION_RATE, _FORCE_RATE = 25.0, 100.0  # below them heel strike and toe-off are blurred; assumed [Hz]
_MOMENT_ERROR = 0.1  # RMS in stance against the reference [N·m/kg]
_FORWARD = 0.005  # fore-and-aft force that is none; slow patients' peak is 0.03; assumed [body weights]
_EXPLAINED = 0.5  # of the RMS: what leaves less explains the difference; assumed
_UNLOADED = 0.1  # of the plantarflexor moment's peak: less is the foot's own weight and inertia; derived
_LONGEST_SHIFT = 0.1  # in time that is tried, as a share of the stride; assumed

_SEGMENTS = {"thigh": ("hip", "knee"), "shank": ("knee", "ankle"), "foot": ("heel", "toe")}
_THIGH_TO_SHANK = (0.75, 1.35)  # lengths; 0.87 to 1.04 in two models and three sets of markers (assumed) [-]
_CHANGE = 0.1  # of a segment's length; skin moves markers by some centimetres of 0.4 m; assumed
_LEAP = 0.1  # of a point in a frame, from where it would have gone; assumed [m]
_ACCELERATION = 60.0  # of a foot at heel strike, that adds to it half a frame's time squared; assumed [m/s²]
_LONGEST_STEP = 0.1  # between two samples over which a point's way can be foretold [s]
_UNEVEN = 0.1  # of the usual step of time, that a step may differ


def doubts(
    cycle: gait.GaitCycle, points: LegPoints, motion: LegMotion, ground: GroundForce | None, zero: float,
    reference: np.ndarray | None,
) -> tuple[Notice, ...]:  # fmt: skip
    """What a person should look at in a stride, one sentence with its number each."""
    compensated = gait.signs(cycle, cycle.body_height or _ADULT) if cycle.walker == "patient" else ()
    found = [*(compensated or walker_doubts(cycle)), *gait.closing_doubts(cycle), *_zero(zero), *_flat(cycle)]
    found += [*_ankle_height(cycle, points), *_knee(cycle)]
    found += _pressure(cycle, *_outline(points, motion))
    if np.isfinite(cycle.grf_x).all() and np.abs(cycle.grf_x).max() <= _FORWARD:
        text = "the ground force has no forward or backward component: a plate that measures only vertical "
        text += "force? The ankle moment then lacks that force times {height_cm:.0f} cm"
        found.append(Notice("no-shear-force", text, height_cm=100.0 * cycle.ankle_height))
    found += _moment_peak(cycle)
    _require_ankle(cycle, points)
    if reference is not None:
        found += _against_reference(cycle, reference)
    found += _steps_of_time("the motion", points.time, _MOTION_RATE)
    for name, (time, _) in ({} if ground is None else ground.plates).items():
        found += _steps_of_time(f"plate {name}", time, _FORCE_RATE)
    lengths = {
        name: np.linalg.norm(points.points[upper].path - points.points[lower].path, axis=1)
        for name, (upper, lower) in _SEGMENTS.items()
    }
    found += _lengths(points, lengths) + _proportion(points, lengths) + _leaps(points)
    return tuple(found)


def walker_doubts(cycle: gait.GaitCycle) -> list[Notice]:
    """A warning if the ankle contradicts `walker`; none if `walker` is unknown."""
    mean, beyond = gait.swing_off_norm(cycle)
    if cycle.walker == "healthy" and beyond > gait.PEOPLE:
        text = "in swing the ankle is {mean:+.0f} deg off the norm's band ({beyond:.0f} deg RMS), more than "
        text += "healthy people's spread of {limit:.0f} deg: if it is the patient's own walk, import it with "
        text += "{subject} patient, else the weakness counts twice"
        return [
            Notice("walker-not-usual", text, subject="walker", limit=gait.PEOPLE, beyond=beyond, mean=mean)
        ]
    return [*gait.as_healthy(cycle)] if cycle.walker == "patient" else []


def _zero(zero: float) -> list[Notice]:
    degrees = float(np.degrees(np.arctan2(np.sin(zero), np.cos(zero))))
    if abs(degrees) > _ZERO[1]:
        problem = f"the foot's line lies {degrees:+.0f} deg from the floor while the foot is flat: heel and "
        problem += "toe are exchanged, or the ankle angle uses another convention"
        allowed = f"a line from heel to toe within {_ZERO[1]:.0f} deg of the sole"
        raise InputError(problem, field="marker.heel", allowed=allowed)
    if abs(degrees) <= _ZERO[0]:
        return []
    text = "the ankle's zero was moved by {moved:+.0f} deg, so that the flat foot is level: more than "
    text += "{usual:.0f} deg is a marker at another place, or a foot that never lies flat"
    return [Notice("ankle-zero-far", text, moved=-degrees, usual=_ZERO[0])]


def _flat(cycle: gait.GaitCycle) -> list[Notice]:
    if cycle.flat.steady:
        return []
    text = "the foot is never steady for {least:.0f} % of the stride between {low:.0f} and {high:.0f} %: "
    text += "{taken} are taken as flat, and with them the ankle's zero and height"
    low, high = (100.0 * share for share in gait.WITHIN)
    data: Keywords = {"least": 100.0 * gait.LEAST, "low": low, "high": high, "taken": cycle.flat.words}
    return [Notice("foot-never-flat", text, **data)]


def _ankle_height(cycle: gait.GaitCycle, points: LegPoints) -> list[Notice]:
    low, high = _ANKLE_HEIGHT[0] * _shank(points) / _ADULT_SHANK, _ANKLE_HEIGHT[1]
    stated = points.ankle_height  # of a model or a standing trial
    if stated is not None:
        low, high = stated - gait.HEIGHT_ERROR, stated + gait.HEIGHT_ERROR
    height = float(cycle.ankle_z[cycle.foot_flat()].min())  # a heel that leaves early raises the mean
    if low <= height <= high:
        return []
    text = "the ankle is {height_cm:.1f} cm above the floor with the foot flat; of this leg {low_cm:.0f} to "
    text += "{high_cm:.0f} cm is usual: is the floor at 0, the foot ever flat?"
    data: Keywords = {"height_cm": 100.0 * height, "low_cm": 100.0 * low, "high_cm": 100.0 * high}
    return [Notice("ankle-height", text, **data)]


def _require_ankle(cycle: gait.GaitCycle, points: LegPoints) -> None:
    """Refuse an ankle that is the heel, or that is both too low and has too great a moment."""
    way = points.points["ankle"].path - points.points["heel"].path
    seen = np.linalg.norm(way[np.all(np.isfinite(way), axis=1)], axis=1)
    if len(seen) and np.median(seen) < _ONE_POINT:
        problem = f"the ankle lies {1e3 * np.median(seen):.0f} mm from the heel: "
        problem += "is one marker used for both?"
        allowed = f"an ankle {1e3 * _ONE_POINT:.0f} mm or more from the heel's marker"
        raise InputError(problem, field="marker.ankle", allowed=allowed)
    low = _ANKLE_HEIGHT[0] * _shank(points) / _ADULT_SHANK
    height = float(cycle.ankle_z[cycle.foot_flat()].min())
    peak = float(np.nan_to_num(-cycle.ankle_moment).max())
    if height < low and peak > _PEAK[1]:
        problem = f"the ankle is {100.0 * height:.1f} cm above the floor with the foot flat, and its moment "
        problem += f"peaks at {peak:.2f} N·m/kg: is another point, such as the heel, taken for it?"
        allowed = f"an ankle {100.0 * low:.0f} cm or more above the floor, or a peak up to {_PEAK[1]:g}"
        raise InputError(problem, field="marker.ankle", allowed=allowed)


def _shank(points: LegPoints) -> float:
    """Length of the shank, an adult's at most [m]."""
    line = points.points["knee"].path - points.points["ankle"].path
    seen = line[np.all(np.isfinite(line), axis=1)]
    return min(_ADULT_SHANK, float(np.median(np.linalg.norm(seen, axis=1)))) if len(seen) else _ADULT_SHANK


def _knee(cycle: gait.GaitCycle) -> list[Notice]:
    knee = np.degrees(cycle.knee_angle)
    most, mostly = -float(knee.min()), np.median(knee) < 0.0
    doubt = ", and for most of the stride: its sign, or the knee's place" if mostly else ": the knee's place"
    text = f"the knee bends backward by up to {{most:.0f}} deg{doubt}?"
    return [Notice("knee-backward", text, most=most)] if mostly or most > _HYPEREXTENSION else []


def _outline(points: LegPoints, motion: LegMotion) -> tuple[float, float]:
    """Where the centre of pressure can be ahead of the ankle with the foot flat: last and first [m]."""
    if {"heel", "toe"} <= set(points.outline):
        behind, ahead = points.outline["heel"], points.outline["toe"]
    else:
        seen = np.ones(len(motion.time), dtype=bool)  # a marker that is not seen is held at its last place
        for _, start, end in motion.hidden:
            seen &= (motion.time < start) | (motion.time > end)
        heel, toe, ankle_x = (way[seen] for way in (motion.heel, motion.toe, motion.ankle_x))
        raised = np.maximum(heel[:, 1] - heel[:, 1].min(), toe[:, 1] - toe[:, 1].min())
        flat = raised <= np.quantile(raised, 0.25)
        behind, ahead = (float(np.median((end[:, 0] - ankle_x)[flat])) for end in (heel, toe))
    whole = _WHOLE_FOOT * _shank(points) / _ADULT_SHANK
    return behind - _MARGIN, ahead + (_MARGIN if ahead - behind >= whole else _TOES)


def _pressure(cycle: gait.GaitCycle, last: float, first: float) -> list[Notice]:
    """The sole stays where it lies, so that the centre of pressure stays within it all through stance."""
    on = np.isfinite(cycle.cop_x) & (cycle.grf_z > gait.COP_FORCE) & (cycle.phase < gait.LATE_SWING)
    if not np.any(on):
        return []
    place = (cycle.cop_x + cycle.ankle_x)[on] - cycle.ankle_x[cycle.foot_flat()].mean()
    if np.ptp(place) < _TRAVEL:
        problem = f"the centre of pressure stays within {1e3 * np.ptp(place):.0f} mm all through stance"
        allowed = "one that moves along the foot, by some 15 cm; are its places metres under mm?"
        raise InputError(problem, field="plate", allowed=allowed)
    behind, ahead = last - place, place - first
    share = float(np.mean((behind > 0.0) | (ahead > 0.0)))
    if share <= _OUTSIDE and np.mean(behind > 0.0) <= _BEHIND:
        return []
    most, end = max((float(behind.max()), "behind the heel"), (float(ahead.max()), "ahead of the toes"))
    text = "the centre of pressure is outside the foot for {percent:.0f} % of stance, up to {most_cm:.0f} cm "
    text += "{end}: plates and markers in different places?"
    return [Notice("pressure-off-foot", text, percent=100.0 * share, most_cm=100.0 * most, end=end)]


def _moment_peak(cycle: gait.GaitCycle) -> list[Notice]:
    moment = -cycle.ankle_moment[np.isfinite(cycle.ankle_moment)]
    if not len(moment) or _PEAK[0] <= moment.max() <= _PEAK[1]:
        return []
    if moment.max() < _NO_MOMENT:
        problem = f"the ankle moment is never plantarflexor: its peak is {moment.max() + 0.0:.2f} N·m/kg"
        allowed = "a centre of pressure ahead of the ankle in late stance: plates and motion of one trial, "
        raise InputError(problem, field="plate", allowed=f"{allowed}in the same axes and units")
    text = "the plantarflexor moment peaks at {peak:.2f} N·m/kg, outside {low:g} to {high:g}: {cause}"
    peak = float(moment.max())
    cause = "a weak push-off, or too large a mass" if peak < _PEAK[0] else "the ankle's place, the mass?"
    return [Notice("moment-peak", text, peak=peak, low=_PEAK[0], high=_PEAK[1], cause=cause)]


def _against_reference(cycle: gait.GaitCycle, reference: np.ndarray) -> list[Notice]:
    on = (cycle.grf_z > gait.STANCE_FORCE) & (cycle.phase < gait.LATE_SWING)
    on &= np.isfinite(cycle.ankle_moment) & np.isfinite(reference)
    if on.sum() < 3:
        return []

    def rms(other: np.ndarray) -> float:
        return float(np.sqrt(np.mean((cycle.ankle_moment - other)[on] ** 2)))

    error = rms(reference)
    if error <= _MOMENT_ERROR:
        return []
    shifts = np.linspace(-_LONGEST_SHIFT, _LONGEST_SHIFT, 201)
    known = np.isfinite(reference)
    late = [np.interp(cycle.phase - s, cycle.phase[known], reference[known], period=1.0) for s in shifts]
    k = int(np.argmin([rms(moved) for moved in late]))
    factor = float(cycle.ankle_moment[on] @ reference[on] / np.sum(reference[on] ** 2))
    reasons = [
        (rms(late[k]), f"moved by {1e3 * shifts[k] * cycle.stride_time:+.0f} ms"),
        (rms(-reference), "with the other sign"),
        (rms(factor * reference), "in N·mm" if 9e-4 < factor < 1.1e-3 else f"times {factor:.2f} (the mass?)"),
    ]
    left, reason = min(reasons)
    peak, own = (float(np.max(np.abs(moment[on]))) for moment in (reference, cycle.ankle_moment))
    text = "the ankle moment is {error:.2f} N·m/kg RMS away from the given one in stance"
    data: Keywords = {"error": error, "peak": peak, "own": own, "left": left, "reason": reason}
    if peak < _UNLOADED * own:
        text += ", which peaks at {peak:.2f} of {own:.2f} N·m/kg: was it computed without ground forces?"
    elif left < _EXPLAINED * error:
        text += "; the given one fits within {left:.2f} {reason}"
    return [Notice("moment-off-reference", text, **data)]


def _proportion(points: LegPoints, lengths: Mapping[str, np.ndarray]) -> list[Notice]:
    """A sentence where thigh and shank cannot be one person's: a hip or knee at another place."""
    thigh, shank = (lengths[name][np.isfinite(lengths[name])] for name in ("thigh", "shank"))
    if not len(thigh) or not len(shank):
        return []
    means = float(np.median(thigh)), float(np.median(shank))
    if _THIGH_TO_SHANK[0] <= means[0] / means[1] <= _THIGH_TO_SHANK[1]:
        return []
    text = "the {subject} thigh is {thigh_cm:.0f} cm long and the shank {shank_cm:.0f} cm: is the hip's or "
    text += "the knee's marker at another place?"
    thigh_cm, shank_cm = (100.0 * mean for mean in means)
    return [Notice("leg-proportion", text, subject=points.side, thigh_cm=thigh_cm, shank_cm=shank_cm)]


def _lengths(points: LegPoints, lengths: Mapping[str, np.ndarray]) -> list[Notice]:
    found = []
    for name, (upper, lower) in _SEGMENTS.items():
        length = lengths[name]
        known = np.isfinite(length)
        if known.sum() < 3:
            continue
        median = float(np.median(length[known]))
        change = np.where(known, length, median) / median - 1.0
        if np.abs(change).max() <= _CHANGE:
            continue
        k, bad = int(np.argmax(np.abs(change))), np.abs(change) > _CHANGE
        first, last = points.time[bad][[0, -1]]
        span = f"in {bad.sum()} frames of {first:.2f} to {last:.2f} s"
        when = f"at {first:.2f} s" if bad.sum() == 1 else span
        text = "the {subject}, {upper} to {lower}, changes its length of {length_cm:.1f} cm by "
        text += "{percent:+.0f} %, {when}: exchanged or sliding markers?"
        data: Keywords = {"upper": upper, "lower": lower, "when": when}
        data |= {"length_cm": 100.0 * median, "percent": 100.0 * float(change[k])}
        found.append(Notice("segment-length", text, subject=f"{points.side} {name}", **data))
    return found


def _leaps(points: LegPoints) -> list[Notice]:
    found = []
    for role, point in points.points.items():
        known = np.all(np.isfinite(point.path), axis=1)
        time, path = points.time[known], point.path[known]
        if len(time) < 3:
            continue
        step = np.diff(time)
        velocity = np.diff(path, axis=0) / step[:, None]
        off = np.linalg.norm((velocity[1:] - velocity[:-1]) * step[1:, None], axis=1)
        near = (step[1:] <= _LONGEST_STEP) & (step[:-1] <= _LONGEST_STEP)
        leaps = near & (off > _LEAP + _ACCELERATION * step[1:] ** 2)
        if np.any(leaps):
            k = int(np.argmax(leaps))
            text = "the {subject} leaps by {off_cm:.0f} cm at {time:.2f} s"
            text += " and later: exchanged markers?" if leaps[k + 3 :].any() else ": exchanged markers?"
            data: Keywords = {"off_cm": 100.0 * float(off[k]), "time": float(time[k + 2])}
            found.append(Notice("point-leaps", text, subject=f"{points.side} {role}", **data))
    return found


def _steps_of_time(what: str, time: np.ndarray, rate: float) -> list[Notice]:
    """Warnings on a clock that is slower than `rate` [Hz] or uneven."""
    steps = np.diff(time)
    step = float(np.median(steps))
    found = []
    if 1.0 / step < rate * (1.0 - 1e-6):
        text = "{subject} is sampled at only {rate:.0f} Hz; {needed:.0f} Hz or more are needed for the events"
        found.append(Notice("sampled-slowly", text, subject=what, rate=1.0 / step, needed=rate))
    uneven = np.abs(steps - step) > _UNEVEN * step
    if np.any(uneven):
        worst = steps[np.argmax(np.abs(steps - step))]
        text = "{subject} has {uneven} of {steps} steps of time that are not {step_ms:.3g} ms, one of "
        text += "{worst_ms:.3g} ms: the samples between are interpolated"
        data: Keywords = {"uneven": int(uneven.sum()), "steps": len(steps)}
        data |= {"step_ms": 1e3 * step, "worst_ms": 1e3 * float(worst)}
        found.append(Notice("sampled-unevenly", text, subject=what, **data))
    return found

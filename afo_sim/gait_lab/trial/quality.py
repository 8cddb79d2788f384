"""Can this trial be believed? Faults of a laboratory that spoil the ankle moment and show in no curve."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass

import numpy as np

from afo_sim.common import GRAVITY, InputError, Json, Keywords, Notice, with_code
from afo_sim.gait_lab.readers.signals import fill_gaps, low_pass, stretches
from afo_sim.gait_lab.trial.ground_force import PlateContact
from afo_sim.gait_lab.trial.imported import Check, Imported
from afo_sim.gait_lab.trial.marker_legs import standing_posture
from afo_sim.gait_lab.trial.newton import UNAIDED, Newton
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

_SHORT_FOOT = 0.25  # heel to toe point; below it the toe point lies on the metatarsal heads (assumed) [m]
# A foot that rolls over its heel turns about where it presses. The pressure less the point of the sole that
# neither rises nor falls is -6 to +9 mm in five recorded walks of four laboratories, and +20 mm on a
# treadmill (measured, the mean over the contacts); beyond that it is doubted [m]
_ROLLED = 0.022
_LANDS = 0.06  # beyond it the foot does not land on its heel, but on its toes (assumed) [m]
_TURNS = 1.5  # speed of a foot that rolls over its heel [rad/s]; below it the point is not clear (assumed)
_LANDING = (0.04, 0.2)  # from the contact's beginning, when the heel is pressed in and the foot rolls [s]
_ROLL_CUTOFF = 12.0  # of the foot's motion; 20 Hz changes the ten by up to 2 mm (measured) [Hz]
# Sideways distance from the line heel–toe, mean of right and left foot, in which what feet have alike
# cancels: 0 to 9 mm in three recorded walks (measured) [m]
_ASIDE = 0.014
# Speed of heel and toe point that are not standing; noise of 2 mm at 20 Hz makes 0.2 (derived) [m/s]
_MOVES = 0.7
# Heel stops, toe point starts, before the force begins and ends, their mean: 17 to 33 ms in seven walkers
# at three rates, 26 and 36 ms in recorded walks; it scatters by 15 ms among 74 public trials (measured), and
# the limit is 2.5 of that [s]
_BEFORE, _LATE = 0.025, 0.037
_SURE = 2.5  # standard errors from which on there is a doubt: 1.2 % of sound trials, were they normal [-]
_CLEAR = 0.05  # error of a mass by a plate beyond which the plate is not compared (assumed) [-]
_PLATES, _WORN = 0.01, 0.02  # of two plates that are right; of a scale with clothes and shoes (assumed) [-]
_FLAT, _FLAT_TIME = 2e-4, 0.03  # of the greatest force, and how long it stays so near: a peak of 0.15 s half
# width does for 4 ms, a slow walker's level stance for 28 (derived); a plate's noise ends it sooner
_LENGTHS = 0.04  # of segments, standing to walking: skin moves markers by 1 to 2 cm of 40 (assumed)
_RIGID = 0.01  # deviation of two markers' distance that are of one segment (assumed) [m]
_LONG = 0.15  # distance of two markers that shows a size [m]
_PUSH_OFF = 1.1 * GRAVITY  # upward force over body mass at push-off (assumed) [N/kg]
_ROLLS = 0.35  # speed of the pressure along the foot in stance (assumed) [m/s]
_BMI = (13.0, 50.0)  # body mass over squared height, thin children to the heaviest [kg/m²]


@dataclass(frozen=True, eq=False)
class _Steps:
    """What a foot's whole contacts show, the mean over them; NaN where they do not."""

    ahead: float  # pressure ahead of where the sole neither rises nor falls, while it rolls over the heel [m]
    aside: float  # mean pressure to the right of the line heel–toe [m]
    moved: float  # heel's stop and toe point's start after the force's beginning and end [s]


def examine(done: Imported) -> tuple[Check, ...]:
    """Look for a laboratory's faults in an imported trial."""
    steps = {side: _steps(done, side) for side in done.grounds}
    overflowed = [  # channels that the reader could not put together again
        Check(
            f"overflow (plate {each.subject})", f"channel {each.data['channel']} jumps", "none", notice=each
        )
        for each in with_code(done.notices, "plate-overflow")
    ]
    return (
        _along(steps),
        _aside(steps),
        _late(steps, done.newton),
        *_unlike(done.newton),
        *overflowed,
        *_clipped(done),
        *_scaled(done),
        *_standing(done),
        _bmi(done),
    )


def words(checks: tuple[Check, ...]) -> str:
    """The checks in one line for a file's header."""
    groups: dict[str, list[str]] = {"doubted": [], "passed": [], "not checked": []}
    for check in checks:
        groups[check.verdict.partition(":")[0].lower()].append(check.fault)
    return "; ".join(f"{kind}: {', '.join(faults)}" for kind, faults in groups.items() if faults)


def _steps(done: Imported, side: str) -> _Steps | None:
    """What the whole contacts of a foot show; None of a foot without markers of heel and metatarsal heads."""
    leg, frame, time = done.legs[side], done.frame, done.legs[side].time
    if leg.by_angles or leg.points["heel"].error is not None:
        return None
    heel, toe = (_level(frame, time, _bridged(time, leg.points[role].path)) for role in ("heel", "toe"))
    plates, found = {}, []
    used = {contact.plate for contact in done.grounds[side].contacts}
    for each in (plate for plate in done.trial.plates if plate.name in used):
        upward = np.abs(frame.plane(each.force)[:, 1])
        plates[each.name] = each.time, upward, _level(frame, each.time, each.place)
    for contact in done.grounds[side].contacts:
        if not contact.whole or contact.start < time[0] or contact.end > time[-1]:
            continue
        flat = _during(time, contact, 0.25, 0.5)
        if np.isnan(heel[flat] + toe[flat]).all():
            continue  # a foot that was not seen on its plate
        behind, ahead = (np.nanmedian(way[flat], axis=0) for way in (heel, toe))
        along = (ahead - behind)[:2]
        length = float(np.linalg.norm(along))
        if not length > 0.0:
            continue
        clock, up, pressed = plates[contact.plate]
        on = _during(clock, contact, 0.0, 1.0)
        on &= up > 0.15 * up[on].max()
        place = (pressed[on] - behind)[:, :2]
        late = done.newton.late[0] if isinstance(done.newton, Newton) and done.newton.follows else 0.0
        rolls = along / length, contact.start - late, clock - late, pressed[:, :2]
        aside = float(np.mean(place[:, 1] * along[0] - place[:, 0] * along[1])) / length
        moved = 0.5 * (_stop(time, heel, contact.start, -1) + _stop(time, toe, contact.end, 1))
        moved = moved if length < _SHORT_FOOT else np.nan
        found.append(_Steps(_rolled(time, heel, toe, *rolls), aside, moved))
    if not found:
        return None
    columns = np.array([astuple(each) for each in found]).T
    known = (column[np.isfinite(column)] for column in columns)
    return _Steps(*(float(np.mean(each)) if len(each) else np.nan for each in known))


def _bridged(time: np.ndarray, path: np.ndarray) -> np.ndarray:
    """A path over its short gaps; NaN where it was not seen for longer (n, 3)."""
    columns = []
    for column in path.T:
        filled, hidden = fill_gaps(time, column)
        for start, end in hidden:
            filled = np.where((time >= start) & (time <= end), np.nan, filled)
        columns.append(filled)
    return np.column_stack(columns)


def _level(frame: WalkingFrame, time: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Forward over the ground under the feet, to the right, up, without noise beyond 20 Hz [m] (n, 3)."""
    plane = frame.plane(path)
    way = np.column_stack([plane[:, 0] + frame.belt_speed * time, frame.across(path), plane[:, 1]])
    return low_pass(time, way, 20.0) if np.isfinite(way).all() and 1.0 / (time[1] - time[0]) > 45.0 else way


def _during(time: np.ndarray, contact: PlateContact, first: float, last: float) -> np.ndarray:
    length = contact.end - contact.start
    return (time >= contact.start + first * length) & (time <= contact.start + last * length)


def _stop(time: np.ndarray, way: np.ndarray, at: float, sign: int) -> float:
    """How long after an instant a point last (−1) or first (1) goes forward [s]; NaN if it never does."""
    near = (time > at - (0.2 if sign < 0 else 0.15)) & (time < at + (0.15 if sign < 0 else 0.2))
    moving = np.flatnonzero(near & (np.gradient(way[:, 0], time) > _MOVES))
    return float(time[moving[-1 if sign < 0 else 0]] - at) if len(moving) else np.nan


def _check(
    fault: str, found: str, limit: str, wrong: bool, code: str, text: str, subject: str = "", /, **data: Json
) -> Check:
    return Check(fault, found, limit, notice=Notice(code, text, subject=subject, **data) if wrong else None)


def _rolled(
    time: np.ndarray, heel: np.ndarray, toe: np.ndarray, along: np.ndarray, start: float, clock: np.ndarray,
    pressed: np.ndarray,
) -> float:  # fmt: skip
    """How far the pressure is ahead of the point about which the foot rolls on its heel [m]; NaN if none."""
    # ways of heel and toe [m] (n, 3), of the pressure [m] (k, 2), over their times [s]; along the foot (2,)
    near = (time > start - 0.3) & (time < start + 0.5) & np.isfinite(heel + toe).all(axis=1)
    seen = time[near]
    if len(seen) < 16 or seen[0] > start or seen[-1] < start + _LANDING[1] or np.ptp(np.diff(seen)) > 0.01:
        return np.nan
    behind, ahead = (low_pass(time[near], way[near], _ROLL_CUTOFF) for way in (heel, toe))
    at = np.arange(start + _LANDING[0], start + _LANDING[1], 0.002)
    (back, falls), (front, drops) = (
        (
            np.interp(at, time[near], way[:, :2] @ along),
            np.interp(at, time[near], np.gradient(way[:, 2], time[near])),
        )
        for way in (behind, ahead)
    )
    turn = (drops - falls) / (front - back)
    if turn.min() > -_TURNS:
        return np.nan
    weights = np.where(turn < 0.7 * turn.min(), turn**2, 0.0)  # of a fall that is measured: v = turn · way
    place = np.interp(at, clock, pressed @ along)
    off = float(np.average(place - back + falls / np.minimum(turn, -1e-3), weights=weights))
    return off if abs(off) < _LANDS else np.nan


def _along(steps: Mapping[str, _Steps | None]) -> Check:
    fault = "pressure along the walk"
    known = [step.ahead for step in steps.values() if step is not None and np.isfinite(step.ahead)]
    if not known:
        return Check(fault, needs="a heel that lands first, whole on a plate, and its two markers")
    off, limit = 1e3 * float(np.mean(known)), 1e3 * _ROLLED
    text = "the plates' pressure lies {off:+.0f} mm ahead of where the foot rolls over its heel (limit "
    text += "{limit:.0f} mm): plates and cameras disagree along the walk; the moment at push-off is off by "
    text += "about {moment:.2f} N·m/kg (force times shift)"
    data = {"off": off, "limit": limit, "moment": _PUSH_OFF * abs(off) * 1e-3}
    lies, most = f"{off:+.0f} mm ahead of where the foot rolls", f"±{limit:.0f} mm"
    return _check(fault, lies, most, abs(off) > limit, "pressure-shifted", text, **data)


def _aside(steps: Mapping[str, _Steps | None]) -> Check:
    fault, known = "pressure sideways", [step.aside for step in steps.values() if step is not None]
    if len(known) < 2:
        return Check(fault, needs="both feet whole on plates, with heel and toe markers")
    off, limit = 1e3 * float(np.mean(known)), 1e3 * _ASIDE
    each = ", ".join(f"{side} {1e3 * step.aside:+.0f}" for side, step in steps.items() if step is not None)
    lies, most, wrong = f"{off:+.0f} mm to the right of both feet", f"±{limit:.0f} mm", abs(off) > limit
    text = "the plates' pressure lies {off:+.0f} mm to the right of both feet ({each}; limit {limit:.0f} "
    text += "mm): plates and cameras disagree sideways, or a foot marker is misplaced; the sagittal "
    text += "moment is unaffected"
    return _check(fault, lies, most, wrong, "pressure-aside", text, off=off, limit=limit, each=each)


def _late(steps: Mapping[str, _Steps | None], law: Newton | str) -> Check:
    """By Newton's law where it can be asked, else by when heel and toe stop and start."""
    fault = "force's clock"
    known = [step.moved for step in steps.values() if step is not None and np.isfinite(step.moved)]
    if isinstance(law, Newton) and law.follows:
        late, limit = 1e3 * law.late[0], 1e3 * _SURE * law.late[1]
        by = "the trunk's acceleration" if law.by == "trunk" else "the pelvis' acceleration"
    elif known:
        # of plates with clocks of their own the mean of both feet shows nothing
        moved = max(known, key=lambda own: abs(own + _BEFORE)) if np.ptp(known) > _LATE else np.mean(known)
        late, limit = 1e3 * (-_BEFORE - float(moved)), 1e3 * _LATE
        by = "when heel and toe stop and start"
    else:
        law = f"a force that follows the {law.by}: {UNAIDED}" if isinstance(law, Newton) else law
        return Check(fault, needs=f"{law}; or a foot whole on a plate, with its heel and metatarsal heads")
    comes, most, wrong = f"{late:+.0f} ms after {by}", f"±{limit:.0f} ms", abs(late) > limit
    if isinstance(law, Newton) and law.why:
        comes += f", without {law.left_out}, which is partly off it"
    text = "the force is about {late:.0f} ms {order} by {by} (limit {limit:.0f} ms); the pressure under the "
    text += "foot moves by some {way:.0f} mm, the moment at push-off by {moment:.2f} N·m/kg"
    way, order = _ROLLS * abs(late), "late" if late > 0.0 else "early"
    sizes = {"late": abs(late), "limit": limit, "way": way, "moment": _PUSH_OFF * 1e-3 * way}
    return _check(fault, comes, most, wrong, "force-late", text, order=order, by=by, **sizes)


def _unlike(law: Newton | str) -> Iterator[Check]:
    """A foot whose force does not follow the body, where no heel beside the plate explains it."""
    if isinstance(law, Newton) and law.left_out and not law.why:
        text = "the force of {subject} does not follow the {by} while the other feet's does: its clock, its "
        text += "scale, or a foot partly off it; do not use a stride on it"
        found, limit = f"not of {law.left_out}", "each foot's"
        known = "force follows the body", found, limit, True, "foot-unlike", text
        yield _check(*known, law.left_out, by=law.by)


def _clipped(done: Imported) -> list[Check]:
    """Of each clipped plate; where none is, of the one that stays longest at its peak."""
    used = {c.plate for ground in done.grounds.values() for c in ground.contacts}
    plates = {name: each for ground in done.grounds.values() for name, each in ground.plates.items()}
    found: list[tuple[float, Check]] = []
    for name in sorted(used):
        time, force = plates[name]
        top = force >= (1.0 - _FLAT) * force.max()
        most = max(stop - first for first, stop in stretches(top))
        lasts, limit = 1e3 * (most - 1) * float(time[1] - time[0]), 1e3 * _FLAT_TIME
        text = "plate {subject} is clipped: it reads {force:.0f} N for {lasts:.0f} ms on end (limit "
        text += "{limit:.0f} ms); the clipped part is unknown, so the peak moment is too small"
        said, wrong = (f"{lasts:.0f} ms at the peak", f"{limit:.0f} ms"), most >= 5 and lasts > limit
        data = {"limit": limit, "force": float(force.max()), "lasts": lasts}
        fault = f"clipped (plate {name})" if wrong else "clipped plates"
        found.append((lasts, _check(fault, *said, wrong, "plate-clipped", text, name, **data)))
    return [check for _, check in found if check.notice] or [max(found, key=lambda pair: pair[0])[1]]


def _scaled(done: Imported) -> Iterator[Check]:
    """The body's mass by the plates against each other, and against the stated one."""
    law, mass = done.newton, done.mass
    if isinstance(law, str):
        yield Check("mass and plates' scale", needs=law)
        return
    # a plate on which nobody stands alone says little
    clear = {name: each for name, each in law.masses.items() if each[1] < _CLEAR * each[0]}
    alike = len(clear) < 2
    if alike:
        yield Check("plates alike", needs="both feet alone on plates of their own")
    else:
        low, high = (pick(clear, key=lambda name: clear[name]) for pick in (min, max))
        less, limit = _apart(clear[low], clear[high], _PLATES)
        alike = less >= -limit
        text = "plate {subject} carries {percent:.0f} % less than plate {other} by Newton's law (limit "
        text += "{limit:.0f} %): one of them is scaled, and its moments by as much, or a cane or a rail "
        text += "carries the rest"
        data: Keywords = {"percent": -less, "other": high, "limit": limit}
        said = f"plate {low} {-less:.0f} % less", f"{limit:.0f} %"
        yield _check("plates alike", *said, not alike, "plates-unlike", text, low, **data)
    if mass.how == "by the plates":
        yield Check("mass against the plates", needs="a stated mass")
        return
    for name, each in ({"all": law.mass} if alike else clear).items():
        off, limit = _apart(each, (mass.mass, 0.0), _WORN)
        subject = "the plates carry" if alike else f"plate {name} carries"
        cause = "the mass, their scale, what is worn, or a cane or rail that carries the rest"
        text = "{subject} {carried:.1f} ±{error:.1f} kg by Newton's law, {percent:+.0f} % off the mass "
        text += "{how}, {mass:.1f} kg (limit {limit:.0f} %): {cause}; moments are off by as much"
        data = {"carried": each[0], "error": each[1], "percent": off, "how": mass.how, "mass": mass.mass}
        data |= {"limit": limit, "cause": cause if alike else "its scale, or a cane or rail beside it"}
        code = "mass-differs" if alike else "plate-scaled"
        fault = "mass against the plates" if alike else f"scale (plate {name})"
        said = f"{off:+.0f} ±{100.0 * each[1] / each[0]:.0f} %", f"±{limit:.0f} %"
        yield _check(fault, *said, abs(off) > limit, code, text, subject, **data)


def _apart(one: tuple[float, float], other: tuple[float, float], more: float) -> tuple[float, float]:
    """Difference of two masses with their errors, and what it may be where both are right [%]."""
    error = np.sqrt((one[1] / one[0]) ** 2 + (other[1] / other[0]) ** 2 + more**2)
    return 100.0 * (one[0] / other[0] - 1.0), 100.0 * _SURE * float(error)


def _standing(done: Imported) -> Iterator[Check]:
    """Sizes of what moves as one, standing against walking; and the person's right where the right is."""
    still, walk = done.trial.standing, done.trial.markers
    if still is None or walk is None:
        yield Check("standing trial", needs="a standing trial with the walk's markers")
        return
    try:
        pose = {name: path[0] for name, path in standing_posture(still).positions.items()}
    except InputError:
        yield Check("standing trial", needs="somebody who stands still in it")
        return
    names = sorted(name for name in pose if name in walk.positions and np.isfinite(pose[name]).all())
    ratios = []
    for one, other in itertools.combinations(names, 2):
        apart = np.linalg.norm(walk.positions[one] - walk.positions[other], axis=1)
        own = float(np.linalg.norm(pose[one] - pose[other]))
        if np.nanstd(apart) < _RIGID and own > _LONG:
            ratios.append(own / float(np.nanmean(apart)) - 1.0)
    if not ratios:
        yield Check("standing trial", needs="markers that it shares with the walk")
        return
    off, limit = 100.0 * float(np.median(ratios)), 100.0 * _LENGTHS
    said, wrong = (f"{off:+.1f} % of the walker's size", f"±{limit:.0f} %"), abs(off) > limit
    text = "the standing trial is another person's: its segments are {percent:+.0f} % longer than the "
    text += "walker's (limit {limit:.0f} %), and the ankle's place and lever with them"
    yield _check("standing trial", *said, wrong, "standing-stranger", text, percent=off, limit=limit)
    signs = [_handed(done, {n: p[None] for n, p in pose.items()}), _handed(done, walk.positions)]
    if not all(signs):
        yield Check("standing mirrored", needs="heel, toe, ankle and knee of both legs in both trials")
        return
    mirrored = signs[0] * signs[1] < 0.0
    text = "the standing trial is mirrored: its right side is the walk's left; centres lie on the wrong side "
    text += "of their markers"
    hand = "other hand" if mirrored else "same hand"
    yield _check("standing mirrored", hand, "same hand", mirrored, "standing-mirrored", text)


def _handed(done: Imported, positions: Mapping[str, np.ndarray]) -> float:
    """Sign of forward × up · right of a body by the markers of the legs' points; 0 if not known."""
    ends: dict[tuple[str, str], np.ndarray] = {}
    for side, leg in done.legs.items():
        for role in ("heel", "toe", "knee"):
            source = leg.points[role].source.replace(",", " ").split()
            names = [name for name in positions if name in source]
            if names:
                ends[side, role] = np.mean([positions[name] for name in names], axis=0)
    if len(ends) < 6:
        return 0.0
    forward = sum(ends[s, "toe"] - ends[s, "heel"] for s in done.legs)
    up = sum(ends[s, "knee"] - ends[s, "heel"] for s in done.legs)
    right = ends["right", "knee"] - ends["left", "knee"]
    return float(np.sign(np.nanmedian(np.sum(np.cross(forward, up) * right, axis=1))))


def _bmi(done: Imported) -> Check:
    fault, height, mass, (low, high) = "mass against height", done.cycle.body_height, done.mass.mass, _BMI
    if height is None:
        return Check(fault, needs="a stated height")
    index = mass / height**2
    said, wrong = (f"{index:.0f} kg/m²", f"{low:.0f} to {high:.0f}"), not low <= index <= high
    text = "{mass:.1f} kg of {height:.2f} m are {index:.0f} kg/m², outside {low:.0f} to {high:.0f}: the "
    text += "mass, the plates' unit or the height; the moment per mass is off as the mass is"
    data = {"mass": mass, "height": height, "index": index, "low": low, "high": high}
    return _check(fault, *said, wrong, "mass-for-height", text, **data)

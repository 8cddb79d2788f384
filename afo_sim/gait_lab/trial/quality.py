"""Can this trial be believed? Faults of a laboratory that spoil the ankle moment and show in no curve."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from afo_sim.common import GRAVITY, InputError, Notice
from afo_sim.gait_lab.readers.signals import low_pass, stretches
from afo_sim.gait_lab.trial.events import find_events
from afo_sim.gait_lab.trial.ground_force import GroundForce, PlateContact
from afo_sim.gait_lab.trial.imported import Check, Imported
from afo_sim.gait_lab.trial.marker_legs import standing_posture
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

_SHORT_FOOT = 0.25  # heel to toe point; below it the toe point lies on the metatarsal heads (assumed) [m]
_HEEL_FIRST = 0.14  # rise of the toe point over the heel's, of their distance: 8 deg [-]
# First pressure ahead of the heel's marker, of the way to the metatarsal heads: 0.07 to 0.19 in three
# recorded walks of two laboratories, 0.17 to 0.26 with seven walkers' pressures (measured) [-]
_LANDING = (0.06, 0.29)
# A landing below the first whose pressure ends below the second; it ends at 0.99 to 1.33 in the same [-]
_BOTH_BACK = (0.12, 0.93)
_USUAL = 0.19  # the most frequent landing, from which the size of a shift is stated [-]
# Sideways distance from the line heel–toe, mean of right and left foot, in which what feet have alike
# cancels: 0 to 9 mm in three recorded walks (measured) [m]
_ASIDE = 0.014
# Speed of heel and toe point that are not standing; noise of 2 mm at 20 Hz makes 0.2 (derived) [m/s]
_MOVES = 0.7
# Heel stops, toe point starts, before the force begins and ends, their mean: 17 to 33 ms in seven walkers
# at three rates, 26 and 36 ms in recorded walks (measured); the limit is four of their deviations of 4 ms [s]
_BEFORE, _LATE = 0.025, 0.016
_FLAT, _FLAT_TIME = 2e-4, 0.03  # of the greatest force, and how long it stays so near: a peak of 0.15 s half
# width does for 4 ms, a slow walker's level stance for 28 (derived); a plate's noise ends it sooner
_LIKE = 0.08  # between two plates; 0 to 1 % in recorded and generated walks, the pelvis' two halves alike
_TRUE = 0.12  # of a plate against a stated mass; the pelvis is the body's centre to 5 % of g (measured)
_INSIDE = 0.04  # from the other foot's events to what surely is single support [s]
_LENGTHS = 0.04  # of segments, standing to walking: skin moves markers by 1 to 2 cm of 40 (assumed)
_RIGID = 0.01  # deviation of two markers' distance that are of one segment (assumed) [m]
_LONG = 0.15  # distance of two markers that shows a size [m]
_PUSH_OFF = 1.1 * GRAVITY  # upward force over body mass at push-off (assumed) [N/kg]
_ROLLS = 0.35  # speed of the pressure along the foot in stance (assumed) [m/s]
_BMI = (13.0, 50.0)  # body mass over squared height, thin children to the heaviest [kg/m²]


@dataclass(frozen=True, eq=False)
class _Steps:
    """What a foot's whole contacts show, the mean over them; NaN where they do not."""

    landing: float  # first pressure ahead of the heel, of the way to the toe point [-]
    leaving: float  # likewise its last [-]
    length: float  # of that way [m]
    aside: float  # mean pressure to the right of that way [m]
    moved: float  # heel's stop and toe point's start after the force's beginning and end [s]


def examine(done: Imported) -> tuple[Check, ...]:
    """Look for a laboratory's faults in an imported trial."""
    steps = {side: _steps(done, side) for side in done.grounds}
    return (
        *(_landing(side, step) for side, step in steps.items()),
        _aside(steps),
        _late(steps),
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
    if leg.by_angles:
        return None
    heel, toe = (_level(frame, time, leg.points[role].path) for role in ("heel", "toe"))
    found = []
    for contact in done.grounds[side].contacts:
        if not contact.whole or contact.start < time[0] or contact.end > time[-1]:
            continue
        flat = _during(time, contact, 0.25, 0.5)
        if np.isnan(heel[flat] + toe[flat]).all():
            continue  # a foot that was not seen on its plate
        behind, ahead = (np.nanmedian(way[flat], axis=0) for way in (heel, toe))
        along = (ahead - behind)[:2]
        length = float(np.linalg.norm(along))
        if not 0.0 < length < _SHORT_FOOT:
            continue
        plate = next(plate for plate in done.trial.plates if plate.name == contact.plate)
        up = np.abs(frame.plane(plate.force)[:, 1])
        on = _during(plate.time, contact, 0.0, 1.0)
        on &= up > 0.15 * up[on].max()
        place = (_level(frame, plate.time, plate.place)[on] - behind)[:, :2]
        first = max(1, int(0.05 * on.sum()))
        rise = np.interp(contact.start, time, (toe - heel)[:, 2]) - (ahead - behind)[2]
        landed = place[:first] @ along / length**2
        found.append(
            _Steps(
                landing=float(landed.mean()) if rise > _HEEL_FIRST * length else np.nan,
                leaving=float(np.quantile(place @ along, 0.95)) / length**2,
                length=length,
                aside=float(np.mean(place[:, 1] * along[0] - place[:, 0] * along[1])) / length,
                moved=0.5 * (_stop(time, heel, contact.start, -1) + _stop(time, toe, contact.end, 1)),
            )
        )
    if not found:
        return None
    return _Steps(*(float(np.mean(each)) for each in zip(*map(astuple, found), strict=True)))


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
    fault: str, found: str, limit: str, wrong: bool, code: str, text: str, subject: str = "", /, **data: Any
) -> Check:
    """A check that was made, with its notice where something is wrong."""
    return Check(fault, found, limit, notice=Notice(code, text, subject=subject, **data) if wrong else None)


def _landing(side: str, step: _Steps | None) -> Check:
    fault = f"pressure along the walk ({side})"
    if step is None or not np.isfinite(step.landing):
        return Check(fault, needs="a heel that lands first, whole on a plate, and its two markers")
    low, high = (1e3 * share * step.length for share in _LANDING)
    found, off = 1e3 * step.landing * step.length, 1e3 * (step.landing - _USUAL) * step.length
    wrong = (step.landing < _BOTH_BACK[0] and step.leaving < _BOTH_BACK[1]) or not low <= found <= high
    text = (
        "the {subject} foot's pressure is shifted along the walk by about {off:+.0f} mm (±15): it lands "
        "{found:.0f} mm ahead of the heel's marker, {low:.0f} to {high:.0f} mm are usual; the moment at "
        "push-off is off by about {moment:.2f} N·m/kg (force times shift)"
    )
    data = {"off": off, "found": found, "low": low, "high": high, "moment": _PUSH_OFF * abs(off) * 1e-3}
    lands, usual = f"lands {found:.0f} mm ahead of the heel's marker", f"{low:.0f} to {high:.0f} mm"
    return _check(fault, lands, usual, wrong, "pressure-shifted", text, side, **data)


def _aside(steps: Mapping[str, _Steps | None]) -> Check:
    fault, known = "pressure sideways", [step.aside for step in steps.values() if step is not None]
    if len(known) < 2:
        return Check(fault, needs="both feet whole on plates, with heel and toe markers")
    off, limit = 1e3 * float(np.mean(known)), 1e3 * _ASIDE
    lies, most, wrong = f"{off:+.0f} mm to the right of both feet", f"±{limit:.0f} mm", abs(off) > limit
    text = (
        "the plates' pressure lies {off:+.0f} mm to the right of both feet (limit {limit:.0f} mm): plates "
        "and cameras disagree sideways; the sagittal moment is not changed by that"
    )
    return _check(fault, lies, most, wrong, "pressure-aside", text, off=off, limit=limit)


def _late(steps: Mapping[str, _Steps | None]) -> Check:
    fault = "force's clock"
    known = [step.moved for step in steps.values() if step is not None and np.isfinite(step.moved)]
    if not known:
        return Check(fault, needs="a foot whole on a plate, with markers on heel and metatarsal heads")
    late, limit = 1e3 * (-_BEFORE - float(np.mean(known))), 1e3 * _LATE
    comes, most, wrong = f"{late:+.0f} ms after the foot", f"±{limit:.0f} ms", abs(late) > limit
    text = (
        "the force is about {late:.0f} ms {order} by when heel and toe stop and start (limit {limit:.0f} "
        "ms); the pressure under the foot moves by some {way:.0f} mm, the moment at push-off by "
        "{moment:.2f} N·m/kg"
    )
    way, order = _ROLLS * abs(late), "late" if late > 0.0 else "early"
    sizes = {"late": abs(late), "limit": limit, "way": way, "moment": _PUSH_OFF * 1e-3 * way}
    return _check(fault, comes, most, wrong, "force-late", text, order=order, **sizes)


def _clipped(done: Imported) -> Iterator[Check]:
    used = {c.plate for ground in done.grounds.values() for c in ground.contacts}
    plates = {name: each for ground in done.grounds.values() for name, each in ground.plates.items()}
    for name in sorted(used):
        time, force = plates[name]
        top = force >= (1.0 - _FLAT) * force.max()
        most = max(stop - first for first, stop in stretches(top))
        lasts = (most - 1) * float(time[1] - time[0])
        found, limit = 1e3 * lasts, 1e3 * _FLAT_TIME
        text = (
            "plate {subject} is clipped: it reads {force:.0f} N for {lasts:.0f} ms on end (limit "
            "{limit:.0f} ms); what is cut off is not known, so the peak moment is too small"
        )
        said, wrong = (f"{found:.0f} ms at the peak", f"{limit:.0f} ms"), most >= 5 and found > limit
        data = {"limit": limit, "force": float(force.max()), "lasts": found}
        yield _check(f"clipped (plate {name})", *said, wrong, "plate-clipped", text, name, **data)


def _scaled(done: Imported) -> Iterator[Check]:
    """m = F̄ / (g + Δv/Δt) of each plate in single support, v the pelvis' upward speed."""
    found: dict[str, list[float]] = {}
    for side, ground in done.grounds.items():
        for name, mass in _carried(done, side, ground):
            found.setdefault(name, []).append(mass)
    masses = {name: float(np.median(each)) for name, each in found.items()}
    typed = done.mass.mass if done.mass.how == "given" else None
    off = {name: 100.0 * (mass / typed - 1.0) for name, mass in masses.items()} if typed else {}
    wrong = {name: abs(each) > 100.0 * _TRUE for name, each in off.items()}
    if not off:
        needs = "a typed mass, the pelvis' markers, one foot alone on a plate"
        yield Check("scale of each plate", needs=needs)
    for name, each in off.items():
        limit = 100.0 * _TRUE
        text = (
            "plate {subject} is scaled by about {percent:+.0f} %: alone it carries {carried:.1f} kg of the "
            "stated {mass:.1f} kg (limit {limit:.0f} %); its moments are off by as much"
        )
        data: dict[str, Any] = {"percent": each, "carried": masses[name], "mass": typed, "limit": limit}
        said = f"{each:+.0f} % of the stated mass", f"±{limit:.0f} %"
        yield _check(f"scale (plate {name})", *said, wrong[name], "plate-scaled", text, name, **data)
    if len(masses) < 2:
        yield Check("plates alike", needs="each foot alone on a plate of its own, and the pelvis' markers")
        return
    low, high = min(masses, key=masses.__getitem__), max(masses, key=masses.__getitem__)
    less, limit = 100.0 * (1.0 - masses[low] / masses[high]), 100.0 * _LIKE
    said = f"{low} {less:.0f} % less", f"{limit:.0f} %"
    text = (
        "plate {subject} carries {percent:.0f} % less than plate {other} when a foot stands alone on it "
        "(limit {limit:.0f} %): one of them is scaled, and its moments by as much, or a cane or a rail "
        "carries the rest; a typed mass says which"
    )
    one = less > limit and not any(wrong.values())
    data = {"percent": less, "other": high, "limit": limit}
    yield _check("plates alike", *said, one, "plates-unlike", text, low, **data)


def _carried(done: Imported, side: str, ground: GroundForce) -> Iterator[tuple[str, float]]:
    """Each plate that carries a foot alone, with the mass by it [kg]."""
    leg, other = done.legs[side], done.motions.get("left" if side == "right" else "right")
    if other is None or leg.pelvis is None or not np.isfinite(leg.pelvis).all():
        return
    events = find_events(other)
    height = low_pass(leg.time, done.frame.plane(leg.pelvis)[:, 1:], 6.0)[:, 0]
    speed = np.gradient(height, leg.time)
    for off in events.toe_offs:
        strike = next((time for time in events.strikes if time > off), np.inf)
        start, end = off + _INSIDE, strike - _INSIDE
        on = [c.plate for c in ground.contacts if c.start < start and end < c.end]
        inside = (ground.time >= start) & (ground.time <= end)
        if not on or end - start > 0.7 or inside.sum() < 5:
            continue
        first, last = np.interp((start, end), leg.time, speed)
        yield on[0], float(ground.force_z[inside].mean()) / (GRAVITY + (last - first) / (end - start))


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
    text = (
        "the standing trial is another person's: its segments are {percent:+.0f} % longer than the "
        "walker's (limit {limit:.0f} %), and the ankle's place and lever with them"
    )
    yield _check("standing trial", *said, wrong, "standing-stranger", text, percent=off, limit=limit)
    signs = [_handed(done, {n: p[None] for n, p in pose.items()}), _handed(done, walk.positions)]
    if not all(signs):
        yield Check("standing mirrored", needs="heel, toe, ankle and knee of both legs in both trials")
        return
    mirrored = signs[0] * signs[1] < 0.0
    text = (
        "the standing trial is mirrored: its right side is the walk's left; centres lie on the wrong side "
        "of their markers"
    )
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
    text = (
        "{mass:.1f} kg of {height:.2f} m are {index:.0f} kg/m², outside {low:.0f} to {high:.0f}: the mass, "
        "the plates' unit or the height; the moment per mass is off as the mass is"
    )
    data = {"mass": mass, "height": height, "index": index, "low": low, "high": high}
    return _check(fault, *said, wrong, "mass-for-height", text, **data)

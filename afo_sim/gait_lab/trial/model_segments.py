"""The segments of one leg, laid over a trial's markers one after the other, pelvis first."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import InputError, Keywords, Notice
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.markers import Markers
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel
from afo_sim.gait_lab.trial.clusters import RigidFit, fit_rigid
from afo_sim.gait_lab.trial.leg_points import LegPoint, LegPoints
from afo_sim.gait_lab.trial.model_leg import ModelLeg, foot_markers, knee_on_thigh

MISFIT = 0.020  # residual above which the model's marker places do not fit the trial [m] (assumed)

# Error of a joint centre that no residual shows: scaling, skin that moves as one [m] (assumed)
UNSEEN = 0.010
Places = Mapping[str, np.ndarray]  # by point


@dataclass(frozen=True, eq=False)
class Segment:
    """Points of a segment that the model and the trial both know, and the best place of the segment."""

    name: str  # "right thigh"
    local: Places  # point: its place in the segment's axes [m] (3,)
    seen: Places  # point: its path in the laboratory [m] (n, 3)
    missing: tuple[str, ...]  # markers of the model that the trial has not
    fit: RigidFit
    shared: tuple[str, ...] = ()  # joint centres among the points, that a neighbour placed

    @property
    def found(self) -> np.ndarray:
        """Where the segment has a place (n,)."""
        return np.isfinite(self.fit.rms)

    @property
    def rms(self) -> float:
        """Distance between seen and fitted points over the whole trial [m]."""
        return float(np.sqrt(np.nanmean(self.fit.rms**2))) if self.found.any() else float("nan")

    def with_centre(self, name: str, local: np.ndarray, path: np.ndarray) -> "Segment":
        """The same with a joint centre as one more point, its path (n, 3) placed by a neighbour."""
        return replace(
            _lay(self.name, {**self.local, name: local}, {**self.seen, name: path}, len(path), self.missing),
            shared=tuple(dict.fromkeys((*self.shared, name))),
        )

    def error(self, place: np.ndarray) -> float:
        """Standard error in the sagittal plane of a point (3,) of the segment [m]."""
        points = np.array(list(self.local.values()))
        count = len(points)
        variance = self.rms**2 * count / (3 * count - 6)
        away, arms = place - points.mean(axis=0), points - points.mean(axis=0)
        inertia = np.sum(arms**2) * np.eye(3) - arms.T @ arms
        cross = np.cross(np.eye(3), away)
        spread = variance * (np.eye(3) / count + cross.T @ np.linalg.pinv(inertia) @ cross)
        return float(np.sqrt(spread[0, 0] + spread[1, 1]))

    def notices(self) -> tuple[Notice, ...]:
        """What the segment was laid over and how well; a residual that says that model and trial disagree."""
        rms_mm = 1e3 * self.rms
        text = "{subject} laid over {points}: residual {rms_mm:.1f} mm RMS"
        laid = note("segment-laid", text, subject=self.name, points=", ".join(self.local), rms_mm=rms_mm)
        if not self.rms > MISFIT:
            return (laid,)
        off = {
            name: float(np.sqrt(np.nanmean(np.sum((self.fit.place(place) - self.seen[name]) ** 2, axis=1))))
            for name, place in self.local.items()
        }
        worst = max(off, key=lambda name: off[name])
        text = "the model's {subject} misses the trial's markers by {rms_mm:.0f} mm RMS, most of all {worst} "
        text += "by {worst_mm:.0f} mm: another person's model, or a marker moved or swapped?"
        data: Keywords = {"rms_mm": rms_mm, "worst": worst, "worst_mm": 1e3 * off[worst]}
        return laid, Notice("segment-misfit", text, subject=self.name, **data)


def _lay(name: str, local: Places, seen: Places, count: int, missing: tuple[str, ...] = ()) -> Segment:
    """Lay a segment over points that it has in its axes (3,) and in the laboratory, `count` = n of (n, 3)."""
    places = np.array([local[point] for point in seen]).reshape(-1, 3)
    paths = np.stack([seen[point] for point in seen], axis=1) if seen else np.empty((count, 0, 3))
    return Segment(name, {p: local[p] for p in seen}, dict(seen), missing, fit_rigid(places, paths))


def fitted_leg(model: OpenSimModel, leg: ModelLeg, markers: Markers, seen: Places) -> LegPoints:
    """Lay the segments of a leg over markers, and take the leg's points from them."""
    pelvis, thigh, shank, foot = segments = _segments(model, leg, seen)
    lost = [segment for segment in segments[1:] if not segment.found.any()]
    if lost:
        there, missing = (", ".join(names) or "none" for names in (lost[0].local, lost[0].missing))
        problem = f"shows too little of the {lost[0].name}: seen {there}; missing {missing}"
        allowed = f"three points off a line, centres of its joints counted, named as in {model.file.name}"
        raise InputError(problem, file=markers.file, allowed=allowed)
    upper = (pelvis, leg.hip.proximal) if pelvis.found.any() else (thigh, leg.hip.distal)
    places = {"hip": upper, "knee": (shank, leg.knee.distal), "ankle": (foot, leg.ankle.distal)}
    places |= {"heel": (foot, leg.foot.heel), "toe": (foot, leg.foot.toe)}
    laid = [segment for segment in segments if segment.found.any()]
    return LegPoints(
        side=leg.side,
        time=markers.time,
        points={role: _point(leg, role, *place) for role, place in places.items()},
        pelvis=pelvis.fit.position if pelvis.found.any() else None,
        sole=leg.foot.pitch,
        ankle_height=leg.foot.ankle_height,
        outline=leg.foot.outline,
        notices=tuple(notice for segment in laid for notice in segment.notices()),
    )


def _point(leg: ModelLeg, role: str, segment: Segment, place: np.ndarray) -> LegPoint:
    way = f"the model's {segment.name} laid over {', '.join(segment.local)}"
    better = ""
    if len(segment.local) - len(segment.shared) < 3:
        wish = f", such as {' or '.join(segment.missing)}" if segment.missing else ""
        better = f"more markers on the {segment.name} in model and trial{wish}"
    error = float(np.hypot(segment.error(place), leg.foot.error.get(role, UNSEEN)))
    source = leg.foot.sources.get(role, "")
    return LegPoint(segment.fit.place(place), source, error, better, way=way)


def _segments(model: OpenSimModel, leg: ModelLeg, seen: Places) -> tuple[Segment, ...]:
    """Pelvis, thigh, shank and foot, each with the joint centre of the one above it."""
    names = "pelvis", "thigh", "shank", "foot"
    pelvis, thigh, shank, foot = (_own(model, leg, name, seen) for name in names)
    if pelvis.found.any():
        thigh = thigh.with_centre("hip centre", leg.hip.distal, pelvis.fit.place(leg.hip.proximal))
    if not thigh.found.any() and shank.found.any():
        thigh = thigh.with_centre("knee centre", leg.knee.proximal, shank.fit.place(leg.knee.distal))
    if not shank.found.any() and foot.found.any():
        shank = shank.with_centre("ankle centre", leg.ankle.proximal, foot.fit.place(leg.ankle.distal))
    if thigh.found.any() and "knee centre" not in thigh.shared:
        shank = _joined(model, leg, thigh, shank)
    if shank.found.any() and "ankle centre" not in shank.shared:
        foot = foot.with_centre("ankle centre", leg.ankle.distal, shank.fit.place(leg.ankle.proximal))
    return pelvis, thigh, shank, foot


def _joined(model: OpenSimModel, leg: ModelLeg, thigh: Segment, shank: Segment) -> Segment:
    """The shank with the knee's centre, first where the default knee angle has it, then at the fitted one."""
    place = np.tile(leg.knee.proximal, (len(thigh.fit.rms), 1))
    for _ in range(3):  # a knee centre moves by mm, so that its angle hardly changes the second time
        if shank.found.any():
            turn = np.swapaxes(thigh.fit.rotation, 1, 2) @ shank.fit.rotation
            there = knee_on_thigh(model, leg, turn)
            place = np.where(np.isfinite(there), there, place)
        path = np.einsum("nij,nj->ni", thigh.fit.rotation, place) + thigh.fit.position
        shank = shank.with_centre("knee centre", leg.knee.distal, path)
    return shank


def _own(model: OpenSimModel, leg: ModelLeg, name: str, seen: Places) -> Segment:
    body = leg.bodies[name]
    if name == "foot":
        local = foot_markers(model, body, leg.bodies.get("toes"))
    else:
        local = {marker: place for marker, (of, place) in model.markers.items() if of == body}
    count = len(next(iter(seen.values())))
    there = {marker: seen[marker] for marker in local if marker in seen}
    missing = tuple(marker for marker in local if marker not in seen)
    return _lay(name if name == "pelvis" else f"{leg.side} {name}", local, there, count, missing)

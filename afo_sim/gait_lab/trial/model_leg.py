"""The leg that an OpenSim model describes: its bodies, its joint centres, and the points of its foot."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common import InputError
from afo_sim.gait_lab.readers.opensim_joint import Joint
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel

# Names of bodies by segment, without side and punctuation; the first is OpenSim's own
_NAMES = {
    "pelvis": ("pelvis", "hip", "hips"),
    "thigh": ("femur", "thigh", "upperleg"),
    "shank": ("tibia", "shank", "lowerleg", "tibfib", "shin"),
    "foot": ("calcn", "calcaneus", "foot", "hindfoot", "rearfoot", "calc"),
    "toes": ("toes", "toe", "forefoot", "phalanges"),
}


_NEAR_END = 0.015  # points this near the foot's end share it; the lowest of them counts [m] (assumed)
_SKIN = 0.010  # how far a marker's centre may lie from the end of the foot that it marks [m] (assumed)
_BONE = 0.02  # how far the foot may reach behind the heel bone's origin [m] (assumed)
_GROUND = ("ground", "floor", "sole")  # in the name of a marker that was projected onto the floor


@dataclass(frozen=True, eq=False)
class ModelJoint:
    """A joint of the leg, and its centre as a fixed point of both bodies that it connects."""

    joint: Joint  # the first one between the two that can move
    proximal: np.ndarray  # centre in the proximal body's axes, by default [m] (3,)
    distal: np.ndarray  # in the distal body's axes [m] (3,)


@dataclass(frozen=True, eq=False)
class ModelFoot:
    """Points of the foot in the axes of its body: x forward, y up, z to the right [m]."""

    heel: np.ndarray  # (3,)
    toe: np.ndarray  # (3,)
    sources: Mapping[str, str]  # heel and toe: what they are
    error: Mapping[str, float]  # heel and toe, from the foot's own ends [m]
    ankle: np.ndarray  # the ankle's centre, by default (3,)
    ankle_height: float | None  # of the ankle's centre above the sole, where something shows the sole [m]
    outline: Mapping[str, float] = field(default_factory=dict)  # ends ahead of the ankle [m]

    @property
    def pitch(self) -> float:
        """Pitch of the line heel–toe with the body's x axis level, toe up positive [rad]."""
        way = self.toe - self.heel
        return float(np.arctan2(way[1], way[0]))


@dataclass(frozen=True, eq=False)
class ModelLeg:
    """One leg of a model."""

    side: str
    bodies: Mapping[str, str]  # segment: the model's body; no toes where the model has none
    hip: ModelJoint
    knee: ModelJoint
    ankle: ModelJoint
    foot: ModelFoot  # its points in the axes of the foot's body, toes straight

    @property
    def points(self) -> dict[str, tuple[str, np.ndarray]]:
        """The leg's points by role: the segment that shows each, and its place there [m] (3,)."""
        return {
            "hip": ("thigh", self.hip.distal),
            "knee": ("shank", self.knee.distal),
            "ankle": ("shank", self.ankle.proximal),
            "heel": ("foot", self.foot.heel),
            "toe": ("foot", self.foot.toe),
        }


def find_leg(model: OpenSimModel, side: str) -> ModelLeg:
    """Find a leg by the names of its bodies, and its joints between them."""
    bodies, missing = {}, []
    for segment, names in _NAMES.items():
        # with the side's letter or word before or after a name
        sides = ("",) if segment == "pelvis" else (side[0], side)
        called = {each for name in names for word in sides for each in (name + word, word + name)}
        found = [body for body in model.bodies if re.sub("[^a-z]", "", body.lower()) in called]
        if found:
            bodies[segment] = found[0]
        elif segment != "toes":
            missing.append(f"{segment} ({names[0]}{'' if segment == 'pelvis' else '_' + side[0]})")
    if missing:
        problem = f"has no {side} leg: no body for {', '.join(missing)}"
        allowed = f"bodies named as OpenSim's gait models have them; there are {', '.join(model.bodies)}"
        raise InputError(problem, file=model.file, allowed=allowed)
    hip, knee, ankle = (
        _joint(model, bodies[a], bodies[b])
        for a, b in (("pelvis", "thigh"), ("thigh", "shank"), ("shank", "foot"))
    )
    foot = _find_foot(model, bodies["foot"], bodies.get("toes"), ankle.distal)
    return ModelLeg(side, bodies, hip, knee, ankle, foot)


def knee_on_thigh(model: OpenSimModel, leg: ModelLeg, turn: np.ndarray) -> np.ndarray:
    """The knee's centre in the thigh's axes at the knee angle that a fit shows [m] (n, 3)."""
    coordinates = [c for c in leg.knee.joint.coordinates if c.rotational]
    if len(coordinates) != 1 or not np.isfinite(coordinates[0].limits).all():
        return np.where(np.isfinite(turn[:, :1, 0]), leg.knee.proximal, np.nan)
    angles = np.linspace(*coordinates[0].limits, 501)
    allowed = model.pose(leg.bodies["thigh"], leg.bodies["shank"], {coordinates[0].name: angles})
    known = np.isfinite(turn).all(axis=(1, 2))
    likeness = np.einsum("nij,aij->na", np.where(known[:, None, None], turn, 0.0), allowed.rotation)
    places = allowed.point(leg.knee.distal)[np.argmax(likeness, axis=1)]
    return np.where(known[:, None], places, np.nan)


def _joint(model: OpenSimModel, proximal: str, distal: str) -> ModelJoint:
    steps = [step for step in model.path(proximal, distal) if step[0].coordinates]
    if not steps:
        raise InputError(f"has no joint that moves between {proximal} and {distal}", file=model.file)
    joint, outward = steps[0]
    body, frame = (joint.child, joint.in_child) if outward else (joint.parent, joint.in_parent)
    distal_place = model.pose(distal, body, {}).point(frame.position[0])
    return ModelJoint(joint, model.pose(proximal, distal, {}).point(distal_place)[0], distal_place[0])


def _find_foot(model: OpenSimModel, foot: str, toes: str | None, ankle: np.ndarray) -> ModelFoot:
    """Find the ends of the foot among its markers, contact spheres and joints, with the toes straight."""
    points = foot_markers(model, foot, toes)
    floor = [place[1] for name, place in points.items() if any(word in name.lower() for word in _GROUND)]
    for k, sphere in enumerate(s for s in model.spheres if s.body in (foot, toes)):
        centre = _on_foot(model, foot, sphere.body, sphere.centre)
        floor.append(centre[1] - sphere.radius)
        for word, ahead in (("behind", -1.0), ("before", 1.0)):
            points[f"contact sphere {k + 1}, {word}"] = centre + sphere.radius * np.array([ahead, 0.0, 0.0])
    marked = set(points)
    bones = {"the origin of the heel bone": np.zeros(3)}
    if toes is not None:
        bones["the joint of the toes"] = _on_foot(model, foot, toes, np.zeros(3))
    back = _end({n: p for n, p in points.items() if p[0] < ankle[0]} or bones, -1.0)
    front = _end({n: p for n, p in points.items() if p[0] > ankle[0]} or bones, 1.0)
    if front[1][0] <= back[1][0]:
        problem = f"the foot {foot} has no marker, contact sphere or toe joint ahead of the ankle"
        raise InputError(problem, file=model.file)
    ends = {"heel": back, "toe": front}
    outline = {role: float(place[0] - ankle[0]) for role, (name, place) in ends.items() if name in marked}
    return ModelFoot(
        heel=back[1],
        toe=front[1],
        sources={role: f"{name} of the model" for role, (name, _) in ends.items()},
        error={role: _SKIN if name in marked else _BONE for role, (name, _) in ends.items()},
        ankle=ankle,
        ankle_height=float(ankle[1] - min(floor)) if floor else None,
        outline=outline,
    )


def foot_markers(model: OpenSimModel, foot: str, toes: str | None) -> dict[str, np.ndarray]:
    """Markers of foot and toes in the foot's axes [m] (3,), the toes straight."""
    return {
        name: _on_foot(model, foot, body, place)
        for name, (body, place) in model.markers.items()
        if body in (foot, toes)
    }


def _on_foot(model: OpenSimModel, foot: str, body: str, place: np.ndarray) -> np.ndarray:
    return np.asarray(place if body == foot else model.pose(foot, body, {}).point(place)[0])


def _end(points: Mapping[str, np.ndarray], ahead: float) -> tuple[str, np.ndarray]:
    """The lowest of the points at one end of the foot: it shows when that end meets the floor."""
    furthest = max(ahead * place[0] for place in points.values())
    there = {n: p for n, p in points.items() if ahead * p[0] > furthest - _NEAR_END}
    name = min(there, key=lambda n: there[n][1])
    return name, there[name]

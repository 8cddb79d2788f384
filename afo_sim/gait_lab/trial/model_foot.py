"""Heel, toe and sole of an OpenSim model's foot, as far as its markers and contact spheres tell."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_model import OpenSimModel

NEAR_END = 0.015  # points this near the foot's end share it; the lowest of them counts [m] (assumed)
SKIN = 0.010  # how far a marker's centre may lie from the end of the foot that it marks [m] (assumed)
BONE = 0.02  # how far the foot may reach behind the heel bone's origin [m] (assumed)
GROUND = ("ground", "floor", "sole")  # in the name of a marker that was projected onto the floor


@dataclass(frozen=True, eq=False)
class ModelFoot:
    """Points of the foot in the axes of its body: x forward, y up, z to the right [m]."""

    heel: np.ndarray  # (3,)
    toe: np.ndarray  # (3,)
    how: Mapping[str, str]  # heel and toe: what they are
    error: Mapping[str, float]  # heel and toe, from the foot's own ends [m]
    ankle: np.ndarray  # the ankle's centre, by default (3,)
    ankle_height: float | None  # of the ankle's centre above the sole, where something tells the sole [m]
    outline: Mapping[str, float] = field(default_factory=dict)  # ends ahead of the ankle [m]

    @property
    def pitch(self) -> float:
        """Pitch of the line heel–toe with the body's x axis level, toe up positive [rad]."""
        way = self.toe - self.heel
        return float(np.arctan2(way[1], way[0]))


def find_foot(model: OpenSimModel, foot: str, toes: str | None, ankle: np.ndarray) -> ModelFoot:
    """Find the ends of the foot among its markers, contact spheres and joints, with the toes straight.

    Units: ankle [m] (3,).
    """
    points = foot_markers(model, foot, toes)
    floor = [place[1] for name, place in points.items() if any(word in name.lower() for word in GROUND)]
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
        how={role: f"{name} of the model" for role, (name, _) in ends.items()},
        error={role: SKIN if name in marked else BONE for role, (name, _) in ends.items()},
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
    there = {n: p for n, p in points.items() if ahead * p[0] > furthest - NEAR_END}
    name = min(there, key=lambda n: there[n][1])
    return name, there[name]

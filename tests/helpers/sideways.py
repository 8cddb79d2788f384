"""Muscles, ankle and subtalar hinge by rotation matrices and cross products, without MuJoCo."""

import numpy as np

from afo_sim.description import MuscleGroup, Scenario
from afo_sim.model import Size, muscle_names

Lines = tuple[np.ndarray, np.ndarray, np.ndarray]


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' rotation matrix."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found: np.ndarray = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return found


class Talus:
    """Axes of a posture in the shank's axes, from the ankle; inversion positive on both sides."""

    def __init__(self, scenario: Scenario, ankle: float, subtalar: float = 0.0):
        hinge = scenario.leg.subtalar
        self.right = scenario.simulated_side == "right"
        self.ankle = turn(np.array([0.0, -1.0, 0.0]), ankle)
        inside = 1.0 if self.right else -1.0  # the right leg's inside is to the left, +y
        self.forward = inside * self.ankle[:, 0]
        self.centre, self.axis, self.foot = np.zeros(3), self.forward, self.ankle
        if hinge is not None:
            rise, aside = hinge.inclination, hinge.deviation
            ahead = np.cos(rise) * np.array([np.cos(aside), inside * np.sin(aside), np.tan(rise)])
            below = np.array([0.0, 0.0, -hinge.below_ankle * Size.of(scenario).taller])
            self.centre, self.axis = self.ankle @ below, inside * self.ankle @ ahead
            self.foot = turn(self.axis, subtalar) @ self.ankle

    def placed(self, point: np.ndarray) -> np.ndarray:
        """A point of the foot, told from the ankle at angles of zero."""
        bare = self.ankle.T @ self.centre
        found: np.ndarray = self.centre + self.foot @ (point - bare)
        return found


def ends(scenario: Scenario, name: str, group: MuscleGroup) -> tuple[np.ndarray, np.ndarray]:
    """Origin and insertion of a single muscle as the orthosis lies on the simulated side."""
    assert group.origin is not None and group.insertion is not None
    mirrored = scenario.simulated_side != scenario.orthosis.side
    beside = int(name.rsplit("_", 1)[1]) - 0.5 * (group.count + 1)
    found = []
    for anchor in (group.origin, group.insertion):
        x, y, z = anchor.from_joint
        y += beside * anchor.spacing
        found.append(np.array([x, -y if mirrored else y, z]))
    return found[0], found[1]


def moments(
    scenario: Scenario, tensions: dict[str, float], ankle: float, subtalar: float = 0.0
) -> tuple[float, float]:
    """Moments of all muscles on the foot about the talus' forward axis and the subtalar axis [N·m]."""
    talus, inversion, about = Talus(scenario, ankle, subtalar), 0.0, 0.0
    for name, group in muscle_names(scenario.orthosis).items():
        origin, insertion = ends(scenario, name, group)
        at = talus.placed(insertion)
        pull = tensions[name] * (origin - at) / np.linalg.norm(origin - at)
        inversion += float(talus.forward @ np.cross(at, pull))
        about += float(talus.axis @ np.cross(at - talus.centre, pull))
    return inversion, about

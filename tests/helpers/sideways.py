"""Muscles and ankle by rotation matrices and cross products, without MuJoCo."""

import numpy as np

from afo_sim.description import MuscleGroup, Scenario
from afo_sim.model import muscle_names

Lines = tuple[np.ndarray, np.ndarray, np.ndarray]


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rodrigues' rotation matrix."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found: np.ndarray = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return found


class Talus:
    """Axes of a posture in the shank's axes, from the ankle; inversion positive on both sides."""

    def __init__(self, scenario: Scenario, ankle: float):
        self.ankle = turn(np.array([0.0, -1.0, 0.0]), ankle)
        inside = 1.0 if scenario.simulated_side == "right" else -1.0  # the right leg's is to the left, +y
        self.forward = inside * self.ankle[:, 0]

    def placed(self, point: np.ndarray) -> np.ndarray:
        """A point of the foot, told from the ankle at an angle of zero."""
        found: np.ndarray = self.ankle @ point
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


def inversion_moment(scenario: Scenario, tensions: dict[str, float], ankle: float) -> float:
    """Moment of all muscles on the foot about the talus' forward axis [N·m]."""
    talus, found = Talus(scenario, ankle), 0.0
    for name, group in muscle_names(scenario.orthosis).items():
        origin, insertion = ends(scenario, name, group)
        at = talus.placed(insertion)
        pull = tensions[name] * (origin - at) / np.linalg.norm(origin - at)
        found += float(talus.forward @ np.cross(at, pull))
    return found

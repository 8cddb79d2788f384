"""The ankle above a foot that rocks on the floor: over the heel, flat, over the ball with the toes flat."""

from dataclasses import dataclass

import numpy as np

ADULT = 1.75  # body height that the lengths below belong to [m]
# Heel's contact behind the ankle centre: halfway between the centre of pressure of the loaded heel (10 mm:
# Bovi 2011, by moment and force) and the heel bone's end (48.8 mm: opensim-models, talus to calcaneus).
HEEL = 0.030
HINGE = 0.130  # joint of the toes ahead of the ankle centre (opensim-models: 178.8 − 48.8 mm) [m]
HINGE_HEIGHT = 0.025  # of that joint above the floor: an ankle axis at 69 mm, the joint 44 mm below [m]


@dataclass(frozen=True)
class FootShape:
    """What rocks on the floor, from the ankle centre, with the foot flat.

    ankle_height above the floor [m]; heel: its contact, behind [m]; hinge of the toes, ahead [m];
    hinge_height above the floor [m].
    """

    ankle_height: float
    heel: float
    hinge: float
    hinge_height: float

    @classmethod
    def of_height(cls, body_height: float, ankle_height: float, behind: float = 0.0) -> "FootShape":
        """An adult's foot, scaled by body height.

        Units: body_height [m], ankle_height [m], behind [m].
        """
        size = body_height / ADULT
        return cls(ankle_height, size * HEEL - behind, size * HINGE + behind, size * HINGE_HEIGHT)


def rocking(pitch: np.ndarray, foot: FootShape) -> tuple[np.ndarray, np.ndarray]:
    """Where the ankle is while the foot stands and turns without sliding.

    Toe up, the foot turns about the heel's contact. Toe down, it turns about the hinge of the toes, which lie
    flat on the floor.

    Source
    ------
    Perry & Burnfield 2010, Gait Analysis, chapter 3 (heel, ankle and forefoot rocker), as rigid parts.

    Units: pitch [rad] (n,), returns [m].
    """
    sine, cosine = np.sin(np.abs(pitch)), np.cos(pitch)
    above = foot.ankle_height - foot.hinge_height  # of the ankle above the hinge
    on_heel = foot.heel * (cosine - 1.0) - foot.ankle_height * sine
    on_ball = foot.hinge * (1.0 - cosine) + above * sine
    over_heel = foot.heel * sine + foot.ankle_height * cosine
    over_ball = foot.hinge_height + foot.hinge * sine + above * cosine
    toe_up = pitch > 0.0
    return np.where(toe_up, on_heel, on_ball), np.where(toe_up, over_heel, over_ball)

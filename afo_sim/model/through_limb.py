"""Where a muscle's path passes through the limb: how deep, at which angle, and what would mend it."""

import math
from dataclasses import dataclass

import numpy as np

from afo_sim.model.build import Built
from afo_sim.model.limb_shapes import LimbShapes, knee_height, limb_shapes
from afo_sim.model.mounting import ANKLE, muscle_names
from afo_sim.model.path_points import along, at_lengths, path_points

STEP = 0.004  # between points of a path that are looked at [m]
ANGLES = 21  # over the range of motion
DEEP = 0.005  # depth below the skin from which on a muscle is told to pass through it [m]
AT_END = 0.015  # of the path beside an end that itself lies in the limb: skin or plate there [m]
BONE = 0.010  # distance from the line ankle–knee below which the path passes through bone [m]


@dataclass(frozen=True)
class ThroughLimb:
    """A muscle's path within the limb, where it is deepest.

    muscle : its name
    part : "shank", "foot", or the name of what hangs on the foot
    angle : of the ankle [rad]
    depth : below the skin [m]; through bone, the distance from the line ankle–knee
    place : deepest point of the path, world axes at that angle [m] (3,)
    bone : whether the path passes within BONE of the line ankle–knee
    end : the end to be moved, "origin" or "insertion"
    move : forward by so much, back where negative [m], about
    """

    muscle: str
    part: str
    angle: float
    depth: float
    place: tuple[float, float, float]
    bone: bool
    end: str
    move: float

    @property
    def role(self) -> str:
        """The muscle group."""
        return self.muscle.rsplit("_", 1)[0]

    @property
    def words(self) -> str:
        """One sentence: muscle, angle, depth, part, and the fix."""
        at = f"at {np.degrees(self.angle):.0f} deg"
        if self.bone:
            what = f"passes {1e3 * self.depth:.0f} mm from the line ankle–knee {at}: through bone"
        else:
            what = f"passes {1e3 * self.depth:.0f} mm under the skin of the {self.part} {at}"
        way = "forward" if self.move > 0.0 else "back"
        by = math.ceil(1e3 * abs(self.move))
        return f"{self.muscle} {what}; move {self.end}.from_ankle {way} by about {by} mm, or add a path point"


def through_limb(built: Built, shapes: LimbShapes | None = None) -> list[ThroughLimb]:
    """Every muscle whose path passes through the limb within the range of motion, at its deepest.

    The paths are those of anchors that have not given way. Muscles over a pulley have no path in space. A
    mesh is taken as it is, not as its hull.
    """
    shapes = limb_shapes(built) if shapes is None else shapes
    groups = muscle_names(built.scenario.orthosis)
    worst: dict[tuple[str, str, bool], ThroughLimb] = {}
    top = knee_height(shapes)
    for angle in np.linspace(*built.scenario.orthosis.range_of_motion, ANGLES):
        shapes.pose(float(angle))
        for muscle in (name for name, group in groups.items() if group.pulley is None):
            corners = path_points(shapes.model, shapes.data, muscle)
            length = along(corners)[-1]
            way = np.linspace(0.0, length, max(int(length / STEP), 2) + 1)
            points = at_lengths(corners, way)
            for found in [
                *_in_parts(shapes, muscle, float(angle), points, way),
                *_in_bone(shapes, muscle, float(angle), points, way, top),
            ]:
                key = found.muscle, found.part, found.bone
                deeper = found.depth < worst[key].depth if found.bone and key in worst else True
                if key not in worst or (deeper if found.bone else found.depth > worst[key].depth):
                    worst[key] = found
    return list(worst.values())


def _in_parts(
    shapes: LimbShapes, muscle: str, angle: float, points: np.ndarray, way: np.ndarray
) -> list[ThroughLimb]:
    """The deepest point in each part, where it is deeper than DEEP."""
    depth: dict[str, np.ndarray] = {}
    for geom, part in shapes.geoms.items():
        own = shapes.depths(geom, points)
        for end, beside in ((0, way <= AT_END), (-1, way >= way[-1] - AT_END)):
            if own[end] > 0.0:
                own = np.where(beside, -1.0, own)
        depth[part] = np.maximum(depth.get(part, own), own)
    return [
        _found(shapes, muscle, part, angle, float(own.max()), points, way, int(own.argmax()), False)
        for part, own in depth.items()
        if own.max() > DEEP
    ]


def _in_bone(
    shapes: LimbShapes, muscle: str, angle: float, points: np.ndarray, way: np.ndarray, top: float
) -> list[ThroughLimb]:
    """The point nearest to the line from the ankle up to the knee, where it is nearer than BONE."""
    ankle = shapes.data.xanchor[shapes.model.joint(ANKLE).id]
    shank = shapes.model.jnt_bodyid[shapes.model.joint(ANKLE).id]
    up = shapes.data.xmat[shapes.model.body_parentid[shank]].reshape(3, 3)[:, 2]
    height = np.clip((points - ankle) @ up, 0.0, max(top, 0.0))
    away = np.linalg.norm(points - ankle - height[:, None] * up, axis=1)
    nearest = int(away.argmin())
    if away[nearest] >= BONE:
        return []
    return [_found(shapes, muscle, "shank", angle, float(away[nearest]), points, way, nearest, True)]


def _found(
    shapes: LimbShapes,
    muscle: str,
    part: str,
    angle: float,
    depth: float,
    points: np.ndarray,
    way: np.ndarray,
    at: int,
    bone: bool,
) -> ThroughLimb:
    """With the end that would take the path out by the shorter way: the nearer one.

    A straight path moves at a share s from its insertion by s times what its origin moves.
    """
    share = 1.0 - way[at] / way[-1]
    end, lever = ("origin", share) if share >= 0.5 else ("insertion", 1.0 - share)
    ankle = shapes.data.xanchor[shapes.model.joint(ANKLE).id]
    forward = 1.0 if float(points[:, 0].mean() - ankle[0]) >= 0.0 else -1.0
    out = BONE - depth if bone else depth
    x, y, z = map(float, points[at])
    return ThroughLimb(muscle, part, angle, depth, (x, y, z), bone, end, forward * out / lever)

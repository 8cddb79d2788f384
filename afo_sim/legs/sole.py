"""Points of the sole that walking needs, from a foot's shapes: heel, ball, pulp and tip."""

import dataclasses

import numpy as np

from afo_sim.legs.cutting import FOOT, SHANK, TOES
from afo_sim.legs.extent import lower_edge, moved, outline
from afo_sim.legs.tree import Part, Tree
from afo_sim.model.outsole import OLD, POINTS

# Share of the foot's length from its hindmost to its foremost point, as of the shipped adult leg.
SHARES = {"heel": 0.06, "ball": 0.737, "pulp": 0.944, "tip": 1.0}


def with_sole(leg: Tree) -> tuple[Tree, str]:
    """A leg with the sole's points on foot and toes, and where they come from, in words.

    The file's own points are kept where heel and ball, and pulp and tip or toe, are there. Otherwise they lie
    on the lower convex hull of the foot's shapes in the plane of walking, in the middle of its width.
    """
    own = _own(leg)
    if all(name in own or (OLD in own and name in POINTS[2:]) for name in POINTS):
        return _placed(leg, own), "the file's own points"
    derived = _derived(leg)
    if not derived:
        return leg, "none: the foot has no shapes, and cannot be walked on"
    return _placed(leg, derived), "derived from the lower edge of the foot's shapes"


def _below_foot(leg: Tree) -> list[Part]:
    return leg.below(FOOT)


def _from_ankle(leg: Tree, part: Part) -> np.ndarray:
    """Pose of a part from the ankle, in the axes of the leg (4, 4)."""
    found = leg.world_pose(part.name).copy()
    found[:3, 3] -= leg.parts[SHANK].pose[:3, 3]
    return found


def _own(leg: Tree) -> dict[str, np.ndarray]:
    """The file's points of these names, from the ankle [m]."""
    return {
        name: moved(_from_ankle(leg, part), at[None])[0]
        for part in _below_foot(leg)
        for name, at in part.points.items()
        if name in (*POINTS, OLD)
    }


def _derived(leg: Tree) -> dict[str, np.ndarray]:
    points = outline(leg, _below_foot(leg), points=False) - leg.parts[SHANK].pose[:3, 3]
    if len(points) < 3 or np.ptp(points[:, 0]) < 0.02:
        return {}
    ahead, above = lower_edge(points[:, 0], points[:, 2])
    middle = 0.5 * float(points[:, 1].min() + points[:, 1].max())
    at = {name: ahead[0] + share * (ahead[-1] - ahead[0]) for name, share in SHARES.items()}
    return {name: np.array([x, middle, np.interp(x, ahead, above)]) for name, x in at.items()}


def _placed(leg: Tree, points: dict[str, np.ndarray]) -> Tree:
    """The leg with these points on foot and toes; others of their names are renamed."""
    parts = {}
    for name, part in leg.parts.items():
        kept = {
            f"file_{point}" if point in (*POINTS, OLD) else point: at
            for point, at in part.points.items()
            if not (point in points and part in _below_foot(leg))
        }
        parts[name] = dataclasses.replace(part, points=kept)
    for point, at in points.items():
        segment = TOES if TOES in parts and point not in ("heel", "ball") else FOOT
        origin = _from_ankle(leg, leg.parts[segment])[:3, 3]
        parts[segment].points[point] = at - origin
    return dataclasses.replace(leg, parts=parts)

"""How far shapes reach: points on their surfaces, and the lower edge of a foot's outline."""

from collections.abc import Iterable

import numpy as np

from afo_sim.legs.tree import Part, Shape, Tree, moved

AROUND, ALONG = 64, 33  # points on a circle, and from pole to pole


def surface(shape: Shape) -> np.ndarray:
    """Points on a shape's surface, in the part's axes [m] (n, 3): corners, or dense on what is round."""
    size = shape.size
    if shape.kind == "mesh":
        own = shape.vertices
    elif shape.kind == "box":
        own = np.array(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0])).reshape(3, -1).T * size[:3]
    elif shape.kind == "cylinder":
        own = np.concatenate([_circle(size[0]) + np.array([0.0, 0.0, end * size[1]]) for end in (-1.0, 1.0)])
    elif shape.kind == "capsule":
        ball = _ball() * size[0]
        own = ball + np.where(ball[:, 2:] < 0.0, -1.0, 1.0) * [0.0, 0.0, size[1]]
    else:
        own = _ball() * (size[0] if shape.kind == "sphere" else size[:3])
    return moved(shape.pose, own)


def _circle(radius: float) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    return radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(AROUND)], axis=1)


def _ball() -> np.ndarray:
    height = np.linspace(-0.5 * np.pi, 0.5 * np.pi, ALONG)
    rings = [_circle(np.cos(angle)) + np.array([0.0, 0.0, np.sin(angle)]) for angle in height]
    return np.concatenate(rings)


def outline(tree: Tree, parts: Iterable[Part], *, points: bool = True) -> np.ndarray:
    """Surfaces of several parts, and their named points, in the world [m] (n, 3)."""
    found = [np.empty((0, 3))]
    for part in parts:
        own = [surface(shape) for shape in part.shapes]
        if points and part.points:
            own.append(np.array(list(part.points.values())))
        found += [moved(tree.world_pose(part.name), each) for each in own]
    return np.concatenate(found)


def lower_edge(ahead: np.ndarray, above: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The lower convex hull of points, from behind to ahead [m]."""
    hull: list[tuple[float, float]] = []
    for x, z in sorted(zip(ahead.tolist(), above.tolist(), strict=True)):
        while len(hull) > 1:
            (x_0, z_0), (x_1, z_1) = hull[-2:]
            if (x_1 - x_0) * (z - z_0) - (z_1 - z_0) * (x - x_0) > 0.0:  # the way turns to the left
                break
            hull.pop()
        hull.append((x, z))
    while len(hull) > 2 and hull[-1][0] - hull[-2][0] < 1e-9:  # a front that stands upright
        hull.pop()
    corners = np.array(hull)
    return corners[:, 0], corners[:, 1]


def sole_slope(ahead: np.ndarray, above: np.ndarray) -> float | None:
    """Slope of the sole between heel and ball against forward, toe up [rad]."""
    if len(ahead) < 2 or np.ptp(ahead) < 1e-3:
        return None
    x, z = lower_edge(ahead, above)
    k = int(np.clip(np.searchsorted(x, 0.5 * (x[0] + x[-1])), 1, len(x) - 1))
    return float(np.arctan2(z[k] - z[k - 1], x[k] - x[k - 1]))

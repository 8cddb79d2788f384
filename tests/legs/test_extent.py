"""How far shapes reach, by their support functions; the lower edge of points, by a second convex hull."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from turned_leg import placed

from afo_sim.legs import Shape, surface
from afo_sim.legs.extent import lower_edge, sole_slope
from afo_sim.legs.tree import ShapeKind

A, B, C = 0.03, 0.05, 0.08
COARSE = 0.003  # of a radius: 64 points on a circle leave out less than 1 − cos(π/64), 33 to the poles less


def reach(kind: str, way: np.ndarray) -> float:
    """The farthest of a shape along a direction of its own axes [m]."""
    x, y, z = np.abs(way)
    across = float(np.hypot(x, y))
    if kind in ("box", "mesh"):
        return float(A * x + B * y + C * z)
    return {
        "sphere": A,
        "cylinder": A * across + B * z,
        "capsule": A + B * z,
        "ellipsoid": float(np.linalg.norm([A * x, B * y, C * z])),
    }[kind]


@pytest.mark.parametrize("kind", ["box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh"])
def test_a_shape_reaches_as_far_as_its_support_function_says(kind: ShapeKind) -> None:
    random = np.random.default_rng(3)
    pose = placed(random)
    corners = np.array([[x, y, z] for x in (-A, A) for y in (-B, B) for z in (-C, C)])
    shape = Shape("shape", kind, pose, np.array([A, B, C]), vertices=corners)
    points = surface(shape) - pose[:3, 3]
    ways = [*np.eye(3), *-np.eye(3), *random.normal(size=(40, 3))]
    for way in (each / np.linalg.norm(each) for each in ways):
        far = float((points @ pose[:3, :3] @ way).max())
        assert reach(kind, way) - COARSE * C <= far <= reach(kind, way) + 1e-12


def test_the_lower_edge_is_the_lower_half_of_the_convex_hull() -> None:
    for seed in range(20):
        points = np.random.default_rng(seed).uniform([-0.06, -0.08], [0.2, 0.0], (60, 2))
        x, z = lower_edge(*points.T)
        hull = ConvexHull(points)
        corners = points[np.unique(hull.simplices[hull.equations[:, 1] < 0.0])]
        np.testing.assert_array_equal(np.column_stack([x, z]), corners[np.argsort(corners[:, 0])])


@pytest.mark.parametrize("degrees", [-30.0, 0.0, 12.0])
def test_the_slope_is_that_of_the_sole_wherever_the_foot_lies(degrees: float) -> None:
    """A box of 25 by 6 cm with a toe that rises; between heel and ball it lies on its lower side."""
    corners = np.array([[0.0, 0.0], [0.18, 0.0], [0.25, 0.03], [0.25, 0.08], [0.0, 0.08]])
    turn = np.radians(degrees)
    x, z = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ corners.T
    for ahead, above in ((0.0, 0.0), (-0.06, -0.07), (3.0, 5.0)):
        assert sole_slope(x + ahead, z + above) == pytest.approx(turn, abs=1e-12)
    assert sole_slope(x[:1], z[:1]) is None and sole_slope(0.0 * x, z) is None

"""The shapes of shank, foot and toes, and how deep a point lies within each."""

from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from afo_sim.model.build import Built
from afo_sim.model.mounting import ANKLE
from afo_sim.model.shoe_body import SHOE
from afo_sim.model.support import support

ORTHOSIS = ("cuff_", "plate_", "shank_anchors", "foot_anchors", SHOE)  # how bodies begin that are no limb
PROBE = "probe of depth"  # name of the point that is moved about
POINT = 1e-6  # its radius [m]
REACH = 0.05  # distance beyond which it is no longer asked how far away a shape is [m]
FLAT = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)


@dataclass(frozen=True, eq=False)
class LimbShapes:
    """The limb's shapes in a model of their own, posed by `pose`.

    model, data : with a probe beside the full model's shapes
    geoms : those of the limb, with the name of the part that each belongs to
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    geoms: dict[int, str]
    meshes: dict[int, Any] = field(default_factory=dict)

    def pose(self, ankle: float) -> None:
        """Turn the ankle to an angle [rad]."""
        self.data.qpos[self.model.joint(ANKLE).qposadr[0]] = ankle
        mujoco.mj_fwdPosition(self.model, self.data)

    def depths(self, geom: int, points: np.ndarray) -> np.ndarray:
        """Depth of points below a shape's surface [m] (n,); negative outside, −REACH or less far away.

        Units: points [m] (n, 3).
        """
        found = np.full(len(points), -REACH)
        offset = np.linalg.norm(points - self.data.geom_xpos[geom], axis=1)
        near = np.flatnonzero(offset < self.model.geom_rbound[geom] + REACH)
        if not len(near):
            return found
        if self.model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            found[near] = self._in_mesh(geom, points[near])
            return found
        probe = self.model.geom(PROBE).id
        segment = np.zeros(6)
        for k in near:
            self.data.geom_xpos[probe] = points[k]
            distance = mujoco.mj_geomDistance(self.model, self.data, probe, geom, REACH, segment)
            found[k] = -distance - POINT
        return found

    def _in_mesh(self, geom: int, points: np.ndarray) -> np.ndarray:
        """The mesh itself is asked: MuJoCo's distances are to its convex hull."""
        import trimesh  # large, and for meshes alone

        turn = self.data.geom_xmat[geom].reshape(3, 3)
        local = (points - self.data.geom_xpos[geom]) @ turn
        if geom not in self.meshes:
            self.meshes[geom] = _triangles(self.model, geom)
        triangles = self.meshes[geom]
        low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        found = np.full(len(points), -REACH)
        for k in np.flatnonzero(((local > low) & (local < high)).all(axis=1)):
            if winding_number(triangles, local[k]) > 0.5:
                nearest = trimesh.triangles.closest_point(triangles, np.tile(local[k], (len(triangles), 1)))
                found[k] = np.linalg.norm(nearest - local[k], axis=1).min()
        return found


def winding_number(triangles: np.ndarray, point: np.ndarray) -> float:
    """How often a surface winds around a point [-]: 1 inside a closed mesh, 0 outside.

    Σ Ω/4π over the triangles' solid angles, tan(Ω/2) = a·(b×c)/(abc + (a·b)c + (b·c)a + (c·a)b)
    (van Oosterom and Strackee 1983).
    """
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    top = np.einsum("ij,ij->i", a, np.cross(b, c))
    pairs = [np.einsum("ij,ij->i", *pair) * size for *pair, size in ((a, b, lc), (b, c, la), (c, a, lb))]
    return float(np.arctan2(top, la * lb * lc + sum(pairs)).sum() / (2.0 * np.pi))


def _triangles(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """Corners of a mesh's triangles in the shape's own axes [m] (n, 3, 3)."""
    mesh = model.geom_dataid[geom]
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
    faces = model.mesh_face[model.mesh_faceadr[mesh] :][: model.mesh_facenum[mesh]]
    corners: np.ndarray = vertices[faces].astype(float)
    return corners


def limb_shapes(built: Built) -> LimbShapes:
    """The limb's shapes of a compiled scenario, at an ankle angle of zero."""
    spec = built.spec.copy()
    spec.worldbody.add_geom(
        name=PROBE, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[POINT] * 3, contype=0, conaffinity=0
    )
    model = spec.compile()
    shapes = LimbShapes(model, mujoco.MjData(model), limb_geoms(model, built))
    shapes.pose(0.0)
    return shapes


def limb_geoms(model: mujoco.MjModel, built: Built) -> dict[int, str]:
    """Shapes of shank, foot and what hangs on it, without orthosis and shoe: {geom: "shank", "foot" …}."""
    leg = built.scenario.leg
    found = {}
    for geom in range(model.ngeom):
        body = model.body(model.geom_bodyid[geom]).name
        worn = model.geom(geom).name.startswith(f"{SHOE}_") or body.startswith(ORTHOSIS)
        if worn or model.geom_type[geom] in FLAT:
            continue
        if body == leg.shank or body == leg.foot or _hangs_on(model, geom, leg.foot):
            part = {leg.shank: "shank", leg.foot: "foot"}.get(body, body or "foot")
            found[geom] = part
    return found


def _hangs_on(model: mujoco.MjModel, geom: int, foot: str) -> bool:
    body, above = int(model.geom_bodyid[geom]), model.body(foot).id
    while body > 0 and body != above:
        body = int(model.body_parentid[body])
    return body == above


def knee_height(shapes: LimbShapes) -> float:
    """Height of the topmost point of the shank's shapes above the ankle [m]; 0 of a shank without shapes."""
    ankle = shapes.data.xanchor[shapes.model.joint(ANKLE).id][2]
    shank = [geom for geom, part in shapes.geoms.items() if part == "shank"]
    up = np.array([[0.0, 0.0, 1.0]])
    tops = [support(shapes.model, shapes.data, geom, up)[0, 2] for geom in shank]
    return float(max(tops, default=ankle) - ankle)

"""Shapes of the leg: how deep a muscle's path passes through them, at which angle, and the remedy."""

import math
from dataclasses import dataclass, field

import mujoco
import numpy as np

from afo_sim.common import Foreign, Keywords, Notice
from afo_sim.description import JOINTS, WORN
from afo_sim.model.build import Built
from afo_sim.model.mounting import ANKLE, muscle_names
from afo_sim.model.outsole import SHOE
from afo_sim.model.paths import along, at_lengths, path_points

POINT_SPACING = 0.004  # between points of a path that are looked at [m]
POSTURES = 21  # over the range of motion
DEEP = 0.005  # depth below the skin from which on a muscle is said to pass through it [m]
AT_END = 0.015  # of the path beside an end that itself lies in the leg: skin or plate there [m]
BONE = 0.010  # distance from the line ankle–knee below which the path passes through bone [m]
# how bodies begin that are no leg
ADDED = ("cuff_", "plate_", *(f"{segment}_anchors" for segment in WORN), SHOE)
PROBE = "probe of depth"  # name of the point that is moved about
PROBE_RADIUS = 1e-6  # its radius [m]
REACH = 0.05  # distance beyond which the distance of a shape is not computed [m]
FLAT = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)


@dataclass(frozen=True, eq=False)
class LegShapes:
    """The leg's shapes in a model of their own, posed by `pose`."""

    model: mujoco.MjModel
    data: mujoco.MjData
    geoms: dict[int, str]
    meshes: dict[int, Foreign] = field(default_factory=dict)

    def pose(self, ankle: float) -> None:
        """Turn the ankle to an angle [rad]."""
        self.data.qpos[self.model.joint(ANKLE).qposadr[0]] = ankle
        mujoco.mj_fwdPosition(self.model, self.data)

    def depths(self, geom: int, points: np.ndarray) -> np.ndarray:
        """Depth of points below a shape's surface [m] (n,); negative outside, −REACH or less far away."""
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
            found[k] = -distance - PROBE_RADIUS
        return found

    def _in_mesh(self, geom: int, points: np.ndarray) -> np.ndarray:
        """To the mesh itself: MuJoCo's distances are to its convex hull."""
        import trimesh  # large, and for meshes alone

        local = (points - self.data.geom_xpos[geom]) @ self.data.geom_xmat[geom].reshape(3, 3)
        if geom not in self.meshes:
            # Corners of a mesh's triangles in the shape's own axes [m] (n, 3, 3)
            mesh = self.model.geom_dataid[geom]
            vertices = self.model.mesh_vert[self.model.mesh_vertadr[mesh] :][: self.model.mesh_vertnum[mesh]]
            faces = self.model.mesh_face[self.model.mesh_faceadr[mesh] :][: self.model.mesh_facenum[mesh]]
            self.meshes[geom] = vertices[faces].astype(float)
        triangles = self.meshes[geom]
        low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        found = np.full(len(points), -REACH)
        for k in np.flatnonzero(((local > low) & (local < high)).all(axis=1)):
            if winding_number(triangles, local[k]) > 0.5:
                nearest = trimesh.triangles.closest_point(triangles, np.tile(local[k], (len(triangles), 1)))
                found[k] = np.linalg.norm(nearest - local[k], axis=1).min()
        return found


def leg_shapes(built: Built) -> LegShapes:
    """The leg's shapes of a compiled scenario, at an ankle angle of zero."""
    spec = built.spec.copy()
    spec.worldbody.add_geom(
        name=PROBE, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[PROBE_RADIUS] * 3, contype=0, conaffinity=0
    )
    model = spec.compile()
    shapes = LegShapes(model, mujoco.MjData(model), leg_geoms(model, built))
    shapes.pose(0.0)
    return shapes


def leg_geoms(model: mujoco.MjModel, built: Built) -> dict[int, str]:
    """Shapes of shank, foot and its descendants, without orthosis and shoe: {geom: "shank", "foot" …}."""
    leg = built.scenario.leg
    above, below, foot = JOINTS[leg.joint].above, JOINTS[leg.joint].below, model.body(leg.foot).id
    found = {}
    for geom in range(model.ngeom):
        body = model.body(model.geom_bodyid[geom]).name
        worn = model.geom(geom).name.startswith(f"{SHOE}_") or body.startswith(ADDED)
        if worn or model.geom_type[geom] in FLAT:
            continue
        part = {leg.shank: above, leg.foot: below}.get(body, body or below)
        up = int(model.geom_bodyid[geom])
        while up > 0 and up != foot:  # up to what it hangs on
            up = int(model.body_parentid[up])
        if body == leg.shank or up == foot:
            found[geom] = part
    return found


def _knee_height(shapes: LegShapes, above: str = "shank") -> float:
    """Height of the topmost point of the shank's shapes above the ankle [m]; 0 of a shank without shapes."""
    ankle = shapes.data.xanchor[shapes.model.joint(ANKLE).id][2]
    shank = [geom for geom, part in shapes.geoms.items() if part == above]
    up = np.array([[0.0, 0.0, 1.0]])
    tops = [support(shapes.model, shapes.data, geom, up)[0, 2] for geom in shank]
    return float(max(tops, default=ankle) - ankle)


def winding_number(triangles: np.ndarray, point: np.ndarray) -> float:
    """How often a surface winds around a point [-]: 1 inside a closed mesh, 0 outside."""
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    top = np.einsum("ij,ij->i", a, np.cross(b, c))
    pairs = [np.einsum("ij,ij->i", *pair) * size for *pair, size in ((a, b, lc), (b, c, la), (c, a, lb))]
    return float(np.arctan2(top, la * lb * lc + sum(pairs)).sum() / (2.0 * np.pi))


def support(model: mujoco.MjModel, data: mujoco.MjData, geom: int, directions: np.ndarray) -> np.ndarray:
    """Outermost points of a shape."""
    turn, size = data.geom_xmat[geom].reshape(3, 3), model.geom_size[geom]
    d = directions @ turn
    types, kind = mujoco.mjtGeom, model.geom_type[geom]
    if kind == types.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]].astype(float)
        local = vertices[np.argmax(d @ vertices.T, axis=1)]
    elif kind == types.mjGEOM_BOX:
        local = np.sign(d) * size
    elif kind == types.mjGEOM_ELLIPSOID:
        local = d * size**2 / np.linalg.norm(d * size, axis=1)[:, None]
    elif kind == types.mjGEOM_CYLINDER:
        radial = np.hypot(d[:, 0], d[:, 1]).clip(1e-12)
        local = np.column_stack([size[0] * d[:, :2] / radial[:, None], np.sign(d[:, 2]) * size[1]])
    elif kind == types.mjGEOM_CAPSULE:
        local = size[0] * d
        local[:, 2] += np.sign(d[:, 2]) * size[1]
    else:
        local = size[0] * d  # a sphere
    return np.asarray(data.geom_xpos[geom] + local @ turn.T)


@dataclass(frozen=True)
class ThroughLeg:
    """A muscle's path within the leg, where it is deepest."""

    muscle: str  # its name
    part: str  # "shank", "foot", or the name of what hangs on the foot
    angle: float  # of the ankle [rad]
    depth: float  # below the skin [m]; through bone, the distance from the line ankle–knee
    place: tuple[float, float, float]  # deepest point of the path, world axes at that angle [m] (3,)
    bone: bool  # whether the path passes within BONE of the line ankle–knee
    end: str  # the one to be moved
    move: float  # forward, back where negative [m], about

    @property
    def role(self) -> str:
        """The muscle group."""
        return self.muscle.rsplit("_", 1)[0]

    @property
    def notice(self) -> Notice:
        """One sentence: muscle, angle, depth, part, and the fix."""
        at = f"at {np.degrees(self.angle):.0f} deg"
        if self.bone:
            line = "line ankle–knee" if self.part == "shank" else f"middle of the {self.part}"
            what = f"passes {1e3 * self.depth:.0f} mm from the {line} {at}: through bone"
        else:
            what = f"passes {1e3 * self.depth:.0f} mm under the skin of the {self.part} {at}"
        way = "forward" if self.move > 0.0 else "back"
        by = math.ceil(1e3 * abs(self.move))
        code = "path-through-bone" if self.bone else "path-through-skin"
        text = "{muscle} {what}; move {end}.from_joint {way} by about {by} mm, or add a path point"
        data: Keywords = {"muscle": self.muscle, "what": what, "end": self.end, "way": way, "by": by}
        data |= {"depth": self.depth, "angle": self.angle}
        return Notice(code, text, subject=f"{self.muscle}, {self.part}", **data)


def through_leg(built: Built) -> list[ThroughLeg]:
    """Every muscle whose path passes through the leg within the range of motion, at its deepest."""
    shapes, groups = leg_shapes(built), muscle_names(built.scenario.orthosis)
    worst: dict[tuple[str, str, bool], ThroughLeg] = {}
    above = JOINTS[built.scenario.leg.joint].above
    top = _knee_height(shapes, above)
    for angle in np.linspace(*built.scenario.orthosis.range_of_motion, POSTURES):
        shapes.pose(float(angle))
        for muscle in (name for name, group in groups.items() if group.pulley is None):
            corners = path_points(shapes.model, shapes.data, muscle)
            length = along(corners)[-1]
            way = np.linspace(0.0, length, max(int(length / POINT_SPACING), 2) + 1)
            points = at_lengths(corners, way)
            found = [(*deep, False) for deep in _in_parts(shapes, points, way)]
            ankle = shapes.data.xanchor[shapes.model.joint(ANKLE).id]
            shank = shapes.model.jnt_bodyid[shapes.model.joint(ANKLE).id]
            up = shapes.data.xmat[shapes.model.body_parentid[shank]].reshape(3, 3)[:, 2]
            height = np.clip((points - ankle) @ up, 0.0, max(top, 0.0))
            away = np.linalg.norm(points - ankle - height[:, None] * up, axis=1)
            if away.min() < BONE:  # of the line from ankle to knee
                found.append((above, float(away.min()), int(away.argmin()), True))
            for part, depth, at, bone in found:
                key = muscle, part, bone
                # of bone the distance is given
                if key in worst and (depth >= worst[key].depth if bone else depth <= worst[key].depth):
                    continue
                # the end that would take the path out by the shorter way: the nearer one
                share = 1.0 - way[at] / way[-1]
                end, lever = ("origin", share) if share >= 0.5 else ("insertion", 1.0 - share)
                ankle = shapes.data.xanchor[shapes.model.joint(ANKLE).id]
                forward = 1.0 if float(points[:, 0].mean() - ankle[0]) >= 0.0 else -1.0
                x, y, z = map(float, points[at])
                move = forward * (BONE - depth if bone else depth) / lever
                worst[key] = ThroughLeg(muscle, part, float(angle), depth, (x, y, z), bone, end, move)
    return list(worst.values())


def _in_parts(shapes: LegShapes, points: np.ndarray, way: np.ndarray) -> list[tuple[str, float, int]]:
    """(part, depth, place) of the deepest point in each part, where it is deeper than DEEP."""
    depth: dict[str, np.ndarray] = {}
    for geom, part in shapes.geoms.items():
        own = shapes.depths(geom, points)
        for end, beside in ((0, way <= AT_END), (-1, way >= way[-1] - AT_END)):
            if own[end] > 0.0:
                own = np.where(beside, -1.0, own)
        depth[part] = np.maximum(depth.get(part, own), own)
    return [(part, float(own.max()), int(own.argmax())) for part, own in depth.items() if own.max() > DEEP]

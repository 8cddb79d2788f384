"""The path of every muscle: between two anchors, through points and around surfaces, or over a pulley.

`add_tendons` puts the paths into any spec. `paths_of` has them about a bare ankle, on two bodies and one
hinge: it needs no leg, and gives the same lengths as the compiled scenario.
"""

import functools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import fmean

import mujoco
import numpy as np

from afo_sim.description import JOINTS, Joint, MuscleGroup, Orthosis, PathPoint, Segment
from afo_sim.model.mounting import ANKLE, drawn, muscle_names, postures

LATERAL = np.array([0.0, 1.0, 0.0])
GUIDE = [0.35, 0.5, 0.7, 1.0]  # colour of points and surfaces
DRAWN_HALF = 0.02  # half of the drawn length of a cylinder that stands for an endless one [m]
ARC = 9  # points of an arc
SPHERE, CYLINDER = mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CYLINDER


def add_tendons(
    spec: mujoco.MjSpec, anchors: dict[str, mujoco.MjsBody], orthosis: Orthosis, *, prefix: str = "",
    default: mujoco.MjsDefault | None = None,
) -> None:  # fmt: skip
    """A tendon for every single muscle, of its name; `anchors` are the bodies that carry the ends."""
    for name, group in muscle_names(orthosis).items():
        tendon = spec.add_tendon(default, name=prefix + name, width=group.type.bore / 2.0)
        add = _add_path if group.pulley is None else _add_pulley
        add(tendon, anchors, prefix + name, group)


def _add_path(
    tendon: mujoco.MjsTendon, anchors: dict[str, mujoco.MjsBody], name: str, group: MuscleGroup
) -> None:
    """The path of one muscle from origin to insertion; half its mass stands at each end."""
    assert group.origin is not None and group.insertion is not None
    tendon.rgba = [0.75, 0.25, 0.2, 1.0]
    look = drawn([0.8, 0.8, 0.82, 1.0], group.type.whole_mass / 2.0)
    for end, anchor in (("origin", group.origin), ("insertion", group.insertion)):
        if end == "insertion":
            for number, point in enumerate(group.path):
                _add_point(anchors[point.segment], tendon, f"{name}_path{number}", name, group, point)
        body = anchors[anchor.segment]
        position = np.array(anchor.from_joint) + side(name, group) * anchor.spacing * LATERAL
        site = body.add_site(name=f"{name}_{end}", pos=position, size=[0.005] * 3)
        body.add_geom(name=f"{name}_{end}", type=SPHERE, pos=position, size=[0.006, 0.0, 0.0], **look)
        tendon.wrap_site(site.name)


def _add_point(
    body: mujoco.MjsBody, tendon: mujoco.MjsTendon, label: str, name: str, group: MuscleGroup,
    point: PathPoint,
) -> None:  # fmt: skip
    """A point or a surface of one muscle's path, on the body that carries the anchors of its segment."""
    position = np.array(point.from_joint) + side(name, group) * point.spacing * LATERAL
    surface = point.surface
    if surface is None:
        body.add_site(name=label, pos=position, size=[0.004] * 3, rgba=GUIDE)
        tendon.wrap_site(label)
        return
    turn, size = np.array([1.0, 0.0, 0.0, 0.0]), [surface.radius, 0.0, 0.0]
    kind = SPHERE
    if surface.shape == "cylinder":
        kind, size[1] = CYLINDER, max(0.5 * point.spacing, DRAWN_HALF)
        mujoco.mju_quatZ2Vec(turn, np.array(surface.axis) / np.linalg.norm(surface.axis))
    body.add_geom(name=label, type=kind, pos=position, quat=turn, size=size, **drawn(GUIDE))
    tendon.wrap_geom(label, "")


def side(name: str, group: MuscleGroup) -> float:
    """Place of a single muscle beside its parallel ones, in spacings from their middle."""
    return int(name.rsplit("_", 1)[1]) - 0.5 * (group.count + 1)


def _add_pulley(
    tendon: mujoco.MjsTendon, anchors: dict[str, mujoco.MjsBody], name: str, group: MuscleGroup
) -> None:
    """One muscle over a pulley: a fixed tendon of length −(moment arm) × angle."""
    assert group.pulley is not None
    arm, muscle = group.pulley.moment_arm, group.type
    tendon.wrap_joint(ANKLE, -arm)
    offset = side(name, group) * group.pulley.spacing
    height = muscle.end_length - group.series_length + 0.5 * math.pi * group.pulley.radius
    above, below = anchors.values()
    for end, z in (("origin", height), ("insertion", 0.0)):
        above.add_site(name=f"{name}_{end}", pos=[arm, offset, z], size=[0.005] * 3)
    half_width = 0.004 + (0.5 * group.pulley.spacing if group.count > 1 else 0.0)
    below.add_geom(
        name=f"{name}_pulley",
        type=CYLINDER,
        fromto=[0.0, offset - half_width, 0.0, 0.0, offset + half_width, 0.0],
        size=[group.pulley.radius, 0.0, 0.0],
        **drawn([0.55, 0.57, 0.6, 1.0]),
    )


@dataclass(frozen=True, eq=False)
class Route:
    """A path in one posture: where it is held, from origin to insertion, and on what."""

    points: np.ndarray  # in the world [m] (n, 3)
    bodies: np.ndarray  # ids (n,)
    surfaces: np.ndarray  # geom ids, −1 of a point without surface (n,)

    @property
    def crossings(self) -> Iterator[int]:
        """Numbers of the straight pieces that run from one body to another."""
        return (k for k in range(len(self.bodies) - 1) if self.bodies[k] != self.bodies[k + 1])


def route_of(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> Route:
    """The path of a spatial tendon in the posture of `data`, whose tendons are computed."""
    start, count = int(data.ten_wrapadr[tendon]), int(data.ten_wrapnum[tendon])
    points = data.wrap_xpos.reshape(-1, 3)[start : start + count].copy()
    surfaces = data.wrap_obj.reshape(-1)[start : start + count].copy()
    entries = slice(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    types, ids = model.wrap_type[entries], model.wrap_objid[entries]
    sites = iter(ids[types == mujoco.mjtWrap.mjWRAP_SITE])
    bodies = [model.site_bodyid[next(sites)] if geom < 0 else model.geom_bodyid[geom] for geom in surfaces]
    return Route(points, np.array(bodies), surfaces)


@dataclass(frozen=True, eq=False)
class Paths:
    """Paths of all single muscles of an orthosis that run between two anchors; names as `muscle_names`."""

    model: mujoco.MjModel
    tendons: dict[str, int]

    def lengths(self, angles: np.ndarray) -> np.ndarray:
        """Lengths over the joint's angles [m] (n, n_muscle)."""
        own = list(self.tendons.values())
        return np.array([data.ten_length[own] for data in postures(self.model, 0, angles)])

    def moment_arms(self, angles: np.ndarray) -> np.ndarray:
        """−dL/dθ over the joint's angles, positive when tension raises the angle [m] (n, n_muscle)."""
        dense = np.zeros((self.model.ntendon, 1))
        found = []
        for data in postures(self.model, 0, angles):
            mujoco.mju_sparse2dense(
                dense, data.ten_J.reshape(-1), self.model.ten_J_rownnz, self.model.ten_J_rowadr,
                self.model.ten_J_colind.reshape(-1),
            )  # fmt: skip
            found.append(-dense[list(self.tendons.values()), 0])
        return np.array(found)

    def directions(self, angles: np.ndarray, segment: Segment) -> np.ndarray:
        """Pull of each muscle on a segment, per unit of tension, in the segment's axes (n, n_muscle, 3)."""
        own = self.model.body(segment).id
        found = np.zeros((len(angles), len(self.tendons), 3))
        for k, data in enumerate(postures(self.model, 0, angles)):
            turn = data.xmat[own].reshape(3, 3)
            for column, tendon in enumerate(self.tendons.values()):
                route = route_of(self.model, data, tendon)
                for piece in route.crossings:
                    along = route.points[piece + 1] - route.points[piece]
                    along = along if route.bodies[piece] == own else -along
                    found[k, column] += along / np.linalg.norm(along) @ turn
        return found


def paths_of(orthosis: Orthosis) -> Paths:
    """The paths of an orthosis' muscles; those over pulleys are left out."""
    return _paths(tuple(orthosis.anchored.items()), orthosis.words)


@functools.lru_cache(maxsize=8)
def _paths(groups: tuple[tuple[str, MuscleGroup], ...], joint: Joint) -> Paths:
    spec = mujoco.MjSpec()
    names = joint.segments
    above = spec.worldbody.add_body(name=names[0])
    below = above.add_body(name=names[1], mass=1.0, inertia=[1.0, 1.0, 1.0])
    below.explicitinertial = True
    below.add_joint(name=ANKLE, type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis)
    alone = Orthosis.model_construct(
        range_of_motion=(0.0, 0.0), muscle=dict(groups), anchor={}, chamber={}
    )  # no chambers: paths have no air
    add_tendons(spec, dict(zip(names, (above, below), strict=True)), alone)
    model = spec.compile()
    return Paths(model, {name: model.tendon(name).id for name in muscle_names(alone)})


def mean_length(group: MuscleGroup) -> float:
    """Mean length of the paths of a group's muscles at an angle of zero [m]; not of a pulley."""
    if not group.guided_by_surfaces:
        return fmean(group.path_lengths)
    ends = {place.segment for place in group.places}
    joint = next(each for each in JOINTS.values() if ends <= {*each.segments})  # at zero all are alike
    return float(_paths((("muscle", group),), joint).lengths(np.zeros(1)).mean())


def path_points(model: mujoco.MjModel, data: mujoco.MjData, muscle: str) -> np.ndarray:
    """Corners of a muscle's path from origin to insertion, with points along its arcs."""
    route, found = route_of(model, data, model.tendon(muscle).id), list[np.ndarray]()
    around = route.surfaces
    for k, point in enumerate(route.points):
        if k and around[k] >= 0 and around[k] == around[k - 1]:
            found.extend(_arc(model, data, int(around[k]), route.points[k - 1], point))
        found.append(point)
    return np.array(found).reshape(-1, 3)


def _arc(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, start: np.ndarray, end: np.ndarray
) -> list[np.ndarray]:
    """Points between two on a sphere or cylinder, about its middle by the shorter way."""
    centre, axis = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)[:, 2]
    first, last = start - centre, end - centre
    heights = np.zeros(2)
    if model.geom_type[geom] == CYLINDER:
        heights = np.array([first @ axis, last @ axis])
        first, last = first - heights[0] * axis, last - heights[1] * axis
    cosine = first @ last / (np.linalg.norm(first) * np.linalg.norm(last))
    turn = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
    if turn < 1e-6:
        return []
    shares = np.linspace(0.0, 1.0, ARC + 2)[1:-1]
    return [
        centre
        + (np.sin((1.0 - s) * turn) * first + np.sin(s * turn) * last) / np.sin(turn)
        + ((1.0 - s) * heights[0] + s * heights[1]) * axis
        for s in shares
    ]


def along(points: np.ndarray) -> np.ndarray:
    """Length of a path from its first point to each [m] (n,)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def at_lengths(points: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Places on a path at lengths from its first point [m] (m, 3)."""
    way = along(points)
    return np.column_stack([np.interp(lengths, way, points[:, k]) for k in range(3)])

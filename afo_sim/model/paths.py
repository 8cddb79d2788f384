"""Paths of an orthosis' muscles about a bare ankle: lengths, moment arms and straight pieces over its angle.

The muscles' ends, points and surfaces alone, on two bodies and one hinge, as MuJoCo lays the paths. It needs
no leg, and tells the same lengths as the compiled scenario.
"""

import functools
import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import fmean

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.description.attachment import Segment
from afo_sim.description.orthosis import MuscleGroup, Orthosis
from afo_sim.model.mounting import ANKLE, muscle_names
from afo_sim.model.tendons import add_tendons

SEGMENTS: tuple[Segment, ...] = ("shank", "foot")


@dataclass(frozen=True, eq=False)
class Route:
    """A path in one posture: where it is held, from origin to insertion, and on which body each place is.

    points : [m], in the world (n, 3)
    bodies : ids (n,)
    surfaces : geom id of the surface that a point lies on, −1 for a point without surface (n,)
    """

    points: np.ndarray
    bodies: np.ndarray
    surfaces: np.ndarray

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
        """Lengths over the ankle's angles [m] (n, n_muscle)."""
        return np.array([data.ten_length[list(self.tendons.values())] for data in self._at(angles)])

    def moment_arms(self, angles: np.ndarray) -> np.ndarray:
        """−dL/dθ over the ankle's angles, positive when tension dorsiflexes [m] (n, n_muscle)."""
        dense = np.zeros((self.model.ntendon, 1))
        found = []
        for data in self._at(angles):
            mujoco.mju_sparse2dense(
                dense, data.ten_J.reshape(-1), self.model.ten_J_rownnz, self.model.ten_J_rowadr,
                self.model.ten_J_colind.reshape(-1),
            )  # fmt: skip
            found.append(-dense[list(self.tendons.values()), 0])
        return np.array(found)

    def directions(self, angles: np.ndarray, segment: Segment) -> np.ndarray:
        """Pull of each muscle on a segment, per unit of tension, in the segment's axes (n, n_muscle, 3).

        Guides on the segment are part of what is pulled on. So only the pieces that leave it count.
        """
        own = self.model.body(segment).id
        found = np.zeros((len(angles), len(self.tendons), 3))
        for k, data in enumerate(self._at(angles)):
            turn = data.xmat[own].reshape(3, 3)
            for column, tendon in enumerate(self.tendons.values()):
                route = route_of(self.model, data, tendon)
                for piece in route.crossings:
                    along = route.points[piece + 1] - route.points[piece]
                    along = along if route.bodies[piece] == own else -along
                    found[k, column] += along / np.linalg.norm(along) @ turn
        return found

    def _at(self, angles: np.ndarray) -> Iterator[mujoco.MjData]:
        data = native.scratch(self.model)
        for angle in angles:
            data.qpos[0] = angle
            mujoco.mj_fwdPosition(self.model, data)
            yield data


def paths_of(orthosis: Orthosis) -> Paths:
    """The paths of an orthosis' muscles; those over pulleys are left out."""
    return _paths(tuple(orthosis.anchored.items()))


@functools.lru_cache(maxsize=8)
def _paths(groups: tuple[tuple[str, MuscleGroup], ...]) -> Paths:
    spec = mujoco.MjSpec()
    shank = spec.worldbody.add_body(name="shank")
    foot = shank.add_body(name="foot", mass=1.0, inertia=[1.0, 1.0, 1.0])
    foot.explicitinertial = True
    foot.add_joint(name=ANKLE, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, -1.0, 0.0])
    alone = Orthosis.model_construct(
        range_of_motion=(0.0, 0.0), muscle=dict(groups), anchor={}, chamber={}
    )  # no chambers: paths have no air
    add_tendons(spec, {"shank": shank, "foot": foot}, alone)
    model = spec.compile()
    return Paths(model, {name: model.tendon(name).id for name in muscle_names(alone)})


def mean_length(group: MuscleGroup) -> float:
    """Mean length of the paths of a group's muscles at an ankle angle of zero [m]; not of a pulley."""
    if not group.guided_by_surfaces:
        return fmean(group.path_lengths)
    return float(_paths((("muscle", group),)).lengths(np.zeros(1)).mean())


def turns(route: Route) -> np.ndarray:
    """Angles by which a path turns at its points, 0 at its ends [rad] (n,)."""
    pieces = np.diff(route.points, axis=0)
    found = np.zeros(len(route.points))
    for k, (a, b) in enumerate(itertools.pairwise(pieces), start=1):
        found[k] = np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)
    return found

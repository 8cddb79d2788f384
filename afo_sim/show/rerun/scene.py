"""The scene in space: segments, orthosis, muscles as tubes, floor, joint axis."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import rerun as rr

from afo_sim.description.muscle import Muscle
from afo_sim.description.orthosis import MuscleGroup
from afo_sim.metrics.strides import stance_force
from afo_sim.model.mounting import ANKLE, chamber_of, muscle_names
from afo_sim.show.rerun.clock import GAIT, send
from afo_sim.show.rerun.source import Columns, Source

FORCE_SCALE = 100.0  # force at which a muscle is fully coloured [N]
PRESSURE_SCALE = 4e5  # gauge pressure at which a muscle is fully coloured [Pa]
SLACK, PULLING = np.array([150, 155, 165]), np.array([245, 60, 30])
CABLE_RADIUS = 0.0015  # [m]
WALKING = (  # columns that walking is shown by, beside the model's coordinates
    *GAIT,
    "gait/ankle_angle",
    "shank/angle",
    *(f"ankle/position/{x}" for x in "xz"),
    *(f"ground/{x}" for x in ("force/x", "force/z", "position/x")),
)


@dataclass(frozen=True)
class Stage:
    """One run's place in space: where its entities stand, and how opaque it is drawn."""

    model: mujoco.MjModel
    groups: dict[str, MuscleGroup]
    root: str
    opacity: float
    colour_by: str
    walking: tuple[str, ...] = ()  # columns that a walking run is shown by besides

    @property
    def columns(self) -> list[str]:
        """The columns that poses and muscles are made of."""
        joints = [f"qpos/{self.model.joint(j).name}" for j in range(self.model.njnt)]
        muscles = [f"muscle/{m}/{x}" for m in self.groups for x in ("length", "contraction", "force")]
        chambers = [f"chamber/{chamber_of(m, g)}/pressure" for m, g in self.groups.items()]
        return ["time", *joints, *muscles, *dict.fromkeys(chambers), *self.walking]


def stage(source: Source, root: str = "world", opacity: float = 1.0, colour_by: str = "force") -> Stage:
    """The stage of a run."""
    model = mujoco.MjModel.from_xml_string(source.header.model_xml)
    walking = tuple(dict.fromkeys((*WALKING, stance_force(source.columns)))) if source.walks else ()
    return Stage(model, muscle_names(source.scenario.orthosis), root, opacity, colour_by, walking)


def log_axes(stream: rr.RecordingStream) -> None:
    """Log the upward axis, once."""
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)


def log_floor(stream: rr.RecordingStream) -> None:
    """A floor to sit at, once."""
    floor = rr.Boxes3D(
        half_sizes=[[0.45, 0.3, 0.002]],
        centers=[[0.05, 0.0, 0.0]],
        colors=[[62, 66, 72]],
        fill_mode="solid",
    )
    stream.log("world/floor", floor, static=True)


def log_shapes(stream: rr.RecordingStream, view: Stage) -> None:
    """Everything that does not move within its body, once."""
    model = view.model
    for body in range(1, model.nbody):
        log_body(stream, view, body, f"{view.root}/bodies/{model.body(body).name}")
    joint = model.joint(ANKLE)
    body = model.body(joint.bodyid[0]).name
    ends = [joint.pos + side * 0.085 * joint.axis for side in (-1.0, 1.0)]
    axis = rr.LineStrips3D([ends], radii=[0.002], colors=[[255, 220, 90, round(255 * view.opacity)]])
    stream.log(f"{view.root}/bodies/{body}/ankle_axis", axis, static=True)
    for name in view.groups:
        solid = rr.Capsules3D.from_fields(fill_mode="solid")
        stream.log(f"{view.root}/muscles/{name}", solid, static=True)
        cable = rr.LineStrips3D.from_fields(radii=[CABLE_RADIUS], colors=[[210, 210, 215]])
        stream.log(f"{view.root}/cables/{name}", cable, static=True)


def log_body(
    stream: rr.RecordingStream, view: Stage, body: int, root: str, colour: list[int] | None = None
) -> None:
    """The shapes of one body of the model under an entity, in their own colours or all in one (RGBA)."""
    model = view.model
    for geom in np.flatnonzero(model.geom_bodyid == body):
        pose = rr.Transform3D(
            translation=model.geom_pos[geom], quaternion=model.geom_quat[geom][[1, 2, 3, 0]]
        )
        own = (255 * model.geom_rgba[geom] * [1, 1, 1, view.opacity]).astype(np.uint8)
        shape = _shape(model, int(geom), own if colour is None else np.array(colour, np.uint8))
        if shape is not None:
            stream.log(f"{root}/{model.geom(geom).name or f'geom_{geom}'}", pose, shape, static=True)


def _shape(model: mujoco.MjModel, geom: int, colour: np.ndarray) -> Any:
    size, kind = model.geom_size[geom], model.geom_type[geom]
    look: dict[str, Any] = {"colors": [colour], "fill_mode": "solid"}
    types = mujoco.mjtGeom
    if kind == types.mjGEOM_SPHERE:
        return rr.Ellipsoids3D(half_sizes=[[size[0]] * 3], **look)
    if kind == types.mjGEOM_ELLIPSOID:
        return rr.Ellipsoids3D(half_sizes=[size], **look)
    if kind == types.mjGEOM_BOX:
        return rr.Boxes3D(half_sizes=[size], **look)
    if kind == types.mjGEOM_CYLINDER:
        return rr.Cylinders3D(lengths=[2 * size[1]], radii=[size[0]], **look)
    if kind == types.mjGEOM_CAPSULE:  # Rerun's starts at its origin, MuJoCo's is centred
        start = [[0, 0, -size[1]]]
        return rr.Capsules3D(lengths=[2 * size[1]], radii=[size[0]], translations=start, **look)
    return None


def log_poses(stream: rr.RecordingStream, view: Stage, block: Columns) -> None:
    """Replay a block's coordinates through the kinematics; bodies, muscles and cables."""
    model = view.model
    position, quaternion, ends = replay(model, block, tuple(view.groups))
    for body in range(1, model.nbody):
        pose = rr.Transform3D.columns(
            translation=position[:, body].astype(np.float32),
            quaternion=quaternion[:, body][:, [1, 2, 3, 0]].astype(np.float32),
        )
        send(stream, f"{view.root}/bodies/{model.body(body).name}", block, pose)
    for number, (name, group) in enumerate(view.groups.items()):
        _log_muscle(stream, view, block, name, group, ends[:, number])


def replay(
    model: mujoco.MjModel, block: Columns, muscles: tuple[str, ...] = ()
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses of bodies and paths of muscles at the coordinates of a block of rows.

    Parameters
    ----------
    model : of the run
    block : with a column qpos/<joint> for every joint [m], [rad] (n,)
    muscles : names of those whose ends are wanted

    Returns
    -------
    positions of the bodies (n, nbody, 3) [m], their quaternions wxyz (n, nbody, 4), and origin and
    insertion of each muscle (n, number of muscles, 2, 3) [m]
    """
    data = mujoco.MjData(model)
    qpos = np.column_stack([block[f"qpos/{model.joint(j).name}"] for j in range(model.njnt)])
    sites = [[model.site(f"{name}_{end}").id for end in ("origin", "insertion")] for name in muscles]
    pairs = np.array(sites, int).reshape(-1, 2)
    position = np.empty((len(qpos), model.nbody, 3))
    quaternion = np.empty((len(qpos), model.nbody, 4))
    ends = np.empty((len(qpos), len(pairs), 2, 3))
    for k, row in enumerate(qpos):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        position[k], quaternion[k] = data.xpos, data.xquat
        ends[k] = data.site_xpos[pairs]
    return position, quaternion, ends


def _log_muscle(
    stream: rr.RecordingStream,
    view: Stage,
    block: Columns,
    name: str,
    group: MuscleGroup,
    ends: np.ndarray,
) -> None:
    """A tube from the origin, as long as the muscle and as thick as its braid, and the cable beyond."""
    span = ends[:, 1] - ends[:, 0]
    path = np.linalg.norm(span, axis=1)
    direction = span / path[:, None]
    radius = tube_radius(block[f"muscle/{name}/contraction"], group.type)
    length = np.clip(block[f"muscle/{name}/length"] + group.type.end_length, 0.02, path)
    if view.colour_by == "pressure":
        share = block[f"chamber/{chamber_of(name, group)}/pressure"] / PRESSURE_SCALE
    else:
        share = np.sqrt(np.clip(block[f"muscle/{name}/force"], 0.0, None) / FORCE_SCALE)
    colour = SLACK + np.clip(share, 0.0, 1.0)[:, None] * (PULLING - SLACK)
    rgba = np.column_stack([colour, np.full(len(path), 255 * view.opacity)]).round().astype(np.uint8)
    tube = rr.Capsules3D.columns(
        lengths=(length - 2.0 * radius).clip(0.001).astype(np.float32),
        radii=radius.astype(np.float32),
        translations=(ends[:, 0] + radius[:, None] * direction).astype(np.float32),
        quaternions=_turn_from_z(direction).astype(np.float32),
        colors=rgba,
    )
    send(stream, f"{view.root}/muscles/{name}", block, tube)
    start = ends[:, 0] + length[:, None] * direction
    strips = list(np.stack([start, ends[:, 1]], axis=1).astype(np.float32))
    send(stream, f"{view.root}/cables/{name}", block, rr.LineStrips3D.columns(strips=strips))


def tube_radius(contraction: np.ndarray, muscle: Muscle) -> np.ndarray:
    """Radius of the braid at a contraction ratio: r0 sin α/sin α0 with cos α = (1 − κ) cos α0 [m].

    A slack muscle is as thick as at its greatest volume (54.74°); a stretched one never thinner than
    two thirds of its bore.
    """
    angle = muscle.braid_angle
    cosine = np.clip((1.0 - contraction) * np.cos(angle), np.sqrt(1.0 / 3.0), 1.0)
    grown = np.sqrt(1.0 - cosine**2) / np.sin(angle)
    return 0.5 * muscle.bore * np.maximum(grown, 2.0 / 3.0)


def _turn_from_z(direction: np.ndarray) -> np.ndarray:
    """Quaternions (xyzw) that turn the z axis to unit vectors (n, 3)."""
    cross = np.column_stack([-direction[:, 1], direction[:, 0], np.zeros(len(direction))])
    quaternion = np.column_stack([cross, 1.0 + direction[:, 2]])
    quaternion[quaternion[:, 3] < 1e-9] = (1.0, 0.0, 0.0, 0.0)  # straight down: half a turn about x
    return quaternion / np.linalg.norm(quaternion, axis=1)[:, None]

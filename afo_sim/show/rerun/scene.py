"""The scene in space: segments, orthosis, muscles as tubes, floor, joint axis."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import rerun as rr

from afo_sim.common import Keywords
from afo_sim.description import MuscleGroup
from afo_sim.metrics import stance_force
from afo_sim.model import ANKLE, muscle_names, path_points
from afo_sim.show.ground_force import COLUMNS as FORCE
from afo_sim.show.moving_parts import Mountings, joint_columns, padded
from afo_sim.show.rerun.muscle_shapes import DrawnMuscle
from afo_sim.show.rerun.run_rows import GAIT, Columns, Source, send

_WALKING = (  # columns that walking is shown by, as far as a run has them
    *GAIT,
    "gait/ankle_angle",
    "shank/angle",
    *(f"ankle/position/{x}" for x in "xz"),
    *FORCE,
    "gait/toe_extension",
)


def guided_lines(
    model: mujoco.MjModel, block: Columns, groups: Mapping[str, MuscleGroup], mountings: Mountings
) -> dict[str, np.ndarray]:
    """Lines of the muscles whose path has points or surfaces, at the coordinates of a block of rows."""
    names = [name for name, group in groups.items() if group.path]
    if not names:
        return {}
    data = mujoco.MjData(model)
    found: dict[str, list[np.ndarray]] = {name: [] for name in names}
    for k in range(len(block[joint_columns(model)[0]])):
        mountings.pose(data, _row(block, k))
        for name in names:
            found[name].append(path_points(model, data, name))
    mountings.place({})
    return {name: padded(lines) for name, lines in found.items()}


def _row(block: Columns, k: int) -> Callable[[str], float]:
    return lambda name: float(block[name][k])


@dataclass(frozen=True)
class Stage:
    """One run's place in space: where its entities are, and how opaque it is drawn."""

    model: mujoco.MjModel
    groups: dict[str, MuscleGroup]
    root: str
    opacity: float
    colour_by: str
    mountings: Mountings
    walking: tuple[str, ...] = ()  # columns that a walking run is shown by besides

    @property
    def muscles(self) -> list[DrawnMuscle]:
        """Every single muscle."""
        look = (self.root, self.opacity, self.colour_by)
        return [DrawnMuscle(name, group, *look) for name, group in self.groups.items()]

    @property
    def columns(self) -> list[str]:
        """The columns that poses and muscles are made of."""
        muscles = [column for muscle in self.muscles for column in muscle.columns]
        given = self.mountings.columns.values()
        return ["time", *joint_columns(self.model), *dict.fromkeys(muscles), *given, *self.walking]


def stage(source: Source, root: str = "world", opacity: float = 1.0, colour_by: str = "force") -> Stage:
    """The stage of a run."""
    try:
        model = mujoco.MjModel.from_xml_string(source.header.model_xml)
    except ValueError:  # meshes stand in the kept model alone
        model = source.header.model()
    walking = {*_WALKING, stance_force(source.columns)} & {*source.columns} if source.walks else set()
    groups = muscle_names(source.scenario.orthosis)
    mountings = Mountings(model, groups, source.columns)
    return Stage(model, groups, root, opacity, colour_by, mountings, tuple(sorted(walking)))


def log_floor(stream: rr.RecordingStream, half: Sequence[float], centre: Sequence[float]) -> None:
    """A floor, once: half its size, and its middle [m]."""
    floor = rr.Boxes3D(half_sizes=[half], centers=[centre], colors=[[62, 66, 72]], fill_mode="solid")
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
    for muscle in view.muscles:
        solid = rr.Capsules3D.from_fields(fill_mode="solid")
        stream.log(f"{muscle.root}/muscles/{muscle.name}", solid, static=True)


def log_body(
    stream: rr.RecordingStream, view: Stage, body: int, root: str, colour: list[int] | None = None
) -> None:
    """The shapes of one body of the model under an entity, in their own colours or all in one (RGBA)."""
    model = view.model
    for geom in np.flatnonzero(model.geom_bodyid == body):
        turned = model.geom_quat[geom][[1, 2, 3, 0]]
        pose = rr.Transform3D(translation=model.geom_pos[geom], quaternion=turned)
        own = (255 * model.geom_rgba[geom] * [1, 1, 1, view.opacity]).astype(np.uint8)
        shape = _shape(model, int(geom), own if colour is None else np.array(colour, np.uint8))
        if shape is not None:
            stream.log(f"{root}/{model.geom(geom).name or f'geom_{geom}'}", pose, shape, static=True)


def _shape(model: mujoco.MjModel, geom: int, colour: np.ndarray) -> rr.AsComponents:
    size, kind = model.geom_size[geom], model.geom_type[geom]
    look: Keywords = {"colors": [colour], "fill_mode": "solid"}
    types = mujoco.mjtGeom
    if kind in (types.mjGEOM_SPHERE, types.mjGEOM_ELLIPSOID):
        return rr.Ellipsoids3D(half_sizes=[size if kind == types.mjGEOM_ELLIPSOID else [size[0]] * 3], **look)
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
    position, quaternion, ends = replay(model, block, tuple(view.groups), view.mountings)
    for body in range(1, model.nbody):
        place = f"{view.root}/bodies/{model.body(body).name}"
        send_pose(stream, place, block, position[:, body], quaternion[:, body])
    if not view.groups:
        return
    given = np.sum([block[column] for column in view.mountings.columns.values()], axis=0)
    above = ("shank_anchors", "proximal_anchors")
    ankle = position[:, next(k for k in range(model.nbody) if model.body(k).name in above)]
    lines = guided_lines(model, block, view.groups, view.mountings)
    for number, muscle in enumerate(view.muscles):
        own = given if muscle.group.pulley is None else 0.0
        own = np.broadcast_to(own, len(ankle))
        muscle.log(stream, block, ends[:, number], ankle, own, lines.get(muscle.name))


def send_pose(
    stream: rr.RecordingStream, entity: str, block: Columns, position: np.ndarray, quaternion: np.ndarray
) -> None:
    """A body's place and MuJoCo's quaternion at a block of rows."""
    turned = quaternion[:, [1, 2, 3, 0]].astype(np.float32)
    pose = rr.Transform3D.columns(translation=position.astype(np.float32), quaternion=turned)
    send(stream, entity, block, pose)


def replay(
    model: mujoco.MjModel, block: Columns, muscles: tuple[str, ...] = (), mountings: Mountings | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses of bodies and paths of muscles at the coordinates of a block of rows."""
    data, moved = mujoco.MjData(model), mountings or Mountings(model, {}, ())
    sites = [[model.site(f"{name}_{end}").id for end in ("origin", "insertion")] for name in muscles]
    pairs, count = np.array(sites, int).reshape(-1, 2), len(block[joint_columns(model)[0]])
    position, quaternion = np.empty((count, model.nbody, 3)), np.empty((count, model.nbody, 4))
    ends = np.empty((count, len(pairs), 2, 3))
    for k in range(count):
        moved.pose(data, _row(block, k))
        position[k], quaternion[k], ends[k] = data.xpos, data.xquat, data.site_xpos[pairs]
    moved.place({})
    return position, quaternion, ends

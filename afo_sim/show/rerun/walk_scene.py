"""Walking in space: floor, ground force, trails of the sole, the whole figure, the recorded foot as a ghost.

The camera rides beside the walker on a carriage of even speed. One run keeps its place on the floor; several
are shown relative to their own carriages. The floor is at height 0: each run's outsole stands on it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import rerun as rr

from afo_sim.common import InputError, Keywords, assets
from afo_sim.gait import file as gait
from afo_sim.metrics import loaded, stance_force
from afo_sim.model import ANKLE, TOE_POINTS, foot_of, phase_at
from afo_sim.show.ground_force import EDGE, SIDE, GroundForce
from afo_sim.show.moving_parts import Carriage
from afo_sim.show.rerun.colours import SOLE
from afo_sim.show.rerun.run_rows import GAIT, Columns, Source, send, strides
from afo_sim.show.rerun.scene import Stage, log_body, log_floor, replay, send_pose
from afo_sim.show.walking_figure import RADII, Limbs, capsules

CARRIAGE = "world/carriage"
_TRAILS = {point: own for point, (own, _) in SOLE.items()}  # points of the sole, in their plot's colours
SUNK = [255, 40, 40]  # where a point is below the floor in swing
_FORCE = [110, 235, 120]
_GHOST_COLOUR = [150, 205, 255, 90]
_LIMB_COLOUR = [160, 165, 175, 110]
_FAR = 0.4  # far side of the walkway [m]
_PHASES = (  # from which gait phase on; after Perry & Burnfield, Gait Analysis, 2010
    (0.0, "loading response"),
    (0.12, "mid-stance"),
    (0.31, "terminal stance"),
    (0.50, "pre-swing"),
    (0.62, "initial swing"),
    (0.75, "mid-swing"),
    (0.87, "terminal swing"),
)


def carriage(source: Source) -> Carriage:
    """The carriage that keeps up with a run's ankle."""
    blocks = list(source.read(["time", *GAIT, "ankle/position/x"], source.every(100.0)))
    time, x = (np.concatenate([block[n] for block in blocks]) for n in ("time", "ankle/position/x"))
    return Carriage.beside(time, np.concatenate([strides(block) for block in blocks]), x)


def expected_carriage(source: Source) -> Carriage:
    """The carriage of a run that is only beginning, from its gait cycle."""
    walking = source.scenario.gait
    assert walking is not None
    cycle = gait.read(assets.find_gait(walking.cycle))
    stride_time = walking.stride_time or cycle.stride_time
    time = np.arange(0.0, source.scenario.duration + stride_time, 0.01)
    walked = phase_at(walking.model_copy(update={"variability": 0.0}), cycle.stride_time, time)
    return Carriage.beside(time, walked, cycle.signal("ankle_x", walked))


def _log_walkway(stream: rr.RecordingStream, way: Carriage) -> None:
    """A walkway with a line every 10 cm and a stronger one every metre, once."""
    left, right = np.floor(way.ends[0]) - 2.0, np.ceil(way.ends[1]) + 2.0
    size, centre = (np.array([right, _FAR]) - s * np.array([left, EDGE]) for s in (1.0, -1.0))
    log_floor(stream, [*(0.5 * size), 0.002], [*(0.5 * centre), -0.002])
    places = np.arange(round(10 * left), round(10 * right) + 1)
    ends = np.array([[0.0, side, 0.0005] for side in (EDGE, _FAR)])
    strips = ends + 0.1 * places[:, None, None] * np.array([1.0, 0.0, 0.0])
    metre = places % 10 == 0
    lines = rr.LineStrips3D(
        strips.astype(np.float32),
        radii=np.where(metre, 0.004, 0.001),
        colors=np.where(metre[:, None], [[150, 155, 165]], [[92, 97, 105]]),
    )
    stream.log("world/floor/lines", lines, static=True)


def _ghost_bodies(source: Source) -> dict[str, str]:
    leg = source.scenario.leg
    return {"foot": leg.foot} | ({} if leg.toes is None else {"toes": leg.toes.body})


@dataclass
class Walker:
    """Logs what walking adds to a run's poses, block by block."""

    view: Stage
    source: Source
    way: Carriage
    colour: list[int] | None = None  # of the trails among several runs
    first: bool = True  # of several: it has the camera, the arrow and the ghost

    def __post_init__(self) -> None:
        leg = self.source.scenario.leg
        self._foot = foot_of(self.view.model, leg, ANKLE)
        self._toe = None if leg.toes is None else f"qpos/{leg.toes.joint}"  # column of the toes' hinge
        self._ends: dict[str, np.ndarray] = {}  # of the trails so far

    @property
    def trails(self) -> list[str]:
        """The entities of its trails; among several runs only the toe leaves one."""
        return [f"/{self.view.root}/trail/{name}" for name in _TRAILS if name == "toe" or not self.colour]

    @cached_property
    def limbs(self) -> Limbs | None:
        """Of the whole figure; None where the file of the recorded walk is gone."""
        try:
            return Limbs.of(self.source.header, self.view.model)
        except InputError:
            return None

    def log(self, stream: rr.RecordingStream, block: Columns) -> None:
        """A block of rows at the rate of poses."""
        x = self.way.at(strides(block))
        places = np.column_stack([x, np.zeros((len(x), 2))])
        if self.first:
            moved = rr.Transform3D.columns(translation=places.astype(np.float32))
            send(stream, CARRIAGE, block, moved)
            starts, names = zip(*_PHASES, strict=True)
            which = np.searchsorted(starts, block["gait/phase"], side="right") - 1
            rows = zip(block["gait/stride"], block["gait/phase"], which, strict=True)
            texts = [f"stride {s + 1:.0f} · {100.0 * phase:.0f} % · {names[k]}" for s, phase, k in rows]
            send(stream, f"{CARRIAGE}/caption", block, rr.Points3D.columns(labels=texts))
            self._log_force(stream, block)
            self._log_ghost(stream, block)
            self._log_figure(stream, block)
        if self.view.root.startswith(CARRIAGE):
            moved = rr.Transform3D.columns(translation=-places.astype(np.float32))
            send(stream, self.view.root, block, moved)
        self._log_trails(stream, block)

    def _log_force(self, stream: rr.RecordingStream, block: Columns) -> None:
        force = GroundForce.of(block.__getitem__, self.source.body_mass)
        stands = force.stands
        arrow = rr.Arrows3D.columns(
            vectors=force.vector[stands].astype(np.float32),
            origins=force.start[stands].astype(np.float32),
            colors=np.full((stands.sum(), 3), _FORCE, np.uint8),
        )
        send(stream, f"{self.view.root}/ground_force", block, arrow.partition(stands.astype(int)))

    def _log_figure(self, stream: rr.RecordingStream, block: Columns) -> None:
        """Thigh, trunk and other leg, as recorded."""
        if self.limbs is None:
            return
        ankle = np.column_stack([block[f"ankle/position/{x}"] for x in "xz"])
        points = self.limbs.points(ankle, block["shank/angle"], block["gait/phase"])
        start, end = np.moveaxis(capsules(points), 2, 0)
        axis = end - start
        half, still = 0.5 * np.arctan2(axis[..., 0], axis[..., 2]), np.zeros(axis.shape[:2])
        turned = np.stack([still, np.sin(half), still, np.cos(half)], axis=-1)
        shapes = rr.Capsules3D.columns(
            translations=start.reshape(-1, 3).astype(np.float32),
            quaternions=turned.reshape(-1, 4).astype(np.float32),
        )
        counts = np.full(len(start), len(RADII))
        send(stream, f"{self.view.root}/figure", block, shapes.partition(counts))

    def _log_ghost(self, stream: rr.RecordingStream, block: Columns) -> None:
        """The foot at the recorded ankle angle on the same shank, its toes at rest."""
        recorded = {**block, f"qpos/{ANKLE}": block["gait/ankle_angle"]}
        if self._toe is not None:
            recorded[self._toe] = block["gait/toe_extension"]
        position, quaternion, _ = replay(self.view.model, recorded)
        for part, name in _ghost_bodies(self.source).items():
            body = self.view.model.body(name).id
            place = f"{self.view.root}/recorded/{part}"
            send_pose(stream, place, block, position[:, body], quaternion[:, body])

    def _log_trails(self, stream: rr.RecordingStream, block: Columns) -> None:
        """From a point of the outsole to where it is next; of the toe, of the lower of pulp and tip."""
        extension = 0.0 if self._toe is None else block[self._toe]
        points = self._foot.outsole(block[f"qpos/{ANKLE}"] - block["shank/angle"], extension)
        (x, z), (other_x, other_z) = (points[name] for name in TOE_POINTS)
        points["toe"] = np.where(other_z < z, other_x, x), np.minimum(z, other_z)
        swings = ~loaded(block[stance_force(self.source.columns)], self.source.body_mass)
        for entity in self.trails:
            name = entity.rsplit("/", 1)[1]
            x, z = (a + block[f"ankle/position/{b}"] for a, b in zip(points[name], "xz", strict=True))
            path = np.column_stack([x, np.full(len(x), SIDE), z])
            path = np.vstack([self._ends.get(name, path[:1]), path])
            self._ends[name] = path[-1:]
            strips = np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)
            colours = np.where((swings & (z < 0.0))[:, None], SUNK, self.colour or _TRAILS[name])
            trail = rr.LineStrips3D.columns(strips=list(strips), colors=colours.astype(np.uint8))
            send(stream, entity, block, trail)


def log_walker_styles(stream: rr.RecordingStream, walker: Walker) -> None:
    """Log once all that does not change over a walk."""
    root = walker.view.root
    for trail in walker.trails:
        stream.log(trail, rr.LineStrips3D.from_fields(radii=[0.0035]), static=True)
    if not walker.first:
        return
    _log_walkway(stream, walker.way)
    for part, name in _ghost_bodies(walker.source).items():
        body = walker.view.model.body(name).id
        log_body(stream, walker.view, body, f"{root}/recorded/{part}", _GHOST_COLOUR)
    if walker.limbs is not None:
        ends = capsules(walker.limbs.points(np.zeros((1, 2)), np.zeros(1), np.zeros(1)))[0]
        shapes = rr.Capsules3D.from_fields(
            lengths=np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1),
            radii=RADII,
            colors=[_LIMB_COLOUR],
            fill_mode="solid",
        )
        stream.log(f"{root}/figure", shapes, static=True)
    look: Keywords = {"radii": [0.0001], "colors": [[200, 205, 215]], "show_labels": True}
    stream.log(f"{CARRIAGE}/caption", rr.Points3D([[-0.36, 0.0, 0.8]], **look), static=True)
    stream.log(f"{root}/ground_force", rr.Arrows3D.from_fields(radii=[0.01]), static=True)

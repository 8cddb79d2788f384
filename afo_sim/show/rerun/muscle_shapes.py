"""A muscle in space: a tube as long as its braid, and the cable that carries it, taut or slack."""

from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import rerun as rr

from afo_sim.description import Muscle, MuscleGroup
from afo_sim.model import chamber_of
from afo_sim.show.rerun.run_rows import Columns, send

_FORCE_SCALE = 100.0  # force at which a muscle is fully coloured [N]
_PRESSURE_SCALE = 4e5  # gauge pressure at which a muscle is fully coloured [Pa]
SLACK, PULLING = np.array([150, 155, 165]), np.array([245, 60, 30])
_CABLE, _SLACK_CABLE = [210, 210, 215], [120, 125, 135]
_CABLE_RADIUS, _SLACK_RADIUS = 0.0015, 0.0008  # [m]
_HANGS = 1e-4  # excess of a slack cable's length from which on its bow is drawn [m]
POINTS = 9  # of a bow
_SAGS = np.linspace(0.0, 3.0, 301)  # of parabolas, in chords
_ARCS = 0.5 * np.hypot(1.0, 4.0 * _SAGS) + np.arcsinh(4.0 * _SAGS) / (8.0 * np.maximum(_SAGS, 1e-9))
_ARCS[0] = 1.0  # their lengths, in chords


@dataclass(frozen=True)
class DrawnMuscle:
    """A single muscle as it is drawn: entities below a root, opacity, and what colours it."""

    name: str
    group: MuscleGroup
    root: str
    opacity: float
    colour_by: str

    @property
    def columns(self) -> list[str]:
        """The columns that it is drawn from."""
        own = [f"muscle/{self.name}/{x}" for x in ("length", "contraction", "force", "path_length")]
        return [*own, f"chamber/{chamber_of(self.name, self.group)}/pressure"]

    def log(
        self,
        stream: rr.RecordingStream,
        block: Columns,
        ends: np.ndarray,
        axis: np.ndarray,
        given: np.ndarray,
        line: np.ndarray | None = None,
    ) -> None:
        """A block of rows: a tube from the origin, as thick as its braid, and the cable beyond."""
        muscle = self.group.type
        span = (ends if line is None else line)[:, 1] - ends[:, 0]  # a muscle lies before its first guide
        path = np.linalg.norm(span, axis=1)
        direction = span / path[:, None]
        radius = tube_radius(block[f"muscle/{self.name}/contraction"], muscle)
        own = block[f"muscle/{self.name}/length"]
        length = np.clip(own + muscle.end_length, 0.02, path)
        cross = np.column_stack([-direction[:, 1], direction[:, 0], np.zeros(len(direction))])
        quaternion = np.column_stack([cross, 1.0 + direction[:, 2]])
        quaternion[quaternion[:, 3] < 1e-9] = (1.0, 0.0, 0.0, 0.0)  # straight down: half a turn about x
        if self.colour_by == "pressure":
            share = block[self.columns[-1]] / _PRESSURE_SCALE
        else:
            share = np.sqrt(np.clip(block[f"muscle/{self.name}/force"], 0.0, None) / _FORCE_SCALE)
        colour = SLACK + np.clip(share, 0.0, 1.0)[:, None] * (PULLING - SLACK)
        rgba = np.column_stack([colour, np.full(len(share), 255 * self.opacity)])
        tube = rr.Capsules3D.columns(
            lengths=(length - 2.0 * radius).clip(0.001).astype(np.float32),
            radii=radius.astype(np.float32),
            translations=(ends[:, 0] + radius[:, None] * direction).astype(np.float32),
            quaternions=(quaternion / np.linalg.norm(quaternion, axis=1)[:, None]).astype(np.float32),
            colors=rgba.round().astype(np.uint8),
        )
        send(stream, f"{self.root}/muscles/{self.name}", block, tube)
        free = block[f"muscle/{self.name}/path_length"] - self.group.series_length - given
        excess = np.where(block[f"muscle/{self.name}/force"] > 0.0, 0.0, (own - free).clip(0.0))
        start = ends[:, 0] + length[:, None] * direction
        if line is not None:
            points = np.concatenate([start[:, None], line[:, 1:]], axis=1)
        else:  # straight where the cable is taut; where it is slack, a bow as long as it is
            points = bow(np.stack([start, ends[:, 1]], axis=1), excess, axis)
        drawn = np.ones(points.shape[:2], bool)
        if line is None:
            drawn[excess <= _HANGS, 1:-1] = False
        slack = block[f"muscle/{self.name}/force"] <= 0.0
        # lines as Arrow has them: Rerun would convert each line alone
        form = rr.components.LineStrip3DBatch([]).as_arrow_array().type
        offsets = np.concatenate([[0], np.cumsum(drawn.sum(axis=1))])
        inner = rr.components.Position3DBatch(points[drawn].astype(np.float32)).as_arrow_array()
        cable = rr.LineStrips3D.columns(
            strips=pa.ListArray.from_arrays(pa.array(offsets, pa.int32()), inner, type=form),
            radii=np.where(slack, _SLACK_RADIUS, _CABLE_RADIUS).astype(np.float32),
            colors=np.where(slack[:, None], _SLACK_CABLE, _CABLE).astype(np.uint8),
        )
        send(stream, f"{self.root}/cables/{self.name}", block, cable)


def bow(ends: np.ndarray, excess: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Parabolas between two points, longer than the straight lines, bent away from a third point."""
    span = ends[:, 1] - ends[:, 0]
    chord = np.linalg.norm(span, axis=1).clip(1e-6)
    along = span / chord[:, None]
    away = ends.mean(axis=1) - axis
    away -= np.sum(away * along, axis=1)[:, None] * along
    away /= np.linalg.norm(away, axis=1).clip(1e-9)[:, None]
    sag = chord * np.interp(1.0 + excess / chord, _ARCS, _SAGS)
    share = np.linspace(0.0, 1.0, POINTS)[None, :, None]
    bent = (4.0 * share * (1.0 - share)) * (sag[:, None] * away)[:, None]
    return ends[:, :1] + share * span[:, None] + bent


def tube_radius(contraction: np.ndarray, muscle: Muscle) -> np.ndarray:
    """Radius of the braid at a contraction ratio: r0 sin α/sin α0 with cos α = (1 − κ) cos α0 [m]."""
    angle = muscle.braid_angle
    cosine = np.clip((1.0 - contraction) * np.cos(angle), np.sqrt(1.0 / 3.0), 1.0)
    grown = np.sqrt(1.0 - cosine**2) / np.sin(angle)
    return 0.5 * muscle.bore * np.maximum(grown, 2.0 / 3.0)

"""Leg, orthosis and muscles seen from the side or from the front, in metres of the model."""

import itertools
from dataclasses import dataclass
from typing import Any, Literal

import mujoco
import numpy as np

from afo_sim.description.orthosis import MuscleGroup
from afo_sim.model.build import Built
from afo_sim.model.leg_shapes import FLAT, leg_geoms, support
from afo_sim.model.mounting import ANKLE
from afo_sim.model.path_facts import PathFacts
from afo_sim.model.paths import along, at_lengths, path_points

View = Literal["side", "front"]
ACROSS = {"side": 0, "front": 1}  # coordinate that runs across the page; up the page runs z
AROUND = np.linspace(0.0, 2.0 * np.pi, 73)[:-1]
SKIN, SKIN_EDGE, PART, PART_EDGE = "#F3E4DA", "#8A6F60", "#D3D6DC", "#5A606B"
GHOST = "0.62"
FITTING, CABLE = "#3A3A3A", "#3A3A3A"
ENDS = ("_origin", "_insertion")  # how the names of shapes end that mark a muscle's ends


@dataclass(frozen=True, eq=False)
class Pose:
    """The full model at an ankle angle [rad], seen from one side; the ankle is at (0, 0).

    The view from the front shows the wearer's left on the right.
    """

    built: Built
    model: mujoco.MjModel
    data: mujoco.MjData
    view: View

    @classmethod
    def at(cls, built: Built, angle: float, view: View = "side") -> "Pose":
        """Posed."""
        model = built.full_model
        data = mujoco.MjData(model)
        data.qpos[model.joint(ANKLE).qposadr[0]] = angle
        mujoco.mj_fwdPosition(model, data)
        return cls(built, model, data, view)

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Places as they are seen, from the ankle [m] (n, 2)."""
        relative = np.asarray(points) - self.data.xanchor[self.model.joint(ANKLE).id]
        return relative[:, [ACROSS[self.view], 2]]

    def outline(self, geom: int) -> np.ndarray:
        """Outline of a shape, from its outermost points all around [m] (n, 2)."""
        directions = np.zeros((len(AROUND), 3))
        directions[:, ACROSS[self.view]], directions[:, 2] = np.cos(AROUND), np.sin(AROUND)
        return self.flat(support(self.model, self.data, geom, directions))

    def outlines(self) -> dict[str, list[np.ndarray]]:
        """Outlines of the shapes of limb, orthosis and foot alone: {"limb", "part", "foot": …}."""
        limb = leg_geoms(self.model, self.built)
        found: dict[str, list[np.ndarray]] = {"limb": [], "part": [], "foot": [], "shank": []}
        for geom in range(self.model.ngeom):
            name = self.model.geom(geom).name
            if self.model.geom_type[geom] in FLAT or name.endswith(ENDS):
                continue
            shape = self.outline(geom)
            found["limb" if geom in limb else "part"].append(shape)
            found["foot" if self._turns(geom) else "shank"].append(shape)
        return found

    def _turns(self, geom: int) -> bool:
        """Whether a shape turns with the foot."""
        body, foot = int(self.model.geom_bodyid[geom]), int(self.model.jnt_bodyid[self.model.joint(ANKLE).id])
        while body > 0 and body != foot:
            body = int(self.model.body_parentid[body])
        return body == foot

    def path(self, muscle: str) -> np.ndarray:
        """Path of a muscle [m] (n, 3), world axes; over a pulley, from its upper end to the wheel."""
        points = path_points(self.model, self.data, muscle)
        if len(points):
            return points
        return np.array([self.data.site(f"{muscle}{end}").xpos for end in ENDS])


def draw_leg(axis: Any, pose: Pose) -> None:
    """Limb and orthosis: each part's shapes as one, with an edge around all of them."""
    found = pose.outlines()
    for kind, face, edge, order in (("limb", SKIN, SKIN_EDGE, 1), ("part", PART, PART_EDGE, 2)):
        for shape in found[kind]:
            axis.fill(*shape.T, facecolor=edge, edgecolor=edge, lw=1.4, zorder=order, joinstyle="round")
        for shape in found[kind]:
            axis.fill(*shape.T, facecolor=face, edgecolor="none", zorder=order + 0.1)


def draw_ghost(axis: Any, pose: Pose, facts: list[PathFacts]) -> None:
    """What turns with the foot, as one pale outline, and the muscles as thin lines."""
    found = pose.outlines()["foot"]
    for shape in found:
        axis.fill(*shape.T, facecolor=GHOST, edgecolor=GHOST, lw=1.2, zorder=0.5, joinstyle="round")
    for shape in found:
        axis.fill(*shape.T, facecolor="white", edgecolor="none", zorder=0.6)
    for entry in facts:
        axis.plot(*pose.flat(pose.path(entry.muscles[0])).T, color=GHOST, lw=0.6, ls=(0, (3, 2)), zorder=2.5)


def draw_muscle(
    axis: Any,
    pose: Pose,
    muscle: str,
    facts: PathFacts,
    colour: str,
    millimetre: float,
    opacity: float = 1.0,
) -> None:
    """A muscle without air: ends, braid as thick as its bore, and the cable beyond, dashed if it hangs."""
    points, group = pose.path(muscle), facts.group
    way = float(along(points)[-1])
    ends = parts(facts.group, float(facts.muscle_length[facts.at(0.0), 0]), way)
    thick = max(1e3 * group.type.bore * millimetre, 1.5)
    hangs = facts.chain_length[facts.at(0.0), 0] > facts.length[facts.at(0.0)] + 5e-4
    style = (0, (4, 1.5)) if hangs and group.pulley is None else "-"
    for kind, start, end in ends:
        lengths = np.linspace(start, end, 24)
        look: dict[str, Any] = {
            "cable": {"color": CABLE, "lw": 0.9, "ls": style},
            "fitting": {"color": FITTING, "lw": 0.6 * thick, "solid_capstyle": "butt"},
            "braid": {"color": colour, "lw": thick, "solid_capstyle": "butt"},
        }[kind]
        axis.plot(*pose.flat(at_lengths(points, lengths)).T, zorder=4, alpha=opacity, **look)
    if group.pulley is None:
        look = {"color": colour, "ms": 3.0, "mec": "white", "mew": 0.5, "zorder": 5, "alpha": opacity}
        axis.plot(*pose.flat(points[[0, -1]]).T, "o", **look)
        if len(points) > 2:
            axis.plot(*pose.flat(points[1:-1]).T, ".", color=colour, ms=2.5, zorder=5)


def parts(group: MuscleGroup, own: float, way: float) -> list[tuple[str, float, float]]:
    """Cable, fittings and braid along a path: (kind, from, to) [m] from the origin.

    Units: own [m], way [m].
    """
    fitting, own = 0.5 * group.type.end_length, min(own, way)
    edges = [("fitting", 0.0, fitting), ("braid", fitting, own - fitting), ("fitting", own - fitting, own)]
    return [edge for edge in [*edges, ("cable", own, way)] if edge[2] > edge[1]]


def lever(pose: Pose, facts: PathFacts) -> tuple[np.ndarray, np.ndarray]:
    """The moment arm: from the ankle to the foot of its perpendicular on the path's line [m] (2,), (2,).

    Of a path of several pieces, the line is that of the piece whose distance is nearest to the moment arm.
    """
    if facts.group.pulley is not None:
        return np.zeros(2), np.array([facts.arm[facts.at(0.0)], 0.0])
    corners = pose.flat(pose.path(facts.muscles[0]))
    wanted = abs(float(facts.arm[facts.at(0.0)]))
    feet = []
    for start, end in itertools.pairwise(corners):
        along_it = (end - start) / max(float(np.linalg.norm(end - start)), 1e-12)
        feet.append(start - (start @ along_it) * along_it)
    best = min(feet, key=lambda foot: abs(float(np.linalg.norm(foot)) - wanted))
    return np.zeros(2), best

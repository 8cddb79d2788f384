"""The views of a design, to scale, with dimensions in millimetres."""

import itertools
import textwrap
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from afo_sim.common import Keywords
from afo_sim.description import JOINTS, Anchor, MuscleGroup
from afo_sim.model import (
    ANKLE,
    FLAT,
    Built,
    Design,
    PathFacts,
    along,
    at_lengths,
    degrees,
    leg_geoms,
    path_points,
    support,
)
from afo_sim.show.style import COLOURS, Axes, plain

_View = Literal["side", "front"]
_ACROSS = {"side": 0, "front": 1}  # coordinate that runs across the page; up the page runs z
_AROUND = np.linspace(0.0, 2.0 * np.pi, 73)[:-1]
_SKIN, _SKIN_EDGE, _PART, _PART_EDGE = "#F3E4DA", "#8A6F60", "#D3D6DC", "#5A606B"
_GHOST = "0.62"
_FITTING, _CABLE = "#3A3A3A", "#3A3A3A"
_ENDS = ("_origin", "_insertion")  # how the names of shapes end that mark a muscle's ends
_SCALES = (1.0, 2.0, 2.5, 4.0, 5.0, 6.0, 7.5, 8.0, 10.0, 15.0, 20.0, 50.0)  # 1 to so many
_INCH = 0.0254  # [m]
_COLUMN = 0.0255  # of labels on either side of the view [m] on the page
_BEHIND = 0.35  # opacity of muscles behind the leg
_BORDER = 0.004  # free above and below [m] on the page
_NARROW, _WIDE = 0.010, 0.024  # heights along which words stand in two lines, in one [m] on the page
_APART = 0.008  # between the ends of moment arms that are both drawn [m] on the page
_NAME = 0.009  # of a ghost's angle, beside it [m] on the page
_LETTERS = 19  # of a line of a label
_FONT = 7.0
_LINE = 0.0029  # height of a line of that font [m] on the page
_DIMENSION = {
    "arrowstyle": "<|-|>",
    "lw": 0.6,
    "color": "0.25",
    "mutation_scale": 6.0,
    "shrinkA": 0,
    "shrinkB": 0,
}
WHITE = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85}
Box = tuple[float, float, float, float]  # left, bottom, width, height [inch]


@dataclass(frozen=True, eq=False)
class Pose:
    """The full model at an ankle angle [rad], seen from one side; the ankle is at (0, 0)."""

    built: Built
    model: mujoco.MjModel
    data: mujoco.MjData
    view: _View

    @classmethod
    def at(cls, built: Built, angle: float, view: _View = "side") -> "Pose":
        """Posed."""
        model = built.full_model
        data = mujoco.MjData(model)
        data.qpos[model.joint(ANKLE).qposadr[0]] = angle
        mujoco.mj_fwdPosition(model, data)
        return cls(built, model, data, view)

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Places as they are seen, from the ankle [m] (n, 2)."""
        relative = np.asarray(points) - self.data.xanchor[self.model.joint(ANKLE).id]
        return relative[:, [_ACROSS[self.view], 2]]

    def outline(self, geom: int) -> np.ndarray:
        """Outline of a shape, from its outermost points all around [m] (n, 2)."""
        directions = np.zeros((len(_AROUND), 3))
        directions[:, _ACROSS[self.view]], directions[:, 2] = np.cos(_AROUND), np.sin(_AROUND)
        return self.flat(support(self.model, self.data, geom, directions))

    def outlines(self) -> dict[str, list[np.ndarray]]:
        """Outlines of the shapes of limb, orthosis and foot alone: {"limb", "part", "foot": …}."""
        limb, turning = leg_geoms(self.model, self.built), [int(self.model.joint(ANKLE).bodyid[0])]
        for body, above in enumerate(self.model.body_parentid):  # with the foot; parents come first
            turning += [body] if above in turning else []
        found: dict[str, list[np.ndarray]] = {"limb": [], "part": [], "foot": []}
        for geom in range(self.model.ngeom):
            if self.model.geom_type[geom] in FLAT or self.model.geom(geom).name.endswith(_ENDS):
                continue
            shape = self.outline(geom)
            found["limb" if geom in limb else "part"].append(shape)
            found["foot"] += [shape] if self.model.geom_bodyid[geom] in turning else []
        return found

    def path(self, muscle: str) -> np.ndarray:
        """Path of a muscle [m] (n, 3), world axes; over a pulley, from its upper end to the wheel."""
        points = path_points(self.model, self.data, muscle)
        if len(points):
            return points
        return np.array([self.data.site(f"{muscle}{end}").xpos for end in _ENDS])


def _draw_leg(axis: Axes, pose: Pose) -> None:
    """Limb and orthosis: each part's shapes as one, with an edge around all of them."""
    found = pose.outlines()
    for kind, face, edge, order in (("limb", _SKIN, _SKIN_EDGE, 1), ("part", _PART, _PART_EDGE, 2)):
        for shape in found[kind]:
            axis.fill(*shape.T, facecolor=edge, edgecolor=edge, lw=1.4, zorder=order, joinstyle="round")
        for shape in found[kind]:
            axis.fill(*shape.T, facecolor=face, edgecolor="none", zorder=order + 0.1)


def _draw_ghost(axis: Axes, pose: Pose, facts: list[PathFacts], angle: float) -> None:
    """What turns with the foot, as one pale outline with its angle, and the muscles as thin lines."""
    found = pose.outlines()["foot"]
    for shape in found:
        axis.fill(*shape.T, facecolor=_GHOST, edgecolor=_GHOST, lw=1.2, zorder=0.5, joinstyle="round")
    for shape in found:
        axis.fill(*shape.T, facecolor="white", edgecolor="none", zorder=0.6)
    for entry in facts:
        axis.plot(*pose.flat(pose.path(entry.muscles[0])).T, color=_GHOST, lw=0.6, ls=(0, (3, 2)), zorder=2.5)
    # beside the foot's foremost point; of another joint, beside the farthest one
    shapes = np.concatenate(found)
    far = shapes[:, 0] if pose.built.scenario.leg.joint == "ankle" else np.linalg.norm(shapes, axis=1)
    look: Keywords = {"va": "center", "fontsize": _FONT, "color": "0.35"}
    place = {"xytext": (2.5, 0.0), "textcoords": "offset points"}
    axis.annotate(f"{degrees(angle)} deg", shapes[far.argmax()], **place, **look)


def _draw_muscle(
    axis: Axes,
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
    own = float(group.type.end_length + group.type.nominal_length * (1.0 - facts.own[facts.at(0.0), 0]))
    ends = parts(group, own, way)
    thick = max(1e3 * group.type.bore * millimetre, 1.5)
    hangs = facts.chain_length[facts.at(0.0), 0] > facts.length[facts.at(0.0)] + 5e-4
    style = (0, (4, 1.5)) if hangs and group.pulley is None else "-"
    for kind, start, end in ends:
        lengths = np.linspace(start, end, 24)
        look: Keywords = {
            "cable": {"color": _CABLE, "lw": 0.9, "ls": style},
            "fitting": {"color": _FITTING, "lw": 0.6 * thick, "solid_capstyle": "butt"},
            "braid": {"color": colour, "lw": thick, "solid_capstyle": "butt"},
        }[kind]
        axis.plot(*pose.flat(at_lengths(points, lengths)).T, zorder=4, alpha=opacity, **look)
    if group.pulley is None:
        look = {"color": colour, "ms": 3.0, "mec": "white", "mew": 0.5, "zorder": 5, "alpha": opacity}
        axis.plot(*pose.flat(points[[0, -1]]).T, "o", **look)
        if len(points) > 2:
            axis.plot(*pose.flat(points[1:-1]).T, ".", color=colour, ms=2.5, zorder=5)


def parts(group: MuscleGroup, own: float, way: float) -> list[tuple[str, float, float]]:
    """Cable, fittings and braid along a path: (kind, from, to) [m] from the origin."""
    fitting, own = 0.5 * group.type.end_length, min(own, way)
    edges = [("fitting", 0.0, fitting), ("braid", fitting, own - fitting), ("fitting", own - fitting, own)]
    return [edge for edge in [*edges, ("cable", own, way)] if edge[2] > edge[1]]


def lever(pose: Pose, facts: PathFacts) -> np.ndarray:
    """The moment arm: from the ankle to the foot of its perpendicular on the path's line [m] (2,)."""
    if facts.group.pulley is not None:
        return np.array([facts.arm[facts.at(0.0)], 0.0])
    corners = pose.flat(pose.path(facts.muscles[0]))
    wanted = abs(float(facts.arm[facts.at(0.0)]))
    feet = []
    for start, end in itertools.pairwise(corners):
        along_it = (end - start) / max(float(np.linalg.norm(end - start)), 1e-12)
        feet.append(start - (start @ along_it) * along_it)
    return min(feet, key=lambda foot: abs(float(np.linalg.norm(foot)) - wanted))


@dataclass(frozen=True)
class _Scale:
    """1 to `ratio`; what a view shows is centred on `middle` [m]."""

    ratio: float
    middle: tuple[float, float]

    @property
    def millimetre(self) -> float:
        """Of the model on the page [points]."""
        return 72.0 / (1e3 * _INCH * self.ratio)


def colours(design: Design) -> dict[str, str]:
    """A colour for every group of alike muscles, by its name."""
    return {entry.name: COLOURS[k % len(COLOURS)] for k, entry in enumerate(design.facts)}


def scale_of(design: Design, box: Box) -> _Scale:
    """The largest usual scale at which the leg in all its postures fits in the side view's box."""
    shapes: list[np.ndarray] = []
    for pose in (Pose.at(design.built, angle) for angle in (0.0, *design.facts[0].range)):
        found = pose.outlines()
        paths = [pose.flat(pose.path(muscle)) for entry in design.facts for muscle in entry.muscles]
        shapes += [*found["limb"], *found["part"], *paths]
    corners = np.concatenate(shapes)
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = np.array([box[2] * _INCH - 2.0 * _COLUMN - _NAME, box[3] * _INCH - 2.0 * _BORDER])
    needed = float(((high - low) / room).max())
    ratio = next((scale for scale in _SCALES if scale >= needed), needed)
    x, z = 0.5 * (low + high)
    return _Scale(ratio, (float(x) + 0.5 * _NAME * ratio, float(z)))


def place(axis: Axes, box: Box, scale: _Scale, across: float) -> None:
    """Set an axis' limits so that a view is to scale; `across` is what stands in its middle [m]."""
    half = 0.5 * np.array(box[2:]) * _INCH * scale.ratio
    axis.set_xlim(across - half[0], across + half[0])
    axis.set_ylim(scale.middle[1] - half[1], scale.middle[1] + half[1])
    axis.set_axis_off()


def side_view(axis: Axes, design: Design, box: Box, scale: _Scale) -> None:
    """From the wearer's right: leg, orthosis, muscles, ghosts, anchors, moment arms."""
    place(axis, box, scale, scale.middle[0])
    pose = Pose.at(design.built, 0.0)
    for angle in design.facts[0].range:
        _draw_ghost(axis, Pose.at(design.built, angle), design.facts, angle)
    _draw_leg(axis, pose)
    named = colours(design)
    for entry in design.facts:
        for muscle in entry.muscles:
            _draw_muscle(axis, pose, muscle, entry, named[entry.name], scale.millimetre)
    axis.plot(0.0, 0.0, "+", color="black", ms=9.0, mew=0.8, zorder=6)
    drawn: list[np.ndarray] = []
    for entry in design.facts:
        end = lever(pose, entry)
        if all(np.linalg.norm(end - other) > _APART * scale.ratio for other in drawn):
            drawn.append(end)
            if float(np.linalg.norm(end)) >= 1e-3:  # the perpendicular to the path, with its length
                look: Keywords = {"color": named[entry.name], "zorder": 6}
                axis.plot(*np.array([np.zeros(2), end]).T, lw=0.9, ls=(0, (2, 1)), **look)
                arm = 1e3 * abs(float(entry.arm[entry.at(0.0)]))
                look |= {"ha": "center", "va": "bottom", "fontsize": _FONT, "bbox": WHITE, "zorder": 7}
                axis.annotate(f"{arm:.0f}", 0.55 * end, (0.0, 1.5), textcoords="offset points", **look)
    for right in (True, False):
        wanted = []
        for entry in design.facts:
            points = pose.flat(pose.path(entry.muscles[0]))
            if (points[:, 0].mean() >= 0.0) == right:
                wanted += [(at, text, named[entry.name]) for at, text in _told(entry, points)]
        _column(axis, wanted, right, scale, box)
    ankle = plain(design.built.scenario.leg.ankle, 12)
    text = f"from the right, 1:{scale.ratio:g} on A4, {ankle} at 0 deg, without air; mm from the {ankle}"
    axis.set_title(text, loc="left", fontsize=8.0, pad=3.0)


def _told(entry: PathFacts, points: np.ndarray) -> list[tuple[np.ndarray, str]]:
    """What is written beside a muscle: (place, text) of its ends, and of its middle."""
    kind, group, zero = entry.group.type, entry.group, entry.at(0.0)
    lines = [
        *(line.replace("_ ", "_") for line in textwrap.wrap(plain(entry.name).replace("_", "_ "), _LETTERS)),
        *textwrap.wrap(f"{len(entry.muscles)} × {plain(kind.name)}", _LETTERS),
        f"muscle {1e3 * kind.total_length:.0f}",
        f"of it braid {1e3 * kind.nominal_length:.0f}",
    ]
    if group.pulley is not None:
        lines.append(f"wheel, radius {1e3 * group.pulley.radius:.0f}")
        return [(points[0], "\n".join(lines))]
    assert group.origin is not None and group.insertion is not None and group.link_length is not None
    lines += [f"link {1e3 * group.link_length:.0f}", f"path {1e3 * entry.length[zero]:.0f}"]
    hangs = entry.chain_length[zero, 0] - entry.length[zero]
    if hangs > 5e-4:
        lines.append(f"hangs through {1e3 * hangs:.0f}")
    middle = points[0] + 0.4 * (points[-1] - points[0])
    found = [(points[0], _anchor("origin", group.origin)), (middle, "\n".join(lines))]
    for k, point in enumerate(group.path, start=1):
        at = 0.5 * (points[0] + points[-1]) if len(points) < 3 else points[min(k, len(points) - 2)]
        found.append((at, _anchor("around" if point.surface else "through", point)))
    return [*found, (points[-1], _anchor("insertion", group.insertion))]


def _anchor(word: str, anchor: Anchor) -> str:
    """Coordinates of an anchor, and how far apart its muscles are [mm]."""
    x, y, z = (f"{1e3 * part:.4g}".replace("-", "−") for part in anchor.from_joint)
    apart = f"\n{1e3 * anchor.spacing:.4g} apart" if anchor.spacing else ""
    return f"{word}\n{x}, {y}, {z}{apart}"


def _column(
    axis: Axes, wanted: list[tuple[np.ndarray, str, str]], right: bool, scale: _Scale, box: Box
) -> None:
    """Labels under one another beside the view, as near to their places as their heights allow."""
    wanted = sorted(wanted, key=lambda label: -label[0][1])
    line = _LINE * scale.ratio
    heights = [(text.count("\n") + 1) * line + 0.6 * line for _, text, _ in wanted]
    top, bottom = axis.get_ylim()[1] - line, axis.get_ylim()[0] + line
    tops = stacked([float(at[1]) + 0.5 * height for (at, _, _), height in zip(wanted, heights, strict=True)],
                   heights, top, bottom)  # fmt: skip
    half = 0.5 * box[2] * _INCH * scale.ratio
    edge = scale.middle[0] + (half - _COLUMN * scale.ratio) * (1.0 if right else -1.0)
    for (at, text, colour), upper, height in zip(wanted, tops, heights, strict=True):
        middle = upper - 0.5 * height
        look: Keywords = {"fontsize": _FONT, "va": "center", "linespacing": 1.1, "zorder": 8}
        axis.text(edge, middle, text, ha="left" if right else "right", color="black", **look)
        gap = 0.0012 * scale.ratio * (-1.0 if right else 1.0)
        axis.plot([at[0], edge + gap], [at[1], middle], color=colour, lw=0.5, zorder=3.5)


def stacked(tops: list[float], heights: list[float], highest: float, lowest: float) -> list[float]:
    """Upper edges of labels, from above, moved so that none overlaps the next and all are within bounds."""
    found: list[float] = []
    for top, height in zip(tops, heights, strict=True):
        below = found[-1] - heights[len(found) - 1] if found else highest
        found.append(min(top, below, highest) if height else top)
    floor = lowest
    for k in range(len(found) - 1, -1, -1):
        found[k] = max(found[k], floor + heights[k])
        floor = found[k]
    return found


def front_view(axis: Axes, design: Design, box: Box, scale: _Scale) -> None:
    """From ahead: spacing of parallel muscles, and heights of knee, ankle and sole."""
    place(axis, box, scale, 0.0)
    pose = Pose.at(design.built, 0.0, "front")
    _draw_leg(axis, pose)
    named = colours(design)
    ankle = float(pose.data.xanchor[pose.model.joint(ANKLE).id][0])
    ahead = sorted(design.facts, key=lambda entry: float(pose.path(entry.muscles[0])[:, 0].mean()))
    for entry in ahead:
        for muscle in entry.muscles:
            behind = _BEHIND if float(pose.path(muscle)[:, 0].mean()) < ankle else 1.0
            _draw_muscle(axis, pose, muscle, entry, named[entry.name], scale.millimetre, behind)
    axis.plot(0.0, 0.0, "+", color="black", ms=9.0, mew=0.8, zorder=6)
    _heights(axis, design, pose, scale, box)
    axis.set_title("from ahead", loc="left", fontsize=8.0, pad=3.0)


def _heights(axis: Axes, design: Design, pose: Pose, scale: _Scale, box: Box) -> None:
    """Dimensions from the ankle up to the knee and down to the sole."""
    at = (0.5 * box[2] * _INCH - 0.0055) * scale.ratio
    levels = [level for level in (knee(design), sole(design, pose)) if level is not None]
    for name, height in levels:
        axis.annotate("", (at, 0.0), (at, height), arrowprops=_DIMENSION, annotation_clip=False)
        for level in (0.0, height):
            axis.plot([0.0, at * 1.06], [level, level], color="0.45", lw=0.4, ls=(0, (1, 2)), zorder=3)
        room = abs(height) / scale.ratio  # [m] on the page
        text = f"{name} {1e3 * abs(height):.0f}"
        look: Keywords = {"ha": "right", "fontsize": _FONT, "linespacing": 1.0, "zorder": 8}
        if room < _NARROW:
            axis.text(at, min(height, 0.0) - 0.001 * scale.ratio, text, va="top", **look)
        else:
            text = text if room > _WIDE else text.replace("–", "–\n")
            axis.text(at * 0.985, 0.5 * height, text, va="center", rotation=90, **look)


def knee(design: Design) -> tuple[str, float] | None:
    """The knee above the ankle [m]: from the leg; else the top of the shank's shapes."""
    if not design.built.scenario.orthosis.anchored:
        return None
    leg = design.built.scenario.leg
    above = JOINTS[leg.joint].above
    if leg.shank_length and leg.joint == "ankle":
        return "knee–ankle", float(leg.shank_length)
    top = _extreme(design, highest=True)
    return None if top is None else (f"{above}'s top–{leg.joint}", top)


def sole(design: Design, pose: Pose) -> tuple[str, float] | None:
    """The bare sole below the ankle [m]: the heel's site, else the lowest of the foot's shapes."""
    if not design.built.scenario.orthosis.anchored:
        return None
    if "heel" in [pose.model.site(k).name for k in range(pose.model.nsite)]:
        height = float(pose.flat(pose.data.site("heel").xpos[None, :])[0, 1])
    else:
        height = _extreme(design, highest=False) or 0.0
    joint = design.built.scenario.leg.joint
    end = "sole" if joint == "ankle" else "lowest"
    return (f"{joint}–{end}", height) if height < -1e-3 else None


def _extreme(design: Design, *, highest: bool) -> float | None:
    """The top of the segment above the joint, or the lowest height of all others [m]."""
    pose, above = Pose.at(design.built, 0.0), JOINTS[design.built.scenario.leg.joint].above
    limb = leg_geoms(pose.model, design.built)
    found = [pose.outline(g)[:, 1] for g, part in limb.items() if (part == above) is highest]
    if not found:
        return None
    heights = np.concatenate(found)
    return float(heights.max() if highest else heights.min())

"""A leg from the side and from ahead: shapes, axis and stops of the ankle, centres of mass, sole."""

import pathlib

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from afo_sim.common import Keywords
from afo_sim.legs import FOOT, SHANK, LegNumbers, Shape, Tree, from_ankle, moved, surface
from afo_sim.model import OLD_TOE, POINTS
from afo_sim.show.style import BLUE, GREEN, GREY, RED, Axes, new_figure, plain

_SKIN = {SHANK: "#d9b49a", FOOT: "#c99a7c"}  # of the two segments
_VIEWS = (("from the right", (0, 2), "forward [mm]"), ("from ahead", (1, 2), "left [mm]"))
_MANY = 20_000  # faces of a mesh above which its outline is drawn alone


def draw_leg(leg: Tree, title: str, path: pathlib.Path) -> None:
    """Draw a leg."""
    with new_figure(path, (7.1, 5.4)) as figure:
        axes = figure.subplots(1, 2, sharey=True)
        numbers = LegNumbers.of(leg)
        foot = {part.name for part in leg.below(FOOT)}
        letters: Keywords = {"color": BLUE, "ha": "center", "va": "top", "fontsize": 7.5}
        for axis, (name, columns, label) in zip(axes, _VIEWS, strict=True):
            for part in leg.parts.values():
                for shape in part.shapes:
                    colour = _SKIN[FOOT if part.name in foot else SHANK]
                    _silhouette(axis, from_ankle(leg, part), shape, columns, colour)
            axis.axhline(0.0, color="0.85", lw=0.6, zorder=0)
            axis.axvline(0.0, color="0.85", lw=0.6, zorder=0)
            axis.plot(0.0, 0.0, "o", color=RED, ms=6, zorder=4, label="ankle" if columns[0] == 0 else None)
            for segment, colour, word in ((numbers.shank, "#000000", "shank"), (numbers.foot, GREEN, "foot")):
                look = {"color": colour, "label": f"centre of mass, {word}, {segment.mass:.3g} kg"}
                axis.plot(*(1e3 * segment.centre[list(columns)]), "x", ms=7, mew=1.8, zorder=4, **look)
            for part in leg.below(FOOT):
                for point, at in ((n, at) for n, at in part.points.items() if n in (*POINTS, OLD_TOE)):
                    place = 1e3 * moved(from_ankle(leg, part), at[None])[0][list(columns)]
                    axis.plot(*place, "v", color=BLUE, ms=4, zorder=4)
                    if columns[0] == 0:  # the names of the sole's points
                        below = (8, -2) if point == "tip" else (0, -6)
                        axis.annotate(point, place, below, textcoords="offset points", **letters)
            axis.set(xlabel=label, title=name)
            axis.margins(0.12)
            axis.set_aspect("equal", adjustable="datalim")
        axes[0].set_ylabel("above the ankle [mm]")
        parts = leg.below(FOOT)
        own = [moved(from_ankle(leg, part), surface(shape)) for part in parts for shape in part.shapes]
        reach = 1e3 * (float(np.concatenate(own)[:, 0].max()) if own else 0.2)  # of the foot's foremost point
        # the ankle's range as an arc of the foot's forward axis, with its angles
        (low, high), radius = numbers.range, 1.2 * reach
        angle = np.linspace(low, high, 60)
        axes[0].plot(radius * np.cos(angle), radius * np.sin(angle), color=RED, lw=1.2, zorder=3)
        for end, side in ((low, "top"), (high, "bottom")):
            x, z = radius * np.cos(end), radius * np.sin(end)
            axes[0].plot([0.0, x], [0.0, z], color=RED, lw=0.6, ls=":", zorder=3)
            label, beside = f"{np.degrees(end):+.0f}°".replace("-", "−"), {"va": side, "ha": "left"}
            axes[0].annotate(label, (x, z), (3, 0), textcoords="offset points", color=RED, **beside)
        axes[0].plot([0.0, radius], [0.0, 0.0], color=GREY, lw=0.6, zorder=3)
        axes[1].plot([-0.35 * reach, 0.35 * reach], [0.0, 0.0], color=RED, lw=1.2)
        axes[1].annotate("ankle's axis", (0.35 * reach, 0.0), (3, 3), textcoords="offset points", color=RED)
        axes[1].invert_xaxis()  # who looks at the toes has the leg's left at the right hand
        figure.suptitle(plain(title, 90))
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)


def _silhouette(axis: Axes, pose: np.ndarray, shape: Shape, columns: tuple[int, int], colour: str) -> None:
    points = 1e3 * moved(pose, surface(shape))[:, columns]
    look = {"facecolor": colour, "edgecolor": "0.35", "lw": 0.5, "alpha": 0.8, "zorder": 1}
    if shape.kind == "mesh" and 0 < len(shape.faces) <= _MANY:
        from matplotlib.collections import PolyCollection

        axis.add_collection(PolyCollection(points[shape.faces], facecolor=colour, edgecolor="none", zorder=1))
        axis.update_datalim(points)
        look |= {"facecolor": "none", "alpha": 0.6}
    try:
        hull = ConvexHull(points).vertices
    except (QhullError, ValueError):  # all on a line
        return
    axis.fill(*points[hull].T, **look)

"""Panels on a trial's taken stride: points of the leg, foot on the ground, all strides behind it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from afo_sim.gait.checks import stance
from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait.flat_foot import USUAL
from afo_sim.gait_lab.trial.importing import Imported
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride
from afo_sim.show.style import COLOURS, NORM

OTHER = "0.55"  # grey of what was not taken
DASHES = (0, (4, 2))  # of the other side's
# Of a standard deviation.
BAND: dict[str, Any] = {"facecolor": "none", "edgecolor": COLOURS[3], "hatch": "//////", "lw": 0.4}
TOES = 0.06  # ahead of a toe point, for the drawing only [m]
DEGREES = 180.0 / np.pi
SIGNALS = (  # panel, field of GaitCycle, scale of the axis' unit
    ("shank", "shank_angle", DEGREES),
    ("knee", "knee_angle", DEGREES),
    ("ankle", "ankle_angle", DEGREES),
    ("moment", "ankle_moment", -1.0),  # plantarflexion upward
    ("force", "grf_z", 1.0),
    ("force", "grf_x", 1.0),
)
LINKS = (("hip", "knee"), ("knee", "ankle"), ("ankle", "heel"), ("heel", "toe"), ("toe", "ankle"))
# Where a point's label stands: from the point [points], horizontal and vertical alignment.
LABELS = {
    "hip": ((7, 0), "left", "center"),
    "knee": ((9, 0), "left", "center"),
    "ankle": ((7, 7), "left", "bottom"),
    "heel": ((-3, -5), "right", "top"),  # both under the floor, clear of a low ankle
    "toe": ((3, -5), "left", "top"),
}


def taken_sides(imported: Imported) -> set[str]:
    """The sides of the strides that were taken: one, or both where their mean was."""
    return {imported.strides[index].side for index in imported.chosen}


def foot_ends(imported: Imported, usual: tuple[float, float]) -> tuple[float, float]:
    """Heel and toe of the taken foot ahead of its ankle, flat [m]: the outline, or else its points.

    A toe point is on the metatarsals, as a rule, so that toes are drawn ahead of it.

    Units: usual [m].
    """
    leg = imported.legs[imported.cycle.side]
    if {"heel", "toe"} <= set(leg.outline):
        return leg.outline["heel"], leg.outline["toe"]
    k = _flat_instant(imported, imported.strides[imported.chosen[0]])
    if k is None or not {"heel", "toe"} <= set(leg.points):
        return usual
    way = {role: imported.frame.plane(leg.points[role].path[k])[0] for role in ("heel", "ankle", "toe")}
    return way["heel"] - way["ankle"], way["toe"] - way["ankle"] + TOES


def draw_points(axis: Any, imported: Imported) -> None:
    """The taken leg at one instant of flat stance: each point, with how far it may be off."""
    from matplotlib.ticker import MaxNLocator

    leg = imported.legs[imported.cycle.side]
    stride = imported.strides[imported.chosen[0]]
    k = _flat_instant(imported, stride)
    if k is None:
        axis.text(0.5, 0.5, "no instant shows\nthe whole leg", transform=axis.transAxes, ha="center")
        return
    ankle = imported.frame.plane(leg.points["ankle"].path[k])
    about = np.array([ankle[0], 0.0])
    places = {role: imported.frame.over_floor(point.path[k]) - about for role, point in leg.points.items()}
    for start, end in LINKS:
        if start in places and end in places:
            axis.plot(*np.transpose([places[start], places[end]]), color=OTHER, lw=1.2, zorder=1)
    for role, (x, z) in places.items():
        joint = role not in ("heel", "toe")
        axis.plot(x, z, "o" if joint else "s", ms=6.0 if joint else 4.0, color="black", mfc="white", mew=1.1)
        error = leg.points[role].error
        words = role if error is None else f"{role} ±{1e3 * error:.0f} mm"
        offset, across, along = LABELS[role]
        place = {"xytext": offset, "textcoords": "offset points", "ha": across, "va": along}
        axis.annotate(words, (x, z if joint else 0.0), fontsize=8.0, **place)
    axis.axhline(0.0, color="0.3", lw=0.8, zorder=0)
    axis.set_aspect("equal")
    axis.set_xlim(-0.66, 0.72)
    top = max(place[1] for place in places.values())
    axis.set_ylim(-0.15 * top, 1.06 * top)
    axis.yaxis.set_major_locator(MaxNLocator(5))
    axis.set_title(f"points found, at {leg.time[k]:.2f} s", fontsize=8.0)
    axis.set_xlabel("ahead of the ankle [m]")
    axis.set_ylabel("up [m]")


def _flat_instant(imported: Imported, stride: RecordedStride) -> int | None:
    """Row of the leg's points nearest to mid-stance at which all of them are seen."""
    leg = imported.legs[imported.cycle.side]
    seen = np.all([np.isfinite(point.path).all(axis=1) for point in leg.points.values()], axis=0)
    if not seen.any():
        return None
    length = stride.end - stride.start
    # a stride that was closed lies a whole period beside what was recorded
    away = (leg.time - stride.start - 0.5 * sum(USUAL) * length) / length
    away = np.abs(away - np.round(away)) + 0.01 * np.abs(np.round(away))
    return int(np.argmin(np.where(seen, away, np.inf)))


def draw_foot(axis: Any, imported: Imported, outline: tuple[float, float]) -> None:
    """The foot from its side, and below it where the ground pressed while stance went on."""
    cycle = imported.cycle
    heel, toe = (100.0 * end for end in outline)
    top = 24.0  # of the drawn foot, in the axis' own per cent of stance
    shape = np.array([(heel, 1.0), (heel, 7.0), (-3.5, top), (3.5, top), (0.55 * toe, 8.0), (toe, 1.0)])
    axis.fill(shape[:, 0], -shape[:, 1], color="0.85", lw=0.0)
    axis.plot(*np.vstack([shape, shape[:1]]).T * [[1.0], [-1.0]], color="0.4", lw=0.8)
    axis.plot(0.0, -0.75 * top, "o", ms=5.0, color="black", mfc="white")
    for end in (heel, toe):
        axis.axvline(end, color="0.4", lw=0.6, ls=":")
    sides = taken_sides(imported)
    for other in imported.cycles:
        if other.side in sides and other is not cycle:
            axis.plot(*_on_floor(other), color=OTHER, lw=0.5)
    axis.plot(*_on_floor(cycle), color="black", lw=1.3)
    axis.set_ylim(100.0, -top - 4.0)
    axis.set_yticks([0, 25, 50, 75, 100])
    low, high = axis.get_xlim()
    axis.set_xlim(min(low, heel) - 2.0, max(high, toe) + 2.0)
    axis.set_xlabel("centre of pressure on the floor,\nahead of the flat foot's ankle [cm]")
    axis.set_ylabel("stance [%]")


def _on_floor(cycle: GaitCycle) -> tuple[np.ndarray, np.ndarray]:
    """Centre of pressure ahead of where the ankle is in flat stance [cm], and per cent of stance (m,)."""
    on = np.isfinite(cycle.cop_x)
    ahead = (cycle.cop_x + cycle.ankle_x)[on] - cycle.ankle_x[cycle.foot_flat()].mean()
    share = cycle.phase[on] / stance(cycle) if on.any() else cycle.phase[on]
    return 100.0 * ahead, 100.0 * share


def draw_strides(figure: Any, axes: Mapping[str, Any], imported: Imported) -> None:
    """All strides of both sides, thin, behind the taken one, with the band of its side and one legend."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    for panel, field, scale in SIGNALS:
        _strides(axes[panel], imported, field, scale)
    side, sides = imported.cycle.side, {cycle.side for cycle in imported.cycles}
    handles: list[Any] = [Line2D([], [], color=COLOURS[1], label="taken")]
    handles.append(Line2D([], [], color="black", lw=0.8, ls="--", label="its Fourier series"))
    for other in sorted(sides, key=lambda name: name != side):
        look: dict[str, Any] = {"color": OTHER, "lw": 0.7, "ls": "-" if other == side else DASHES}
        handles.append(Line2D([], [], **look, label=f"{other} strides"))
    if imported.band is not None:
        handles.append(Patch(**BAND, label=f"{' and '.join(sorted(taken_sides(imported)))}: mean ± 1 SD"))
    handles.append(Patch(facecolor=NORM, label="published means"))
    figure.legend(handles=handles, loc="outside upper left", ncols=3)


def _strides(axis: Any, imported: Imported, name: str, scale: float) -> None:
    side, sides = imported.cycle.side, taken_sides(imported)
    for cycle in imported.cycles:
        look = {"color": OTHER, "lw": 0.5, "ls": "-" if cycle.side == side else DASHES, "zorder": 1.2}
        axis.plot(100.0 * cycle.phase, scale * getattr(cycle, name), **look)
    if imported.band is None or name not in imported.band:
        return
    own = [getattr(cycle, name) for cycle in imported.cycles if cycle.side in sides]
    mean = scale * np.mean([row for row in own if np.isfinite(row).all()], axis=0)
    deviation = scale * imported.band[name]
    look = {"zorder": 1.1, **BAND}
    axis.fill_between(100.0 * imported.cycle.phase, mean - deviation, mean + deviation, **look)

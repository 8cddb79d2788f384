"""Panels on a walking trial: its strides, its plates, and its ways from above."""

from collections.abc import Mapping, Sequence

import numpy as np

from afo_sim.common import Foreign, JsonDict, Keywords
from afo_sim.gait import USUAL, GaitCycle, stance
from afo_sim.gait_lab import Check, Imported, direction
from afo_sim.gait_lab.trial.strides import RecordedStride
from afo_sim.show.style import BLUE, LINE, NORM, RED, VIOLET, Axes, Figure, plain, wrapped

_DASHES = (0, (4, 2))  # of the other side's
# Of a standard deviation.
_BAND: Keywords = {"facecolor": "none", "edgecolor": VIOLET, "hatch": "//////", "lw": 0.4}
_TOES = 0.06  # ahead of a toe point, for the drawing only [m]
_DEGREES = 180.0 / np.pi
_SIGNALS = (  # panel, field of GaitCycle, scale of the axis' unit
    ("shank", "shank_angle", _DEGREES),
    ("knee", "knee_angle", _DEGREES),
    ("ankle", "ankle_angle", _DEGREES),
    ("moment", "ankle_moment", -1.0),  # plantarflexion upward
    ("force", "grf_z", 1.0),
    ("force", "grf_x", 1.0),
)
_LINKS = (("hip", "knee"), ("knee", "ankle"), ("ankle", "heel"), ("heel", "toe"), ("toe", "ankle"))
# Where a point's label stands: from the point [points], horizontal and vertical alignment.
_LABELS = {
    "hip": ((7, 0), "left", "center"),
    "knee": ((9, 0), "left", "center"),
    "ankle": ((7, 7), "left", "bottom"),
    "heel": ((-3, -5), "right", "top"),  # both under the floor, clear of a low ankle
    "toe": ((3, -5), "left", "top"),
}
_SAME = 0.005  # apart, two instants are one event [s]
_ASIDE = 0.3  # shown before and after the motion [s]
_BROAD = 4.0  # least length of the view from above over its height
_BESIDE = 0.25  # shown beside the ways, seen from above [m]
_FEW = 10  # strides or contacts of both sides that are numbered one by one
_NOT_TAKEN = "0.55"  # grey of what was not taken
_EVENTS = (  # name, marker, whether it is filled
    ("heel strike by force", "v", True),
    ("by kinematics", "v", False),
    ("toe-off by force", "^", True),
    ("by kinematics", "^", False),
)


def taken_sides(imported: Imported) -> set[str]:
    """The sides of the strides that were taken: one, or both where their mean was."""
    return {imported.strides[index].side for index in imported.chosen}


def foot_ends(imported: Imported, usual: tuple[float, float]) -> tuple[float, float]:
    """Heel and toe of the taken foot ahead of its ankle, flat [m]: the outline, or else its points."""
    leg = imported.legs[imported.cycle.side]
    if {"heel", "toe"} <= set(leg.outline):
        return leg.outline["heel"], leg.outline["toe"]
    k = _flat_instant(imported, imported.strides[imported.chosen[0]])
    if k is None or not {"heel", "toe"} <= set(leg.points):
        return usual
    way = {role: imported.frame.plane(leg.points[role].path[k])[0] for role in ("heel", "ankle", "toe")}
    return way["heel"] - way["ankle"], way["toe"] - way["ankle"] + _TOES


def draw_points(axis: Axes, imported: Imported) -> None:
    """The taken leg at one instant of flat stance: each point, with how far it may be off."""
    from matplotlib.ticker import MaxNLocator

    leg = imported.legs[imported.cycle.side]
    k = _flat_instant(imported, imported.strides[imported.chosen[0]])
    if k is None:
        axis.text(0.5, 0.5, "no instant shows\nthe whole leg", transform=axis.transAxes, ha="center")
        return
    about = np.array([imported.frame.plane(leg.points["ankle"].path[k])[0], 0.0])
    places = {role: imported.frame.over_floor(point.path[k]) - about for role, point in leg.points.items()}
    for start, end in _LINKS:
        if start in places and end in places:
            axis.plot(*np.transpose([places[start], places[end]]), color=_NOT_TAKEN, lw=1.2, zorder=1)
    for role, (x, z) in places.items():
        joint = role not in ("heel", "toe")
        axis.plot(x, z, "o" if joint else "s", ms=6.0 if joint else 4.0, color="black", mfc="white", mew=1.1)
        error = leg.points[role].error
        words = role if error is None else f"{role} ±{1e3 * error:.0f} mm"
        offset, across, along = _LABELS[role]
        place = {"xytext": offset, "textcoords": "offset points", "ha": across, "va": along}
        axis.annotate(words, (x, z if joint else 0.0), fontsize=8.0, **place)
    axis.axhline(0.0, color="0.3", lw=0.8, zorder=0)
    axis.set(aspect="equal", xlim=(-0.66, 0.72))
    top = max(place[1] for place in places.values())
    axis.set_ylim(-0.15 * top, 1.06 * top)
    axis.yaxis.set_major_locator(MaxNLocator(5))
    axis.set_title(f"points found, at {leg.time[k]:.2f} s", fontsize=8.0)
    axis.set(xlabel="ahead of the ankle [m]", ylabel="up [m]")


def check_cells(checks: Sequence[Check]) -> list[list[str]]:
    """Fault, what was found or needed, limit and verdict of each check, wrapped to their columns."""
    return [
        [
            wrapped(check.fault, 28),
            wrapped(check.verdict, 90) if check.needs else wrapped(check.found, 38),
            wrapped(check.limit, 22),
            "" if check.needs else check.verdict,
        ]
        for check in checks
    ]


def draw_checks(figure: Figure, checks: Sequence[Check], size: float) -> None:
    """Can this trial be believed: each fault that was looked for, what was found, the limit, the verdict."""
    axis = figure.add_subplot()
    axis.set_axis_off()
    axis.set_title("can I believe this trial?", loc="left", fontsize=9.0)
    rows = check_cells(checks)
    lines = [max(cell.count("\n") + 1 for cell in cells) for cells in rows]
    for row, (check, cells) in enumerate(zip(checks, rows, strict=True)):
        colour = RED if check.notice else "0.45" if check.needs else "black"
        y = 1.0 - (sum(lines[:row]) + 0.2) / sum(lines)
        for x, text in zip((0.0, 0.26, 0.58, 0.77), cells, strict=True):
            axis.text(x, y, text, fontsize=size, color=colour, va="top", linespacing=1.05)


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


def draw_foot(axis: Axes, imported: Imported, outline: tuple[float, float]) -> None:
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
            axis.plot(*_on_floor(other), color=_NOT_TAKEN, lw=0.5)
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


def draw_strides(figure: Figure, axes: Mapping[str, Axes], imported: Imported) -> None:
    """All strides of both sides, thin, behind the taken one, with the band of its side and one legend."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    for panel, field, scale in _SIGNALS:
        _strides(axes[panel], imported, field, scale)
    side, sides = imported.cycle.side, {cycle.side for cycle in imported.cycles}
    handles: list[Foreign] = [Line2D([], [], color=BLUE, label="taken")]
    handles.append(Line2D([], [], color="black", lw=0.8, ls="--", label="its Fourier series"))
    for other in sorted(sides, key=lambda name: name != side):
        look: Keywords = {"color": _NOT_TAKEN, "lw": 0.7, "ls": "-" if other == side else _DASHES}
        handles.append(Line2D([], [], **look, label=f"{other} strides"))
    if imported.band is not None:
        handles.append(Patch(**_BAND, label=f"{' and '.join(sorted(taken_sides(imported)))}: mean ± 1 SD"))
    handles.append(Patch(facecolor=NORM, label="published means"))
    figure.legend(handles=handles, loc="outside upper left", ncols=3)


def _strides(axis: Axes, imported: Imported, name: str, scale: float) -> None:
    side, sides = imported.cycle.side, taken_sides(imported)
    for cycle in imported.cycles:
        look = {"color": _NOT_TAKEN, "lw": 0.5, "ls": "-" if cycle.side == side else _DASHES, "zorder": 1.2}
        axis.plot(100.0 * cycle.phase, scale * getattr(cycle, name), **look)
    if imported.band is None or name not in imported.band:
        return
    own = [getattr(cycle, name) for cycle in imported.cycles if cycle.side in sides]
    mean = scale * np.mean([row for row in own if np.isfinite(row).all()], axis=0)
    deviation = scale * imported.band[name]
    look = {"zorder": 1.1, **_BAND}
    axis.fill_between(100.0 * imported.cycle.phase, mean - deviation, mean + deviation, **look)


def draw_trial(figure: Figure, imported: Imported) -> None:
    """Strides and forces over time with one legend above them, and below the ways from above."""
    from matplotlib.lines import Line2D

    events, plates, above = figure.subplots(3, 1, height_ratios=[0.3 * len(imported.legs), 1.0, 0.9])
    events.sharex(plates)
    # while motion or strides last, a little wider; plates may have been on for longer
    times = [time for leg in imported.legs.values() for time in (leg.time[0], leg.time[-1])]
    times += [t for s in imported.strides if s.closed is None for t in (s.start, s.end)]
    plates.set_xlim(min(times) - _ASIDE, max(times) + _ASIDE)
    _events(events, imported)
    _plates(plates, imported)
    _from_above(above, imported)
    marks = [
        Line2D([], [], ls="", marker=m, ms=5.0, color="black", mfc="black" if filled else "white", label=name)
        for name, m, filled in _EVENTS
    ]
    lines, _ = plates.get_legend_handles_labels()
    lines += [line for line in above.lines if line.get_label() == "pelvis"]
    figure.legend(handles=[*marks, *lines], loc="outside upper left", ncols=4)


def _events(axis: Axes, imported: Imported) -> None:
    """Strides of both sides as bars with their events; the part that was bridged is dotted."""
    sides = [imported.cycle.side, *(s for s in imported.legs if s != imported.cycle.side)]
    numbered = len(imported.strides) <= _FEW
    counts = dict.fromkeys(sides, 0)
    for index, stride in enumerate(imported.strides):
        level = -float(sides.index(stride.side))
        counts[stride.side] += 1
        taken = index in imported.chosen
        colour, width = ("black", 2.2) if taken else (_NOT_TAKEN, 1.0)
        look = {"color": colour, "lw": width, "solid_capstyle": "butt"}
        start, end = stride.start, stride.end
        if stride.closed is not None:
            start, end = stride.closed.window
            axis.plot([end, end + stride.closed.gap], [level] * 2, ls=":", **look)
        axis.plot([start, end], [level] * 2, **look)
        ground, size = imported.grounds.get(stride.side), 5.0 if numbered else 3.0
        contacts = () if ground is None else ground.contacts
        for time, marker, lands in _marks(stride):
            forced = any(_apart(time, c.start if lands else c.end, stride) < _SAME for c in contacts)
            filling = "black" if forced else "white"  # open by kinematics
            axis.plot(time, level, marker, ms=size, color="black", mfc=filling, mew=0.16 * size, zorder=3)
        if numbered or (taken and len(imported.chosen) == 1):
            words = f"{counts[stride.side]}, taken" if taken else str(counts[stride.side])
            marks = np.array([time for time, _, _ in _marks(stride)])
            places = np.linspace(start, end, 11)[2:-2]
            at = places[np.abs(places[:, None] - marks).min(axis=1).argmax()]  # far from its marks
            box = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none"}
            axis.text(at, level, words, ha="center", va="center", fontsize=7.5, color=colour, bbox=box)
    axis.set_yticks([-float(k) for k in range(len(sides))], sides)
    axis.set_ylim(-len(sides) + 0.4, 0.6)
    axis.tick_params(axis="y", length=0)
    axis.tick_params(axis="x", labelbottom=False, length=0)
    for edge in ("left", "bottom"):
        axis.spines[edge].set_visible(False)


def _marks(stride: RecordedStride) -> list[tuple[float, str, bool]]:
    """Heel strikes and toe-off of a stride [s]: time, marker, whether it is a heel strike."""
    if stride.closed is None:
        return [(stride.start, "v", True), (stride.end, "v", True), (stride.toe_off, "^", False)]
    first = stride.closed.window[0]
    strike, off = (first + (time - first) % stride.time for time in (stride.start, stride.toe_off))
    return [(strike, "v", True), (off, "^", False)]


def _apart(time: float, other: float, stride: RecordedStride) -> float:
    """How far two instants are apart [s]; of a closed stride in its period."""
    if stride.closed is None:
        return abs(time - other)
    return abs((time - other + 0.5 * stride.time) % stride.time - 0.5 * stride.time)


def _plates(axis: Axes, imported: Imported) -> None:
    """Upward force of every plate, and over it whose foot it was."""
    shown = {name: series for ground in imported.grounds.values() for name, series in ground.plates.items()}
    contacts = [contact for ground in imported.grounds.values() for contact in ground.contacts]
    contacts.sort(key=lambda contact: not contact.whole)  # whose names have room over them
    last = {name: name.rpartition("_")[2] for name in shown}  # ground_force_r is r, where that tells it apart
    for name, (time, force) in shown.items():
        axis.plot(time, force, color="0.7", lw=0.8)
        first = next((c for c in contacts if c.plate == name), None)
        if first is not None and len(contacts) <= _FEW:
            inside = (time >= first.start) & (time <= first.end)
            place = {"xytext": (0, 3), "textcoords": "offset points", "ha": "center"}
            peak = 0.5 * (first.start + first.end), force[inside].max()
            own = last[name] if list(last.values()).count(last[name]) == 1 and last[name] else name
            words = f"plate {own}" if len(own) < 5 else own
            axis.annotate(plain(words, 18), peak, fontsize=7.5, **place)
    for side, ground in imported.grounds.items():
        label: str | None = f"{side} foot"
        for contact in ground.contacts:
            time, force = ground.plates[contact.plate]
            on = (time >= contact.start) & (time <= contact.end)
            axis.plot(time[on], force[on], lw=1.3, label=label, **_look(imported, side))
            label = None
    axis.plot([], [], color="0.7", lw=0.8, label="not assigned")
    top = max((float(force.max()) for _, force in shown.values()), default=1.0)
    axis.set_ylim(top=1.25 * top)
    axis.set(ylabel="upward\nforce [N]", xlabel="time in the trial [s]")


def _from_above(axis: Axes, imported: Imported) -> None:
    """The ways of pelvis and ankles seen from above, the plates under them, and where forward is."""
    from matplotlib.ticker import MaxNLocator

    frame = imported.frame
    ways = {f"{side} ankle": leg.points["ankle"].path for side, leg in imported.legs.items()}
    pelvis = next((leg.pelvis for leg in imported.legs.values() if leg.pelvis is not None), None)
    looks: dict[str, Keywords] = {f"{side} ankle": _look(imported, side) for side in imported.legs}
    if pelvis is not None:
        ways["pelvis"], looks["pelvis"] = pelvis, {"color": _NOT_TAKEN, "ls": ":"}
    seen = []
    for name, path in ways.items():
        ahead, left = frame.plane(path)[:, 0], -frame.across(path)
        axis.plot(ahead, left, lw=1.0, label=name, **looks[name])
        seen.append(np.column_stack([ahead, left]))
    around = np.concatenate(seen)
    low, high = np.nanmin(around, axis=0) - _BESIDE, np.nanmax(around, axis=0) + _BESIDE
    axis.set_aspect("equal", adjustable="box", anchor="W")
    wider = max(0.0, _BROAD * (high[1] - low[1]) - (high[0] - low[0]))  # a walk on a belt stays in place
    axis.set(xlim=(low[0] - 0.5 * wider, high[0] + 0.5 * wider), ylim=(low[1], high[1]))
    for plate in imported.trial.plates:  # as far as it is in view; its name at the view's edge
        if plate.corners is not None:
            outline = plate.corners[[0, 1, 2, 3, 0]]
            ahead, left = frame.plane(outline)[:, 0], -frame.across(outline)
            axis.plot(ahead, left, color="0.75", lw=0.8, zorder=1)
            middle, (bottom, top) = float(np.mean(ahead[:4])), axis.get_ylim()
            within = axis.get_xlim()[0] < middle < axis.get_xlim()[1]
            if within and left.min() < top and left.max() > bottom:
                place = {"ha": "center", "va": "bottom", "fontsize": 7.0, "color": "0.4"}
                axis.text(middle, bottom + 0.01, plain(plate.name, 18), **place)
    axis.set_title(f"→ {plain(direction(frame), LINE)}", loc="left", fontsize=8.0)
    axis.yaxis.set_major_locator(MaxNLocator(2, steps=[1, 5, 10], min_n_ticks=1))
    axis.set_xlabel("forward in the laboratory, seen from above [m]", loc="left")
    axis.set_ylabel("to the\nleft [m]")


def _look(imported: Imported, side: str) -> JsonDict:
    if side == imported.cycle.side:
        return {"color": "black", "ls": "-"}
    return {"color": BLUE, "ls": (0, (4, 1.5))}

"""The design picture: an orthosis on its leg with dimensions, and what its muscles do over the angle."""

import functools
import os
import pathlib
import textwrap
from collections.abc import Sequence
from typing import Literal, overload

import numpy as np

from afo_sim.common import InputError, Keywords, check_writable, replacing, unknown
from afo_sim.description import WORN, Described
from afo_sim.model import AirScheme, Design, PathFacts, Source, arm, own, peak, pressure, taut, torques
from afo_sim.model.design import design
from afo_sim.show.air_drawing import scheme_of, write_air
from afo_sim.show.drawing_views import WHITE, Box, colours, front_view, scale_of, side_view
from afo_sim.show.style import FORMATS, GREY, LINE, RED, ZERO, Axes, Figure, plain, width_of, write_page

_KINDS = {"assumed": "a", "derived": "d", "fitted": "f", "published": "p", "user": "u"}
_FOOT = (
    "(a) assumed, (d) derived, (f) fitted, (p) published, (u) your own; unmarked: no source told. "
    "Path, angles, contractions, arms and torques are computed from these, at rest and without friction."
)
_FONT = 7.0
_LINES = 9  # below the head
_PAGE_WIDTH, _COLUMN_GAP = 792.0, 7.0  # of the table, and least between columns [points]
_LEAST_WARNINGS = 2  # lines that the groups leave to warnings
WIDTH = 190  # letters of a line
_BEYOND = "0.92"  # shade of angles outside the range of motion
_HANGS = 0.16  # opacity of the shade where a muscle hangs through
_ROOM = 0.08  # of an axis above and below what is within the range of motion
_STYLES: tuple[object, ...] = (":", "--", "-")  # without air, at half and at full pressure
_WORDS = 0.13  # height of a line of words in the panel of contraction [-]
_SMALL = 7.0  # size of words in panels
PAGE = (297.0 / 25.4, 210.0 / 25.4)  # A4 landscape [inch]
SIDE: Box = (0.35, 1.8, 4.9, 5.65)
_FRONT: Box = (5.2, 1.8, 1.65, 5.65)
_CURVES: Box = (7.3, 2.2, 4.05, 5.25)
_TABLE: Box = (0.35, 0.15, 11.0, 1.5)
_PANEL_GAP = 0.24  # between panels [inch]
_RERUN = "rrd"
_ALLOWED = (*FORMATS, _RERUN)
_DESIGN, AIR = "design", "air"
VIEWS = {_DESIGN: _ALLOWED, AIR: FORMATS}  # what is drawn, and the formats that there are of it


def table(design: Design) -> tuple[list[str], list[list[str]]]:
    """Head, and a row for each group of alike muscles."""
    bar = pressure(design.facts[0])
    head = ["group", "muscles", "path at\n0 deg [mm]", "link\n[mm]", "slack\n[mm]", "cable\n[kN/m]"]
    head += ["taut\nwithout air", f"taut\nat {bar}", f"own contraction\nat {bar}", "moment arm"]
    head += [f"torque\nat {bar}", f"at most\nat {bar}"]
    return head, [_row(entry) for entry in design.facts]


def _row(entry: PathFacts) -> list[str]:
    group, kind = entry.group, entry.group.type
    length = f"{len(entry.muscles)} × {plain(kind.name, 20)}"
    over = group.pulley is not None
    return [
        plain(entry.name, 24),
        length,
        "wheel" if over else f"{1e3 * entry.length[entry.at(0.0)]:.0f}",
        "–" if group.link_length is None else marked(f"{1e3 * group.link_length:.4g}", group, "link_length"),
        "–" if over else marked(f"{1e3 * group.slack:.4g}", group, "slack"),
        marked(f"{1e-3 * group.cable.stiffness:.4g}", group.cable, "stiffness"),
        taut(entry, 0),
        taut(entry, 1),
        own(entry, 1),
        arm(entry),
        torques(entry),
        peak(entry),
    ]


def marked(text: str, described: Described, key: str) -> str:
    """A number with the letter of its source's kind; none without a source."""
    origin = described.provenance.get(key)
    return text if origin is None else f"{text} ({_KINDS.get(origin.kind, origin.kind)})"


def _sources(design: Design) -> str:
    """The kinds of the numbers that are drawn and not in the table, in a line."""
    told = []
    for kind in {entry.group.type.name: entry.group.type for entry in design.facts}.values():
        length = marked(f"{1e3 * kind.total_length:.0f} mm", kind, "total_length")
        ends = marked(f"ends {1e3 * kind.end_length:.0f} mm", kind, "end_length")
        told.append(f"{plain(kind.name, 20)}: {length}, {ends}, {marked('bore', kind, 'bore')}")
    for segment, mounting in design.built.scenario.orthosis.anchor.items():
        part = WORN[segment]
        stiffness = "" if mounting.stiffness is None else f"{1e-3 * mounting.stiffness:.4g} kN/m"
        told.append(f"{part} {marked(stiffness, mounting, 'stiffness') if stiffness else 'stiffens'}")
    if not design.built.scenario.orthosis.anchor:
        told.append("cuff and plate rigid")
    return "; ".join(told)


def _draw_table(axis: Axes, design: Design) -> None:
    """Head, rows, warnings and the foot, from above, on an axis of the page's width."""
    axis.set_axis_off()
    axis.set(xlim=(0.0, 1.0), ylim=(_LINES + 2.4, 0.0))
    head, rows = table(design)
    most = _LINES - 2 - (_LEAST_WARNINGS if design.warnings else 0)
    shown = rows if len(rows) <= most else rows[: most - 1]
    columns = zip(head, *rows, strict=True)
    widths = [max(width_of(line, _FONT) for line in "\n".join(cells).split("\n")) for cells in columns]
    gap = max((_PAGE_WIDTH - sum(widths)) / (len(widths) - 1), _COLUMN_GAP)
    total = sum(widths) + gap * (len(widths) - 1)
    edges = [sum(widths[:k]) + gap * k for k in range(len(widths))]
    size = _FONT * min(1.0, _PAGE_WIDTH / total)
    for edge, text in zip(edges, head, strict=True):
        axis.text(edge / total, 1.9, text, fontsize=size, va="bottom", weight="bold", linespacing=1.05)
    axis.plot([0.0, 1.0], [2.0, 2.0], color="0.4", lw=0.5)
    named = list(colours(design).values())
    at = 2.8
    for row, colour in zip(shown, named, strict=False):
        for k, (edge, text) in enumerate(zip(edges, row, strict=True)):
            look: Keywords = {"color": colour, "weight": "bold"} if k == 0 else {}
            axis.text(edge / total, at, text, fontsize=size, va="center", **look)
        at += 1.0
    if len(rows) > len(shown):
        text = f"… and {len(rows) - len(shown)} more: afo-sim check tells them"
        axis.text(0.0, at, text, fontsize=_FONT, va="center")
        at += 1.0
    lines, room = [], int(_LINES + 0.8 - at)
    for warning in design.warnings:
        first, *others = textwrap.wrap(plain(warning, None), WIDTH - 4)
        lines += [f"! {first}", *(f"   {other}" for other in others)]
    if len(lines) > room:
        kept = max(room - 1, 0)
        lines = [*lines[:kept], f"! {len(lines) - kept} more lines of warnings: afo-sim check tells them"]
    for line in lines:
        axis.text(0.0, at, line, fontsize=_FONT, va="center", color=RED)
        at += 1.0
    below = plain(_sources(design), WIDTH)
    axis.text(0.0, _LINES + 0.9, below, fontsize=_FONT - 0.5, va="center", color="0.25")
    axis.text(0.0, _LINES + 1.8, _FOOT, fontsize=_FONT - 0.5, va="center", color="0.25")


def _draw_curves(axes: list[Axes], design: Design) -> None:
    """Fill four panels, one under another."""
    named, leg, bar = colours(design), design.built.scenario.leg, pressure(design.facts[0])
    panels = (
        (_contraction, f"contraction [%]: path thin, {bar} thick, no air dotted, slack shaded"),
        (_lengths, f"length [mm]: path thin; muscle + link + slack at {bar} thick, no air dotted"),
        (_arm, f"moment arm about the {plain(leg.ankle, 20)} [mm]"),
        (_torque, f"torque at rest [N·m]: {bar} thick, half of it dashed, no air dotted"),
    )
    first, last = np.degrees(design.facts[0].angles[[0, -1]])
    low, high = np.degrees(design.facts[0].range)
    for axis, (draw, title) in zip(axes, panels, strict=True):
        for start, end in ((first, low), (high, last)):
            if end > start:  # for which the device is not built
                axis.axvspan(start, end, color=_BEYOND, lw=0.0, zorder=0)
        axis.axvline(0.0, color=ZERO, lw=0.5, zorder=1)
        axis.axhline(0.0, color=ZERO, lw=0.5, zorder=1)
        axis.set_xlim(first, last)
        axis.tick_params(labelsize=_SMALL)
        for entry in design.facts:
            draw(axis, entry, named[entry.name])
        values = [
            y for line in axis.lines if len(line.get_xdata()) > 2
            for x, y in zip(line.get_xdata(), line.get_ydata(), strict=True) if low <= x <= high
        ]  # fmt: skip
        room = _ROOM * max(max(values) - min(values), 1e-6)
        axis.set_ylim(min(values) - room, max(values) + room)
        axis.set_title(title, loc="left", fontsize=_SMALL, pad=2.5)
    _limits(axes[0], design)
    label = f"{plain(leg.ankle, 20)} angle [deg], {leg.directions[0]} +; grey: beyond the range of motion"
    axes[-1].set_xlabel(label, fontsize=_SMALL + 0.5)
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)


def _contraction(axis: Axes, entry: PathFacts, colour: str) -> None:
    degrees = np.degrees(entry.angles)
    axis.plot(degrees, 100.0 * entry.path, color=colour, lw=0.7)
    axis.plot(degrees, 100.0 * entry.own[:, 0], color=colour, lw=1.0, ls=_STYLES[0])
    axis.plot(degrees, 100.0 * entry.own[:, -1], color=colour, lw=1.6)
    for column, which in ((0, 0), (-1, 1)):
        for low, high in entry.slack[which]:
            within = (entry.angles >= low) & (entry.angles <= high)
            path, own = 100.0 * entry.path[within], 100.0 * entry.own[within, column]
            axis.fill_between(degrees[within], own, path, color=colour, alpha=_HANGS, lw=0.0, zorder=0.5)
            for edge in (low, high):
                if entry.angles[0] < edge < entry.angles[-1]:
                    at = 100.0 * float(np.interp(edge, entry.angles, entry.path))
                    axis.plot(np.degrees(edge), at, "o", color=colour, ms=3.2, mec="white", mew=0.5, zorder=5)


def _limits(axis: Axes, design: Design) -> None:
    """Lock and limits of each kind of muscle, where the axis shows them."""
    kinds, levels = {entry.group.type.name: entry.group.type for entry in design.facts}, []
    for name, kind in kinds.items():
        levels.append((100.0 * kind.limits.contraction_max, "cannot shorten further", name, "-."))
        levels.append((100.0 * kind.limits.contraction_min, "stretch limit", name, ":"))
        levels.append((100.0 * kind.braid.lock, "braid locks", name, "-"))
    heights = [level for level, *_ in levels]
    bottom, top = axis.get_ylim()
    low, high = min(bottom, *heights), max(top, *heights)
    words = _WORDS * (high - low)
    axis.set_ylim(min(bottom, low - 1.2 * words), max(top, high + 1.2 * words))
    lowest = 100.0 * min(kind.braid.lock for kind in kinds.values())
    axis.axhspan(-100.0, lowest, color=GREY, alpha=0.25, lw=0.0)
    taken: list[float] = []
    for height, word, name, style in levels:
        axis.axhline(height, color=GREY, lw=0.8, ls=style, zorder=2)
        below = word == "braid locks"
        middle = height + (-0.5 if below else 0.5) * words
        if any(abs(middle - other) < words for other in taken):
            continue
        taken.append(middle)
        of = f" ({plain(name, 16)})" if len(kinds) > 1 else ""
        look: Keywords = {"fontsize": _SMALL, "color": "0.25", "va": "top" if below else "bottom"}
        left = np.degrees(design.facts[0].angles[0]) + 0.5
        axis.text(left, height, f"{word}{of}", zorder=6, bbox=WHITE, **look)


def _lengths(axis: Axes, entry: PathFacts, colour: str) -> None:
    degrees = np.degrees(entry.angles)
    axis.plot(degrees, 1e3 * entry.length, color=colour, lw=0.7)
    axis.plot(degrees, 1e3 * entry.chain_length[:, 0], color=colour, lw=1.0, ls=_STYLES[0])
    axis.plot(degrees, 1e3 * entry.chain_length[:, -1], color=colour, lw=1.6)


def _arm(axis: Axes, entry: PathFacts, colour: str) -> None:
    axis.plot(np.degrees(entry.angles), 1e3 * entry.arm, color=colour, lw=1.6)
    row = entry.at(0.0)
    axis.plot(0.0, 1e3 * entry.arm[row], "o", color=colour, ms=3.2, mec="white", mew=0.5, zorder=5)


def _torque(axis: Axes, entry: PathFacts, colour: str) -> None:
    for column, style in enumerate(_STYLES):
        width = 1.6 if column == len(_STYLES) - 1 else 1.0
        axis.plot(np.degrees(entry.angles), entry.torque[:, column], color=colour, lw=width, ls=style)


def page(figure: Figure, design: Design) -> None:
    """Fill an empty figure of PAGE's size."""
    figure.set_layout_engine("none")
    scenario = design.built.scenario
    heading = f"{plain(scenario.orthosis.name or 'orthosis')} on {plain(scenario.leg.name or 'leg')}: design"
    figure.text(SIDE[0] / PAGE[0], 0.975, heading, fontsize=12.0, weight="bold", va="top")
    told = plain(scenario.orthosis.description, LINE + 60)
    figure.text(SIDE[0] / PAGE[0], 0.945, told, fontsize=8.0, va="top", color="0.25")
    scale = scale_of(design, SIDE)
    side_view(_axis(figure, SIDE), design, SIDE, scale)
    front_view(_axis(figure, _FRONT), design, _FRONT, scale)
    left, bottom, width, height = _CURVES
    each = (height - 3.0 * _PANEL_GAP) / 4.0
    boxes = [(left, bottom + (3 - k) * (each + _PANEL_GAP), width, each) for k in range(4)]
    _draw_curves([_axis(figure, box) for box in boxes], design)
    _draw_table(_axis(figure, _TABLE), design)


def _axis(figure: Figure, box: Box) -> Axes:
    left, bottom, width, height = box
    return figure.add_axes((left / PAGE[0], bottom / PAGE[1], width / PAGE[0], height / PAGE[1]))


def check_files(paths: Sequence[pathlib.Path], *, force: bool = False, view: str = _DESIGN) -> None:
    """Refuse files that cannot be written, or that are there already, before anything is computed."""
    for path in paths:
        if path.suffix.lower().removeprefix(".") not in VIEWS[view]:
            allowed = f"a name that ends in {', '.join(f'.{each}' for each in VIEWS[view])}"
            raise InputError("is not a format of a drawing", file=path, allowed=allowed)
        if path.is_dir():
            raise InputError("is a folder, and a file of that name is to be written", file=path)
        if path.exists() and not force:
            raise InputError("is there already", file=path, allowed="another name, or --force to replace it")
        check_writable(path.parent)


def write_drawing(design: Design, path: pathlib.Path) -> None:
    """Draw a design and write it, whole or not at all."""
    if path.suffix.lower() != f".{_RERUN}":
        return write_page(path, PAGE, functools.partial(page, design=design))
    from afo_sim.show.rerun.design_recording import write_design

    with replacing(path) as temporary:
        write_design(design, temporary)


@overload
def draw(
    orthosis: Source,
    out: str | os.PathLike[str] | None = None,
    *,
    leg: str | None = None,
    pressure: float | str | None = None,
    view: Literal["design"] = "design",
) -> Design: ...


@overload
def draw(
    orthosis: Source,
    out: str | os.PathLike[str] | None = None,
    *,
    leg: str | None = None,
    pressure: float | str | None = None,
    view: Literal["air"],
) -> AirScheme: ...


def draw(
    orthosis: Source,
    out: str | os.PathLike[str] | None = None,
    *,
    leg: str | None = None,
    pressure: float | str | None = None,
    view: Literal["design", "air"] = "design",
) -> Design | AirScheme:
    """Draw an orthosis on its leg to scale, with dimensions and its muscles' behaviour over the angle.

    The view "air" is a schematic of its air path instead, from the source to the muscles.

    Parameters
    ----------
    orthosis : a shipped orthosis or scenario, the TOML file or folder of one, an Orthosis or a Scenario
    out : file to write, replaced whole: png, pdf or svg, or rrd of a design for the Rerun viewer; by default
        nothing
    leg : of a design: a shipped name or a file; the scenario's own by default
    pressure : gauge, [Pa] or text such as "4 bar"; the scenario's supply by default
    view : "design" or "air"

    Returns
    -------
    Design: `facts` (lengths, contraction, moment arm, torque of every group), `through` and `warnings`. Of
    the view "air" AirScheme: `nodes`, `edges`, and of every chamber the ways of `filling` and `venting` with
    their `conductance` [m³/(s·Pa)] and `narrowest` part

    Raises
    ------
    InputError
        The orthosis or view does not exist, has no muscle or cannot be built; the suffix is not a format.

    Examples
    --------
    >>> front = draw("s1", pressure="4 bar").facts[0]
    >>> front.name, round(1000 * front.arm[front.at(0.0)])  # [mm]
    ('dorsiflexor', 65)
    >>> draw("s1_waist", view="air").filling["dorsiflexor"].narrowest
    'dorsiflexor inlet'
    """
    path = None if out is None else pathlib.Path(out)
    if view not in VIEWS:
        raise unknown(view, VIEWS, field="view", problem="is not a valid view")
    if path is not None:
        check_files([path], force=True, view=view)
    if view == AIR:
        refuse_leg(leg)
        scheme = scheme_of(orthosis, pressure)
        if path is not None:
            write_air(scheme, path)
        return scheme
    found = design(orthosis, leg=leg, pressure=pressure)
    if path is not None:
        write_drawing(found, path)
    return found


def refuse_leg(leg: str | None, field: str = "leg") -> None:
    """Refuse a leg where an air path is drawn, which has none."""
    if leg is not None:
        problem = "has no effect: the air path is the orthosis' own"
        raise InputError(problem, field=field, value=leg, allowed="no leg")

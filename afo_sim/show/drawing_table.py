"""The table below a design's views: every muscle group in a line, with the kind of each number's source."""

import textwrap
from typing import Any

from afo_sim.description.quantity import Described
from afo_sim.model.design import Design
from afo_sim.model.path_facts import PathFacts
from afo_sim.model.path_words import arm, own, peak, pressure, taut, torques
from afo_sim.show.drawing_views import colours
from afo_sim.show.style import RED, plain

KINDS = {"assumed": "a", "derived": "d", "fitted": "f", "published": "p", "user": "u"}
FOOT = (
    "(a) assumed, (d) derived, (f) fitted, (p) published, (u) your own; unmarked: no source told. "
    "Path, angles, contractions, arms and torques are computed from these, at rest and without friction."
)
FONT = 7.0
LINES = 9  # below the head
PAGE_WIDTH, GAP = 792.0, 7.0  # of the table, and least between columns [points]
LEAST_WARNINGS = 2  # lines that the groups leave to warnings
WIDTH = 190  # letters of a line


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
    """A number with the letter of its source's kind; none where no source is told."""
    origin = described.provenance.get(key)
    return text if origin is None else f"{text} ({KINDS.get(origin.kind, origin.kind)})"


def sources(design: Design) -> str:
    """The kinds of the numbers that are drawn and not in the table, in a line."""
    told = []
    for kind in {entry.group.type.name: entry.group.type for entry in design.facts}.values():
        length = marked(f"{1e3 * kind.total_length:.0f} mm", kind, "total_length")
        ends = marked(f"ends {1e3 * kind.end_length:.0f} mm", kind, "end_length")
        told.append(f"{plain(kind.name, 20)}: {length}, {ends}, {marked('bore', kind, 'bore')}")
    for segment, mounting in design.built.scenario.orthosis.anchor.items():
        part = "cuff" if segment == "shank" else "plate"
        if mounting.stiffness is not None:
            stiffness = f"{1e-3 * mounting.stiffness:.4g} kN/m"
            told.append(f"{part} {marked(stiffness, mounting, 'stiffness')}")
        else:
            told.append(f"{part} stiffens")
    if not design.built.scenario.orthosis.anchor:
        told.append("cuff and plate rigid")
    return "; ".join(told)


def draw_table(axis: Any, design: Design) -> None:
    """Head, rows, warnings and the foot, from above, on an axis of the page's width."""
    axis.set_axis_off()
    axis.set_xlim(0.0, 1.0)
    axis.set_ylim(LINES + 2.4, 0.0)
    head, rows = table(design)
    most = LINES - 2 - (LEAST_WARNINGS if design.warnings else 0)
    shown = rows if len(rows) <= most else rows[: most - 1]
    widths = [max(map(_width, column)) for column in zip(head, *rows, strict=True)]
    gap = max((PAGE_WIDTH - sum(widths)) / (len(widths) - 1), GAP)
    total = sum(widths) + gap * (len(widths) - 1)
    edges = [sum(widths[:k]) + gap * k for k in range(len(widths))]
    size = FONT * min(1.0, PAGE_WIDTH / total)
    for edge, text in zip(edges, head, strict=True):
        axis.text(edge / total, 1.9, text, fontsize=size, va="bottom", weight="bold", linespacing=1.05)
    axis.plot([0.0, 1.0], [2.0, 2.0], color="0.4", lw=0.5)
    named = list(colours(design).values())
    at = 2.8
    for row, colour in zip(shown, named, strict=False):
        for k, (edge, text) in enumerate(zip(edges, row, strict=True)):
            look: dict[str, Any] = {"color": colour, "weight": "bold"} if k == 0 else {}
            axis.text(edge / total, at, text, fontsize=size, va="center", **look)
        at += 1.0
    if len(rows) > len(shown):
        text = f"… and {len(rows) - len(shown)} more: afo-sim check tells them"
        axis.text(0.0, at, text, fontsize=FONT, va="center")
        at += 1.0
    for line in _warned(design, int(LINES + 0.8 - at)):
        axis.text(0.0, at, line, fontsize=FONT, va="center", color=RED)
        at += 1.0
    axis.text(0.0, LINES + 0.9, plain(sources(design), WIDTH), fontsize=FONT - 0.5, va="center", color="0.25")
    axis.text(0.0, LINES + 1.8, FOOT, fontsize=FONT - 0.5, va="center", color="0.25")


def _width(cell: str) -> float:
    """Width of a cell's widest line in bold letters [points]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=FONT, weight="bold")
    return max(
        float(text_to_path.get_text_width_height_descent(line, font, False)[0]) for line in cell.split("\n")
    )


def _warned(design: Design, room: int) -> list[str]:
    """Warnings in so many lines at most."""
    lines = []
    for warning in design.warnings:
        first, *others = textwrap.wrap(plain(warning, None), WIDTH - 4)
        lines += [f"! {first}", *(f"   {other}" for other in others)]
    if len(lines) > room:
        kept = max(room - 1, 0)
        lines = [*lines[:kept], f"! {len(lines) - kept} more lines of warnings: afo-sim check tells them"]
    return lines

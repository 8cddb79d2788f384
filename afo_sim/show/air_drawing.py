"""The picture of an air path: its parts as boxes in layers by their distance from the source.

Two neighbours are always one layer apart, since every line joins a node and an edge: no line meets a box.
"""

import pathlib
import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from afo_sim.common import Keywords, gauge
from afo_sim.description import AMBIENT
from afo_sim.model import AirEdge, AirScheme, AirWay, Source, conductance, scenario_of
from afo_sim.model.air_scheme import air_scheme
from afo_sim.show.style import COLOURS, ORANGE, Axes, Figure, ink, plain, width_of, write_page
from afo_sim.show.style import LINE as PAGE_LETTERS

_FONT, _LINE, _LONGEST = 6.6, 0.118, 51  # of a label [points], its line [inch], letters that are kept
_PAD, _BETWEEN, _CHANNEL = 0.06, 0.14, 0.42  # in a box, between boxes, and between layers [inch]
_VENT = 0.2  # below a box that leads to the ambient air [inch]
_SWEEPS = 40  # over the layers, to put every box beside its neighbours
NARROW = "narrowest"
_WORDS = {"valve": "2/2 valve", "valve_3_2": "3/2", "chamber": "", "point": ""}  # of kinds
_WRAP = textwrap.TextWrapper(20)
_WRAP.wordsep_re = re.compile(r"(\s+|[^\s_]*_+)")  # broken at spaces and underscores

_Point = tuple[float, float]
_LEAST_WIDTH, _BORDER, _HEAD, _FOOT = 7.3, 0.35, 0.62, 0.2  # of the page, above picture and caption [inch]
_CAPTION, _CAPTION_LINE = 7.5, 0.125  # letters [points], height of a line [inch]
_LETTER = 0.0545  # mean width of a letter of the caption [inch]
_PALE, _NODE = "#FDE9D9", "0.95"  # behind the narrowest, behind a node
INK, THIN, WIDE = "0.1", 1.0, 1.9
_ARROW = {"color": INK, "lw": THIN, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
_UNIT = "dm³/(s·bar)"
_LEGEND = (
    "C: sonic conductance of air in dm³/(s·bar), b: critical pressure ratio (ISO 6358), of the open part. "
    "Together C = 1/√(Σ1/C²). Pressures are gauge. Round boxes have a pressure, air flows through square "
    "ones, one way along an arrow. Triangle: ambient air. Lines that cross do not meet."
)


@dataclass(frozen=True)
class Box:
    """A node or an edge on the page, its middle in the plane below (0, 0) [inch]."""

    lines: tuple[str, ...]
    bold: int
    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True)
class Layout:
    """Boxes by name, and (node, edge, end at the node, end at the edge) of every line."""

    boxes: dict[str, Box]
    lines: list[tuple[str, str, _Point, _Point]]
    width: float
    height: float


def layout(scheme: AirScheme) -> Layout:
    """Place an air path's parts and lines."""
    beside: dict[str, list[str]] = {name: [] for name in (*scheme.nodes, *scheme.edges) if name != AMBIENT}
    links = [(node, name) for name, edge in scheme.edges.items() for node in edge.ends if node != AMBIENT]
    for node, edge in links:
        beside[node].append(edge)
        beside[edge].append(node)
    layers = _layers(scheme.origin, beside)
    labels = {name: label(scheme, name) for name in beside}
    tall = {name: _LINE * len(lines) + 2.0 * _PAD for name, (lines, _) in labels.items()}
    vents = {name for name, edge in scheme.edges.items() if AMBIENT in edge.ends}
    below = {name: _VENT * (name in vents) for name in beside}
    y = _heights(layers, beside, {name: tall[name] + _BETWEEN + below[name] for name in beside})
    top = max(y[name] + 0.5 * tall[name] for name in beside)
    boxes, left = {}, 0.0
    for layer in layers:
        wide = max(_width(*labels[name]) for name in layer) + 2.0 * _PAD
        for name in layer:
            boxes[name] = Box(*labels[name], left + 0.5 * wide, y[name] - top, wide, tall[name])
        left += wide + _CHANNEL
    height = max(0.5 * box.height - box.y + below[name] for name, box in boxes.items())
    return Layout(boxes, [(*link, *_ends(boxes, beside, *link)) for link in links], left - _CHANNEL, height)


def _layers(origin: str, beside: dict[str, list[str]]) -> list[list[str]]:
    """Names by steps from the origin, in each layer in the order in which air comes to them."""
    steps: dict[str, int] = {}
    for start in (origin, *beside):
        queue = {start: 0} if start not in steps else {}
        while queue:
            steps |= queue
            ahead = {other: step + 1 for name, step in queue.items() for other in beside[name]}
            queue = {name: step for name, step in ahead.items() if name not in steps}
    return [[name for name in steps if steps[name] == k] for k in range(1 + max(steps.values()))]


def _heights(
    layers: list[list[str]], beside: dict[str, list[str]], room: dict[str, float]
) -> dict[str, float]:
    """Of every box, as near to its neighbours' mean as its layer lets it; sorts the layers."""
    from scipy.optimize import isotonic_regression

    y = {name: -float(k) for layer in layers for k, name in enumerate(layer)}
    for sweep in range(_SWEEPS):
        for layer in layers if sweep % 2 == 0 else layers[::-1]:
            wish = {name: float(np.mean([y[o] for o in beside[name]] or [y[name]])) for name in layer}
            layer.sort(key=wish.__getitem__, reverse=True)
            size = np.array([room[name] for name in layer])
            least = 0.5 * size - np.cumsum(size)  # of boxes without room between them
            found = isotonic_regression([wish[name] for name in layer] - least, increasing=False).x + least
            y |= dict(zip(layer, found.tolist(), strict=True))
    return y


def _ends(boxes: dict[str, Box], beside: dict[str, list[str]], node: str, edge: str) -> tuple[_Point, _Point]:
    """Of a line: the middle of a node's side, and its own port of an edge."""
    a, b = boxes[node], boxes[edge]
    side = 0.5 if a.x < b.x else -0.5
    ports = sorted((-boxes[each].y, each) for each in beside[edge] if (boxes[each].x < b.x) == (a.x < b.x))
    share = 0.5 - (1 + ports.index((-a.y, node))) / (1 + len(ports))
    return (a.x + side * a.width, a.y), (b.x - side * b.width, b.y + share * b.height)


def label(scheme: AirScheme, name: str) -> tuple[tuple[str, ...], int]:
    """Lines of a part's label, and how many of them are its name."""
    part = scheme.nodes.get(name) or scheme.edges[name]
    edge = part if isinstance(part, AirEdge) else None
    title = _WRAP.wrap(plain(part.name if edge is None else edge.label, _LONGEST))
    kind = _WORDS.get(part.kind, part.kind).replace("_", " ")
    told = " ".join((*title, *part.lines)).replace("_", " ")
    lines = [*([] if kind.removeprefix("2/2 ") in told else [kind]), *part.lines]
    if edge is not None and edge.forward < float("inf"):
        c = edge.back if edge.kind == "throttle" else edge.forward
        lines.append(f"C {conductance(c)}, b {edge.ratio:.2g}")
        if edge.exhaust:
            lines.append(f"out {conductance(edge.venting)}, {edge.venting_ratio:.2g}")
    if name in scheme.narrowest:
        title = [NARROW, *title]
    return (*title, *(each for line in lines for each in _WRAP.wrap(plain(line, _LONGEST)))), len(title)


def _width(lines: tuple[str, ...], bold: int) -> float:
    """Of a label [inch]."""
    shown = ((line.replace(r"\$", "$"), k < bold) for k, line in enumerate(lines))
    return max(1.03 * width_of(line, _FONT, bold=thick) / 72.0 for line, thick in shown)


def write_air(scheme: AirScheme, path: pathlib.Path) -> None:
    """Draw an air path and write it, whole or not at all; PNG, PDF or SVG by the file's suffix."""
    write_page(path, *page(scheme))


def page(scheme: AirScheme) -> tuple[tuple[float, float], Callable[[Figure], None]]:
    """Width and height [inch], and what fills an empty figure of this size."""
    found = layout(scheme)
    width = max(_LEAST_WIDTH, found.width + 2.0 * _BORDER)
    texts = [*(text.replace(f" {_UNIT}", "") for text in ways(scheme)), _LEGEND]
    letters = int((width - 2.0 * _BORDER) / _LETTER)
    caption = [line for text in texts for line in textwrap.wrap(text, letters)]
    height = _HEAD + found.height + _FOOT + _CAPTION_LINE * len(caption) + _BORDER

    def fill(figure: Figure) -> None:
        figure.set_layout_engine("none")
        x = _BORDER / width
        told = plain(scheme.description, min(PAGE_LETTERS + 60, int((width - 2.0 * _BORDER) / 0.06)))
        title = f"{plain(scheme.name)}: air path"
        figure.text(x, 1.0 - 0.2 / height, title, fontsize=12.0, weight="bold", va="top")
        figure.text(x, 1.0 - 0.42 / height, told, fontsize=8.0, va="top", color="0.25")
        for k, line in enumerate(caption):
            top = _HEAD + found.height + _FOOT + k * _CAPTION_LINE
            figure.text(x, 1.0 - top / height, line, fontsize=_CAPTION, va="top", color="0.15")
        axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        aside = 0.5 * (width - found.width)
        axis.set(xlim=(-aside, width - aside), ylim=(_HEAD - height, _HEAD))
        axis.set_axis_off()
        for node, edge, *ends in found.lines:
            style = "-|>" if scheme.edges[edge].leads_to(node) else "-"
            axis.annotate("", *ends, arrowprops={"arrowstyle": style, **_ARROW})
        for name, box in found.boxes.items():
            _draw_box(axis, scheme, name, box)

    return (width, height), fill


def _draw_box(axis: Axes, scheme: AirScheme, name: str, box: Box) -> None:
    """A box with its label: round for a node, thick in its colour for a muscle and for the narrowest."""
    from matplotlib.patches import FancyBboxPatch, Polygon

    x, y, half = box.x, box.y, 0.5 * box.height
    chambers = [name for name, node in scheme.nodes.items() if node.kind == "chamber"]
    look: Keywords = {"edgecolor": INK, "lw": THIN, "facecolor": "white"}
    style = "square,pad=0"
    if name in scheme.nodes:
        look, style = look | {"facecolor": _NODE}, "round,pad=0,rounding_size=0.09"
    if name in chambers:  # the colour of its muscles in the design picture
        look |= {"lw": WIDE, "edgecolor": COLOURS[chambers.index(name) % len(COLOURS)]}
    if name in scheme.narrowest:
        look |= {"lw": WIDE, "edgecolor": ORANGE, "facecolor": _PALE}
    axis.add_patch(FancyBboxPatch((x - 0.5 * box.width, y - half), box.width, box.height, style, **look))
    if name in scheme.edges and AMBIENT in scheme.edges[name].ends:
        low = y - half - 0.06
        axis.plot((x, x), (y - half, low), color=INK, lw=THIN)
        corners = [(x - 0.055, low), (x + 0.055, low), (x, low - 0.1)]
        axis.add_patch(Polygon(corners, facecolor="white", edgecolor=INK, lw=THIN, zorder=4))
    for k, line in enumerate(box.lines):
        bold = k < box.bold
        colour = ink(ORANGE) if line == NARROW else "black" if bold else "0.2"
        words: Keywords = {"fontsize": _FONT, "ha": "center", "va": "center", "color": colour}
        axis.text(x, y + half - _PAD - (k + 0.5) * _LINE, line, weight="bold" if bold else "normal", **words)


def ways(scheme: AirScheme) -> list[str]:
    """Conductance of the ways of each chamber's air, and the narrowest part on them, a text a chamber."""
    found = {name: f"filling {_told(way)}" for name, way in scheme.filling.items()}
    vents = {name: f"; venting {_told(way)}" for name, way in scheme.venting.items()}
    return [f"{plain(name)}: {words}{vents.get(name, '')}." for name, words in found.items()]


def _told(way: AirWay) -> str:
    """A way in words: "C 0.0545 dm³/(s·bar) of 3 parts, the narrowest: feed (C 0.0551, 98 % of Σ1/C²)"."""
    if not way.edges:
        return "without restriction"
    narrowest, total = plain(way.narrowest, None), f"C {conductance(way.conductance)} {_UNIT}"
    if len(way.edges) == 1:
        return f"through {narrowest} alone, {total}"
    least = f"C {conductance(dict(way.edges)[way.narrowest])}, {100.0 * way.share:.0f} % of Σ1/C²"
    return f"{total} of {len(way.edges)} parts, the narrowest: {narrowest} ({least})"


def scheme_of(source: Source, pressure: float | str | None = None) -> AirScheme:
    """The air path of an orthosis, or of a scenario's on its supply."""
    scenario, pressure = scenario_of(source, None), None if pressure is None else gauge(pressure)
    if pressure is not None:
        scenario = scenario.set({"supply.pressure": f"{pressure!r} Pa"})
    return air_scheme(scenario.orthosis, scenario.supply)

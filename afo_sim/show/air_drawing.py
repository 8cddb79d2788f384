"""The picture of an air path: its parts as symbols, the lines between them, the narrowest on each way."""

import functools
import itertools
import pathlib
import re
import textwrap
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.description import AMBIENT
from afo_sim.model import AirEdge, AirScheme, AirWay, Source, conductance, gauge, scenario_of
from afo_sim.model.air_scheme import air_scheme
from afo_sim.show.air_routes import Cell, Routes, Vertex, cells, ports, route
from afo_sim.show.air_symbols import DROP, INK, SYMBOLS, THIN, TRIANGLE, WIDE, Pen, Symbol
from afo_sim.show.style import COLOURS, ORANGE, ink, plain, write_page
from afo_sim.show.style import LINE as PAGE_LETTERS

_FONT, _LINE = 6.6, 0.108  # of a label [points], height of its line
_LETTERS = 17  # of a line of a name
_LONGEST = 51  # letters of a name that are kept
_PITCH, _MARGIN = 0.09, 0.08  # between tracks, and beside the outermost ones
_ABOVE = 0.04  # between a symbol and its label
NARROW = "narrowest"


@dataclass(frozen=True)
class _Placed:
    """A part on the page."""

    cell: Cell
    kind: str
    symbol: Symbol
    lines: tuple[str, ...]
    bold: int
    x: float
    y: float

    @property
    def top(self) -> float:
        """Lower edge of its label."""
        return self.y + self.symbol.up + _ABOVE

    def port(self, side: str) -> tuple[float, float]:
        """Where its line begins."""
        if side == "low":
            return self.x + self.symbol.low[0], self.y + self.symbol.low[1]
        return self.x + (self.symbol.half if side == "right" else -self.symbol.half), self.y


@dataclass(frozen=True)
class Layout:
    """All parts, and the lines between them, in the lower right quarter of the plane below (0, 0)."""

    placed: dict[str, _Placed]
    routes: Routes
    x: np.ndarray
    y: np.ndarray
    moved: dict[Vertex, float]  # abscissae of third ports, which stand beside their column's middle

    @property
    def width(self) -> float:
        """Of all of it."""
        return float(self.x[-1])

    @property
    def height(self) -> float:
        """Of all of it."""
        return -float(self.y[-1])

    def at(self, vertex: Vertex) -> tuple[float, float]:
        """A vertex on the page."""
        return self.moved.get(vertex, float(self.x[vertex[0]])), float(self.y[vertex[1]])


def layout(scheme: AirScheme) -> Layout:
    """Place an air path's parts and lines."""
    found = cells(scheme)
    routes = route(found)
    labels = {cell.name: label(scheme, cell) for cell in found}
    kinds = {cell.name: _kind_of(scheme, cell) for cell in found}
    n_column, n_row = routes.tracks.size
    halves, up, down = np.full(n_column, 0.15), np.zeros(n_row), np.zeros(n_row)
    for cell in found:
        symbol, (column, row) = SYMBOLS[kinds[cell.name]][1], cell.place
        lines, bold = labels[cell.name]
        halves[column] = max(halves[column], _half(cell, symbol, lines, bold))
        up[row] = max(up[row], symbol.up + _ABOVE + _LINE * len(lines))
        drop = 0.26 if AMBIENT in (cell.left, cell.right) else 0.0
        drop = 0.2 - symbol.low[1] if cell.low == AMBIENT else drop
        down[row] = max(down[row], symbol.down, drop)
    x = _spaced(routes, halves, halves, 0)
    y = -_spaced(routes, up, down, 1)
    placed = {}
    for cell in found:
        kind, (lines, bold) = kinds[cell.name], labels[cell.name]
        column, row = (routes.tracks.middle(k) for k in cell.place)
        at = float(x[column]), float(y[row])
        placed[cell.name] = _Placed(cell, kind, SYMBOLS[kind][1], lines, bold, *at)
    moved = {routes.tracks.port(cell, "low"): placed[cell.name].port("low")[0] for cell in found if cell.low}
    return Layout(placed, routes, x, y, moved)


def _half(cell: Cell, symbol: Symbol, lines: tuple[str, ...], bold: int) -> float:
    """Half the width that a part needs."""
    text = max((0.5 * width(line, k < bold) for k, line in enumerate(lines)), default=0.0)
    side = DROP + 0.6 * TRIANGLE if AMBIENT in (cell.left, cell.right) else 0.04
    low = abs(symbol.low[0]) + 0.6 * TRIANGLE if cell.low else 0.0
    return max(text + 0.02, symbol.half + side, low)


def _spaced(routes: Routes, before: np.ndarray, behind: np.ndarray, axis: int) -> np.ndarray:
    """Distances of all tracks and middles from the first edge; tracks without a line take no room."""
    tracks, used = routes.tracks, _used(routes, axis)
    places, edge = [], 0.0
    for channel in range(tracks.size[axis] + 1):
        lines = [k for k in range(tracks.n) if tracks.track(channel, k) in used]
        outer = channel in (0, tracks.size[axis])
        if lines or not outer:
            at = edge + _MARGIN
            here = [at + _PITCH * sum(line < k for line in lines) for k in range(tracks.n)]
            last = at + _PITCH * max(len(lines) - 1, 0)
            places += [min(each, last) for each in here]
            edge = last + _MARGIN
        else:
            places += [edge] * tracks.n
        if channel < tracks.size[axis]:
            places.append(edge + before[channel])
            edge += before[channel] + behind[channel]
    return np.array([*places[:-1], max(places[-1], edge)])


def _used(routes: Routes, axis: int) -> set[int]:
    """Indices of the tracks along which a line goes."""
    pieces = itertools.chain.from_iterable(routes.lines.values())
    return {a[axis] for a, b in pieces if a != b and (a[1] == b[1]) == (axis == 1)}


def _kind_of(scheme: AirScheme, cell: Cell) -> str:
    """The symbol that a part has."""
    return scheme.nodes[cell.name].kind if cell.node else scheme.edges[cell.name].kind


def label(scheme: AirScheme, cell: Cell) -> tuple[tuple[str, ...], int]:
    """Lines of a part's label, and how many of them are its name."""
    if cell.node:
        node = scheme.nodes[cell.name]
        name = _wrapped(node.name)
        return (*name, *(part for line in node.lines for part in _wrapped(line))), len(name)
    edge = scheme.edges[cell.name]
    name = _wrapped(edge.label)
    if cell.name in scheme.narrowest:
        name = [NARROW, *name]
    lines = [part for line in (*edge.lines, *_figures(edge)) for part in _wrapped(line)]
    return (*name, *lines), len(name)


def _figures(edge: AirEdge) -> list[str]:
    """C and b of an edge, of a 3/2 valve and a quick exhaust both ways."""
    if edge.forward == float("inf"):
        return []
    c = edge.back if edge.kind == "throttle" else edge.forward
    found = [f"C {conductance(c)}, b {edge.ratio:.2g}"]
    if edge.exhaust:
        found.append(f"out {conductance(edge.venting)}, {edge.venting_ratio:.2g}")
    return found


def _wrapped(text: str) -> list[str]:
    """A text in lines of a label, broken at spaces and underscores; words too long for a line are cut."""
    found = [""]
    for word in re.findall(r"[^ _]*_+|[^ _]+|_+", " ".join(plain(text, _LONGEST).split())):
        for part in [word[k : k + _LETTERS] for k in range(0, len(word), _LETTERS)]:
            joined = found[-1] + part if found[-1].endswith("_") else f"{found[-1]} {part}".strip()
            if len(joined) <= _LETTERS:
                found[-1] = joined
            else:
                found.append(part)
    return [line for line in found if line]


@functools.cache
def width(text: str, bold: bool = False) -> float:
    """Of a line of a label [inch]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    font = FontProperties(size=_FONT, weight="bold" if bold else "normal")
    points, _, _ = TextToPath().get_text_width_height_descent(text.replace(r"\$", "$"), font, ismath=False)
    return 1.03 * float(points) / 72.0


_BORDER, _HEAD, _FOOT = 0.35, 0.62, 0.2  # of the page, its heading, above the caption [inch]
_LEAST_WIDTH = 7.3  # of the page [inch]
_CAPTION, _CAPTION_LINE = 7.5, 0.125  # letters [points], height of a line [inch]
_LETTER = 0.0545  # mean width of a letter of the caption [inch]
_PALE = "#FDE9D9"  # behind the narrowest
_UNIT = "dm³/(s·bar)"
_LEGEND = (
    "C: sonic conductance of air in dm³/(s·bar), b: critical pressure ratio (ISO 6358), of the open part. "
    "Together C = 1/√(Σ1/C²). Pressures are gauge. Open triangle: ambient air. Lines that cross without a "
    "dot do not meet."
)


def write_air(scheme: AirScheme, path: pathlib.Path) -> None:
    """Draw an air path and write it, whole or not at all; PNG, PDF or SVG by the file's suffix."""
    found = layout(scheme)
    size = page_size(scheme, found)
    write_page(path, size, functools.partial(page, scheme=scheme, found=found))


def page_size(scheme: AirScheme, found: Layout) -> tuple[float, float]:
    """Width and height [inch]."""
    width = max(_LEAST_WIDTH, found.width + 2.0 * _BORDER)
    lines = len(_caption(scheme, width))
    return width, _HEAD + found.height + _FOOT + _CAPTION_LINE * lines + _BORDER


def page(figure: Any, scheme: AirScheme, found: Layout) -> None:
    """Fill an empty figure of the page's size."""
    figure.set_layout_engine("none")
    width, height = page_size(scheme, found)
    x = _BORDER / width
    heading = f"{plain(scheme.name)}: air path"
    figure.text(x, 1.0 - 0.2 / height, heading, fontsize=12.0, weight="bold", va="top")
    told = plain(scheme.description, min(PAGE_LETTERS + 60, int((width - 2.0 * _BORDER) / 0.06)))
    figure.text(x, 1.0 - 0.42 / height, told, fontsize=8.0, va="top", color="0.25")
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    aside = 0.5 * (width - found.width)
    axis.set_xlim(-aside, width - aside)
    axis.set_ylim(_HEAD - height, _HEAD)
    axis.set_axis_off()
    _draw_lines(axis, found)
    colours = _colours(scheme)
    for part in found.placed.values():
        _draw_part(axis, scheme, part, colours.get(part.cell.name, ""))
    top = _HEAD + found.height + _FOOT
    for k, line in enumerate(_caption(scheme, width)):
        look: dict[str, Any] = {"fontsize": _CAPTION, "va": "top", "color": "0.15"}
        figure.text(x, 1.0 - (top + k * _CAPTION_LINE) / height, line, **look)


def _colours(scheme: AirScheme) -> dict[str, str]:
    """A colour for every chamber, that of its muscles in the design picture."""
    chambers = [name for name, node in scheme.nodes.items() if node.kind == "chamber"]
    return {name: COLOURS[(1 - k) % len(COLOURS)] for k, name in enumerate(chambers)}


def _draw_lines(axis: Any, found: Layout) -> None:
    """Lines from port to port, with a dot where three meet."""
    from matplotlib.collections import LineCollection

    pieces = []
    for lines in found.routes.lines.values():
        met: dict[tuple[int, int], int] = {}
        for a, b in lines:
            pieces.append([found.at(a), found.at(b)])
            for end in (a, b) if a != b else ():
                met[end] = met.get(end, 0) + 1
        for part in found.placed.values():
            for side, _ in ports(part.cell):
                vertex = found.routes.tracks.port(part.cell, side)
                if any(vertex in line for line in lines):
                    pieces.append([part.port(side), found.at(vertex)])
                    met[vertex] = met.get(vertex, 0) + 1
        dots = [found.at(vertex) for vertex, count in met.items() if count > 2]
        if dots:
            x, y = zip(*dots, strict=True)
            axis.plot(x, y, "o", color=INK, ms=3.2, zorder=4)
    axis.add_collection(LineCollection(pieces, colors=INK, lw=THIN, capstyle="projecting", zorder=3))


def _draw_part(axis: Any, scheme: AirScheme, part: _Placed, colour: str) -> None:
    """A symbol with its label; on a pale ground and in thick lines where it is the narrowest."""
    cell, narrow = part.cell, part.cell.name in scheme.narrowest
    draw, symbol = SYMBOLS[part.kind]
    if narrow:
        _ground(axis, part)
    edge = scheme.edges.get(cell.name)
    mirrored = edge is not None and not cell.node and edge.upstream == cell.right and bool(cell.right)
    pen = Pen(axis, part.x, part.y, mirrored=mirrored, width=WIDE if narrow else THIN)
    marks = frozenset({colour} if colour else ()) if edge is None or cell.node else edge.marks
    draw(pen, marks)
    upright = Pen(axis, part.x, part.y)
    for side, node in (("left", cell.left), ("right", cell.right)):
        if node == AMBIENT:
            sign = 1.0 if side == "right" else -1.0
            upright.line((sign * symbol.half, 0.0), (sign * (symbol.half + DROP), 0.0))
            upright.ambient(sign * (symbol.half + DROP), 0.0)
    if cell.low == AMBIENT:
        upright.ambient(*symbol.low)
    for k, line in enumerate(reversed(part.lines)):
        name = k >= len(part.lines) - part.bold
        look: dict[str, Any] = {"fontsize": _FONT, "ha": "center", "va": "baseline", "zorder": 7}
        look |= {"weight": "bold" if name else "normal", "color": "black" if name else "0.2"}
        look |= {"color": ink(ORANGE)} if line == NARROW else {}
        axis.text(part.x, part.top + k * _LINE + 0.02, line, **look)


def _ground(axis: Any, part: _Placed) -> None:
    from matplotlib.patches import Rectangle

    half, low, high = part.symbol.half + 0.03, -part.symbol.down - 0.02, part.symbol.up + 0.02
    look: dict[str, Any] = {"facecolor": _PALE, "edgecolor": ORANGE, "lw": 1.0, "zorder": 1}
    axis.add_patch(Rectangle((part.x - half, part.y + low), 2.0 * half, high - low, **look))


def ways(scheme: AirScheme) -> list[str]:
    """Conductance of the ways of each chamber's air, and the narrowest part on them, a text a chamber."""
    return [f"{plain(name)}: {_way(scheme, name)}." for name in scheme.filling]


def _way(scheme: AirScheme, name: str) -> str:
    words = f"filling {_told(scheme.filling[name])}"
    if name in scheme.venting:
        words += f"; venting {_told(scheme.venting[name])}"
    return words


def _told(way: AirWay) -> str:
    """A way in words: "C 0.0545 dm³/(s·bar) of 3 parts, the narrowest: feed (C 0.0551, 98 % of Σ1/C²)"."""
    if not way.edges:
        return "without restriction"
    narrowest = plain(way.narrowest, None)
    if len(way.edges) == 1:
        return f"through {narrowest} alone, C {conductance(way.conductance)} {_UNIT}"
    least = dict(way.edges)[way.narrowest]
    told = f"C {conductance(way.conductance)} {_UNIT} of {len(way.edges)} parts, the narrowest: {narrowest}"
    return f"{told} (C {conductance(least)}, {100.0 * way.share:.0f} % of Σ1/C²)"


def _caption(scheme: AirScheme, width: float) -> list[str]:
    letters = int((width - 2.0 * _BORDER) / _LETTER)
    texts = [*(text.replace(f" {_UNIT}", "") for text in ways(scheme)), _LEGEND]
    return [line for text in texts for line in textwrap.wrap(text, letters)]


def scheme_of(source: Source, pressure: float | str | None = None) -> AirScheme:
    """The air path of an orthosis, or of a scenario's on its supply."""
    scenario, pressure = scenario_of(source, None), gauge(pressure)
    if pressure is not None:
        scenario = scenario.set({"supply.pressure": f"{pressure!r} Pa"})
    return air_scheme(scenario.orthosis, scenario.supply)

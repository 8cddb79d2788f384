"""The air path on its page: labels wrapped and measured, columns and rows as large as they need [inch]."""

import functools
import itertools
import re
from dataclasses import dataclass

import numpy as np

from afo_sim.description.air.air_parts import AMBIENT
from afo_sim.model.air_scheme import AirEdge, AirScheme, conductance
from afo_sim.show.air_cells import Cell, cells
from afo_sim.show.air_routes import Routes, Vertex, route
from afo_sim.show.air_symbols import DROP, SYMBOLS, TRIANGLE, Symbol
from afo_sim.show.style import plain

FONT, LINE = 6.6, 0.108  # of a label [points], height of its line
LETTERS = 17  # of a line of a name
LONGEST = 51  # letters of a name that are kept
PITCH, MARGIN = 0.09, 0.08  # between tracks, and beside the outermost ones
ABOVE = 0.04  # between a symbol and its label
NARROW = "narrowest"


@dataclass(frozen=True)
class Placed:
    """A part on the page.

    lines : of its label, from above; the first `bold` of them its name
    """

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
        return self.y + self.symbol.up + ABOVE

    def port(self, side: str) -> tuple[float, float]:
        """Where its line begins."""
        if side == "low":
            return self.x + self.symbol.low[0], self.y + self.symbol.low[1]
        return self.x + (self.symbol.half if side == "right" else -self.symbol.half), self.y


@dataclass(frozen=True)
class Layout:
    """All parts, and the lines between them, in the lower right quarter of the plane below (0, 0)."""

    placed: dict[str, Placed]
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
    kinds = {cell.name: kind_of(scheme, cell) for cell in found}
    n_column, n_row = routes.tracks.size
    halves, up, down = np.full(n_column, 0.15), np.zeros(n_row), np.zeros(n_row)
    for cell in found:
        symbol, (column, row) = SYMBOLS[kinds[cell.name]][1], cell.place
        lines, bold = labels[cell.name]
        halves[column] = max(halves[column], _half(cell, symbol, lines, bold))
        up[row] = max(up[row], symbol.up + ABOVE + LINE * len(lines))
        drop = 0.26 if AMBIENT in (cell.left, cell.right) else 0.0
        drop = 0.2 - symbol.low[1] if cell.low == AMBIENT else drop
        down[row] = max(down[row], symbol.down, drop)
    x = _spaced(routes, halves, halves, 0)
    y = -_spaced(routes, up, down, 1)
    placed = {}
    for cell in found:
        kind, (lines, bold) = kinds[cell.name], labels[cell.name]
        middle = (routes.tracks.middle(k) for k in cell.place)
        column, row = middle
        placed[cell.name] = Placed(cell, kind, SYMBOLS[kind][1], lines, bold, float(x[column]), float(y[row]))
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
            at = edge + MARGIN
            here = [at + PITCH * sum(line < k for line in lines) for k in range(tracks.n)]
            last = at + PITCH * max(len(lines) - 1, 0)
            places += [min(each, last) for each in here]
            edge = last + MARGIN
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


def kind_of(scheme: AirScheme, cell: Cell) -> str:
    """The symbol that a part has."""
    return scheme.nodes[cell.name].kind if cell.node else scheme.edges[cell.name].kind


def label(scheme: AirScheme, cell: Cell) -> tuple[tuple[str, ...], int]:
    """Lines of a part's label, and how many of them are its name."""
    if cell.node:
        node = scheme.nodes[cell.name]
        name = wrapped(node.name)
        return (*name, *(part for line in node.lines for part in wrapped(line))), len(name)
    edge = scheme.edges[cell.name]
    name = wrapped(edge.label)
    if cell.name in scheme.narrowest:
        name = [NARROW, *name]
    lines = [part for line in (*edge.lines, *figures(edge)) for part in wrapped(line)]
    return (*name, *lines), len(name)


def figures(edge: AirEdge) -> list[str]:
    """C and b of an edge, of a 3/2 valve and a quick exhaust both ways."""
    if edge.forward == float("inf"):
        return []
    c = edge.back if edge.kind == "throttle" else edge.forward
    found = [f"C {conductance(c)}, b {edge.ratio:.2g}"]
    if edge.exhaust:
        found.append(f"out {conductance(edge.venting)}, {edge.venting_ratio:.2g}")
    return found


def wrapped(text: str) -> list[str]:
    """A text in lines of a label, broken at spaces and underscores; words too long for a line are cut."""
    found = [""]
    for word in re.findall(r"[^ _]*_+|[^ _]+|_+", " ".join(plain(text, LONGEST).split())):
        for part in [word[k : k + LETTERS] for k in range(0, len(word), LETTERS)]:
            joined = found[-1] + part if found[-1].endswith("_") else f"{found[-1]} {part}".strip()
            if len(joined) <= LETTERS:
                found[-1] = joined
            else:
                found.append(part)
    return [line for line in found if line]


@functools.cache
def width(text: str, bold: bool = False) -> float:
    """Of a line of a label [inch]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    font = FontProperties(size=FONT, weight="bold" if bold else "normal")
    points, _, _ = TextToPath().get_text_width_height_descent(text.replace(r"\$", "$"), font, ismath=False)
    return 1.03 * float(points) / 72.0

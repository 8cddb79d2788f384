"""The picture of an air path: its parts as symbols, the lines between them, the narrowest on each way."""

import functools
import pathlib
import textwrap
from typing import Any

from afo_sim.description.air.air_parts import AMBIENT
from afo_sim.model.air_scheme import AirScheme, AirWay, air_scheme, conductance
from afo_sim.model.design import Source, gauge, scenario_of
from afo_sim.show.air_layout import FONT, LINE, NARROW, Layout, Placed, layout
from afo_sim.show.air_routes import ports
from afo_sim.show.air_symbols import DROP, INK, SYMBOLS, THIN, WIDE, Pen
from afo_sim.show.contrast import ink
from afo_sim.show.drawing_files import write_page
from afo_sim.show.style import COLOURS, ORANGE, plain
from afo_sim.show.style import LINE as LETTERS

BORDER, HEAD, FOOT = 0.35, 0.62, 0.2  # of the page, its heading, above the caption [inch]
LEAST_WIDTH = 7.3  # of the page [inch]
CAPTION, CAPTION_LINE = 7.5, 0.125  # letters [points], height of a line [inch]
LETTER = 0.0545  # mean width of a letter of the caption [inch]
PALE = "#FDE9D9"  # behind the narrowest
UNIT = "dm³/(s·bar)"
LEGEND = (
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
    width = max(LEAST_WIDTH, found.width + 2.0 * BORDER)
    lines = len(_caption(scheme, width))
    return width, HEAD + found.height + FOOT + CAPTION_LINE * lines + BORDER


def page(figure: Any, scheme: AirScheme, found: Layout) -> None:
    """Fill an empty figure of the page's size."""
    figure.set_layout_engine("none")
    width, height = page_size(scheme, found)
    x = BORDER / width
    heading = f"{plain(scheme.name)}: air path"
    figure.text(x, 1.0 - 0.2 / height, heading, fontsize=12.0, weight="bold", va="top")
    told = plain(scheme.description, min(LETTERS + 60, int((width - 2.0 * BORDER) / 0.06)))
    figure.text(x, 1.0 - 0.42 / height, told, fontsize=8.0, va="top", color="0.25")
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    aside = 0.5 * (width - found.width)
    axis.set_xlim(-aside, width - aside)
    axis.set_ylim(HEAD - height, HEAD)
    axis.set_axis_off()
    draw_lines(axis, found)
    colours = _colours(scheme)
    for part in found.placed.values():
        draw_part(axis, scheme, part, colours.get(part.cell.name, ""))
    top = HEAD + found.height + FOOT
    for k, line in enumerate(_caption(scheme, width)):
        look: dict[str, Any] = {"fontsize": CAPTION, "va": "top", "color": "0.15"}
        figure.text(x, 1.0 - (top + k * CAPTION_LINE) / height, line, **look)


def _colours(scheme: AirScheme) -> dict[str, str]:
    """A colour for every chamber, that of its muscles in the design picture."""
    chambers = [name for name, node in scheme.nodes.items() if node.kind == "chamber"]
    return {name: COLOURS[(1 - k) % len(COLOURS)] for k, name in enumerate(chambers)}


def draw_lines(axis: Any, found: Layout) -> None:
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


def draw_part(axis: Any, scheme: AirScheme, part: Placed, colour: str) -> None:
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
        look: dict[str, Any] = {"fontsize": FONT, "ha": "center", "va": "baseline", "zorder": 7}
        look |= {"weight": "bold" if name else "normal", "color": "black" if name else "0.2"}
        look |= {"color": ink(ORANGE)} if line == NARROW else {}
        axis.text(part.x, part.top + k * LINE + 0.02, line, **look)


def _ground(axis: Any, part: Placed) -> None:
    from matplotlib.patches import Rectangle

    half, low, high = part.symbol.half + 0.03, -part.symbol.down - 0.02, part.symbol.up + 0.02
    look: dict[str, Any] = {"facecolor": PALE, "edgecolor": ORANGE, "lw": 1.0, "zorder": 1}
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
        return f"through {narrowest} alone, C {conductance(way.conductance)} {UNIT}"
    least = dict(way.edges)[way.narrowest]
    told = f"C {conductance(way.conductance)} {UNIT} of {len(way.edges)} parts, the narrowest: {narrowest}"
    return f"{told} (C {conductance(least)}, {100.0 * way.share:.0f} % of Σ1/C²)"


def _caption(scheme: AirScheme, width: float) -> list[str]:
    letters = int((width - 2.0 * BORDER) / LETTER)
    texts = [*(text.replace(f" {UNIT}", "") for text in ways(scheme)), LEGEND]
    return [line for text in texts for line in textwrap.wrap(text, letters)]


def scheme_of(source: Source, pressure: float | str | None = None) -> AirScheme:
    """The air path of an orthosis, or of a scenario's on its supply.

    Parameters
    ----------
    source : a shipped orthosis or scenario, the TOML file or folder of one, an Orthosis or a Scenario
    pressure : gauge, that the supply is set to, [Pa] or text such as "4 bar"; the scenario's own by default

    Raises
    ------
    InputError
        There is no such orthosis or scenario, or it has no chamber.
    """
    scenario, pressure = scenario_of(source, None), gauge(pressure)
    if pressure is not None:
        scenario = scenario.set({"supply.pressure": f"{pressure!r} Pa"})
    return air_scheme(scenario.orthosis, scenario.supply)

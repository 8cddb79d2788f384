"""The picture of `docs/architecture.md`: the rooms of the package, their arrows, and the way of a run.

    python scripts/architecture.py            # draws docs/architecture.svg anew
    python scripts/architecture.py --check    # exit code 1 where the picture and the code differ

Rooms and arrows are read from the imports. The numbers are the order in which a run enters the rooms: a short
run is made, and its calls are watched.
"""

import argparse
import ast
import html
import importlib
import pathlib
import pkgutil
import re
import sys
import textwrap
from collections.abc import Iterable

from afo_sim.common.versions import CORE

ROOT = pathlib.Path(__file__).parents[1]
PACKAGE = ROOT / "afo_sim"
PICTURE = ROOT / "docs" / "architecture.svg"
BLUE = (*CORE, "cli")
WIDTH, HEIGHT, GAP, FLOOR = 190, 78, 26, 132
STYLE = """
text { font-family: system-ui, sans-serif; font-size: 12px; fill: #1b2733 }
.room { fill: #dbe9f6; stroke: #31587e } .extra { fill: #fdf0d9; stroke: #a8741a }
.name { font-weight: 600; font-size: 15px } .small { font-size: 10.5px; fill: #41505e }
.arrow { fill: none; stroke: #7c8b99; stroke-width: 1.3 }
.step { fill: #31587e } .number { fill: white; font-weight: 600; text-anchor: middle }
"""
Arrows = dict[str, set[str]]


def imported(path: pathlib.Path) -> set[str]:
    """Modules and names that a file imports, also inside functions."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def rooms() -> Arrows:
    """{room: the rooms that it imports}."""
    names = sorted(path.parent.name for path in PACKAGE.glob("*/__init__.py"))
    return {
        room: {
            other
            for path in (PACKAGE / room).rglob("*.py")
            for name in imported(path)
            for other in names
            if f"{name}.".startswith(f"afo_sim.{other}.") and other != room
        }
        for room in names
    }


def floors(arrows: Arrows) -> dict[str, int]:
    """Each room's floor: one above the highest room that it imports."""

    def floor(room: str) -> int:
        return 1 + max((floor(other) for other in arrows[room]), default=-1)

    return {room: floor(room) for room in arrows}


def direct(arrows: Arrows) -> Arrows:
    """The arrows that no longer way through other rooms implies."""

    def reach(room: str) -> set[str]:
        return arrows[room].union(*map(reach, arrows[room]))

    return {
        room: {one for one in others if not any(one in reach(other) for other in others - {one})}
        for room, others in arrows.items()
    }


def way_of_a_run() -> list[str]:
    """The rooms in the order in which a run enters them; calls that an import makes are no part of a run."""
    import afo_sim

    for room in BLUE:
        package = importlib.import_module(f"afo_sim.{room}")
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            importlib.import_module(module.name)
    entered: list[str] = []
    prefix = f"{PACKAGE}/"

    def watch(frame: object, event: str, _: object) -> None:
        file: str = frame.f_code.co_filename  # type: ignore[attr-defined]
        if event == "call" and file.startswith(prefix) and frame.f_code.co_name != "<module>":  # type: ignore[attr-defined]
            room = file[len(prefix) :].partition("/")[0]
            if not room.endswith(".py") and room not in entered:
                entered.append(room)

    sys.setprofile(watch)  # type: ignore[arg-type]
    try:
        afo_sim.run("walk-dropfoot-afo", {"duration": "1.3 s"}).metrics  # noqa: B018 - the metrics are computed
    finally:
        sys.setprofile(None)
    return entered


def about(room: str) -> str:
    """What a room is, by its own docstring."""
    tree = ast.parse((PACKAGE / room / "__init__.py").read_text(encoding="utf-8"))
    return (ast.get_docstring(tree) or "").partition("\n")[0]


def label(kind: str, x: float, y: float, text: str) -> str:
    """A text of the picture."""
    return f'<text class="{kind}" x="{x:.0f}" y="{y:.0f}">{html.escape(text)}</text>'


def svg(arrows: Arrows, way: list[str]) -> str:
    """The picture."""
    levels = floors(arrows)
    top = max(levels.values())
    rows = [[room for room in arrows if levels[room] == level] for level in range(top, -1, -1)]
    width = max(len(row) for row in rows) * (WIDTH + GAP) + GAP
    place = {}
    for k, row in enumerate(rows):
        left = (width - len(row) * (WIDTH + GAP) + GAP) / 2
        for n, room in enumerate(row):
            place[room] = (left + n * (WIDTH + GAP), 20 + k * FLOOR)
    height = 20 + len(rows) * FLOOR
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img">',
        "<title>Rooms of afo_sim, their imports, and the order in which a run enters them</title>",
        f"<style>{STYLE}</style>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7"',
        ' orient="auto"><path d="M0 0L8 4L0 8z" fill="#7c8b99"/></marker></defs>',
    ]
    for room, others in sorted(direct(arrows).items()):
        ends = sorted(others, key=lambda other: place[other][0])
        for n, other in enumerate(ends):
            x, y = place[room][0] + WIDTH * (n + 1) / (len(ends) + 1), place[room][1] + HEIGHT
            u, v = place[other][0] + WIDTH / 2, place[other][1]
            parts.append(
                f'<path class="arrow" id="{room}-{other}" marker-end="url(#tip)" '
                f'd="M{x:.0f} {y:.0f}C{x:.0f} {y + 45:.0f} {u:.0f} {v - 45:.0f} {u:.0f} {v:.0f}"/>'
            )
    for room, (x, y) in place.items():
        kind = "room" if room in BLUE else "extra"
        box = f'x="{x:.0f}" y="{y:.0f}" width="{WIDTH}" height="{HEIGHT}" rx="6"'
        parts.append(f'<rect class="{kind}" id="{room}" {box}/>')
        parts.append(label("name", x + 10, y + 20, room))
        lines = textwrap.wrap(about(room), 30, max_lines=3, placeholder=" …")
        parts += [label("small", x + 10, y + 36 + 13 * k, line) for k, line in enumerate(lines)]
        if room in way:
            parts.append(f'<circle class="step" cx="{x + WIDTH - 16:.0f}" cy="{y + 16:.0f}" r="10"/>')
            parts.append(label("number", x + WIDTH - 16, y + 20, str(way.index(room) + 1)))
    return "\n".join([*parts, "</svg>", ""])


def drawn(text: str) -> tuple[set[str], list[str]]:
    """What a picture holds: rooms and arrows, and the numbers of a run's way."""
    ids = set(re.findall(r'id="([\w-]+)"', text))
    return ids, re.findall(r'class="number"[^>]*>(\d+)<', text)


def main(arguments: Iterable[str] | None = None) -> int:
    """Draw, or check."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare the picture with the code")
    options = parser.parse_args(None if arguments is None else list(arguments))
    text = svg(rooms(), way_of_a_run())
    if not options.check:
        PICTURE.write_text(text, encoding="utf-8")
        return 0
    before, now = drawn(PICTURE.read_text(encoding="utf-8")), drawn(text)
    for name in sorted(before[0] ^ now[0]):
        print(f"{name}: {'in the picture only' if name in before[0] else 'in the code only'}")
    if before[1] != now[1]:
        print(f"the way of a run: {before[1]} in the picture, {now[1]} in the code")
    return int(before != now)


if __name__ == "__main__":
    sys.exit(main())

"""Lines between the ports of an air path's parts, through the channels between columns and rows.

Each channel has tracks. A line is found by A* (Hart, Nilsson & Raphael 1968); lines of different nodes may
cross, and never lie on each other.
"""

import heapq
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from afo_sim.description.air.air_parts import AMBIENT
from afo_sim.show.air_cells import Cell, Place

Vertex = tuple[int, int]  # indices of a track or a middle, from the left and from above
HOP, BEND, CROSSING, ASIDE = 4, 3, 6, 8  # costs beside that of a track, 1
MOST_TRACKS = 12
H, V = 0, 1


@dataclass(frozen=True)
class Tracks:
    """Indices of tracks and middles, with `n` tracks in each channel."""

    n: int
    size: Place

    def middle(self, k: int) -> int:
        """Index of the middle of a column or row."""
        return k * (self.n + 1) + self.n

    def track(self, channel: int, k: int) -> int:
        """Index of a track of the channel before a column or row."""
        return channel * (self.n + 1) + k

    def is_middle(self, index: int) -> bool:
        """Whether an index is that of a middle."""
        return index % (self.n + 1) == self.n

    def port(self, cell: Cell, side: str) -> Vertex:
        """Where a port's line begins: on the next track of the channel beside it."""
        column, row = cell.place
        if side == "left":
            return self.track(column, self.n - 1), self.middle(row)
        if side == "right":
            return self.track(column + 1, 0), self.middle(row)
        return self.middle(column), self.track(row + 1, 0)


@dataclass
class Routes:
    """The lines that are found.

    lines : of every node, its pieces from vertex to vertex
    used : of every vertex, the directions in which a node's line goes there
    """

    tracks: Tracks
    lines: dict[str, set[tuple[Vertex, Vertex]]] = field(default_factory=dict)
    used: dict[Vertex, dict[str, set[int]]] = field(default_factory=dict)

    def add(self, node: str, path: Sequence[Vertex]) -> None:
        """A path of a node's line."""
        for a, b in itertools.pairwise(path):
            self.lines.setdefault(node, set()).add((min(a, b), max(a, b)))
            for end in (a, b):
                self.used.setdefault(end, {}).setdefault(node, set()).add(H if a[1] == b[1] else V)


def ports(cell: Cell) -> list[tuple[str, str]]:
    """(side, node) of every port that a line leads to."""
    found = [("left", cell.left), ("right", cell.right), ("low", cell.low)]
    return [(side, node) for side, node in found if node not in ("", AMBIENT)]


def route(cells: Sequence[Cell]) -> Routes:
    """Lines from every edge's ports to its nodes, with as many tracks as they need."""
    for n in range(4, MOST_TRACKS + 1):
        if (found := _route(cells, n)) is not None:
            return found
    raise AssertionError("an air path that no lines can be drawn of")


def _route(cells: Sequence[Cell], n: int) -> Routes | None:
    size = (1 + max(c.place[0] for c in cells), 1 + max(c.place[1] for c in cells))
    tracks = Tracks(n, size)
    taken = {cell.place for cell in cells}
    owner = {tracks.port(cell, side): node for cell in cells for side, node in ports(cell)}
    routes = Routes(tracks)
    for node, ends in sorted(_ends(cells, tracks).items(), key=lambda item: _spread(item[1][1])):
        starts, targets = ends
        reached: dict[Vertex, int] = dict(starts)
        left = set(targets)
        while left:
            path = _search(routes, node, reached, left, taken, owner)
            if path is None:
                return None
            routes.add(node, path)
            left.discard(path[-1])
            # A line may branch where no other node's line crosses it.
            reached |= {v: 0 for v in path if len(routes.used[v]) == 1}
    return routes


def _ends(cells: Sequence[Cell], tracks: Tracks) -> dict[str, tuple[dict[Vertex, int], list[Vertex]]]:
    """Of every node its own ports with what it costs to begin there, and the ports that it leads to."""
    found: dict[str, tuple[dict[Vertex, int], list[Vertex]]] = {}
    columns = {cell.name: cell.place[0] for cell in cells if cell.node}
    last = max(columns.values())
    for cell in cells:
        for side, node in ports(cell):
            starts, targets = found.setdefault(node, ({}, []))
            if cell.node:
                starts[tracks.port(cell, side)] = ASIDE if side == "right" and cell.place[0] == last else 0
            else:
                targets.append(tracks.port(cell, side))
    return found


def _spread(vertices: Iterable[Vertex]) -> int:
    """How far apart vertices are; near ones are joined first."""
    rows, columns = zip(*vertices, strict=True) if vertices else ((0,), (0,))
    return max(rows) - min(rows) + max(columns) - min(columns)


def _search(
    routes: Routes,
    node: str,
    starts: dict[Vertex, int],
    targets: set[Vertex],
    taken: set[Place],
    owner: dict[Vertex, str],
) -> list[Vertex] | None:
    """The cheapest path from a node's line to one of its ports."""
    queue: list[tuple[int, int, Vertex, int, tuple[Vertex, int] | None]] = []
    count = 0
    for start, cost in starts.items():
        if start in targets:
            return [start, start]
        heapq.heappush(queue, (cost, count, start, -1, None))
        count += 1
    before: dict[tuple[Vertex, int], tuple[Vertex, int] | None] = {}
    while queue:
        cost, _, at, way, last = heapq.heappop(queue)
        if (at, way) in before:
            continue
        before[at, way] = last
        if at in targets:
            return _back(before, (at, way))
        crossing = any(other != node for other in routes.used.get(at, {}))
        for other, axis, step in _next(routes.tracks, at, taken):
            if crossing and axis != way:
                continue
            if owner.get(other, node) != node:
                continue
            more = step + (BEND if way not in (-1, axis) else 0)
            foreign = [used for name, used in routes.used.get(other, {}).items() if name != node]
            if foreign:
                if other in targets or any(used != {1 - axis} for used in foreign):
                    continue
                more += CROSSING
            count += 1
            heapq.heappush(queue, (cost + more, count, other, axis, (at, way)))
    return None


def _back(
    before: dict[tuple[Vertex, int], tuple[Vertex, int] | None], end: tuple[Vertex, int]
) -> list[Vertex]:
    path, at = [], before[end]
    path.append(end[0])
    while at is not None:
        path.append(at[0])
        at = before[at]
    return path[::-1]


def _next(tracks: Tracks, at: Vertex, taken: set[Place]) -> Iterable[tuple[Vertex, int, int]]:
    """(vertex, direction, cost) of every step: along rows' middles through empty places, along all tracks."""
    (x, y), n = at, tracks.n
    most = tuple(k * (n + 1) + n for k in tracks.size)
    for other in (x - 1, x + 1):
        if not 0 <= other < most[0]:
            continue
        middle = tracks.is_middle(other) or tracks.is_middle(x)
        column = (x if tracks.is_middle(x) else other) // (n + 1)
        if middle and tracks.is_middle(y) and (column, y // (n + 1)) in taken:
            continue
        yield (other, y), H, HOP if middle else 1
    if tracks.is_middle(x):
        return
    for other in (y - 1, y + 1):
        if 0 <= other < most[1]:
            yield (x, other), V, HOP if tracks.is_middle(other) or tracks.is_middle(y) else 1

"""Lines between the ports of an air path's parts, through the channels between columns and rows.

Each channel has tracks. A line is found by A* (Hart, Nilsson & Raphael 1968); lines of different nodes may
cross, and never lie on each other.
"""

import heapq
import itertools
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from afo_sim.description import AMBIENT
from afo_sim.model import OUTLETS, AirEdge, AirScheme

Place = tuple[int, int]  # column, row, from the left and from above


@dataclass(frozen=True)
class Cell:
    """A part on the grid."""

    name: str
    place: Place
    left: str = ""
    right: str = ""
    low: str = ""
    node: bool = False


def cells(scheme: AirScheme) -> list[Cell]:
    """A cell for every node but the ambient air, and for every edge; no two on one place."""
    return _Grid(scheme).cells()


class _Grid:
    """The grid as it is filled."""

    def __init__(self, scheme: AirScheme) -> None:
        self.scheme = scheme
        self.steps, self.tree = _tree(scheme)
        self.rank = self._ranks()
        self.rows: dict[str, int] = {}
        self.taken: dict[Place, Cell] = {}

    def cells(self) -> list[Cell]:
        self._lanes()
        for name, row in self.rows.items():
            self._put(Cell(name, (2 * self.rank[name], row), name, name, node=True))
        later = []
        for each in self.scheme.edges.values():
            if each.name in self.tree.values():
                child = next(node for node, edge in self.tree.items() if edge == each.name)
                self._put(self._between(each, (2 * self.rank[child] - 1, self.rows[child])))
            elif each.way == OUTLETS and each.upstream in self.rows:
                self._put(self._outlet(each))
            else:
                later.append(each)
        bottom = 1 + max(row for _, row in self.taken)
        later = self._drains(later, bottom)
        for each in later:
            self._put(self._aside(each, bottom))
        return self._from_zero()

    def _ranks(self) -> dict[str, int]:
        """Steps from the origin; chambers and the ends of their tubes as far to the right as they can be."""
        rank = dict(self.steps)
        last = max(rank.values())
        inner = {self._parent(node) for node in self.tree}
        for name, node in self.scheme.nodes.items():
            if name in rank and node.kind == "chamber" and name not in inner:
                rank[name] = last
        for name in sorted(rank, key=lambda node: -self.steps[node]):
            children = [node for node in self.tree if self._parent(node) == name]
            if children and self._fed_by_valve(name) and self.scheme.nodes[name].kind == "point":
                rank[name] = min(rank[child] for child in children) - 1
        return rank

    def _fed_by_valve(self, node: str) -> bool:
        edge = self.tree.get(node)
        return edge is not None and bool(self.scheme.edges[edge].way)

    def _parent(self, node: str) -> str:
        each = self.scheme.edges[self.tree[node]]
        return each.upstream if each.downstream == node else each.downstream

    def _lanes(self) -> None:
        """Rows: a lane for each node that feeds no other, and all others in the middle of what they feed."""
        children: dict[str, list[str]] = {name: [] for name in self.steps}
        order = [name for name in self.scheme.edges if name in self.tree.values()]
        for edge in order:
            child = next(node for node, each in self.tree.items() if each == edge)
            children[self._parent(child)].append(child)
        self._lane(self.scheme.origin, children, 0)

    def _lane(self, node: str, children: dict[str, list[str]], row: int) -> int:
        """Rows of a node and of all that it feeds, from a row on; the first row below them."""
        first = row
        for child in children[node]:
            row = self._lane(child, children, row)
        if children[node]:
            found = [self.rows[child] for child in children[node]]
            self.rows[node] = (min(found) + max(found)) // 2
            return max(row, first + self._height(node))
        self.rows[node] = row
        return row + self._height(node)

    def _height(self, node: str) -> int:
        """Rows of a node's lane: its own, and those of what leads out of it."""
        edges = self.scheme.edges.values()
        ways_out = sum(each.way == OUTLETS and each.upstream == node for each in edges)
        chamber = self.scheme.nodes[node].kind == "chamber"
        aside = sum(chamber and AMBIENT in (e.upstream, e.downstream) and node in (e.upstream, e.downstream)
                    and not e.way for e in edges)  # fmt: skip
        return 1 + max(ways_out, aside)

    def _between(self, each: AirEdge, place: Place) -> Cell:
        """An edge with its port on the source's side to the left."""
        a, b = each.upstream, each.downstream
        ends = (a, b) if self.rank.get(a, 0) <= self.rank.get(b, 0) else (b, a)
        return Cell(each.name, place, *ends, each.exhaust)

    def _outlet(self, each: AirEdge) -> Cell:
        """A chamber's way out, below its way in."""
        column, row = 2 * self.rank[each.upstream] - 1, self.rows[each.upstream] + 1
        return Cell(each.name, self._free(column, row), each.downstream, each.upstream)

    def _drains(self, edges: list[AirEdge], bottom: int) -> list[AirEdge]:
        """Place volumes that chambers alone give air to, and what leads on; the edges that are left."""
        waiting = [
            name
            for name, each in self.scheme.nodes.items()
            if name not in self.rank and each.kind != "ambient"
        ]
        while waiting:
            name = next((n for n in waiting if self._touching(n)), waiting[0])
            waiting.remove(name)
            columns = [place[0] for place in self._touching(name)]
            column = (min(columns) if columns else 1) - 1
            self.rank[name] = column // 2
            cell = Cell(name, self._free(column, bottom), name, name, node=True)
            self._put(cell)
            for each in [e for e in edges if name in (e.upstream, e.downstream)]:
                other = each.downstream if each.upstream == name else each.upstream
                place = self._free(column - 1, cell.place[1])
                self._put(Cell(each.name, place, other, name, each.exhaust))
                edges = [e for e in edges if e is not each]
        return edges

    def _touching(self, node: str) -> list[Place]:
        return [cell.place for cell in self.taken.values() if node in (cell.left, cell.low) and not cell.node]

    def _aside(self, each: AirEdge, bottom: int) -> Cell:
        """What is no part of a lane: ways to the ambient air, and between nodes that have others."""
        ends = [node for node in (each.upstream, each.downstream) if node != AMBIENT]
        far = max(ends, key=lambda node: self.rank[node])
        chamber = self.scheme.nodes[far].kind == "chamber"
        if len(ends) == 1:
            column = 2 * self.rank[far] + (0 if chamber else 1)
            row = self.rows[far] + 1 if chamber else bottom
            return Cell(each.name, self._free(column, row), far, AMBIENT, each.exhaust)
        if self.rank[ends[0]] == self.rank[ends[1]]:
            column, row = 2 * self.rank[far], max(self.rows.get(node, bottom) for node in ends) + 1
            return self._between(each, self._free(column, row))
        return self._between(each, self._free(2 * self.rank[far] - 1, bottom))

    def _free(self, column: int, row: int) -> Place:
        while (column, row) in self.taken:
            row += 1
        return column, row

    def _put(self, cell: Cell) -> None:
        assert cell.place not in self.taken, (cell, self.taken[cell.place])
        self.taken[cell.place] = cell

    def _from_zero(self) -> list[Cell]:
        first = min(column for column, _ in self.taken)
        found = sorted(self.taken.values(), key=lambda cell: cell.place)
        columns = sorted({cell.place[0] for cell in found})
        rows = sorted({cell.place[1] for cell in found})
        assert first == columns[0]
        moved = [(columns.index(c.place[0]), rows.index(c.place[1])) for c in found]
        return [
            Cell(c.name, place, c.left, c.right, c.low, c.node) for c, place in zip(found, moved, strict=True)
        ]


def _tree(scheme: AirScheme) -> tuple[dict[str, int], dict[str, str]]:
    """Steps of every node that air comes to from the origin without a way out, and the edge it comes by."""
    steps, by, queue = {scheme.origin: 0}, {}, deque([scheme.origin])
    while queue:
        node = queue.popleft()
        for name, other in _beside(scheme, node):
            if other not in steps:
                steps[other], by[other] = steps[node] + 1, name
                queue.append(other)
    return steps, by


def _beside(scheme: AirScheme, node: str) -> Iterator[tuple[str, str]]:
    """(edge, node at its other end), but for ways out."""
    for name, each in scheme.edges.items():
        ends = (each.upstream, each.downstream)
        if node not in ends or AMBIENT in ends or each.way == OUTLETS:
            continue
        other = ends[1] if ends[0] == node else ends[0]
        if other == each.upstream and (each.way or each.back == 0.0):
            continue
        yield name, other


Vertex = tuple[int, int]  # indices of a track or a middle, from the left and from above
_HOP, _BEND, _CROSSING, _ASIDE = 4, 3, 6, 8  # costs beside that of a track, 1
_MOST_TRACKS = 12
_H, _V = 0, 1


@dataclass(frozen=True)
class _Tracks:
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
    """The lines that are found."""

    tracks: _Tracks
    lines: dict[str, set[tuple[Vertex, Vertex]]] = field(default_factory=dict)
    used: dict[Vertex, dict[str, set[int]]] = field(default_factory=dict)

    def add(self, node: str, path: Sequence[Vertex]) -> None:
        """A path of a node's line."""
        for a, b in itertools.pairwise(path):
            self.lines.setdefault(node, set()).add((min(a, b), max(a, b)))
            for end in (a, b):
                self.used.setdefault(end, {}).setdefault(node, set()).add(_H if a[1] == b[1] else _V)


def ports(cell: Cell) -> list[tuple[str, str]]:
    """(side, node) of every port that a line leads to."""
    found = [("left", cell.left), ("right", cell.right), ("low", cell.low)]
    return [(side, node) for side, node in found if node not in ("", AMBIENT)]


def route(cells: Sequence[Cell]) -> Routes:
    """Lines from every edge's ports to its nodes, with as many tracks as they need."""
    for n in range(4, _MOST_TRACKS + 1):
        if (found := _route(cells, n)) is not None:
            return found
    raise AssertionError("an air path that no lines can be drawn of")


def _route(cells: Sequence[Cell], n: int) -> Routes | None:
    size = (1 + max(c.place[0] for c in cells), 1 + max(c.place[1] for c in cells))
    tracks = _Tracks(n, size)
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


def _ends(cells: Sequence[Cell], tracks: _Tracks) -> dict[str, tuple[dict[Vertex, int], list[Vertex]]]:
    """Of every node its own ports with what it costs to begin there, and the ports that it leads to."""
    found: dict[str, tuple[dict[Vertex, int], list[Vertex]]] = {}
    columns = {cell.name: cell.place[0] for cell in cells if cell.node}
    last = max(columns.values())
    for cell in cells:
        for side, node in ports(cell):
            starts, targets = found.setdefault(node, ({}, []))
            if cell.node:
                starts[tracks.port(cell, side)] = _ASIDE if side == "right" and cell.place[0] == last else 0
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
            more = step + (_BEND if way not in (-1, axis) else 0)
            foreign = [used for name, used in routes.used.get(other, {}).items() if name != node]
            if foreign:
                if other in targets or any(used != {1 - axis} for used in foreign):
                    continue
                more += _CROSSING
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


def _next(tracks: _Tracks, at: Vertex, taken: set[Place]) -> Iterable[tuple[Vertex, int, int]]:
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
        yield (other, y), _H, _HOP if middle else 1
    if tracks.is_middle(x):
        return
    for other in (y - 1, y + 1):
        if 0 <= other < most[1]:
            yield (x, other), _V, _HOP if tracks.is_middle(other) or tracks.is_middle(y) else 1

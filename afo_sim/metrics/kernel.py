"""Metrics as compiled functions of rows: each formula once, in the subset of Python that numba compiles.

A kernel is a function (b, out) → 0.0 of two flat arrays: a block, which is numbers about rows, then the rows
one behind the other; and where it writes. Compiled code takes their addresses, Python may call it with both.
"""

import functools
import math
from collections import namedtuple
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from afo_sim.common import Doubles, Function, NamedNumbers, user_cache
from afo_sim.gait import norm
from afo_sim.metrics.metric import REPORTED, load_all
from afo_sim.physics import compiled_functions, register_jitable

K = TypeVar("K", bound=Function)
SILENT = -math.inf  # of a metric that is not said; NaN is one that is undefined
BEYOND = 3  # places behind a row's last number, for windows that end there
RECORDED_FORCE = "gait/ground_force_z"  # a column only where the foot is in contact with a floor
COMPUTED = "phase", "speed", "fast", "passing", "steps", "one", "other", "third"  # three to work in
# Rows of a stride's block: behind those that are computed, columns, by the first of their names that is there
ROWS: dict[str, tuple[str, ...]] = dict.fromkeys(COMPUTED, ()) | {
    "time": ("time",), "stride": ("gait/stride",), "cycle": ("gait/phase",),
    "force": (RECORDED_FORCE, "ground/force/z"), "recorded_force": (RECORDED_FORCE,),
    "forward": ("ankle/position/x",), "angle": ("ankle/angle",), "velocity": ("ankle/velocity",),
    "shank": ("shank/angle",), "pitch": ("sole/pitch",), "toe_load": ("foot/toe_load",),
    "sole": ("sole/height_without_floor", "sole/height"), "healthy_sole": ("gait/sole_height",),
    "ball": ("ball/height_without_floor", "ball/height"), "healthy_ball": ("gait/ball_height",),
    "toe": ("toe/height_without_floor", "toe/height"), "healthy_toe": ("gait/toe_height",),
    "less_extended": ("sole/height_less_extended",), "more_extended": ("sole/height_more_extended",),
    "healthy_angle": ("gait/ankle_angle",), "healthy_moment": ("gait/ankle_moment",),
    "needed": ("gait/needed_moment",), "tissue": ("gait/passive_moment",),
    "orthosis": ("ankle/moment/orthosis",), "inversion": ("ankle/moment/inversion",),
    "flow": ("supply/mass_flow",), "exergy": ("supply/exergy_flow",), "vented": ("exhaust/exergy_flow",),
    "chambers": ("valve/{}_inlet/mass_flow", "chamber/{}/pressure"),  # two rows of each chamber,
    "valves": ("valve/{}/switches", "valve/{}/coil"),  # and behind them two of each valve
}  # fmt: skip
R: NamedNumbers = namedtuple("R", ROWS)(*range(len(ROWS)))
# Numbers of a stride's block; rows are counted from the first one in it.
#   count : rows of the recording; first, end : the stride's own; number : of the stride; timestep [s]
#   mass : of the body [kg]; density : of the gas at ANR [kg/m³]; cycles : that share what is counted
#   start, stop : where the whole stride starts and ends
#   duration [s], toe_off, upright, begun, fastest [-], level [rad] : what `events` finds
#   chambers, valves : how many; rows : where they begin; norm : where the norm is: samples, phases, angles
#   table : from here on each row's number in the block, 0 where the recording has no such column
_NUMBERS = (
    "count first end number timestep mass density cycles start stop duration toe_off upright begun fastest "
    "level chambers valves norm rows table"
)
S: NamedNumbers = namedtuple("S", _NUMBERS.split())(*range(len(_NUMBERS.split())))
N_COMPUTED, NUMBERS = len(COMPUTED), 6  # numbers before the rows of `call`

_SOURCES = user_cache.checksum(rooms=("gait", "metrics"))  # now, with the import, as that of other rooms
READS: dict[Function, frozenset[int]] = {}  # rows of columns that each kernel reads


def kernel(*reads: int) -> Callable[[K], K]:
    """Mark a function as a kernel that reads some rows of columns."""

    def register(function: K) -> K:
        READS[function] = frozenset(reads)
        return function

    return register


@functools.cache
def compiled() -> dict[Function, Function]:
    """C functions of all kernels, compiled once and kept."""
    load_all()
    own = [function for function in READS if function.__module__.startswith("afo_sim.")]
    own.sort(key=lambda f: (f.__module__, f.__code__.co_firstlineno))  # whatever was imported first
    found = compiled_functions("metrics", *own, follows=(_SOURCES,))
    return dict(zip(own, found, strict=True))


def call(function: Function, numbers: Sequence[float], rows: Doubles, size: int = 1) -> np.ndarray:
    """What a kernel writes of rows of one length; its block begins with their length and some numbers."""
    values = np.array(rows, float, ndmin=2)
    b, out = np.zeros(NUMBERS + values.size), np.empty(size)
    b[0], b[1 : 1 + len(numbers)], b[NUMBERS:] = values.shape[1], numbers, values.ravel()
    compiled()[function](b.ctypes.data, out.ctypes.data)
    return out


@register_jitable
def base(b: Doubles, row: int) -> int:
    """Place of a row in a block."""
    length = int(b[S.count]) + BEYOND
    if row < N_COMPUTED:
        return int(b[S.rows]) + row * length
    return int(b[S.rows]) + N_COMPUTED * length + int(b[S.table + row]) * int(b[S.count])


@register_jitable
def has(b: Doubles, row: int) -> bool:
    """Whether the recording has the column; the row of one that it has not is no number throughout."""
    return b[S.table + row] > 0.0


@functools.lru_cache(maxsize=64)
def layout(reads: frozenset[int], names: tuple[str, ...]) -> tuple[tuple[str, ...], np.ndarray]:
    """Columns that are read for rows of a block, and how such a block begins."""
    rows, wanted = [*ROWS.values()][:-2], {row for row in reads if row < R.chambers}
    for kind, each in (("chambers", chambers(names)), ("valves", valves(names))):
        own = [(form.format(name),) for name in each for form in ROWS[kind]]
        wanted |= set(range(len(rows), len(rows) + len(own))) if getattr(R, kind) in reads else set()
        rows += own
    first_of = {row: [name for name in rows[row] if name in names][:1] for row in sorted(wanted)}
    found = {row: first[0] for row, first in first_of.items() if first}
    healthy, head = norm.read(), np.zeros(S.table + len(rows))
    head[[S.cycles, S.chambers, S.valves, S.norm]] = 1, len(chambers(names)), len(valves(names)), len(head)
    head[[S.table + row for row in found]] = range(1, len(found) + 1)
    head = np.concatenate((head, [len(healthy.phase)], healthy.phase, healthy.ankle_angle))
    head[S.rows] = len(head)
    return tuple(found.values()), head


class Plan(NamedTuple):
    """What is called for metrics of a stride."""

    reads: frozenset[int]  # rows
    calls: tuple[tuple[Function, int], ...]  # kernels, and where each writes [bytes]
    names: tuple[str, ...]  # of the numbers that they write
    others: tuple[Function, ...]  # functions that are no kernels


@functools.lru_cache(maxsize=64)
def plan(functions: tuple[Function, ...], names: tuple[str, ...]) -> Plan:
    """Of functions that report metrics, and the names of a recording's columns."""
    calls: list[tuple[Function, int]] = []
    told: list[str] = []
    reads: frozenset[int] = frozenset()
    for function in filter(READS.__contains__, functions):
        calls.append((compiled()[function], 8 * len(told)))
        rows, reads = [row.name for row in REPORTED.get(function, ())], reads | READS[function]
        each = valves(names) if R.valves in READS[function] else chambers(names)
        told += [name for name in rows if "{}" not in name]
        told += [name.format(owner) for owner in each for name in rows if "{}" in name]
    return Plan(reads, tuple(calls), tuple(told), tuple(f for f in functions if f not in READS))


def block(
    columns: Mapping[str, np.ndarray], near: slice, reads: frozenset[int], given: Sequence[float]
) -> np.ndarray:
    """Rows of a recording that kernels read, as they take them; `given` : numbers behind their count."""
    found, head = layout(reads, tuple(columns))
    values = [columns[column][near] for column in found]
    count = len(values[0])
    before = len(head) + N_COMPUTED * (count + BEYOND)
    b = np.empty(before + (1 + len(values)) * count)
    b[: len(head)], b[before : before + count] = head, np.nan
    b[: 1 + len(given)] = (count, *given)
    np.concatenate(values, out=b[before + count :])
    return b


def told(calls: Collection[tuple[Function, int]], b: np.ndarray, size: int) -> list[float]:
    """What C functions of kernels write of a block, each from its place on [bytes]."""
    out = np.empty(size)
    out.fill(SILENT)
    to, at = out.ctypes.data, b.ctypes.data
    for function, place in calls:
        function(at, to + place)
    found: list[float] = out.tolist()
    return found


def chambers(names: Iterable[str]) -> list[str]:
    """Names of a recording's chambers, by the names of its columns."""
    return [name.split("/")[1] for name in names if name.startswith("chamber/") and name.endswith("/mass")]


def valves(names: Iterable[str]) -> list[str]:
    """Names of a recording's valves, by the names of its columns."""
    return [name.split("/")[1] for name in names if name.startswith("valve/") and name.endswith("/coil")]

"""A recording of walking cut into strides, heel strike to heel strike."""

import itertools
import math
from collections.abc import Container, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from afo_sim.common import GRAVITY, STANDARD_DENSITY, Doubles, Function
from afo_sim.gait import STANCE_FORCE, STANCE_SHARE
from afo_sim.metrics.kernel import (
    N_COMPUTED,
    READS,
    ROWS,
    SILENT,
    R,
    S,
    base,
    block,
    compiled,
    has,
    kernel,
    layout,
    plan,
    told,
)  # fmt: skip
from afo_sim.metrics.window import ON_ROW, Window, crossed, rectified, row_at, share
from afo_sim.physics import register_jitable

SOLVED = "gait/solved"  # column: 1 in the rows of the settled stride, where it was solved for
SOURCE_PRESSURE, SET_PRESSURE = "store/source/pressure", "supply/set_pressure"
AIR_SETTLED = 0.05  # share by which the air of strides that are alike may differ [-]
FAST = 0.75  # quantile of the foot's forward speed over the stride from which on it is fast [-]
BEGUN = 0.1  # share of the swing in which the foot leaves the floor [-]
ORTHOSIS = "ankle/moment/orthosis"
INTERNAL = ("ankle/moment/passive", "ankle/moment/biological", ORTHOSIS)  # the whole internal moment


@register_jitable
def below(b: Doubles, start: int, count: int, value: float) -> int:
    """Which of rising numbers is the last one that is no greater than a value, or the last but one."""
    low, high = 0, count - 1
    while high - low > 1:
        middle = (low + high) // 2
        if b[start + middle] <= value:
            low = middle
        else:
            high = middle
    return low


@register_jitable
def place(b: Doubles, phase: float) -> float:
    """Position of a phase among the rows; extrapolated after the last row."""
    way = base(b, R.phase)
    k = below(b, way, int(b[S.count]), phase)
    step = b[way + k + 1] - b[way + k]
    return rectified(k + (phase - b[way + k]) / step) if step > 0.0 else float(k)


@register_jitable
def edge(b: Doubles, phase: float) -> float:
    """The same of a window's start or end: on a row, if it is close to it."""
    found = place(b, phase)
    near = float(int(found + 0.5))
    return near if abs(found - near) < ON_ROW else found


@register_jitable
def at(b: Doubles, row: int, phase: float) -> float:
    """A row at a phase from 0 to 1, linear between its values."""
    return row_at(b, base(b, row), int(b[S.count]), place(b, phase))


@register_jitable
def _smallest(b: Doubles, low: int, high: int, k: int) -> float:
    """The k-th smallest of some numbers, which change places (Hoare 1961, doi 10.1145/366622.366647)."""
    while low < high:
        pivot, i, j = b[(low + high) // 2], low, high
        while i <= j:
            while b[i] < pivot:
                i += 1
            while b[j] > pivot:
                j -= 1
            if i <= j:
                b[i], b[j] = b[j], b[i]
                i, j = i + 1, j - 1
        low, high = (low, j) if k <= j else (i, high) if k >= i else (k, k)
    return b[k]


@register_jitable
def quantile(b: Doubles, first: int, count: int, share: float) -> float:
    """Quantile of some numbers, which change places: linear between the nearest of their order."""
    if count == 0:
        return np.nan
    k, high = int(share * (count - 1)), np.inf
    low = _smallest(b, first, first + count - 1, first + k)
    for other in range(first + k + 1, first + count):
        high = min(high, b[other])
    return low + (share * (count - 1) - k) * (high - low) if k + 1 < count else low


SWING = R.force, R.shank, R.forward  # rows for toe-off and upright shank, and for how fast the foot is
LEVEL = R.angle, R.shank, R.pitch


@kernel(R.time, R.stride, R.cycle)
def events(b: Doubles, out: Doubles) -> float:
    """Write what the metrics of a stride share: numbers of its block, and the rows that are computed."""
    # who needs `toe_off` reads R.force besides, `upright` R.force and R.shank, `level` LEVEL, others SWING
    first, end, lean, force = int(b[S.first]), int(b[S.end]), base(b, R.shank), base(b, R.force)
    way, speed, forward, work = base(b, R.phase), base(b, R.speed), base(b, R.forward), base(b, R.one)
    stride, cycle, time = base(b, R.stride), base(b, R.cycle), base(b, R.time)
    for k in range(int(b[S.count])):
        b[way + k] = b[stride + k] + b[cycle + k] - b[S.number]
    b[S.duration] = (b[time + end - 1] - b[time + first]) / (b[way + end - 1] - b[way + first])
    b[S.start], b[S.stop] = edge(b, 0.0), edge(b, 1.0)

    toe_off = upright = 1.0
    least = STANCE_FORCE * b[S.mass] * GRAVITY
    for k in range(first, end):
        a = max(k - 1, first)
        if b[force + k] <= least and b[way + k] > STANCE_SHARE[0]:
            toe_off = crossed(b[way + a], b[way + k], b[force + a] - least, b[force + k] - least)
            break
    for k in range(first + 1, end):
        if b[way + k] >= toe_off and b[lean + k - 1] > 0.0 and b[lean + k] <= 0.0:
            upright = max(toe_off, crossed(b[way + k - 1], b[way + k], b[lean + k - 1], b[lean + k]))
            break
    b[S.toe_off], b[S.upright], b[S.begun] = toe_off, upright, toe_off + BEGUN * (1.0 - toe_off)
    b[S.level] = 0.0
    if has(b, R.pitch):
        b[S.level] = b[base(b, R.angle) + first] - b[lean + first] - b[base(b, R.pitch) + first]

    walks, top = 0, first
    for k in range(first, end):
        a, z = max(k - 1, first), min(k + 1, end - 1)
        b[speed + k] = (b[forward + z] - b[forward + a]) / (b[S.timestep] * (z - a))
        top = k if b[speed + k] > b[speed + top] else top
        if b[way + z] > b[way + a]:  # else who stands long enough is fast at a speed of 0
            b[work + walks] = b[speed + k]
            walks += 1
    fast, top = quantile(b, work, walks, FAST), min(max(top, first + 1), end - 2)
    before, after = b[speed + top - 1], b[speed + top + 1]
    bend = (after - b[speed + top]) - (b[speed + top] - before)  # of the parabola through the fastest rows
    aside = min(max(0.5 * (before - after) / bend, -0.5), 0.5) if bend < 0.0 else 0.0
    b[S.fastest] = b[way + top] + aside * (b[way + top + 1] - b[way + top])
    if bend != bend or end - first < 3:
        b[S.fastest] = np.nan
    quick, passing, steps = base(b, R.fast), base(b, R.passing), base(b, R.steps)
    for k in range(first, end):
        b[quick + k] = 1.0 if b[speed + k] >= fast else 0.0
        b[passing + k] = 1.0 if b[S.begun] <= b[way + k] < upright else 0.0
        b[steps + k] = b[S.timestep] * share(k, first, end - 1, b[S.start], b[S.stop])
    return 0.0


@dataclass(frozen=True, eq=False)
class Stride:
    """One whole stride of a recording. Indexing gives a column's rows of it: `stride["ankle/angle"]` (n,)."""

    columns: Mapping[str, np.ndarray]
    number: int
    rows: slice
    timestep: float  # between two rows [s]
    body_mass: float  # [kg]
    free_density: float = STANDARD_DENSITY  # of the supply's gas at ANR [kg/m³]

    def __getitem__(self, column: str) -> np.ndarray:
        return self.columns[column][self.rows]

    @property
    def near(self) -> slice:
        """The stride's rows with one more on either side."""
        return slice(max(self.rows.start - 1, 0), self.rows.stop + 1)

    def values(self, functions: tuple[Function, ...]) -> dict[str, float]:
        """What functions of the registry report of it, by name; NaN where one is undefined."""
        planned = plan((events, *functions), tuple(self.columns))
        b, names = self._block(planned.reads), tuple(self.columns)
        numbers = told(planned.calls, b, len(planned.names))
        found = {name: value for name, value in zip(planned.names, numbers, strict=True) if value != SILENT}
        if math.isnan(b[base(b, N_COMPUTED) + int(b[S.count]) :].sum()):  # rows that are lost tell nothing
            for function in filter(READS.__contains__, functions):
                if any(np.isnan(self[column]).any() for column in layout(READS[function], names)[0]):
                    found |= dict.fromkeys(found.keys() & plan((function,), names).names, math.nan)
        for function in planned.others:
            found.update(function(self))
        return found

    def _block(self, reads: frozenset[int]) -> np.ndarray:
        """Its rows for kernels, which read some of them."""
        near, rows = self.near, self.rows
        given = rows.start - near.start, rows.stop - near.start, self.number, self.timestep, self.body_mass
        return block(self.columns, near, reads, (*given, self.free_density))

    @cached_property
    def _events(self) -> np.ndarray:
        return self._with_events(frozenset(SWING))

    @cached_property
    def _way(self) -> np.ndarray:
        return self._with_events(frozenset())

    def _with_events(self, reads: frozenset[int]) -> np.ndarray:
        b = self._block(READS[events] | reads)
        told(((compiled()[events], 0),), b, 0)
        return b

    def _row(self, b: np.ndarray, row: int) -> np.ndarray:
        return b[base(b, row) + int(b[S.first]) : base(b, row) + int(b[S.end])]

    @property
    def phase(self) -> np.ndarray:
        """Of each row, 0 = heel strike, below 1 (n,)."""
        return self._row(self._way, R.phase)

    @property
    def duration(self) -> float:
        """Heel strike to heel strike [s]."""
        return float(self._way[S.duration])

    @property
    def toe_off(self) -> float:
        """Phase at which the ground lets the foot go: force below 5 % of the body weight, after 35 % [-]."""
        return float(self._events[S.toe_off])

    @property
    def upright(self) -> float:
        """Phase at which the shank leans back past the vertical in swing [-]; 1 where it does not."""
        return float(self._events[S.upright])

    @property
    def passing(self) -> np.ndarray:
        """Mask of the rows from the swing's first tenth, in which the foot leaves the floor, to then (n,)."""
        return self._row(self._events, R.passing) > 0.0

    @property
    def fast(self) -> np.ndarray:
        """Mask of the rows in which the ankle's forward speed is in its upper quartile (n,)."""
        return self._row(self._events, R.fast) > 0.0

    @property
    def fastest(self) -> float:
        """Phase of the ankle's greatest forward speed [-]."""
        return float(self._events[S.fastest])

    @property
    def whole(self) -> Window:
        """From heel strike to heel strike."""
        return self.between(0.0, 1.0)

    def at(self, column: str, phase: np.ndarray | float) -> np.ndarray:
        """A column at phases from 0 to 1, linear between its rows; of `phase`'s shape."""
        b, start = self._way, base(self._way, R.phase)
        return np.interp(phase, b[start : start + int(b[S.count])], self.columns[column][self.near])

    def between(self, start: float, end: float) -> Window:
        """The stretch of the recording from one phase to another [-]."""
        return Window(*(self.near.start + float(edge(self._way, phase)) for phase in (start, end)))


def stance_force(columns: Container[str]) -> str:
    """The column that distinguishes stance from swing."""
    return next(name for name in ROWS["force"] if name in columns or name == ROWS["force"][-1])


def without_floor(columns: Container[str], height: str) -> str:
    """The column of a height as it is in a swing without a floor; of former recordings the height."""
    free = f"{height}_without_floor"
    return free if free in columns else height


def stance(columns: Mapping[str, np.ndarray], body_mass: float) -> np.ndarray:
    """Mask of the rows in stance: the ground force is above 5 % of the body weight (n,)."""
    return loaded(columns[stance_force(columns)], body_mass)


def loaded(force: np.ndarray, body_mass: float) -> np.ndarray:
    """Mask of upward ground forces [N] of a foot in stance: above 5 % of body weight (n,)."""
    return force > STANCE_FORCE * body_mass * GRAVITY


def progress(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """Strides walked since phase 0 of stride 0 [-] (n,)."""
    return columns["gait/stride"] + columns["gait/phase"]


def strides(
    columns: Mapping[str, np.ndarray],
    timestep: float,
    body_mass: float,
    free_density: float = STANDARD_DENSITY,
) -> list[Stride]:
    """The whole strides of a recording, in order; the first one begun is the transient from the start."""
    way = progress(columns)
    if len(way) < 2:
        return []
    first = math.ceil(way[0] - 0.5 * (way[1] - way[0]))
    last = math.floor(way[-1] + 1.5 * (way[-1] - way[-2]))
    cuts = way.searchsorted(np.arange(first, last + 1) - 1e-9).tolist()
    rows = enumerate(itertools.pairwise(cuts), first)
    return [Stride(columns, k, slice(a, b), timestep, body_mass, free_density) for k, (a, b) in rows]


def settled(columns: Mapping[str, np.ndarray], whole: list[Stride]) -> list[Stride]:
    """Those of the whole strides that are not the transient from the start."""
    if SOLVED in columns:
        return [stride for stride in whole if stride[SOLVED].all()][-1:]
    way = progress(columns)
    begun = int(np.floor(way[0] + 0.5 * (way[1] - way[0]))) if len(way) > 1 else 0
    later = [stride for stride in whole if stride.number > begun]
    empty = emptied_at(columns)
    later = [stride for stride in later if empty is None or stride.rows.stop <= empty] or later
    air = [name for name in columns if name.startswith("chamber/") and name.endswith("/mass")]
    if not air or len(later) < 2:
        return later
    mass = np.array([sum(stride[name][0] for name in air) for stride in later])
    half = mass[len(mass) // 2 :]
    alike = np.abs(mass - np.median(half)) <= max(AIR_SETTLED * np.median(half), 2.0 * half.std())
    return later[int(np.argmax(alike)) :]


def emptied_at(columns: Mapping[str, np.ndarray]) -> int | None:
    """The first row in which bottle or cartridge has less than the set pressure; None where it never has."""
    if SOURCE_PRESSURE not in columns or SET_PRESSURE not in columns:
        return None
    less = columns[SOURCE_PRESSURE] < columns[SET_PRESSURE]
    return int(np.argmax(less)) if less.any() else None

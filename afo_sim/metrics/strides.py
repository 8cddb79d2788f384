"""A recording of walking cut into strides, heel strike to heel strike."""

import itertools
from collections.abc import Container, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from afo_sim.common import GRAVITY, STANDARD_DENSITY
from afo_sim.gait import STANCE_FORCE, STANCE_SHARE
from afo_sim.metrics.window import ON_ROW, Window, crossing

SOLVED = "gait/solved"  # column: 1 in the rows of the settled stride, where it was solved for
SOURCE_PRESSURE, SET_PRESSURE = "store/source/pressure", "supply/set_pressure"
AIR_SETTLED = 0.05  # share by which the air of strides that are alike may differ [-]
FAST = 0.75  # quantile of the foot's forward speed over the stride from which on it is fast [-]
BEGUN = 0.1  # share of the swing in which the foot leaves the floor [-]
ORTHOSIS = "ankle/moment/orthosis"
INTERNAL = ("ankle/moment/passive", "ankle/moment/biological", ORTHOSIS)  # the whole internal moment


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

    @cached_property
    def phase(self) -> np.ndarray:
        """Of each row, 0 = heel strike, below 1 (n,)."""
        return self["gait/stride"] + self["gait/phase"] - self.number

    @property
    def duration(self) -> float:
        """Heel strike to heel strike [s]."""
        return float(np.ptp(self["time"]) / np.ptp(self.phase))

    @cached_property
    def toe_off(self) -> float:
        """Phase at which the ground lets the foot go: force below 5 % of the body weight, after 35 % [-]."""
        beyond = self[stance_force(self.columns)] - STANCE_FORCE * self.body_mass * GRAVITY
        free = (beyond <= 0.0) & (self.phase > STANCE_SHARE[0])
        return crossing(self.phase, beyond, int(np.argmax(free))) if free.any() else 1.0

    @cached_property
    def swing(self) -> np.ndarray:
        """Mask of the rows in swing, from toe-off to the next heel strike (n,)."""
        return self.phase >= self.toe_off

    @cached_property
    def upright(self) -> float:
        """Phase at which the shank leans back past the vertical in swing [-]; 1 where it does not."""
        lean = self["shank/angle"]
        past = np.flatnonzero(self.swing[1:] & (lean[:-1] > 0.0) & (lean[1:] <= 0.0))
        return max(self.toe_off, crossing(self.phase, lean, int(past[0]) + 1)) if len(past) else 1.0

    @property
    def begun(self) -> float:
        """Phase at which the first tenth of the swing ends, in which the foot leaves the floor [-]."""
        return self.toe_off + BEGUN * (1.0 - self.toe_off)

    @cached_property
    def passing(self) -> np.ndarray:
        """Mask of the rows from then on until the shank stands upright (n,)."""
        return (self.phase >= self.begun) & (self.phase < self.upright)

    @cached_property
    def level(self) -> float:
        """Ankle angle at which the outsole stands flat under an upright shank [rad]: that of a drop."""
        if "sole/pitch" not in self.columns:
            return 0.0
        return float(self["ankle/angle"][0] - self["shank/angle"][0] - self["sole/pitch"][0])

    @cached_property
    def fast(self) -> np.ndarray:
        """Mask of the rows in which the ankle's forward speed is in its upper quartile (n,)."""
        walks = np.gradient(self.phase) > 0.0  # else who stands long enough is fast at a speed of 0
        return self.speed >= np.quantile(self.speed[walks], FAST)

    @cached_property
    def speed(self) -> np.ndarray:
        """Forward speed of the ankle [m/s] (n,)."""
        return np.gradient(self["ankle/position/x"], self.timestep)

    @cached_property
    def fastest(self) -> float:
        """Phase of the ankle's greatest forward speed [-], on the parabola through the fastest rows."""
        speed, phase = self.speed, self.phase
        top = min(max(int(np.argmax(speed)), 1), len(speed) - 2)
        before, bend = speed[top - 1] - speed[top + 1], np.diff(speed[top - 1 : top + 2], 2)[0]
        share = min(max(float(0.5 * before / bend), -0.5), 0.5) if bend < 0.0 else 0.0
        return float(phase[top] + share * (phase[top + 1] - phase[top]))

    @cached_property
    def _way(self) -> tuple[slice, np.ndarray]:
        """The stride's rows with one more on either side, and the phase in them, beyond 0 and 1 too."""
        near = slice(max(self.rows.start - 1, 0), self.rows.stop + 1)
        return near, self.columns["gait/stride"][near] + self.columns["gait/phase"][near] - self.number

    def at(self, column: str, phase: np.ndarray | float) -> np.ndarray:
        """A column at phases from 0 to 1, linear between its rows; of `phase`'s shape."""
        near, way = self._way
        return np.interp(phase, way, self.columns[column][near])

    def between(self, start: float, end: float) -> Window:
        """The stretch of the recording from one phase to another [-]."""
        near, way = self._way
        ends = near.start + np.interp([start, end], way, np.arange(len(way)))
        if end > way[-1]:  # the recording ends in the stride's last step
            ends[1] += (end - way[-1]) / (way[-1] - way[-2])
        return Window(*np.where(np.abs(ends - np.rint(ends)) < ON_ROW, np.rint(ends), ends).tolist())

    @cached_property
    def whole(self) -> Window:
        """From heel strike to heel strike."""
        return self.between(0.0, 1.0)

    @cached_property
    def steps(self) -> np.ndarray:
        """Time that each row's step has in the stride [s] (n,)."""
        return self.timestep * self.whole.shares(self.rows.start, len(self.phase))


RECORDED_FORCE = "gait/ground_force_z"  # a column only where the foot is in contact with a floor


def stance_force(columns: Container[str]) -> str:
    """The column that tells stance from swing, of a recording's columns."""
    return RECORDED_FORCE if RECORDED_FORCE in columns else "ground/force/z"


def without_floor(columns: Container[str], height: str) -> str:
    """The column of a height as it is in a swing without a floor; of former recordings the height."""
    free = f"{height}_without_floor"
    return free if free in columns else height


def stance(columns: Mapping[str, np.ndarray], body_mass: float) -> np.ndarray:
    """Mask of the rows in stance: the ground force is above 5 % of the body weight (n,)."""
    return loaded(columns[stance_force(columns)], body_mass)


def loaded(force: np.ndarray, body_mass: float) -> np.ndarray:
    """Mask of upward ground forces [N] that a standing foot bears: above 5 % of the body weight (n,)."""
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
    first = int(np.ceil(way[0] - 0.5 * (way[1] - way[0])))
    last = int(np.floor(way[-1] + 1.5 * (way[-1] - way[-2])))
    cuts = np.searchsorted(way, np.arange(first, last + 1) - 1e-9)
    return [
        Stride(columns, first + k, slice(int(a), int(b)), timestep, body_mass, free_density)
        for k, (a, b) in enumerate(itertools.pairwise(cuts))
    ]


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


def chambers(columns: Mapping[str, np.ndarray]) -> list[str]:
    """Names of a recording's chambers."""
    return [name.split("/")[1] for name in columns if name.startswith("chamber/") and name.endswith("/mass")]

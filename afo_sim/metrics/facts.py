"""What metrics of a run are computed from: its columns, and facts of its scenario beside them [SI].

`simulation/facts.py` makes the facts of a compiled scenario.
"""

import operator
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from afo_sim.common import STANDARD_DENSITY, Mixed, nearest_name
from afo_sim.metrics.metric import METRICS, Metric, Of, all_measured, functions_of, reporting
from afo_sim.metrics.strides import Stride, settled, strides

Columns = Mapping[str, np.ndarray]


class LazyColumns(Columns):
    """Columns by name, each computed when first read, since most are never read."""

    def __init__(self, names: Iterable[str], read: Callable[[str], np.ndarray], known: Columns | None = None):
        self._read = read
        self._found: dict[str, np.ndarray | None] = dict.fromkeys(names) | dict(known or {})

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._found:
            raise KeyError(f"no column {name}; the nearest: {nearest_name(name, self)}")
        found = self._found[name]
        if found is None:
            found = self._found[name] = self._read(name)
        return found

    def get(self, name: str, default: Mixed = None) -> Mixed:  # without a nearest name
        return self[name] if name in self._found else default

    def __contains__(self, name: object) -> bool:
        return name in self._found

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)


def cut(columns: Columns, part: Callable[[np.ndarray], np.ndarray]) -> LazyColumns:
    """The same part of all columns."""
    return LazyColumns(columns, lambda name: part(columns[name]))


class Source(Protocol):
    """What metrics need of a bottle, a cartridge or a compressor; `description.air.source.Source` has it."""

    @property
    def kind(self) -> str: ...
    @property
    def electric_power(self) -> float | None: ...
    def given_at(self, pressure: float, flow: float, content: float | None = None) -> float: ...
    def delivery(self, pressure: float) -> float: ...
    def duty(self, flow: float) -> float: ...


class Limits(Protocol):
    """What metrics and verdicts need of a scenario's limits; `description.walking.Limits` has it [SI]."""

    @property
    def skin_pressure(self) -> tuple[float, float]: ...
    @property
    def blood_flow_pressure(self) -> float: ...
    @property
    def bottle_volume(self) -> float: ...
    @property
    def bottle_pressure(self) -> float: ...
    @property
    def muscle_life(self) -> float: ...
    @property
    def strides_per_day(self) -> float: ...
    @property
    def toe_clearance(self) -> tuple[float, float]: ...
    @property
    def contact_pitch(self) -> tuple[float, float]: ...
    @property
    def torque_against_push_off(self) -> tuple[float, float]: ...
    @property
    def work_against_push_off(self) -> tuple[float, float]: ...
    @property
    def strides_per_bottle(self) -> tuple[float, float]: ...


@dataclass(frozen=True)
class Supply:
    """What the orthosis takes its air from."""

    pressure: float = 0.0
    sags: bool = False
    free_density: float = STANDARD_DENSITY
    source: Source | None = None
    content_at_start: Callable[[], float] = lambda: 0.0


@dataclass(frozen=True)
class Skin:
    """Skin under a cuff or a plate's strap."""

    area: float
    friction: float
    pull: Callable[[Columns], np.ndarray]


@dataclass(frozen=True)
class MuscleLimits:
    """Limits of one muscle: gauge pressure [Pa] in its chamber, force [N], contractions [-]."""

    chamber: str
    pressure: float
    force: float
    contraction_max: float
    contraction_min: float


@dataclass(frozen=True)
class Facts:
    """What metrics need of a scenario beside the columns of its run."""

    timestep: float
    body_mass: float = 0.0
    walks: bool = False
    supply: Supply = Supply()
    limits: Limits | None = None
    skins: Mapping[str, Skin] | None = None
    muscles: Mapping[str, MuscleLimits] | None = None
    rated_switches: Mapping[str, float] | None = None
    laid: float | None = None  # of the recorded sole onto the floor in stance, at most [m]


@dataclass(frozen=True, eq=False)
class Run:
    """A run that metrics look at."""

    columns: Columns
    facts: Facts
    totals: Mapping[str, Metric]
    solved: bool = False
    from_rest: bool = True

    @cached_property
    def counted(self) -> list[Stride]:
        """The counted strides; none without walking."""
        facts = self.facts
        if not facts.walks:
            return []
        whole = strides(self.columns, facts.timestep, facts.body_mass, facts.supply.free_density)
        return whole[-1:] if self.solved else settled(self.columns, whole)

    @cached_property
    def rows(self) -> Columns:
        """Columns of the strides that count, empty where none does; without a gait of the whole run."""
        if not self.facts.walks:
            return self.columns
        if not self.counted:
            return {}
        rows = slice(self.counted[0].rows.start, self.counted[-1].rows.stop)
        return cut(self.columns, operator.itemgetter(rows))


def run_metrics(run: Run, wanted: Collection[str] | None = None) -> dict[str, Metric]:
    """Metrics of a run that follow from its columns, its facts and the metrics known before."""
    found: dict[str, Metric] = {}
    names = None if wanted is None else frozenset(wanted)
    for function in reporting(functions_of(Of.RUN), names, strict=False):
        found |= all_measured(function(run))
    return {n: m for n, m in found.items() if wanted is None or n in wanted or n not in METRICS}

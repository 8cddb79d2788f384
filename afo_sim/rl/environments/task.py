"""A task: scenario, observation, action, reward and length of an episode, for every learning interface."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from afo_sim.common import FloatOrArray, Given, InputError, JsonMapping
from afo_sim.model import Built

Reader = Callable[["Sample"], FloatOrArray]


class Random(Protocol):
    """What draws: numpy's Generator and RandomState do."""

    def uniform(self, low: float, high: float, size: int) -> np.ndarray: ...
    def normal(self, mean: FloatOrArray, deviation: FloatOrArray, size: tuple[int, ...]) -> np.ndarray: ...


class Sample:
    """Columns of the last step, each computed once; `sample["ankle/angle"]` is a number, or (n,)."""

    __slots__ = ("found", "readers", "rows", "script")

    def __init__(
        self,
        readers: Mapping[str, Reader],
        rows: Mapping[str, np.ndarray],
        script: np.ndarray,
        **found: FloatOrArray,
    ):
        self.readers, self.rows, self.script, self.found = readers, rows, script, found

    def __getitem__(self, name: str) -> FloatOrArray:
        if name not in self.found:
            self.found[name] = self.readers[name](self)
        return self.found[name]


DEAD = 1.0 / 3.0  # action up to which both valves of a chamber are shut [-]
INLET_OUTLET = np.array([1.0, -1.0])  # signs of the action that turn them on
ALLOWED = "one number from −1 (outlet) to 1 (inlet) for each chamber"
Formula = Callable[[Sample], FloatOrArray]  # of the last sample of one simulation, or of several (n,)


@dataclass(frozen=True)
class Observed:
    """One number of an observation."""

    name: str
    unit: str
    meaning: str
    low: float
    high: float
    column: str = ""
    formula: Formula | None = None

    def of(self, sample: Sample) -> FloatOrArray:
        """The number in one simulation, or in several (n,)."""
        return sample[self.column] if self.formula is None else self.formula(sample)


@dataclass(frozen=True)
class Task:
    """What is to be done with an orthosis."""

    name: str
    title: str
    scenario: str
    period: float
    duration: float
    observed: tuple[Observed, ...]
    lowest: float
    highest: float
    reward: Formula
    script: Callable[[Built, np.ndarray], Callable[[Random], np.ndarray]]
    sets: JsonMapping = field(default_factory=dict)
    readers: Callable[[Built], Mapping[str, Reader]] = lambda built: {}
    version: int = 0

    @property
    def periods(self) -> int:
        """Actions of an episode."""
        return round(self.duration / self.period)

    @property
    def units(self) -> dict[str, str]:
        """Units of the observation by name."""
        return {one.name: one.unit for one in self.observed}

    @property
    def meanings(self) -> dict[str, str]:
        """Meanings of the observation by name."""
        return {one.name: one.meaning for one in self.observed}


def checked(action: Given, shape: tuple[int, ...]) -> np.ndarray:
    """An action as numbers; InputError where one is none, is out of range, or too many or few are given."""
    try:
        given = np.asarray(action, float)
    except (TypeError, ValueError):
        raise InputError("is not a valid action", field="action", value=action, allowed=ALLOWED) from None
    if given.shape != shape:
        allowed = f"{shape}: {ALLOWED}"
        raise InputError("has another shape", field="action", value=given.shape, allowed=allowed)
    if not np.abs(given).max() <= 1.0:  # nor where one is NaN
        bad = given[~(np.abs(given) <= 1.0)]
        raise InputError("is out of range", field="action", value=float(bad[0]), allowed=ALLOWED)
    return given


def coils_of(action: np.ndarray) -> np.ndarray:
    """Coils of an action (…, 2 n_chamber): inlet and outlet of each chamber, 0 or 1 [-]."""
    on = action[..., None] * INLET_OUTLET > DEAD
    return on.reshape(*action.shape[:-1], -1).astype(float)

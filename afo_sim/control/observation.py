"""What a controller sees: the last sample of every column that it asks for."""

from collections.abc import Mapping
from typing import Protocol


class Observation(Protocol):
    """A view of the last sample, by column name, SI; a name that is not asked for costs nothing.

    A sample is a step old: what stands in `seen["time"]` is the start of the last step. "sensor/<name>" is
    the reading of one of the scenario's sensors, any other name the true column of a run.
    """

    @property
    def time(self) -> float:
        """Present time, at which the command begins [s]."""
        ...

    @property
    def period(self) -> float:
        """Time from one command to the next [s]."""
        ...

    def __getitem__(self, column: str) -> float:
        """The last sample of a column; InputError where there is no such column."""
        ...

    def rows(self, column: str) -> "object":
        """All samples of a column since the last command (n,)."""
        ...


Told = Mapping[str, float]  # what a controller tells beside its commands, by name

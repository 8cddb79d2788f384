"""A user's own column: a function of other columns, row by row, added to the package's."""

import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import place_of, takes
from afo_sim.metrics import LazyColumns

Rows = Mapping[str, np.ndarray]
Function = Callable[[Rows], np.ndarray]
OWN: dict[str, "OwnColumn"] = {}  # by name, in the order in which one may read another


@dataclass(frozen=True)
class OwnColumn:
    """A column of a user's own. Called with columns [SI], it gives what its function does."""

    name: str  # in the recording
    unit: str  # SI; "" of a bare number
    sign: str  # what it is, and which way is positive
    function: Function  # of columns [SI]

    def __call__(self, columns: Rows) -> np.ndarray:
        return self.function(columns)

    def lacks(self, known: Iterable[str]) -> tuple[str, ...]:
        """Columns that it reads and a run lacks, found by a trial with ones."""
        tried = _Tried(dict.fromkeys(known, np.ones(2)))
        with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):
            try:
                self.function(tried)
            except Exception:  # ones need not suit it; a run says what is wrong
                return tried.lacking
        return ()

    def of(self, columns: Rows) -> np.ndarray:
        """Its values at the rows of other columns (n,)."""
        try:
            found = np.asarray(self.function(LazyColumns(columns, lambda name: _kept(columns[name]))), float)
            if found.shape != (rows := columns["time"].shape):
                raise ValueError(f"gives an array of shape {found.shape}, where the columns have {rows}")
            half = LazyColumns(columns, lambda name: _kept(columns[name][len(found) // 2 :]))
            again = np.asarray(self.function(half), float)
            if not np.allclose(again, found[len(found) // 2 :], rtol=1e-9, atol=0.0, equal_nan=True):
                raise ValueError("is another for a part of the rows: each must follow from its own row")
        except Exception as error:  # of the user's code
            error.add_note(f"in the column {self.name}, {place_of(error, self.function)}")
            raise
        return found


class _Tried(dict[str, np.ndarray]):
    lacking: tuple[str, ...] = ()

    def __missing__(self, name: str) -> np.ndarray:
        self.lacking = (name,)
        raise KeyError(name)


def _kept(values: np.ndarray) -> np.ndarray:
    """The same values, into which nobody may write."""
    found = np.asarray(values).view()
    found.flags.writeable = False
    return found


def column(name: str, unit: str, sign: str = "") -> Callable[[Function], OwnColumn]:
    """Make a function of columns a column of every run that has its inputs, for `register`.

    The function gets columns by name, `columns["ankle/angle"]` [SI] (n,), and returns (n,) numbers. Each row
    must follow from the same row alone: a controller sees few rows at a time. Controllers and
    `[sensor.NAME]` can read it.

    Parameters
    ----------
    name : such as "strap/force"
    unit : SI unit of the numbers, such as "N"; "" of a bare number
    sign : what is positive, in words

    Returns
    -------
    OwnColumn; calling it with columns or a recording calls the function

    Raises
    ------
    InputError
        At registration: its name is invalid or taken, or its unit is not SI.

    Examples
    --------
    >>> @column("ankle/power", "W", "of the orthosis, lifting the foot positive")
    ... def power(columns):
    ...     return columns["ankle/moment/orthosis"] * columns["ankle/velocity"]
    >>> register(power)
    >>> run("seated", {"duration": "1 s"})["ankle/power"].shape
    (500,)
    """
    return lambda function: OwnColumn(name, unit, sign, function)


takes(OwnColumn, "afo_sim.simulation.columns")

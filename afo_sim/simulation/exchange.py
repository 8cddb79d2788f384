"""Columns of a recording as tables of other libraries."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas
    import xarray

Describe = Callable[[str], tuple[str, str]]  # (unit, sign) of a column


def frame(columns: Mapping[str, np.ndarray], describe: Describe) -> "pandas.DataFrame":
    """The columns as a pandas DataFrame, their units in `attrs["units"]`."""
    import pandas

    made = pandas.DataFrame(columns)
    made.attrs = {"units": {name: describe(name)[0] for name in columns}}
    return made


def dataset(
    columns: Mapping[str, np.ndarray], describe: Describe, facts: Mapping[str, object]
) -> "xarray.Dataset":
    """The columns as an xarray Dataset over the coordinate `time`.

    Units: describe ["units"].
    """
    import xarray

    variables = {}
    for name, values in columns.items():
        unit, sign = describe(name)
        variables[name] = ("time", values, {"long_name": name, "units": unit, "sign": sign})
    time = variables.pop("time")
    return xarray.Dataset(variables, coords={"time": time}, attrs=dict(facts))

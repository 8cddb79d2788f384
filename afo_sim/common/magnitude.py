"""The one gate that every number of a file passes: finite, and of a magnitude that something can have."""

from typing import Any

import numpy as np

from afo_sim.common.errors import InputError

LARGEST = 1e12  # in any unit that people record in (mm, N·mm, ms, Pa): beyond it products overflow
LEAST = 1e-30  # in such a unit: below it a number is a filter's rest of 0, and its inverse overflows


def plausible(values: Any, *, file: object = None, field: str = "", missing: bool = False) -> np.ndarray:
    """Numbers that were read, as floats that can be calculated with.

    Parameters
    ----------
    values : number or array of any shape, in its file's unit
    file, field : that hold them, for the message
    missing : NaN stands for what was not measured, and passes

    Returns
    -------
    array of the same shape; what is closer to 0 than `LEAST` is 0

    Raises
    ------
    InputError
        A value is not a number, is infinite, or beyond ±`LARGEST`.
    """
    try:
        found = np.array(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError("is not a number", file=file, field=field, value=values) from None
    beyond = ~(np.abs(found) <= LARGEST)
    if missing:
        beyond &= ~np.isnan(found)
    if beyond.any():
        first = float(found[beyond].flat[0])
        problem = "is not a magnitude that this can have" if np.isfinite(first) else "is not a finite number"
        raise InputError(problem, file=file, field=field, value=first, allowed=f"up to ±{LARGEST:g}")
    found[np.abs(found) < LEAST] = 0.0
    return found

"""The peak of a torque as its largest mean over 10 ms: what a single instant shows may be an impact."""

import numpy as np

WINDOW = 0.010  # [s]
OVER = "_10ms"  # ends the name of a peak that is a mean over the window
MEANING = "largest mean over 10 ms"


def largest_mean(values: np.ndarray, timestep: float, window: float = WINDOW) -> float:
    """Largest mean of a signal over a window that begins or ends at a row, straight between its rows.

    Parameters
    ----------
    values : at even instants (n,), n ≥ 1
    timestep : between two rows [s]
    window : [s]

    Returns
    -------
    float; of a signal that is shorter than the window its mean
    """
    if len(values) == 1:
        return float(values[0])
    if (len(values) - 1) * timestep <= window:
        return float(np.mean(0.5 * (values[1:] + values[:-1])))
    return max(_from_rows(values, timestep, window), _from_rows(values[::-1], timestep, window))


def _from_rows(values: np.ndarray, timestep: float, window: float) -> float:
    """Largest mean over the windows that begin at a row."""
    whole = int(window / timestep * (1.0 + 1e-12))
    rest = max(0.0, window / timestep - whole)  # of the last step, as a share of it
    area = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])
    found = area[whole:] - area[: len(area) - whole]
    if rest > 1e-9:
        begun = values[whole:]
        found = found[:-1] + rest * begun[:-1] + 0.5 * rest**2 * np.diff(begun)
    return float(found.max()) * timestep / window

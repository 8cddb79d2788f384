"""Peaks as the means over 10 ms that they are, found by trying windows of finely drawn signals."""

import numpy as np

GRID = 1e-4  # [s]


def over_10_ms(time: np.ndarray, values: np.ndarray) -> float:
    """Largest mean over 10 ms of a signal, straight between its rows."""
    fine = np.arange(time[0], time[-1], GRID)
    signal = np.interp(fine, time, values)
    return float(np.convolve(0.5 * (signal[1:] + signal[:-1]), np.full(100, 0.01), "valid").max())

"""Numbers that a designer asks of a recording."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Metric:
    """A number and the unit it is told in."""

    value: float
    unit: str

    def __str__(self) -> str:
        return f"{self.value:.4g} {self.unit}"


def rise_time(time: np.ndarray, signal: np.ndarray) -> float:
    """Time in which a signal first goes from 10 % to 90 % of the way from its start to its peak.

    Parameters
    ----------
    time : [s] (n,)
    signal : (n,)

    Returns
    -------
    float [s]; NaN when the signal never rises
    """
    peak = int(np.argmax(signal))
    start, height = signal[0], signal[peak] - signal[0]
    if height <= 0.0:
        return float("nan")
    rising = (signal[: peak + 1] - start) / height
    low, high = (_crossing(time, rising, level) for level in (0.1, 0.9))
    return high - low


def _crossing(time: np.ndarray, rising: np.ndarray, level: float) -> float:
    k = int(np.argmax(rising >= level))
    if k == 0:
        return float(time[0])
    share = (level - rising[k - 1]) / (rising[k] - rising[k - 1])
    return float(time[k - 1] + share * (time[k] - time[k - 1]))


def ankle_metrics(
    columns: Mapping[str, np.ndarray],
    timestep: float,
    period: float,
    directions: tuple[str, str] = ("dorsiflexion", "plantarflexion"),
) -> dict[str, Metric]:
    """Angle, torque, pressure and air of a run.

    Parameters
    ----------
    columns : of a recording at the full step rate, SI
    timestep : [s]
    period : the timer's cycle [s]
    directions : what positive and negative angles are called

    Returns
    -------
    dict of Metric by name. Air used is what the inlet valves take from the supply, per cycle begun.
    """
    time, angle = columns["time"], np.degrees(columns["ankle/angle"])
    torque = columns["ankle/moment/orthosis"]
    first_cycle = time < max(period, time[0] + timestep)  # of a later stretch, its first row
    found = {
        f"peak_{directions[0]}_angle": Metric(float(angle.max()), "deg"),
        f"peak_{directions[1]}_angle": Metric(float(angle.min()), "deg"),
        "range_of_motion": Metric(float(np.ptp(angle)), "deg"),
        f"peak_{directions[0]}_torque": Metric(max(float(torque.max()), 0.0), "N*m"),
        f"peak_{directions[1]}_torque": Metric(max(0.0, 0.0 - float(torque.min())), "N*m"),
        "rise_time": Metric(rise_time(time[first_cycle], angle[first_cycle]), "s"),
    }
    cycles = max(math.ceil((time[-1] + timestep) / period - 1e-9), 1)
    total = 0.0
    for name in [c.split("/")[1] for c in columns if c.startswith("chamber/") and c.endswith("/mass")]:
        pressure = columns[f"chamber/{name}/pressure"]
        found[f"peak_pressure_{name}"] = Metric(float(pressure.max()) * 1e-5, "bar")
        flow = columns[f"valve/{name}_inlet/mass_flow"]
        air = float(np.sum(np.maximum(flow, 0.0))) * timestep * 1e3 / cycles
        found[f"air_per_cycle_{name}"] = Metric(air, "g")
        total += air
    found["air_per_cycle"] = Metric(total, "g")
    return found

"""Angle, torque, pressure and air of a run, whoever or whatever turns the joint."""

from collections.abc import Mapping

import numpy as np

from afo_sim.common import STANDARD_DENSITY
from afo_sim.metrics import peak
from afo_sim.metrics.air_per_stride import CYCLE, flow_metrics, grams_taken, grams_through, positive_work
from afo_sim.metrics.metric import AIR, ANKLE, TORQUE, Metric, all_measured, reported
from afo_sim.metrics.needed_torque import inversion_peaks
from afo_sim.metrics.strides import chambers
from afo_sim.metrics.valves import switching_by_the_minute
from afo_sim.metrics.window import crossing, whole_cycles

ROUND_OFF = 1e-12  # of a signal's size: what moves by no more stands still


def rise_time(time: np.ndarray, signal: np.ndarray) -> float:
    """Time in which a signal first goes from 10 % to 90 % of the way from its start to its peak."""
    top = int(np.argmax(signal))
    start, height = signal[0], signal[top] - signal[0]
    if height <= ROUND_OFF * np.abs(signal).max():
        return float("nan")
    rising = (signal[: top + 1] - start) / height
    low, high = (crossing(time, rising - level, int(np.argmax(rising >= level))) for level in (0.1, 0.9))
    return high - low


@reported(
    AIR,
    ("peak_pressure_{}", "bar", "Peak pressure, {}", "gauge"),
    ("air_per_cycle_{}", "g", "Air per cycle, {}", f"through its inlet, wherever from; {CYCLE}"),
    ("air_per_cycle", "g", "Air per cycle", f"taken from the supply; {CYCLE}"),
)
@reported(
    TORQUE,
    peak.row("peak_{}_torque", "{} torque"),
)
@reported(
    ANKLE,
    ("peak_{}_angle", "deg", "{} angle, peak"),
    ("range_of_motion", "deg", "Range of motion"),
    ("rise_time", "s", "Rise time", "from 10 % to 90 % of the way up"),
)
def ankle_metrics(
    columns: Mapping[str, np.ndarray],
    timestep: float,
    period: float,
    directions: tuple[str, str] = ("dorsiflexion", "plantarflexion"),
    free_density: float = STANDARD_DENSITY,
) -> dict[str, Metric]:
    """Angle, torque, pressure and air of a run."""
    time, angle = columns["time"], np.degrees(columns["ankle/angle"])
    torque = columns["ankle/moment/orthosis"]
    first_cycle = time < max(period, time[0] + timestep)  # of a later stretch, its first row
    found = {
        f"peak_{directions[0]}_angle": float(angle.max()),
        f"peak_{directions[1]}_angle": float(angle.min()),
        "range_of_motion": float(np.ptp(angle)),
    }
    for side, way in zip(directions, (torque, 0.0 - torque), strict=True):
        found[f"peak_{side}_torque"] = peak.highest_mean(way, timestep)
    found |= dict(inversion_peaks(columns, timestep))
    found["rise_time"] = rise_time(time[first_cycle], angle[first_cycle])
    cycles, part = whole_cycles(len(time), timestep, period)
    steps, names = timestep * part.shares(0, len(time)), chambers(columns)
    for name in names:
        found[f"peak_pressure_{name}"] = float(columns[f"chamber/{name}/pressure"].max()) * 1e-5
        found[f"air_per_cycle_{name}"] = grams_through(columns, name, steps) / cycles
    found["air_per_cycle"] = grams_taken(columns, names, steps) / cycles
    if names:
        found |= dict(flow_metrics(columns, names, steps, timestep, cycles=cycles, free_density=free_density))
        found["positive_work"] = positive_work(columns, part) / cycles
    found |= dict(switching_by_the_minute(columns, steps))
    return all_measured(found.items())

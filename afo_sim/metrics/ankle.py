"""Angle, torque, pressure and air of a run, whatever turns the joint."""

import math
from collections.abc import Mapping

import numpy as np

from afo_sim.common import STANDARD_DENSITY, Doubles
from afo_sim.metrics import peak
from afo_sim.metrics.air_per_stride import CYCLE, bill, flow_of
from afo_sim.metrics.kernel import NUMBERS, call, chambers, kernel
from afo_sim.metrics.metric import AIR, ANKLE, REPORTED, TORQUE, Metric, all_measured, reported
from afo_sim.metrics.needed_torque import INVERSION
from afo_sim.metrics.valves import switching_by_the_minute
from afo_sim.metrics.window import crossed, whole_cycles

ROUND_OFF = 1e-12  # of a signal's size: what moves by no more stands still


@kernel()
def _rise(b: Doubles, out: Doubles) -> float:
    time, signal, top, size = NUMBERS, NUMBERS + int(b[0]), 0, 0.0
    for k in range(int(b[0])):
        top = k if b[signal + k] > b[signal + top] else top
        size = max(size, abs(b[signal + k]))
    start, height = b[signal], b[signal + top] - b[signal]
    out[0] = 0.0 if height > ROUND_OFF * size else math.nan
    for level, sign in ((0.1, -1.0), (0.9, 1.0)):
        k = 0
        while (b[signal + k] - start) / height < level:
            k += 1
        a = max(k - 1, 0)
        before, value = (b[signal + a] - start) / height - level, (b[signal + k] - start) / height - level
        out[0] += sign * crossed(b[time + a], b[time + k], before, value)
    return 0.0


def rise_time(time: np.ndarray, signal: np.ndarray) -> float:
    """Time in which a signal first goes from 10 % to 90 % of the way from its start to its peak."""
    return float(call(_rise, (), (time, signal))[0])


@reported(
    AIR,
    ("air_per_cycle_{}", "g", "Air per cycle, {}", f"through its inlet, wherever from; {CYCLE}"),
    ("air_per_cycle", "g", "Air per cycle", f"taken from the supply; {CYCLE}"),
)
@reported(TORQUE, peak.row("peak_{}_torque", "{} torque"))
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
    if INVERSION in columns:
        found["peak_inversion_moment"] = peak.highest_mean(columns[INVERSION], timestep)
        found["peak_eversion_moment"] = peak.highest_mean(0.0 - columns[INVERSION], timestep)
    found["rise_time"] = rise_time(time[first_cycle], angle[first_cycle])
    cycles, part = whole_cycles(len(time), timestep, period)
    steps, names = timestep * part.shares(0, len(time)), chambers(columns)
    told = bill(columns, timestep, part, cycles, free_density)
    for name in names:
        found[f"peak_pressure_{name}"] = told[f"peak_pressure_{name}"]
        found[f"air_per_cycle_{name}"] = told[f"air_per_stride_{name}"]
    found["air_per_cycle"] = told["air_per_stride"]
    if names:
        found |= {row.name: told[row.name] for row in REPORTED[flow_of] if row.name in told}
    found |= dict(switching_by_the_minute(columns, steps))
    return all_measured(found.items())

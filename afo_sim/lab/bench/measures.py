"""Numbers of a curve of the stand: errors, loops, time constants, speeds."""

import math

import numpy as np

from afo_sim.lab.bench.plan import StandPlan
from afo_sim.metrics.metric import Metric

Rows = dict[str, np.ndarray]
BEGUN, REACHED = 0.01, 1.0 - math.exp(-1.0)  # shares of a change: dead time, time constant
# Axes of a plot: (abscissa, its unit, ordinate, its unit)
AXES = {
    "isobaric": ("contraction", "", "force", "N"),
    "isotonic": ("pressure", "Pa", "contraction", ""),
    "isometric": ("pressure", "Pa", "force", "N"),
}


def measures(plan: StandPlan, curve: int, columns: Rows, strongest: float) -> dict[str, Metric]:
    """The numbers of one curve, over its last way up and down.

    `off_formula` is the greatest distance of the force from the formula in the rows in which the muscle
    pulls. A held muscle whose mounting hangs slack swells at its own length, where damper and friction alone
    bear its law.

    Units: strongest [N].
    """
    if plan.kind == "step":
        return _step(plan, columns)
    if plan.kind == "release":
        return _release(plan, columns)
    return _sweep(plan, curve, columns, strongest)


def _sweep(plan: StandPlan, curve: int, columns: Rows, strongest: float) -> dict[str, Metric]:
    abscissa, _, ordinate, unit = AXES[plan.kind]
    x, y = columns[abscissa], columns[ordinate]
    carried = columns["force"] if plan.held else columns["load"]
    off = float(np.abs(carried - columns["static_force"]).max(where=columns["force"] > 0.0, initial=0.0))
    # what the dampers and friction took: the formula alone gives back all that it takes
    lost = np.trapezoid(columns["static_force"] - columns["force"], -columns["length"])
    found = {
        f"greatest_{ordinate}": Metric(float(y.max()), unit),
        "off_formula": Metric(off, "N"),
        "off_formula_share": Metric(100.0 * off / strongest, "%"),
    }
    if plan.kind == "isobaric":
        wanted = plan.set_points[curve]
        found["pressure_off"] = Metric(100.0 * float(np.abs(columns["pressure"] / wanted - 1.0).max()), "%")
    down = columns["branch"] % 2 == 1
    if not down.any() or plan.kind == "isometric":  # nothing moves, so nothing rubs
        return found
    return found | {
        "loop_height": Metric(loop_height(x, y, down), unit),
        "loop_area": Metric(abs(float(np.trapezoid(y, x))), "N" if plan.kind == "isobaric" else "Pa"),
        "work_lost_per_cycle": Metric(float(lost), "J"),
    }


def loop_height(x: np.ndarray, y: np.ndarray, down: np.ndarray) -> float:
    """Greatest difference of y between the ways up and down at equal x.

    Units: x, y (n,), down (n,).
    """
    if np.ptp(x) == 0.0:
        return 0.0
    up_x, up_y, down_x, down_y = x[~down], y[~down], x[down][::-1], y[down][::-1]
    grid = np.linspace(max(up_x[0], down_x[0]), min(up_x[-1], down_x[-1]), 400)
    return float(np.abs(np.interp(grid, up_x, up_y) - np.interp(grid, down_x, down_y)).max())


def _step(plan: StandPlan, columns: Rows) -> dict[str, Metric]:
    found = {}
    response = "force" if plan.held else "contraction"
    unit = {"force": "N", "contraction": ""}[response]
    turn = int(np.searchsorted(columns["time"], plan.duration - 1e-9))
    for word, rows in (("fill", slice(0, turn + 1)), ("vent", slice(turn, None))):
        time = columns["time"][rows] - columns["time"][rows][0]
        for name in ("pressure", response):
            values = columns[name][rows]
            found[f"{word}_{name}_dead_time"] = Metric(time_to(BEGUN, time, values), "s")
            found[f"{word}_{name}_time_constant"] = Metric(time_to(REACHED, time, values), "s")
    filled = {name: float(columns[name][turn]) for name in ("pressure", response, "air_mass")}
    found["filled_pressure"] = Metric(filled["pressure"], "Pa")
    found[f"filled_{response}"] = Metric(filled[response], unit)
    found["air_per_fill"] = Metric(1e3 * (filled["air_mass"] - float(columns["air_mass"][0])), "g")
    before = int(np.searchsorted(columns["time"], 0.95 * plan.duration))
    moved = abs(filled[response] - float(columns[response][before]))
    found["still_moving"] = Metric(100.0 * moved / max(abs(filled[response]), 1e-12), "%")
    return found


def time_to(share: float, time: np.ndarray, values: np.ndarray) -> float:
    """First time at which a change from the first to the last value has gone a share of its way [s]."""
    change = values[-1] - values[0]
    if change == 0.0:
        return math.nan
    gone = (values - values[0]) / change
    k = int(np.argmax(gone >= share))
    if k == 0:
        return 0.0
    part = (share - gone[k - 1]) / (gone[k] - gone[k - 1])
    return float(time[k - 1] + part * (time[k] - time[k - 1]))


def _release(plan: StandPlan, columns: Rows) -> dict[str, Metric]:
    speed, contraction = -columns["velocity"], columns["contraction"]
    fastest = int(np.argmax(speed))
    way = contraction[-1] - contraction[0]
    return {
        "peak_speed": Metric(float(speed[fastest]), "m/s"),
        "time_of_peak_speed": Metric(float(columns["time"][fastest]), "s"),
        "time_constant": Metric(time_to(REACHED, columns["time"], contraction), "s"),
        "final_contraction": Metric(float(contraction[-1]), ""),
        "overshoot": Metric(100.0 * float(contraction.max() - contraction[-1]) / way if way else 0.0, "%"),
        "lowest_pressure": Metric(float(columns["pressure"].min()), "Pa"),
    }

"""How long the valves of a run last, by their makers' rated switchings."""

from collections.abc import Mapping

import numpy as np

from afo_sim.metrics.metric import Metric
from afo_sim.metrics.strides import settled, strides
from afo_sim.metrics.switching import life_metrics as metrics_of
from afo_sim.metrics.switching import rises
from afo_sim.model.build import Built

NEEDED: dict[str, frozenset[str]] = {"hours_until_valve_life": frozenset({"stride_time"})}


def life_metrics(built: Built, columns: Mapping[str, np.ndarray]) -> dict[str, Metric]:
    """Hours until a valve's rated switchings; of walking, by the strides that count."""
    rated = {
        f"{name}_{side}": valve.rated_switches
        for name, chamber in built.scenario.orthosis.chamber.items()
        for side, valve in (("inlet", chamber.inlet), ("outlet", chamber.vent))
        if valve.rated_switches is not None
    }
    if not rated:
        return {}
    step, rows = built.scenario.timestep, [slice(None)]
    if built.walk is not None:
        rows = [s.rows for s in settled(columns, strides(columns, step, built.body_mass))]
    seconds = step * sum(len(columns["time"][part]) for part in rows)
    if seconds <= 0.0:
        return {}
    counts = {valve: rises(columns, valve) for valve in rated}
    rates = {
        valve: sum(float(count[part].sum()) for part in rows) / seconds for valve, count in counts.items()
    }
    return metrics_of(rates, rated)

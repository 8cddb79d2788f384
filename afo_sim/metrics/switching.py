"""How often valves are switched, and how long they last at that."""

from collections.abc import Mapping

import numpy as np

from afo_sim.metrics.facts import Run
from afo_sim.metrics.metric import AIR, Found, Metric, Of, measured, reported
from afo_sim.metrics.strides import Stride

ON = "how often its coil is switched on; a proportional valve's, from shut to open"
SECONDS = 3600.0  # of an hour


def valves(columns: Mapping[str, np.ndarray]) -> list[str]:
    """Names of a recording's valves."""
    return [name.split("/")[1] for name in columns if name.startswith("valve/") and name.endswith("/coil")]


def rises(columns: Mapping[str, np.ndarray], valve: str) -> np.ndarray:
    """How often a valve's coil is switched on in each row's step (n,).

    A pressure drive counts its pulses itself. Of others a rise from no current counts: two pulses in
    neighbouring steps would be one.

    Parameters
    ----------
    columns : of a recording at the full step rate
    valve : name, such as "dorsiflexor_inlet"
    """
    counted = columns.get(f"valve/{valve}/switches")
    if counted is not None:
        return np.maximum(np.diff(counted, append=counted[-1:]), 0.0)
    on = columns[f"valve/{valve}/coil"] > 0.0
    before = np.concatenate([[False], on[:-1]])
    found: np.ndarray = (on & ~before).astype(float)
    return found


@reported(AIR, ("switches_per_stride_{}", "", "Switchings per stride, {}", ON), of=Of.WORN)
def switching(stride: Stride) -> Found:
    """Switchings of each valve in a stride."""
    for valve in valves(stride.columns):
        yield f"switches_per_stride_{valve}", float(rises(stride.columns, valve)[stride.rows].sum())


@reported(AIR, ("switches_per_minute_{}", "", "Switchings per minute, {}", ON))
def switching_by_the_minute(columns: Mapping[str, np.ndarray], timestep: float) -> Found:
    """Switchings of each valve in a run, by the minute.

    Units: timestep [s].
    """
    minutes = len(columns["time"]) * timestep / 60.0
    for valve in valves(columns):
        yield f"switches_per_minute_{valve}", float(rises(columns, valve).sum()) / minutes


@reported(
    AIR,
    (
        "hours_until_valve_life",
        "h",
        "Hours until a valve's rated switchings",
        "of the valve that comes to them first, switched without a pause as in this run",
    ),
    of=Of.RUN,
    made_of=("stride_time",),
)
def valve_life(run: Run) -> Found:
    """Hours until a valve's rated switchings; of walking, by the strides that count."""
    rated, step = run.facts.rated_switches or {}, run.facts.timestep
    parts = [stride.rows for stride in run.counted] if run.facts.walks else [slice(None)]
    seconds = step * sum(len(run.columns["time"][part]) for part in parts)
    if not rated or seconds <= 0.0:
        return
    counts = {valve: rises(run.columns, valve) for valve in rated}
    rates = {
        valve: sum(float(count[part].sum()) for part in parts) / seconds for valve, count in counts.items()
    }
    yield from life_metrics(rates, rated).items()


def life_metrics(rates: Mapping[str, float], rated: Mapping[str, float]) -> dict[str, Metric]:
    """Hours until the first valve has been switched as often as its maker rates it.

    Parameters
    ----------
    rates : switchings a second by valve [1/s]
    rated : switchings by valve; those without a rating are left out

    Returns
    -------
    dict of Metric by name; empty where no rated valve is switched
    """
    hours = [rated[valve] / rate / SECONDS for valve, rate in rates.items() if valve in rated and rate > 0.0]
    return {"hours_until_valve_life": measured("hours_until_valve_life", min(hours))} if hours else {}

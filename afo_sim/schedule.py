"""Solenoid timer → the control array (n_step, nu) that a simulation is driven with."""

import numpy as np

from afo_sim.model import Built
from afo_sim.spec import Timer


def open_at(
    intervals: tuple[tuple[float, float], ...], period: float, time: np.ndarray, step: float
) -> np.ndarray:
    """The share of each step for which a valve is switched on.

    Parameters
    ----------
    intervals : [from, to) within the period [s]
    period : [s]
    time : start of each step [s] (n,)
    step : [s]

    Returns
    -------
    (n,) from 0 to 1: between them where an event falls within a step
    """
    merged = _merged(intervals)
    total = sum(end - start for start, end in merged)

    def switched_on_until(moment: np.ndarray) -> np.ndarray:
        cycle, phase = np.divmod(moment, period)
        inside = [np.clip(phase - start, 0.0, end - start) for start, end in merged]
        return cycle * total + np.sum(inside, axis=0) if merged else np.zeros_like(moment)

    share = (switched_on_until(time + step) - switched_on_until(time)) / step
    # to a billionth, so that an event on a step's edge is one
    return np.round(np.clip(share, 0.0, 1.0), 9)


def _merged(intervals: tuple[tuple[float, float], ...]) -> list[tuple[float, float]]:
    """Overlapping events as one."""
    merged: list[tuple[float, float]] = []
    for start, end in sorted(intervals):
        if merged and start <= merged[-1][1]:
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((start, end))
    return merged


def controls(built: Built, n_step: int | None = None) -> np.ndarray:
    """Inputs of every actuator at every step.

    Parameters
    ----------
    built : compiled scenario
    n_step : number of steps; the scenario's own by default

    Returns
    -------
    (n_step, nu): coil commands [-], supply pressure, gauge [Pa], knee angle [rad]; zero for muscles
    """
    scenario, index = built.scenario, built.index
    time = np.arange(n_step or scenario.n_step) * scenario.timestep
    control = np.zeros((len(time), built.model.nu))
    control[:, index.passive] = scenario.shank.knee_angle
    control[:, list(index.chambers.values())] = scenario.supply.pressure
    timer: Timer = scenario.timer
    for chamber, times in timer.chambers.items():
        for side in ("inlet", "outlet"):
            coil = open_at(getattr(times, side), timer.period, time, scenario.timestep)
            control[:, index.valves[f"{chamber}_{side}"]] = coil
    return control

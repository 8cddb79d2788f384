"""Solenoid timer → the control array (n_step, nu) that a simulation is driven with."""

import numpy as np

from afo_sim.model import Built
from afo_sim.spec import Timer


def open_at(intervals: tuple[tuple[float, float], ...], period: float, time: np.ndarray) -> np.ndarray:
    """Whether a valve is switched on, 0 or 1, at each time.

    Parameters
    ----------
    intervals : [from, to) within the period [s]
    period : [s]
    time : [s] (n,)

    Returns
    -------
    (n,) of 0.0 and 1.0
    """
    # a nanosecond's grace, so that 4000 × 0.001 s counts as 4 s
    phase = np.mod(time + 1e-9, period)
    on = np.zeros(len(time), dtype=bool)
    for start, end in intervals:
        on |= (phase >= start) & (phase < end)
    return on.astype(float)


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
            coil = open_at(getattr(times, side), timer.period, time)
            control[:, index.valves[f"{chamber}_{side}"]] = coil
    return control

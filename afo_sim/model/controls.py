"""Solenoid timer, gait phase, recorded walking → the control array (n_step, nu) of a simulation."""

import numpy as np

from afo_sim.model.build import Built
from afo_sim.model.patient import ground_moment
from afo_sim.model.walk import JOINTS
from afo_sim.model.walk_bodies import ACTIVE, FLOORS, GROUND, STIFFNESS, SUPPORT


def open_at(
    intervals: tuple[tuple[float, float], ...], period: float, time: np.ndarray, step: float | np.ndarray
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
    (n_step, nu): coil commands [-], supply pressure, gauge [Pa], knee angle [rad]; in walking also the
    shank's acceleration, the ground's and the patient's moment; zero for muscles
    """
    scenario, index = built.scenario, built.index
    count = n_step or scenario.n_step
    control = np.zeros((count, built.model.nu))
    control[:, index.passive] = scenario.shank.knee_angle or 0.0
    control[:, list(index.chambers.values())] = scenario.supply.pressure
    time = np.arange(count) * scenario.timestep
    if scenario.timer is not None:
        for chamber, times in scenario.timer.chambers.items():
            for side in ("inlet", "outlet"):
                coil = open_at(getattr(times, side), scenario.timer.period, time, scenario.timestep)
                control[:, index.valves[f"{chamber}_{side}"]] = coil
    if built.walk is not None:
        _walking_controls(built, control)
    return control


def _walking_controls(built: Built, control: np.ndarray) -> None:
    """The inputs of recorded walking, and of valves that follow the gait phase, into the array."""
    walk, own, index = built.walk, built.active, built.index
    assert walk is not None and own is not None
    steps = slice(len(control))
    for column, joint in enumerate(JOINTS):
        control[:, index.walking[f"drive_{joint}"]] = walk.acceleration[steps, column]
    control[:, index.passive] = walk.knee[1:-1][steps]
    if built.contact is None:
        control[:, index.walking[GROUND]] = ground_moment(walk, built.body_mass)[steps]
    else:
        control[:, index.walking[GROUND]] = built.contact.moment[steps]
        control[:, index.walking[SUPPORT]] = built.contact.support[steps]
        control[:, [index.walking[name] for name in FLOORS]] = built.contact.floor[steps]
    control[:, index.walking[ACTIVE]] = own.moment[steps]
    control[:, index.walking[STIFFNESS]] = own.stiffness[steps]
    phases = built.scenario.phases
    for chamber, events in phases.chambers.items() if phases else ():
        for side in ("inlet", "outlet"):
            parts = [
                p for a, b in getattr(events, side) for p in ([(a, b)] if a < b else [(a, 1.0), (0.0, b)])
            ]
            phase = walk.phase[1:-1][steps]
            # over a step the phase advances evenly: its share is the time's
            share = open_at(tuple(parts), 1.0, phase, walk.phase[2:][steps] - phase)
            control[:, index.valves[f"{chamber}_{side}"]] = share

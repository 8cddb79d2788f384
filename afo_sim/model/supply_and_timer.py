"""Solenoid timer, gait phase, recorded walking → the control array (n_step, nu) of a simulation."""

import functools
from collections.abc import Container, Iterator

import numpy as np

from afo_sim.common import Mixed
from afo_sim.model.build import Built
from afo_sim.model.foot import REST, rest_moment
from afo_sim.model.muscle_weakness import ground_moment
from afo_sim.model.walk import JOINTS, Clock, Intervals
from afo_sim.model.walk_bodies import ACTIVE, GROUND, PADS, STIFFNESS, SUPPORT

OFF = -1.0  # input of a drive that leaves its valves to their own inputs


def controls(built: Built, n_step: int | None = None) -> np.ndarray:
    """Inputs of every actuator at every step."""
    scenario, index = built.scenario, built.index
    count = n_step or scenario.n_step
    control = np.zeros((count, built.model.nu))
    control[:, index.passive] = scenario.shank.knee_angle or 0.0
    control[:, list(index.chambers.values())] = scenario.supply.fixed
    control[:, list(index.drives.values())] = OFF
    if scenario.timer is not None:
        clock = Clock.of(np.arange(count) * scenario.timestep, scenario.timestep, scenario.timer.period)
        for chamber, times in scenario.timer.chambers.items():
            for valve, intervals in valves_at(chamber, times, index.chambers):
                control[:, index.valves[valve]] = clock.share(intervals)
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
        pads = [index.walking[name] for name in PADS if name in index.walking]
        control[:, pads] = built.contact.floor[steps]
    control[:, index.walking[ACTIVE]] = own.moment[steps]
    control[:, index.walking[STIFFNESS]] = own.stiffness[steps]
    if walk.toe is not None:
        rest = rest_moment(built.model, built.scenario, walk.toe, walk.timestep)
        if built.contact is not None and built.contact.flexors is not None:
            rest = rest + built.contact.flexors
        control[:, index.walking[REST]] = rest[steps]
    phases = built.scenario.phases
    for chamber, events in phases.chambers.items() if phases else ():
        for valve, intervals in valves_at(chamber, events, index.chambers):
            parts = tuple(p for a, b in intervals for p in ([(a, b)] if a < b else [(a, 1.0), (0.0, b)]))
            if parts:
                control[:, index.valves[valve]] = _share(walk.clock, parts)[steps]


def valves_at(name: str, times: Mixed, chambers: Container[str]) -> Iterator[tuple[str, Intervals]]:
    """(valve, its intervals) of a table of times: of a chamber's two valves, or of one between nodes."""
    if name not in chambers:
        yield name, times.open
        return
    for side in ("inlet", "outlet"):
        yield f"{name}_{side}", getattr(times, side)


@functools.lru_cache(maxsize=8)  # cases of a sweep share what they do not change
def _share(clock: Clock, intervals: Intervals) -> np.ndarray:
    share = clock.share(intervals)
    share.flags.writeable = False
    return share

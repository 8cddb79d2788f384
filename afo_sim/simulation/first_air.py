"""The air that the search for a settled stride begins with: chambers of constant volume and temperature.

    dp/dt = R T_a (ṁ_in − ṁ_out)/V

over a few strides in coarse steps. It is a guess, on which no result depends.
"""

from collections.abc import Mapping

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.description.orthosis import Chamber
from afo_sim.model import Built
from afo_sim.physics import valve_flow

FILLED = 0.5  # share of the supply's pressure at which the volume is taken, and from which it begins
PARTS, STRIDES = 60, 3  # coarse steps of a stride, strides


def first_air(built: Built, data: mujoco.MjData, control: np.ndarray) -> Mapping[int, float]:
    """Gauge pressure of every chamber at the start of a stride [Pa], by its actuator."""
    index = built.index
    set_to = built.scenario.supply.pressure  # a line before a regulator has more
    filled = {i: FILLED * min(float(control[0, i]), set_to) for i in index.chambers.values()}
    native.fill_chambers(built.model, data, filled)
    cuts = np.linspace(0, len(control), PARTS + 1).astype(int)
    found = {}
    for name, chamber in built.scenario.orthosis.chamber.items():
        actuator = index.chambers[name]
        coils = [control[:, index.valves[f"{name}_{side}"]] for side in ("inlet", "outlet")]
        opened = [np.add.reduceat(coil, cuts[:-1]) / np.diff(cuts) for coil in coils]
        volume = float(native.read_flows(built.model, data.userdata, actuator).volume)
        supply = min(float(control[0, actuator]), set_to) + AMBIENT_PRESSURE
        found[actuator] = _pressure(chamber, supply, volume, opened, built.scenario.timestep * len(control))
    return found


def _pressure(
    chamber: Chamber, supply: float, volume: float, opened: list[np.ndarray], stride: float
) -> float:
    """Gauge pressure after a few strides [Pa], from the valves' openings in each part of one."""
    if not opened[0].any():  # never filled
        return 0.0
    ambient, warm = AMBIENT_PRESSURE, AMBIENT_TEMPERATURE
    per_mass = GAS_CONSTANT * warm / volume * stride / PARTS
    inlet, outlet = chamber.inlet, chamber.vent
    pressure = ambient + FILLED * (supply - ambient)
    for _ in range(STRIDES):
        for into, out in zip(*(share.tolist() for share in opened), strict=True):
            entering = valve_flow(supply, warm, pressure, warm, into, inlet.conductance, inlet.critical_ratio)
            leaving = valve_flow(
                pressure, warm, ambient, warm, out, outlet.conductance, outlet.critical_ratio
            )
            pressure += per_mass * (entering - leaving)
            pressure = min(max(pressure, ambient), supply)  # a coarse step may overshoot
    return pressure - ambient

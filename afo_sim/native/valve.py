"""Solenoid and proportional valves: the rates of their two states."""

from typing import Any

from afo_sim.native.slots import (
    VALVE_BANDWIDTH,
    VALVE_CLOSING_DELAY,
    VALVE_COIL,
    VALVE_DEAD_BAND,
    VALVE_OPENING_DELAY,
)
from afo_sim.native.state import ARMATURE, OPENING
from afo_sim.physics.driving import proportional_rate
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.pneumatics import beyond_dead_band, valve_rates


@register_jitable
def valve_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Write the rates of the valve actuator i, whose row starts at j; its coil is its input or a drive's."""
    u = m.actuator_user
    adr, driven = m.actuator_actadr[i], int(u[j + VALVE_COIL])
    coil = d.userdata[driven - 1] if driven > 0 else d.ctrl[i]
    if u[j + VALVE_BANDWIDTH] > 0.0:
        asked = beyond_dead_band(coil, u[j + VALVE_DEAD_BAND])
        rate = proportional_rate(asked, d.act[adr + OPENING], u[j + VALVE_BANDWIDTH], m.opt.timestep)
        d.act_dot[adr + ARMATURE], d.act_dot[adr + OPENING] = rate, rate
        return
    d.act_dot[adr + ARMATURE], d.act_dot[adr + OPENING] = valve_rates(
        coil,
        d.act[adr + ARMATURE],
        d.act[adr + OPENING],
        u[j + VALVE_OPENING_DELAY],
        u[j + VALVE_CLOSING_DELAY],
        m.opt.timestep,
    )

"""Solenoid and proportional valves: the rates of their two states."""

from typing import Any

from afo_sim.native.slots import VALVE_ACT, VALVE_ROW
from afo_sim.physics.driving import proportional_rate
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.pneumatics import beyond_dead_band, valve_rates


@register_jitable
def valve_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Write the rates of the valve actuator i, whose row starts at j; its coil is its input or a drive's."""
    u = m.actuator_user
    adr, driven = m.actuator_actadr[i], int(u[j + VALVE_ROW.coil])
    coil = d.userdata[driven - 1] if driven > 0 else d.ctrl[i]
    if u[j + VALVE_ROW.bandwidth] > 0.0:
        asked = beyond_dead_band(coil, u[j + VALVE_ROW.dead_band])
        rate = proportional_rate(
            asked, d.act[adr + VALVE_ACT.opening], u[j + VALVE_ROW.bandwidth], m.opt.timestep
        )
        d.act_dot[adr + VALVE_ACT.armature], d.act_dot[adr + VALVE_ACT.opening] = rate, rate
        return
    d.act_dot[adr + VALVE_ACT.armature], d.act_dot[adr + VALVE_ACT.opening] = valve_rates(
        coil,
        d.act[adr + VALVE_ACT.armature],
        d.act[adr + VALVE_ACT.opening],
        u[j + VALVE_ROW.opening_delay],
        u[j + VALVE_ROW.closing_delay],
        m.opt.timestep,
    )

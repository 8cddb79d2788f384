"""Valves and their pressure drives: a valve's states, and coils from the pressure that is asked for."""

import math
from typing import Any

from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.native.error_codes import FINE, NO_TARGET
from afo_sim.native.slots import (
    AIR_ROW,
    CHAMBER_DATA,
    CHAMBER_ROW,
    DRIVE_ACT,
    DRIVE_DATA,
    DRIVE_ROW,
    VALVE_ACT,
    VALVE_ROW,
    VOLUME_DATA,
    DriveKind,
    Kind,
    kind_of,
)
from afo_sim.physics import (
    NEVER,
    beyond_dead_band,
    low_passed,
    pid,
    proportional_opening,
    pulse_edges,
    pulse_width,
    pulses,
    ramped,
    register_jitable,
    seat_switches,
    two_point,
)


@register_jitable
def seat_of(m: Any, d: Any, i: int) -> tuple[float, float, float, float, float, float, float]:
    """`seat_switches` of the valve actuator i, or its mean opening if it is slow; its opening at the end."""
    u, j, adr, step = m.actuator_user, m.nuser_actuator * i, m.actuator_actadr[i], m.opt.timestep
    opening = d.act[adr + VALVE_ACT.opening]
    told = d.act[adr + VALVE_ACT.seat] + 0.0 * opening  # a NaN stays one
    if u[j + VALVE_ROW.bandwidth] > 0.0:
        asked = beyond_dead_band(coil_of(m, d, i), u[j + VALVE_ROW.dead_band])
        mean, end = proportional_opening(asked, opening, u[j + VALVE_ROW.bandwidth], step)
        return mean, NEVER, NEVER, end, end, 0.0, end
    seat, first, second, armature, end, coil = seat_switches(
        coil_of(m, d, i), d.act[adr + VALVE_ACT.coil], d.act[adr + VALVE_ACT.armature], told,
        u[j + VALVE_ROW.opening_delay] + hold(m, d, j), u[j + VALVE_ROW.closing_delay],
        u[j + VALVE_ROW.threshold], step,
    )  # fmt: skip
    up, down = u[j + VALVE_ROW.opening_ramp] / step, u[j + VALVE_ROW.closing_ramp] / step
    if up + down > 0.0:
        mean, reached = ramped(opening, seat, first, second, up, down)
        return mean, NEVER, NEVER, armature, end, coil, reached
    return seat, first, second, armature, end, coil, end


@register_jitable
def hold(m: Any, d: Any, j: int) -> float:
    """Time for which what holds a valve shut by F0 e^(−t/τ) outlasts the pressure, row at j [s]."""
    u, before = m.actuator_user, int(m.actuator_user[j + VALVE_ROW.before])
    if before < 0 or not u[j + VALVE_ROW.hold_decay] > 0.0:
        return 0.0
    q = m.nuser_actuator * before
    pressure = CHAMBER_DATA.pressure if kind_of(u, q) == Kind.CHAMBER else VOLUME_DATA.pressure
    gauge = max(d.userdata[int(u[q + AIR_ROW.userdata]) + pressure] - AMBIENT_PRESSURE, 1.0)
    return u[j + VALVE_ROW.hold_decay] * max(math.log(u[j + VALVE_ROW.hold_pressure] / gauge), 0.0)


@register_jitable
def coil_of(m: Any, d: Any, i: int) -> float:
    """Coil of the valve actuator i in this step [-]: its input or a drive's."""
    driven = int(m.actuator_user[m.nuser_actuator * i + VALVE_ROW.coil])
    return d.userdata[driven - 1] if driven > 0 else d.ctrl[i]


@register_jitable
def valve_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Write the rates of the valve actuator i, whose row starts at j."""
    adr, step = m.actuator_actadr[i], m.opt.timestep
    _, _, _, armature, seat, coil, opening = seat_of(m, d, i)
    d.act_dot[adr + VALVE_ACT.armature] = (armature - d.act[adr + VALVE_ACT.armature]) / step
    d.act_dot[adr + VALVE_ACT.opening] = (opening - d.act[adr + VALVE_ACT.opening]) / step
    d.act_dot[adr + VALVE_ACT.coil] = (coil - d.act[adr + VALVE_ACT.coil]) / step
    d.act_dot[adr + VALVE_ACT.seat] = (seat - d.act[adr + VALVE_ACT.seat]) / step


FIRST, OFF, ON = 0.0, 1.0, 2.0  # stages of a drive
SHUT = 0.01  # opening below which a proportional valve counts as shut [-]


@register_jitable
def drive_dyn(m: Any, d: Any, i: int, j: int) -> int:
    """Write coils and rates of the drive actuator i, whose row starts at j; the complaint, FINE for none."""
    u, act, act_dot, step = m.actuator_user, d.act, d.act_dot, m.opt.timestep
    a, place, target = m.actuator_actadr[i], int(u[j + DRIVE_ROW.userdata]), d.ctrl[i]
    if target != target:
        return NO_TARGET
    kind, chamber = int(u[j + DRIVE_ROW.kind]), m.nuser_actuator * int(u[j + DRIVE_ROW.chamber])
    pressure = d.userdata[int(u[chamber + AIR_ROW.userdata]) + CHAMBER_DATA.pressure] - AMBIENT_PRESSURE
    stage = act[a + DRIVE_ACT.stage]
    inlet_last, outlet_last = act[a + DRIVE_ACT.inlet_last], act[a + DRIVE_ACT.outlet_last]
    before = pressure if stage < OFF - 0.5 else act[a + DRIVE_ACT.reading]
    reading = low_passed(before, pressure, u[j + DRIVE_ROW.filter_time], step)
    integral, given, clock, now = 0.0, 0.0, 0.0, OFF
    inlet, outlet = d.ctrl[int(u[chamber + CHAMBER_ROW.inlet])], d.ctrl[int(u[chamber + CHAMBER_ROW.outlet])]
    inlet_on, outlet_on = inlet > 0.0, outlet > 0.0
    inlet_rises, outlet_rises = inlet_on and inlet_last < 0.5, outlet_on and outlet_last < 0.5
    if target >= 0.0:
        now, integral = ON, act[a + DRIVE_ACT.integral]
        given, clock = act[a + DRIVE_ACT.given], act[a + DRIVE_ACT.clock]
        if stage < ON - 0.5:  # it was off
            integral, given, clock = 0.0, 0.0, u[j + DRIVE_ROW.least_off]
            if kind == DriveKind.PWM:  # the first pulse comes at once, and goes on where a coil is on
                clock = u[j + DRIVE_ROW.period]
                given = clock if inlet_last > 0.5 else (-clock if outlet_last > 0.5 else 0.0)
        was, then = given, clock
        inlet, outlet, integral, given, clock = driven(
            u, j, integral, given, clock, target - reading, (reading - before) / step, step
        )
        inlet_on, outlet_on = inlet > 0.0, outlet > 0.0
        inlet_rises, outlet_rises = inlet_on and inlet_last < 0.5, outlet_on and outlet_last < 0.5
        if kind == DriveKind.PWM:
            period, anew = u[j + DRIVE_ROW.period], clock < then + 0.5 * step
            inlet_rises, inlet_on = pulse_edges(was, given, clock, anew, period)
            outlet_rises, outlet_on = pulse_edges(-was, -given, clock, anew, period)
        if kind == DriveKind.REGULATOR:
            inlet_on = still_open(m, d, int(u[chamber + CHAMBER_ROW.inlet]), inlet, inlet_last)
            outlet_on = still_open(m, d, int(u[chamber + CHAMBER_ROW.outlet]), outlet, outlet_last)
    act_dot[a + DRIVE_ACT.reading] = (reading - act[a + DRIVE_ACT.reading]) / step
    act_dot[a + DRIVE_ACT.integral] = (integral - act[a + DRIVE_ACT.integral]) / step
    act_dot[a + DRIVE_ACT.given] = (given - act[a + DRIVE_ACT.given]) / step
    act_dot[a + DRIVE_ACT.clock] = (clock - act[a + DRIVE_ACT.clock]) / step
    act_dot[a + DRIVE_ACT.stage] = (now - stage) / step
    act_dot[a + DRIVE_ACT.inlet_switches] = (1.0 if inlet_rises else 0.0) / step
    act_dot[a + DRIVE_ACT.outlet_switches] = (1.0 if outlet_rises else 0.0) / step
    act_dot[a + DRIVE_ACT.inlet_last] = ((1.0 if inlet_on else 0.0) - inlet_last) / step
    act_dot[a + DRIVE_ACT.outlet_last] = ((1.0 if outlet_on else 0.0) - outlet_last) / step
    d.userdata[place + DRIVE_DATA.inlet_coil], d.userdata[place + DRIVE_DATA.outlet_coil] = inlet, outlet
    return FINE


@register_jitable
def still_open(m: Any, d: Any, valve: int, asked: float, last: float) -> bool:
    """Whether a proportional valve is open: asked to, or not yet shut since it was."""
    return asked > 0.0 or (last > 0.5 and d.act[m.actuator_actadr[valve] + VALVE_ACT.opening] > SHUT)


@register_jitable
def driven(
    u: Any, j: int, integral: float, given: float, clock: float, error: float, rate: float, step: float
) -> tuple[float, float, float, float, float]:
    """Coils of inlet and outlet [-], and integral, given side or pulse, and clock after the step."""
    kind = int(u[j + DRIVE_ROW.kind])
    least_on, least_off = u[j + DRIVE_ROW.least_on], u[j + DRIVE_ROW.least_off]
    if kind == DriveKind.BANG_BANG:
        side = two_point(
            error, given, clock, u[j + DRIVE_ROW.dead_band], u[j + DRIVE_ROW.release], least_on, least_off
        )
        held = step if abs(side - given) > 0.5 else clock + step
        return max(side, 0.0), max(-side, 0.0), 0.0, side, held
    output, integral = pid(
        error, rate, integral, u[j + DRIVE_ROW.full_at], u[j + DRIVE_ROW.integral_rate],
        u[j + DRIVE_ROW.derivative_time], u[j + DRIVE_ROW.dead_band], step,
    )  # fmt: skip
    if kind != DriveKind.PWM:
        return max(output, 0.0), max(-output, 0.0), integral, output, clock
    coming = pulse_width(output, u[j + DRIVE_ROW.period], least_on, least_off)
    inlet, outlet, clock, given = pulses(clock, given, u[j + DRIVE_ROW.period], coming, step)
    return inlet, outlet, integral, given, clock

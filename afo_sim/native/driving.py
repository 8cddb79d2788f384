"""Pressure drive: coils of a chamber's two valves from the pressure that is asked for."""

from typing import Any

from afo_sim.common.units import AMBIENT_PRESSURE
from afo_sim.native.complaints import FINE, NO_TARGET
from afo_sim.native.slots import (
    BANG_BANG,
    CHAMBER_INLET,
    CHAMBER_OUTLET,
    CHAMBER_USERDATA,
    DRIVE_CHAMBER,
    DRIVE_DEAD_BAND,
    DRIVE_DERIVATIVE_TIME,
    DRIVE_FILTER_TIME,
    DRIVE_FULL_AT,
    DRIVE_INTEGRAL_RATE,
    DRIVE_KIND,
    DRIVE_LEAST_OFF,
    DRIVE_LEAST_ON,
    DRIVE_PERIOD,
    DRIVE_RELEASE,
    DRIVE_USERDATA,
    PWM,
    REGULATOR,
)
from afo_sim.native.state import (
    CLOCK,
    GIVEN,
    INLET_COIL,
    INLET_LAST,
    INLET_SWITCHES,
    INTEGRAL,
    OPENING,
    OUTLET_COIL,
    OUTLET_LAST,
    OUTLET_SWITCHES,
    PRESSURE,
    READING,
    STAGE,
)
from afo_sim.physics.driving import low_passed, pid, pulse_edges, pulse_width, pulses, two_point
from afo_sim.physics.jitable import register_jitable

FIRST, OFF, ON = 0.0, 1.0, 2.0  # stages of a drive
SHUT = 0.01  # opening below which a proportional valve counts as shut [-]


@register_jitable
def drive_dyn(m: Any, d: Any, i: int, j: int) -> int:
    """Write coils and rates of the drive actuator i, whose row starts at j; the complaint, FINE for none.

    The transducer reads on while the drive is off; all else of its memory is lost then.
    """
    u, act, act_dot, step = m.actuator_user, d.act, d.act_dot, m.opt.timestep
    a, place, target = m.actuator_actadr[i], int(u[j + DRIVE_USERDATA]), d.ctrl[i]
    if target != target:
        return NO_TARGET
    chamber = m.nuser_actuator * int(u[j + DRIVE_CHAMBER])
    pressure = d.userdata[int(u[chamber + CHAMBER_USERDATA]) + PRESSURE] - AMBIENT_PRESSURE
    stage, inlet_last, outlet_last = act[a + STAGE], act[a + INLET_LAST], act[a + OUTLET_LAST]
    before = pressure if stage < OFF - 0.5 else act[a + READING]
    reading = low_passed(before, pressure, u[j + DRIVE_FILTER_TIME], step)
    integral, given, clock, now = 0.0, 0.0, 0.0, OFF
    inlet, outlet = d.ctrl[int(u[chamber + CHAMBER_INLET])], d.ctrl[int(u[chamber + CHAMBER_OUTLET])]
    inlet_on, outlet_on = inlet > 0.0, outlet > 0.0
    inlet_rises, outlet_rises = inlet_on and inlet_last < 0.5, outlet_on and outlet_last < 0.5
    if target >= 0.0:
        now, integral, given, clock = ON, act[a + INTEGRAL], act[a + GIVEN], act[a + CLOCK]
        if stage < ON - 0.5:  # it was off
            integral, given, clock = 0.0, 0.0, u[j + DRIVE_LEAST_OFF]
            if u[j + DRIVE_KIND] == PWM:  # the first pulse comes at once, and goes on where a coil is on
                clock = u[j + DRIVE_PERIOD]
                given = clock if inlet_last > 0.5 else (-clock if outlet_last > 0.5 else 0.0)
        was, then = given, clock
        inlet, outlet, integral, given, clock = driven(
            u, j, integral, given, clock, target - reading, (reading - before) / step, step
        )
        inlet_on, outlet_on = inlet > 0.0, outlet > 0.0
        inlet_rises, outlet_rises = inlet_on and inlet_last < 0.5, outlet_on and outlet_last < 0.5
        if u[j + DRIVE_KIND] == PWM:
            period, anew = u[j + DRIVE_PERIOD], clock < then + 0.5 * step
            inlet_rises, inlet_on = pulse_edges(was, given, clock, anew, period)
            outlet_rises, outlet_on = pulse_edges(-was, -given, clock, anew, period)
        if u[j + DRIVE_KIND] == REGULATOR:
            inlet_on = still_open(m, d, int(u[chamber + CHAMBER_INLET]), inlet, inlet_last)
            outlet_on = still_open(m, d, int(u[chamber + CHAMBER_OUTLET]), outlet, outlet_last)
    act_dot[a + READING] = (reading - act[a + READING]) / step
    act_dot[a + INTEGRAL] = (integral - act[a + INTEGRAL]) / step
    act_dot[a + GIVEN] = (given - act[a + GIVEN]) / step
    act_dot[a + CLOCK] = (clock - act[a + CLOCK]) / step
    act_dot[a + STAGE] = (now - stage) / step
    act_dot[a + INLET_SWITCHES] = (1.0 if inlet_rises else 0.0) / step
    act_dot[a + OUTLET_SWITCHES] = (1.0 if outlet_rises else 0.0) / step
    act_dot[a + INLET_LAST] = ((1.0 if inlet_on else 0.0) - inlet_last) / step
    act_dot[a + OUTLET_LAST] = ((1.0 if outlet_on else 0.0) - outlet_last) / step
    d.userdata[place + INLET_COIL], d.userdata[place + OUTLET_COIL] = inlet, outlet
    return FINE


@register_jitable
def still_open(m: Any, d: Any, valve: int, asked: float, last: float) -> bool:
    """Whether a proportional valve is open: asked to, or not yet shut since it was.

    At the edge of the dead band a regulator asks for an opening in every other step. The valve does not
    follow that, and to count it would count steps.

    Units: asked [-].
    """
    return asked > 0.0 or (last > 0.5 and d.act[m.actuator_actadr[valve] + OPENING] > SHUT)


@register_jitable
def driven(
    u: Any, j: int, integral: float, given: float, clock: float, error: float, rate: float, step: float
) -> tuple[float, float, float, float, float]:
    """Coils of inlet and outlet [-], and integral, given side or pulse, and clock after the step.

    Units: error, rate [Pa], step [s].
    """
    kind, least_on, least_off = u[j + DRIVE_KIND], u[j + DRIVE_LEAST_ON], u[j + DRIVE_LEAST_OFF]
    if kind == BANG_BANG:
        side = two_point(
            error, given, clock, u[j + DRIVE_DEAD_BAND], u[j + DRIVE_RELEASE], least_on, least_off
        )
        held = step if abs(side - given) > 0.5 else clock + step
        return max(side, 0.0), max(-side, 0.0), 0.0, side, held
    output, integral = pid(
        error,
        rate,
        integral,
        u[j + DRIVE_FULL_AT],
        u[j + DRIVE_INTEGRAL_RATE],
        u[j + DRIVE_DERIVATIVE_TIME],
        u[j + DRIVE_DEAD_BAND],
        step,
    )
    if kind != PWM:
        return max(output, 0.0), max(-output, 0.0), integral, output, clock
    coming = pulse_width(output, u[j + DRIVE_PERIOD], least_on, least_off)
    inlet, outlet, clock, given = pulses(clock, given, u[j + DRIVE_PERIOD], coming, step)
    return inlet, outlet, integral, given, clock

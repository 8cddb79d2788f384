"""Pressure drives: transducer, PID, two-point switching with hysteresis, pulse trains over a time step."""

import math

from afo_sim.physics.jitable import register_jitable

_INSTANT = 1e-9  # times that differ by less are one: what rounding leaves of a sum of steps [s]


@register_jitable
def low_passed(reading: float, value: float, time_constant: float, step: float) -> float:
    """Reading of a first-order low-pass one step later, exact for a value that stays.

    y' = y + (1 − e^(−h/τ)) (x − y)

    Parameters
    ----------
    reading, value : y of the step before, and x now, of one unit
    time_constant : τ [s]; 0 is no low-pass
    step : h [s]
    """
    if time_constant <= 0.0:
        return value
    return reading - math.expm1(-step / time_constant) * (value - reading)


@register_jitable
def pid(
    error: float, rate: float, integral: float, full_at: float, integral_rate: float, derivative_time: float,
    dead_band: float, step: float,
) -> tuple[float, float]:  # fmt: skip
    """Output of a PID from −1 to 1, and its integral one step later.

    u = (e − T_d ṗ)/e_full + I, İ = e/(T_i e_full). The derivative is of the measured pressure, so that a new
    target gives no kick. Within the dead band output and integral are 0: the air that is there stays by
    itself, and the output does not jump where the error leaves the band. Where the output is at its end the
    integral stays, unless the error leads back (conditional integration).

    Parameters
    ----------
    error : target less pressure, e [Pa]
    rate : of the pressure, ṗ [Pa/s]
    integral : I [-]
    full_at : error of full output, e_full [Pa]
    integral_rate : 1/T_i [1/s]; 0 for no integral
    derivative_time : T_d [s]
    dead_band : [Pa]
    step : [s]

    Returns
    -------
    (output [-], integral [-])

    Source
    ------
    Derivative of the measurement and anti-windup: Åström & Hägglund, PID Controllers, 2nd ed. 1995 (from
    memory). The integral's end in the dead band is this project's.
    """
    if abs(error) <= dead_band:
        return 0.0, 0.0
    further = integral + step * integral_rate * error / full_at
    output = (error - derivative_time * rate) / full_at + further
    if output > 1.0:
        return 1.0, integral if error > 0.0 else further
    if output < -1.0:
        return -1.0, integral if error < 0.0 else further
    return output, further


@register_jitable
def two_point(
    error: float, side: float, held: float, dead_band: float, release: float, least_on: float,
    least_off: float,
) -> float:  # fmt: skip
    """The valve that has current in this step: 1 the inlet, −1 the outlet, 0 none.

    The inlet's coil is switched on when the error exceeds the dead band, and off when it falls below the
    release; the outlet's likewise below zero. Between the two both are off for at least one step.

    Parameters
    ----------
    error : target less pressure [Pa]
    side : of the step before
    held : time since that began [s]
    dead_band, release : [Pa], release ≤ dead_band
    least_on, least_off : times for which a side, or none, stays [s]
    """
    if side > 0.5:
        return 1.0 if error > release or held + _INSTANT < least_on else 0.0
    if side < -0.5:
        return -1.0 if error < -release or held + _INSTANT < least_on else 0.0
    if held + _INSTANT < least_off:
        return 0.0
    if error > dead_band:
        return 1.0
    return -1.0 if error < -dead_band else 0.0


@register_jitable
def pulse_width(output: float, period: float, least_on: float, least_off: float) -> float:
    """Width of a pulse [s], with the output's sign: |u| of the period.

    A pulse below the least is not given; a gap below the least is none, and the coil stays on.
    """
    width = abs(output) * period
    if width <= 0.0 or width + _INSTANT < least_on:
        return 0.0
    if period - width + _INSTANT < least_off:
        width = period
    return width if output > 0.0 else -width


@register_jitable
def pulses(
    clock: float, width: float, period: float, coming: float, step: float
) -> tuple[float, float, float, float]:
    """Shares of a step for which a pulse train has the coils on, and its clock and width afterwards.

    A pulse begins with its period. A period that begins within the step has the pulse that is coming.

    Parameters
    ----------
    clock : time since the present period began, at the step's beginning [s]
    width : of its pulse, negative for the outlet [s]
    period : not shorter than the step [s]
    coming : width of the next pulse [s]
    step : [s]

    Returns
    -------
    (inlet [-], outlet [-], clock [s], width [s])
    """
    inlet, outlet = 0.0, 0.0
    if clock + _INSTANT > period:
        clock, width = 0.0, coming
    present = min(period - clock, step)
    on = min(max(abs(width) - clock, 0.0), present)
    if width > 0.0:
        inlet += on
    else:
        outlet += on
    clock += step
    rest = step - present
    if rest > _INSTANT:
        clock, width = rest, coming
        on = min(abs(width), rest)
        if width > 0.0:
            inlet += on
        else:
            outlet += on
    return min(inlet / step, 1.0), min(outlet / step, 1.0), clock, width


@register_jitable
def pulse_edges(before: float, width: float, clock: float, anew: bool, period: float) -> tuple[bool, bool]:
    """Whether a coil was switched on in a step, and whether it is on at its end.

    Parameters
    ----------
    before, width : of the pulses at the step's beginning and end; positive for this coil [s]
    clock : time since the present period began, at the step's end [s]
    anew : whether it began in this step
    period : [s]; a pulse as wide goes over into the next without a gap
    """
    rises = anew and width > 0.0 and before + _INSTANT < period
    return rises, width > 0.0 and (width > clock + _INSTANT or width + _INSTANT > period)


@register_jitable
def proportional_opening(asked: float, opening: float, bandwidth: float, step: float) -> tuple[float, float]:
    """Opening of a proportional valve, its mean over one step and at its end: a lag of first order, exact.

    o' = o + (1 − e^(−2π f h)) (u − o), and ō = u − (o' − o)/(2π f h)

    Parameters
    ----------
    asked : opening that is asked for, clamped to 0…1 [-]
    opening : o [-]
    bandwidth : corner frequency f (−3 dB) [Hz]
    step : h [s]
    """
    if asked < 0.0:
        asked = 0.0
    elif asked > 1.0:
        asked = 1.0
    if abs(asked - opening) < _INSTANT:
        return asked, asked
    turn = 2.0 * math.pi * bandwidth * step
    moved = -math.expm1(-turn) * (asked - opening)
    return asked - moved / turn, opening + moved

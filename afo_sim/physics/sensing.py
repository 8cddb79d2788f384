"""What electronics read of a quantity: one kernel for all sensors, over the rows of a run.

Each sensor is one row of parameters, one of memory, and a piece of the delay line. All arrays are flat, so
that compiled code takes them as pointers. In the order in which the signal meets them:

    x   quantity
    e   = gain x + offset + drift t                      errors of the element
    h   = min(max(h, e − w/2), e + w/2)                  play of width w, of one that is not a switch
    l   += (1 − exp(−2π f Δt)) (h − l)                   low-pass of corner frequency f
        sampled at the first step at or after k/rate, k = 0, 1, 2, …, and held in between
    q   = clip(l + σ z, low, high)                       noise, range
    v   = slope q + intercept, or slope/q + intercept    physical output by the true line
    v   = clip(v + σ_v z', low_v, high_v), rounded to whole resolutions of the output
        delayed by whole steps; before the first sample arrives it is the first one
    y   = (v − intercept')/slope', or slope'/(v − intercept'), by the line that is taken for true
        rounded to whole resolutions of the reading
    y   = 1 above, 0 below a threshold, which the hysteresis w parts; it changes after the debounce time

Noise is a function of seed, sensor and number of the row, so readings do not depend on how a run is cut.
A row that is not a number reads as no number; memory begins anew behind it.
"""

import math
from typing import Any

from afo_sim.physics.jitable import register_jitable

# Parameters of a sensor.
GAIN, OFFSET, DRIFT, PLAY, SHARE, RATE, NOISE, LOW, HIGH = range(9)
SLOPE, INTERCEPT, OUT_NOISE, OUT_LOW, OUT_HIGH, OUT_STEP = range(9, 15)
TAKEN_SLOPE, TAKEN_INTERCEPT, STEP, INVERSE = range(15, 19)
THRESHOLD, HYSTERESIS, DEBOUNCE, SWITCH, SEED, NUMBER, DELAY, LINE = range(19, 27)
N_PARAMETER = 27
# Memory of a sensor; its delay line begins at LINE, and is DELAY rows long.
LAG, FILTERED, HELD, SAMPLED, STATE, WAITING, STARTED = range(7)
N_MEMORY = 7

_MASK = 0xFFFFFFFF
_NAN = math.nan
_TWO_PI = 2.0 * math.pi
_SLIGHTLY = 1e-9  # of a sample, by which rounding may put a row before its time


@register_jitable
def _mixed(number: int) -> int:
    """32 bits that look like chance, one for one: the finaliser of MurmurHash3 (Appleby, public domain)."""
    number = number & _MASK
    number = ((number ^ (number >> 16)) * 0x85EBCA6B) & _MASK
    number = ((number ^ (number >> 13)) * 0xC2B2AE35) & _MASK
    return number ^ (number >> 16)


@register_jitable
def _chance(key: int, row: int) -> float:
    """A number from 0 to 1, both excluded, evenly spread; of a key and a row."""
    low = _mixed(row ^ _mixed(key))
    high = _mixed((row >> 32) + _mixed(key + 0x9E3779B9))
    return (_mixed(low + high) + 0.5) / 4294967296.0


@register_jitable
def _normal(seed: int, sensor: int, row: int) -> float:
    """Normal deviate z, mean 0, standard deviation 1, white over rows: z = √(−2 ln u) cos 2πu' (Box, Muller).

    Parameters
    ----------
    seed, sensor, row : whole numbers from 0
    """
    key = _mixed(_mixed(seed) + 0x9E3779B9 * (sensor + 1))
    return math.sqrt(-2.0 * math.log(_chance(key, row))) * math.cos(_TWO_PI * _chance(key + 0x3C6EF372, row))


@register_jitable
def _clipped(value: float, low: float, high: float) -> float:
    """A value within bounds; no number stays none."""
    if value < low:
        return low
    if value > high:
        return high
    return value


@register_jitable
def _rounded(value: float, step: float) -> float:
    """The nearest multiple of a step; the value itself where the step is 0."""
    if step > 0.0 and value - value == 0.0:
        return math.floor(value / step + 0.5) * step
    return value


@register_jitable
def line_output(value: float, slope: float, intercept: float, inverse: float) -> float:
    """Physical output of a calibration line: slope x + intercept, or slope/x + intercept."""
    if inverse > 0.0:
        return slope / value + intercept if value != 0.0 else _NAN
    return slope * value + intercept


@register_jitable
def line_value(output: float, slope: float, intercept: float, inverse: float) -> float:
    """Quantity that a calibration line has at an output: the inverse of `line_output`."""
    above = output - intercept
    if inverse > 0.0:
        return slope / above if above != 0.0 else _NAN
    return above / slope


@register_jitable
def _element(p: Any, i: int, s: Any, j: int, value: float, time: float) -> float:
    """What a sensor's element makes of the quantity, before it is sampled: errors, play, low-pass."""
    felt = p[i + GAIN] * value + p[i + OFFSET] + p[i + DRIFT] * time
    half = 0.5 * p[i + PLAY]
    if half > 0.0:
        lag = s[j + LAG]
        felt = felt if lag != lag or felt != felt else _clipped(lag, felt - half, felt + half)
        s[j + LAG] = felt
    old = s[j + FILTERED]
    if p[i + SHARE] < 1.0 and old == old:
        felt = old + p[i + SHARE] * (felt - old)
    s[j + FILTERED] = felt
    return felt


@register_jitable
def _converted(p: Any, i: int, value: float, row: int) -> float:
    """Physical output of a sample: noise, range, calibration line, the converter's steps."""
    seed, number = int(p[i + SEED]), int(p[i + NUMBER])
    if p[i + NOISE] > 0.0:
        value += p[i + NOISE] * _normal(seed, 2 * number, row)
    value = _clipped(value, p[i + LOW], p[i + HIGH])
    output = line_output(value, p[i + SLOPE], p[i + INTERCEPT], p[i + INVERSE])
    if p[i + OUT_NOISE] > 0.0:
        output += p[i + OUT_NOISE] * _normal(seed, 2 * number + 1, row)
    return _rounded(_clipped(output, p[i + OUT_LOW], p[i + OUT_HIGH]), p[i + OUT_STEP])


@register_jitable
def _switched(p: Any, i: int, s: Any, j: int, value: float) -> float:
    """A switch's state, 0 or 1: the threshold with hysteresis, then the debounce."""
    if value != value:
        s[j + STATE] = _NAN
        return _NAN
    state = s[j + STATE]
    half = 0.5 * p[i + HYSTERESIS]
    if state != state:  # its first row: no past to hold on to
        state = 1.0 if value > p[i + THRESHOLD] else 0.0
        s[j + WAITING] = 0.0
    elif (state < 0.5 and value > p[i + THRESHOLD] + half) or (
        state > 0.5 and value < p[i + THRESHOLD] - half
    ):
        s[j + WAITING] += 1.0
        if s[j + WAITING] > p[i + DEBOUNCE]:
            state, s[j + WAITING] = 1.0 - state, 0.0
    else:
        s[j + WAITING] = 0.0
    s[j + STATE] = state
    return state


@register_jitable
def sense(
    p: Any, s: Any, lines: Any, values: Any, readings: Any, outputs: Any, sensors: int, rows: int, width: int,
    first: int, timestep: float,
) -> float:  # fmt: skip
    """Feed a stretch of rows to all sensors.

    Parameters
    ----------
    p : parameters, sensors × N_PARAMETER
    s : memory, sensors × N_MEMORY; no numbers before the first row
    lines : delay lines, one behind the other
    values : true quantities [SI], sensors × width
    readings, outputs : what the electronics have at each row [SI; V or SI], sensors × width; written
    sensors, rows : how many
    width : of the three arrays, at least `rows`
    first : number of the first row in its run
    timestep : from row to row [s]

    Returns
    -------
    0, for compiled callers
    """
    for sensor in range(sensors):
        i, j = sensor * N_PARAMETER, sensor * N_MEMORY
        delay, line = int(p[i + DELAY]), int(p[i + LINE])
        for k in range(rows):
            row, at = first + k, sensor * width + k
            time = row * timestep
            felt = _element(p, i, s, j, values[at], time)
            sample = row if p[i + RATE] == 0.0 else math.floor(time * p[i + RATE] + _SLIGHTLY)
            # no number is unequal to itself: before the first row a sample is due
            if sample != s[j + SAMPLED]:
                s[j + SAMPLED] = sample
                s[j + HELD] = _converted(p, i, felt, row)
            output = s[j + HELD]
            if delay > 0:
                if s[j + STARTED] != s[j + STARTED]:
                    for place in range(delay):
                        lines[line + place] = output
                    s[j + STARTED] = 1.0
                place = line + row % delay
                output, lines[place] = lines[place], output
            reading = line_value(output, p[i + TAKEN_SLOPE], p[i + TAKEN_INTERCEPT], p[i + INVERSE])
            reading = _rounded(reading, p[i + STEP])
            if p[i + SWITCH] > 0.0:
                reading = _switched(p, i, s, j, reading)
            readings[at], outputs[at] = reading, output
    return 0.0

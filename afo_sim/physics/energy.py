"""Works and energies of air, muscles and anchors between instants of recorded rows, compiled.

`simulation/energy_balance.py` says what they are. Integrals are trapezoidal, straight between two rows.
"""

import math
from typing import Any

import numpy as np

from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.physics.in_series import OF_ROW, signed_at
from afo_sim.physics.jitable import kernels, register_jitable
from afo_sim.physics.law_volume import LAW_VOLUME, muscle_volume
from afo_sim.physics.series import anchor_energy
from afo_sim.physics.static_force import (
    DAMPER_COEFFICIENTS,
    RETURN_PRESSURE,
    SLACK_BLEND,
    three_element_damping,
)

QUADRATURE = tuple(zip(*(each.tolist() for each in np.polynomial.legendre.leggauss(20)), strict=True))
GAUGES = 40  # steps from no pressure to one, over which a muscle's volume at one length is followed
COLUMNS = 5  # of a muscle: contraction, tension, force on the joint, path length, static force
AIR, SKELETON, DAMPER, FRICTION, SPRING, BLADDER, LAW, TURNOVER, WRAP, TERMS = range(10)
# behind a muscle's row of `in_series.row`: column of its pressure, whether it rubs, ...
_PRESSURE, _RUBS, _DAMPING, _RETURNING, _RUBBER = range(OF_ROW, OF_ROW + 5)
_DAMPER = OF_ROW + 5
_VOLUME = _DAMPER + DAMPER_COEFFICIENTS
OF_MUSCLE, OF_ANCHOR = _VOLUME + LAW_VOLUME, 4  # numbers of each


def energies(
    u: np.ndarray, rows: np.ndarray, windows: np.ndarray, chambers: int, muscles: int, anchors: int
) -> np.ndarray:
    """Works and energies of each of some windows.

    Parameters
    ----------
    u : of each muscle (OF_MUSCLE,): `in_series.row`; column of its pressure, 1 where it rubs or 0, damping
        [N·s/Pa], returning [N], volume of rubber [m³], damper, `LawVolume`'s numbers; of each anchor
        stiffness [N/m], force [N], length [m], as of `anchor_energy`, and damping [N·s/m]
    rows : columns one after the other: time [s]; of each chamber gauge pressure [Pa] and volume [m³]; of each
        muscle contraction [-], tension, force that the joint feels [N], path length [m], static force [N]; of
        each anchor displacement [m] (n_column, n), n ≥ 1
    windows : first and last instant, in rows, whole or not; beyond the last row nothing changes (n_window, 2)
    chambers, muscles, anchors : how many; a muscle's terms are those of as many alike as its row says

    Returns
    -------
    [J] (n_window, TERMS): AIR, SKELETON, DAMPER, FRICTION, SPRING, BLADDER, LAW, TURNOVER, WRAP
    """
    out = np.zeros((len(windows), TERMS))
    arrays = (array.ctypes.data for array in (u, rows, windows, out))
    compiled_energies()[0](*arrays, rows.shape[1], len(windows), chambers, muscles, anchors)
    return out


def _energies(
    u: Any, rows: Any, windows: Any, out: Any, n: int, count: int, chambers: int, muscles: int, anchors: int
) -> float:
    for w in range(count):
        start, end, o, at, m = windows[2 * w], windows[2 * w + 1], TERMS * w, n, 0
        for _ in range(chambers):
            _chamber(rows, at, n, start, end, out, o)
            at += 2 * n
        for _ in range(muscles):
            _muscle(u, m, rows, at, n, start, end, out, o)
            at, m = at + COLUMNS * n, m + OF_MUSCLE
        for _ in range(anchors):
            _anchor(u, m, rows, at, n, start, end, out, o)
            at, m = at + n, m + OF_ANCHOR
    return 0.0


compiled_energies = kernels("energy", _energies)


@register_jitable
def _value(rows: Any, at: int, n: int, k: int, share: float) -> float:
    """Of the column from rows[at] on, at a share of the step that begins in row k."""
    if k + 1 >= n:
        return rows[at + n - 1]
    there = rows[at + k + 1]
    return there if share == 1.0 else rows[at + k] + share * (there - rows[at + k])


@register_jitable
def _chamber(rows: Any, at: int, n: int, start: float, end: float, out: Any, o: int) -> None:
    """Work of a chamber's air, which is also its turnover; the laws are to give the same."""
    first, work, turnover = int(start), 0.0, 0.0
    p, v = _value(rows, at, n, first, start - first), _value(rows, at + n, n, first, start - first)
    for k in range(first, math.ceil(end)):
        share = min(1.0, end - k)
        p_next, v_next = _value(rows, at, n, k, share), _value(rows, at + n, n, k, share)
        step = 0.5 * (p_next + p) * (v_next - v)
        work, turnover = work + step, turnover + abs(step)
        p, v = p_next, v_next
    out[o + AIR] += work
    out[o + LAW] -= work
    out[o + TURNOVER] += turnover


@register_jitable
def _muscle(u: Any, m: int, rows: Any, at: int, n: int, start: float, end: float, out: Any, o: int) -> None:
    """Terms of the muscles whose numbers start at u[m] and whose columns start at rows[at]."""
    length, count, gauges, d = u[m + 7], u[m + 9], n * int(u[m + _PRESSURE]), m + _DAMPER
    damping = u[d], u[d + 1], u[d + 2], u[d + 3], u[d + 4], u[d + 5], u[d + 6]
    begun = _state(rows, at, n, gauges, int(start), start - int(start))
    last, by_law, damped, pulled, worked, wrapped = begun, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(int(start), math.ceil(end)):
        here = _state(rows, at, n, gauges, k, min(1.0, end - k))
        moved, lengthened, gauge = here[2] - last[2], here[5] - last[5], 0.5 * (here[1] + last[1])
        rate = moved / (here[0] - last[0])
        damper = three_element_damping(gauge, rate, *damping)
        damped += (u[m + _DAMPING] * (gauge + AMBIENT_PRESSURE) + length * damper) * rate * moved
        by_law += 0.5 * (here[6] + last[6]) * moved
        pulled += 0.5 * (here[6] - here[3] + last[6] - last[3]) * moved
        worked += 0.5 * (here[4] + last[4]) * lengthened
        wrapped += (here[4] - here[3]) * lengthened
        last = here
    # ∫ F(κ, p = 0) dκ from contraction to contraction, whatever lies between, and ∫ p ∂V/∂p dp at both
    stored = length * _return_work(begun[2], last[2], u, m)
    stored += _swelling(begun[2], begun[1], u, m) - _swelling(last[2], last[1], u, m)
    out[o + SKELETON] -= count * worked
    out[o + WRAP] += count * wrapped
    out[o + DAMPER] += count * length * damped
    out[o + FRICTION] += u[m + _RUBS] * count * length * (pulled - damped)
    out[o + SPRING] += count * 0.5 * (last[3] ** 2 - begun[3] ** 2) / u[m + 8]
    out[o + BLADDER] -= count * stored
    out[o + LAW] += count * (length * by_law - stored)


@register_jitable
def _state(
    rows: Any, at: int, n: int, gauges: int, k: int, share: float
) -> tuple[float, float, float, float, float, float, float]:
    """Time, pressure, contraction, tension, force on the joint, path length and static force of a muscle."""
    time, gauge = _value(rows, 0, n, k, share), _value(rows, gauges, n, k, share)
    kappa, tension = _value(rows, at, n, k, share), _value(rows, at + n, n, k, share)
    felt, path = _value(rows, at + 2 * n, n, k, share), _value(rows, at + 3 * n, n, k, share)
    return time, gauge, kappa, tension, felt, path, _value(rows, at + 4 * n, n, k, share)


@register_jitable
def _return_work(first: float, last: float, u: Any, m: int) -> float:
    """∫ F(κ, p = 0) dκ of a muscle from one contraction to another [N], piece by piece between its kinks."""
    total, low, high = 0.0, min(first, last), max(first, last)
    for kink in (-SLACK_BLEND, 0.0, high):
        end = min(max(kink, low), high)
        half, middle = 0.5 * (end - low), 0.5 * (end + low)
        if half != 0.0:  # a NaN is not
            for node, weight in QUADRATURE:
                total += half * weight * signed_at(middle + half * node, 0.0, u, m)
        low = end
    return total if first < last else -total


@register_jitable
def _swelling(kappa: float, pressure: float, u: Any, m: int) -> float:
    """∫ p ∂V/∂p dp of a muscle at one contraction from no pressure to another [J]."""
    total, before, volume = 0.0, 0.0, _volume(kappa, 0.0, u, m)
    for k in range(1, GAUGES + 1):
        gauge = pressure * k / GAUGES
        if before < RETURN_PRESSURE < gauge:  # where the slope jumps
            grown = _volume(kappa, RETURN_PRESSURE, u, m)
            total += 0.5 * (before + RETURN_PRESSURE) * (grown - volume)
            before, volume = RETURN_PRESSURE, grown
        grown = _volume(kappa, gauge, u, m)
        total += 0.5 * (before + gauge) * (grown - volume)
        before, volume = gauge, grown
    return total


@register_jitable
def _volume(kappa: float, pressure: float, u: Any, m: int) -> float:
    """Volume of a muscle beyond its dead volume [m³]."""
    own = u[m + 7], u[m + 4], u[m + 5], u[m + 6], 0.0, u[m + _RUBBER], u[m + _RETURNING]
    return muscle_volume(kappa, pressure, *own, u, m + _VOLUME)[0]


@register_jitable
def _anchor(u: Any, m: int, rows: Any, at: int, n: int, start: float, end: float, out: Any, o: int) -> None:
    """What the anchor whose numbers start at u[m] stores and damps."""
    first = int(start)
    begun, time = _value(rows, at, n, first, start - first), _value(rows, 0, n, first, start - first)
    last, damped = begun, 0.0
    for k in range(first, math.ceil(end)):
        share = min(1.0, end - k)
        here, after = _value(rows, at, n, k, share), _value(rows, 0, n, k, share)
        damped += (here - last) ** 2 / (after - time)
        last, time = here, after
    out[o + SPRING] += anchor_energy(last, u[m], u[m + 1], u[m + 2])
    out[o + SPRING] -= anchor_energy(begun, u[m], u[m + 1], u[m + 2])
    out[o + DAMPER] += u[m + 3] * damped

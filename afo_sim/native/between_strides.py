"""Between two strides of a search, compiled: how far it is, and where its air jumps next.

The settled stride is found when a stride ends as it began: within `AIR` in mass and σ of every chamber and
rigid volume, and within `ANGLE` in the ankle's angle. Where more is carried on (`paired`), two strides in a
row, without a jump between, have to differ by less than `ANGLE` in the ankle's angle everywhere.
"""

import math
from typing import Any

from afo_sim.common import AMBIENT_TEMPERATURE
from afo_sim.native.air_slopes import air_in, air_slopes, entering, giving
from afo_sim.native.slots import CHAMBER_ACT, STORE_ACT
from afo_sim.native.stride_numbers import AT, DONE, GONE, JOINT, NODE, STORE, table
from afo_sim.physics import chamber_pressure, kernels, register_jitable

AIR = 1e-4  # change of mass and σ over a settled stride [-]
ANGLE = math.radians(0.005)  # over a settled stride, or between two [rad]
JUMPS = 12  # of the air, after which strides are only walked
STRIDES = 60  # that are walked at most
NEAR = 10.0 * AIR  # step of Newton's method that is still to go, at most [-]
OF_FLOW, LEAST = 2e-3, 1e-6  # and at most so much of the air that flows in; less is not asked for [-]
LARGEST = 1.0  # change of ln m and ln σ in a jump [-]
LOW, HIGH = math.expm1(-LARGEST), math.expm1(LARGEST)
FORGOTTEN = 12e-3  # time for which a velocity counts that differs [s]
TINY = 1e-9  # change of ln m and ln σ that tells nothing [-]
REFILLED = 0.5  # share of a store's content below which it is filled again [-]
STILL = 1e-6  # share of the largest slope below which a chamber's air has nothing that brings it back
SWEEPS, ACROSS = 20, 1e-15  # of rotations; cosine of a right angle, by the number of rows


def between(
    s: Any, going: Any, begun: Any, ended: Any, qpos: Any, act: Any, userdata: Any, control: Any, count: int,
    size: int, width: int,
) -> float:  # fmt: skip
    """Take a stride that some searches have walked, and put where each begins the next."""
    # s has rows of all searches, `size` wide; `begun` and `ended` their states, `width` wide, air jumps in
    # the latter; `qpos` … `control` rows (count, steps, …), each block of the search in `going`, or −1.
    for place in range(count):
        if going[place] >= 0.0:
            k = int(going[place])
            _take(s, size * k, begun, ended, width * k, qpos, act, userdata, control, place)
    return 0.0


compiled_between = kernels("between_strides", between)


@register_jitable
def _take(
    s: Any, o: int, begun: Any, ended: Any, state: int, qpos: Any, act: Any, userdata: Any, control: Any,
    place: int,
) -> None:  # fmt: skip
    """The same for the search whose row begins at o and its state at `state`."""
    first = place * int(s[o + AT.steps])
    s[o + AT.strides] += 1.0
    s[o + AT.since_jump] += 1.0
    apart, gone = _swing(s, o, qpos, first)
    s[o + AT.angle] = apart if s[o + AT.paired] > 0.0 else _apart(s, o, begun, ended, state)
    s[o + AT.air] = _change(s, o, begun, ended, state)
    near = s[o + AT.air] <= s[o + AT.within] * AIR and s[o + AT.angle] <= s[o + AT.within] * ANGLE
    if near and s[o + AT.since_jump] > s[o + AT.paired]:
        s[o + AT.found], rough = 1.0, s[o + AT.within] > 1.0  # whose air and slopes are a guess
        if s[o + AT.nodes] > 0.0 and (rough or (s[o + AT.jumps] < JUMPS and s[o + AT.sticks] == 0.0)):
            _take_slopes(s, o, begun, ended, state, act, userdata, control, first)
            if not rough and not _is_near(s, o, act, userdata, control, first):
                s[o + AT.found] = 0.0
    if gone:
        s[o + AT.ended] = GONE
    elif s[o + AT.found] > 0.0 or s[o + AT.strides] >= STRIDES:
        s[o + AT.ended] = DONE
    else:
        jumps = _may_jump(s, o)
        if jumps:
            _take_slopes(s, o, begun, ended, state, act, userdata, control, first)
        _keep(s, o, begun, ended, state, act, userdata, first)
        if jumps:
            _jump(s, o, begun, ended, state)
        for k in range(int(s[o + AT.stores])):
            store = table(s, o, AT.store) + len(STORE) * k
            at = state + int(s[o + AT.activations]) + int(s[store + STORE.act])
            if jumps or ended[at + STORE_ACT.mass] / s[store + STORE.content] < REFILLED:
                ended[at + STORE_ACT.mass] = s[store + STORE.content]
                ended[at + STORE_ACT.temperature] = AMBIENT_TEMPERATURE


@register_jitable
def _swing(s: Any, o: int, qpos: Any, first: int) -> tuple[float, bool]:
    """Largest distance of the ankle from the stride before [rad]; whether it has gone through its stops."""
    width, ankle, before = int(s[o + AT.qpos]), int(s[o + AT.ankle]), table(s, o, AT.angles_before)
    apart, gone = 0.0, False
    for i in range(int(s[o + AT.steps])):
        angle = qpos[(first + i) * width + ankle]
        gone = gone or angle < s[o + AT.lowest] or angle > s[o + AT.highest]
        if s[o + AT.paired] > 0.0:
            apart = max(apart, abs(angle - s[before + i]))
            s[before + i] = angle
    return (math.inf if s[o + AT.strides] < 2.0 else apart), gone


@register_jitable
def _apart(s: Any, o: int, begun: Any, ended: Any, state: int) -> float:
    """Distance of what moves by itself at a stride's end from its start [rad]."""
    apart = 0.0
    for k in range(int(s[o + AT.joints])):
        joint = table(s, o, AT.joint) + len(JOINT) * k
        angle, velocity = state + int(s[joint + JOINT.angle]), state + int(s[joint + JOINT.velocity])
        moved = max(abs(ended[angle] - begun[angle]), FORGOTTEN * abs(ended[velocity] - begun[velocity]))
        apart = max(apart, moved / s[joint + JOINT.scale])
    return apart


@register_jitable
def _held(s: Any, o: int, state: int, i: int) -> int:
    """Place in a state of the i-th of all nodes' mass and σ."""
    at = int(s[table(s, o, AT.node) + len(NODE) * (i // 2) + NODE.act])
    return state + int(s[o + AT.activations]) + at + (CHAMBER_ACT.sigma if i % 2 else CHAMBER_ACT.mass)


@register_jitable
def _change(s: Any, o: int, begun: Any, ended: Any, state: int) -> float:
    """Change of ln m and ln σ over the stride, and the largest."""
    largest, change = 0.0, table(s, o, AT.change)
    for i in range(2 * int(s[o + AT.nodes])):
        at = _held(s, o, state, i)
        s[change + i] = math.log(ended[at] / begun[at])
        if not abs(s[change + i]) <= largest:  # or it is not a number
            largest = abs(s[change + i])
        if s[o + AT.strides] == 1.0:
            s[table(s, o, AT.first) + i] = begun[at]
    return largest


@register_jitable
def _may_jump(s: Any, o: int) -> bool:
    """Whether the air is to jump: where it has not settled, and friction has followed the last jump."""
    if s[o + AT.sticks] > 0.0 or s[o + AT.jumps] > JUMPS or s[o + AT.chambers] == 0.0:
        return False
    since = s[o + AT.since_jump]
    if s[o + AT.paired] > 0.0 and s[o + AT.air] <= AIR and not (s[o + AT.angle] <= ANGLE and since > 1.0):
        return False  # it only has to be confirmed
    return since > s[o + AT.frictions]


@register_jitable
def _keep(s: Any, o: int, begun: Any, ended: Any, state: int, act: Any, userdata: Any, first: int) -> None:
    """Keep the air of this stride, for slopes along the next one."""
    for i in range(2 * int(s[o + AT.nodes])):
        at = _held(s, o, state, i)
        s[table(s, o, AT.begun) + i], s[table(s, o, AT.became) + i] = begun[at], ended[at]
    if s[o + AT.strides] >= s[o + AT.trusted]:
        _give(s, o, act, userdata, first, False)


@register_jitable
def _give(s: Any, o: int, act: Any, userdata: Any, first: int, told: bool) -> None:
    """How the volume of each chamber follows its pressure, told by two strides, or the first one of them."""
    every, nodes = int(s[o + AT.every]), int(s[o + AT.nodes])
    rows = -(-int(s[o + AT.steps]) // every)
    for k in range(int(s[o + AT.chambers])):
        for number in range(rows):
            _, pressure, volume = air_in(s, o, k, act, userdata, first + number * every)
            at = table(s, o, AT.giving) + nodes * number + k
            past = table(s, o, AT.past) + 2 * (nodes * number + k)
            if told:
                s[at] = giving(pressure, volume, s[past], s[past + 1], s[at])
            else:
                s[past], s[past + 1] = pressure, volume


@register_jitable
def _take_slopes(
    s: Any, o: int, begun: Any, ended: Any, state: int, act: Any, userdata: Any, control: Any, first: int
) -> None:  # fmt: skip
    """∂(ln m, ln σ) of all nodes at the stride's end by those at its start, into `slopes`."""
    # Those along the stride, corrected so that they tell what the last two strides have shown (Broyden 1965).
    strides = s[o + AT.strides]
    if s[o + AT.own_of] == strides:
        return
    s[o + AT.own_of] = strides
    if strides > s[o + AT.trusted]:
        if strides > 1.0:
            _give(s, o, act, userdata, first, True)
        air_slopes(s, o, act, userdata, control, first)
    n, own, slopes = 2 * int(s[o + AT.nodes]), table(s, o, AT.own), table(s, o, AT.slopes)
    moved, became = table(s, o, AT.step), table(s, o, AT.side)
    largest, square = 0.0, 0.0
    # the first stride from rest has not the past of one
    if strides > 2.0 or (strides > 1.0 and s[o + AT.trusted] > 0.0):
        for i in range(n):
            at = _held(s, o, state, i)
            s[moved + i] = math.log(begun[at] / s[table(s, o, AT.begun) + i])
            s[became + i] = math.log(ended[at] / s[table(s, o, AT.became) + i])
            square += s[moved + i] * s[moved + i]
            largest = max(largest, abs(s[moved + i]))
    for i in range(n):
        told = 0.0
        if largest > TINY:
            told = s[became + i]
            for j in range(n):
                told -= s[own + n * i + j] * s[moved + j]
            told /= square
        for j in range(n):
            s[slopes + n * i + j] = s[own + n * i + j]
            if told != 0.0:
                s[slopes + n * i + j] += told * s[moved + j]


@register_jitable
def _is_near(s: Any, o: int, act: Any, userdata: Any, control: Any, first: int) -> bool:
    """Whether Newton's method would not go far from here; what changes slowly may have far to go."""
    n, flowing, near, step = 2 * int(s[o + AT.nodes]), table(s, o, AT.flowing), True, table(s, o, AT.step)
    entering(s, o, act, userdata, control, first)
    _newton(s, o, step, False)
    for i in range(n):
        flow = s[flowing + i // 2]
        enough = min(max(OF_FLOW * flow, LEAST), NEAR) if flow > 0.0 else NEAR
        near = near and abs(s[step + i]) <= enough
        for j in range(n):  # where nothing flows, a flow's slope is not known
            known = flow > 0.0 and s[flowing + j // 2] > 0.0
            s[table(s, o, AT.told) + n * i + j] = s[table(s, o, AT.own) + n * i + j] if known else 0.0
    s[o + AT.asked] = 1.0
    return near


@register_jitable
def _newton(s: Any, o: int, step: int, plain: bool) -> None:
    """Step of Newton's method in ln m and ln σ, (1 − slopes) step = change; or `plain`, in m and σ."""
    n = 2 * int(s[o + AT.nodes])
    for i in range(n):
        change = s[table(s, o, AT.change) + i]
        ratio = math.exp(change) if plain else 1.0
        s[table(s, o, AT.side) + i] = ratio - 1.0 if plain else change
        for j in range(n):
            slope = ratio * s[table(s, o, AT.slopes) + n * i + j]
            s[table(s, o, AT.matrix) + n * i + j] = 1.0 - slope if i == j else -slope
    least_squares(s, table(s, o, AT.matrix), table(s, o, AT.other), table(s, o, AT.side), step, n)


@register_jitable
def _jump(s: Any, o: int, begun: Any, ended: Any, state: int) -> None:
    """Put the air that should repeat into the state, by one step of Newton's method, at most `LARGEST`."""
    n, step, change = 2 * int(s[o + AT.nodes]), table(s, o, AT.step), table(s, o, AT.change)
    if s[o + AT.jumps] < JUMPS:
        _newton(s, o, step, False)
        along, low, high = 0.0, -LARGEST, LARGEST
        for i in range(n):
            along += s[step + i] * s[change + i]
            low, high = min(low, s[step + i]), max(high, s[step + i])
        scale = LARGEST / max(-low, high)
        if not along >= 0.0:
            _newton(s, o, step, True)
            low, high = LOW, HIGH
            for i in range(n):
                low, high = min(low, s[step + i]), max(high, s[step + i])
            scale = min(LOW / low, HIGH / high)
        for i in range(n):
            moved = scale * s[step + i]
            factor = math.exp(moved) if along >= 0.0 else 1.0 + moved
            ended[_held(s, o, state, i)] = begun[_held(s, o, state, i)] * factor
    else:
        for i in range(n):
            ended[_held(s, o, state, i)] = s[table(s, o, AT.first) + i]
    for k in range(int(s[o + AT.chambers])):
        at = _held(s, o, state, 2 * k) - CHAMBER_ACT.mass
        sigma, volume = ended[at + CHAMBER_ACT.sigma], ended[at + CHAMBER_ACT.last_volume]
        ended[at + CHAMBER_ACT.last_pressure] = chamber_pressure(sigma, volume, s[o + AT.gamma])
    s[o + AT.jumps] += 1.0
    s[o + AT.since_jump] = 0.0


@register_jitable
def least_squares(s: Any, a: int, v: int, b: int, x: int, n: int) -> None:
    """The shortest x [n] that minimises |A x − b|; singular values count from `STILL` of the largest on."""
    # A [n, n] is rotated to columns that are at right angles, A V; they and V [n, n] are left at a and v.
    # Source: Hestenes 1958, doi 10.1137/0106005: one-sided rotations; Golub & Van Loan, § 8.6.3.
    for i in range(n):
        s[x + i] = 0.0
        for j in range(n):
            s[v + n * i + j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        rotated = False
        for p in range(n - 1):
            for q in range(p + 1, n):
                rotated = _at_right_angles(s, a, v, p, q, n) or rotated
        if not rotated:
            break
    largest = 0.0
    for j in range(n):
        largest = max(largest, _product(s, a, j, j, n))
    for j in range(n):
        square, along = _product(s, a, j, j, n), 0.0
        if square <= STILL * STILL * largest:
            continue
        for i in range(n):
            along += s[a + n * i + j] * s[b + i]
        for i in range(n):
            s[x + i] += s[v + n * i + j] * (along / square)


@register_jitable
def _product(s: Any, a: int, p: int, q: int, n: int) -> float:
    """Scalar product of two columns of a matrix [n, n]."""
    found = 0.0
    for i in range(n):
        found += s[a + n * i + p] * s[a + n * i + q]
    return found


@register_jitable
def _at_right_angles(s: Any, a: int, v: int, p: int, q: int, n: int) -> bool:
    """Rotate two columns of A and V so that those of A are at right angles; whether they were not."""
    across, one, other = _product(s, a, p, q, n), _product(s, a, p, p, n), _product(s, a, q, q, n)
    if not abs(across) > ACROSS * n * math.sqrt(one * other):
        return False
    half = (other - one) / (2.0 * across)
    tangent = math.copysign(1.0, half) / (abs(half) + math.sqrt(1.0 + half * half))
    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    for m in (a, v):
        for i in range(n):
            left, right = s[m + n * i + p], s[m + n * i + q]
            s[m + n * i + p] = cosine * (left - tangent * right)
            s[m + n * i + q] = cosine * (tangent * left + right)
    return True

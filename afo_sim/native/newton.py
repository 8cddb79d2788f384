"""Newton's method on a whole network: each leader eliminated into its chamber, each chamber into the pull."""

from typing import Any

from afo_sim.native.balance import air_of, held, lacking, pull_of, shift, within
from afo_sim.native.slots import (
    AIR_ROW,
    CHAMBER_DATA,
    CHAMBER_ROW,
    LEADER_ACT,
    LEADER_DATA,
    MUSCLE_ROW,
    NETWORK_ROW,
)
from afo_sim.physics import register_jitable

NEWTON_STEPS = 30  # it takes two to six, more beside kinks and where a friction turns
SOFTEST = 1e-6  # stiffness by κ [N]; slack, undamped and without return force a muscle has none at all
SETTLED_CONTRACTION, SETTLED_PULL = 1e-8, 1e-5  # last step of Newton's method; what is left is its square


@register_jitable
def guess(m: Any, d: Any, i: int, j: int, rest: bool) -> float:
    """First contractions, into `userdata`, as the last step moved them; the pull that they make [N]."""
    u, act, data = m.actuator_user, d.act, d.userdata
    chamber = int(u[j + NETWORK_ROW.first_chamber])
    while chamber >= 0:
        leader = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.first_muscle])
        while leader >= 0:
            k = m.nuser_actuator * leader
            last = int(u[k + MUSCLE_ROW.state])
            moved = 0.0 if rest else act[last + LEADER_ACT.last_move]
            first = within(u, k, act[last + LEADER_ACT.contraction] + moved)
            data[int(u[k + MUSCLE_ROW.userdata]) + LEADER_DATA.contraction] = first
            leader = int(u[k + MUSCLE_ROW.next])
        chamber = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.next])
    return balanced_pull(m, d, j, rest)


@register_jitable
def balanced_pull(m: Any, d: Any, j: int, rest: bool) -> float:
    """Pull that displaces the anchors so that the cables make it, at the contractions in `userdata` [N]."""
    u, pull = m.actuator_user, 0.0
    if u[j + NETWORK_ROW.anchors] == 0.0:  # nothing moves under the pull
        return pull
    for _ in range(NEWTON_STEPS):
        moved, moved_by_pull = shift(m, d, j, pull, rest)
        pulled, stiffness, chamber = 0.0, 0.0, int(u[j + NETWORK_ROW.first_chamber])
        while chamber >= 0:
            tension, slope = pull_of(m, d, chamber, moved)
            pulled += tension
            stiffness += slope
            chamber = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.next])
        step = (pulled - pull) / (1.0 + stiffness * moved_by_pull)
        pull += step
        if not step > SETTLED_PULL:
            break
    return pull


@register_jitable
def linearise(
    m: Any, d: Any, chamber: int, moved: float, moved_by_pull: float, rest: bool
) -> tuple[float, float, float]:
    """Newton's step of a chamber's leaders as a line over the change of the pull."""
    u, data, q = m.actuator_user, d.userdata, m.nuser_actuator * chamber
    volume, absolute, by_volume = air_of(m, d, chamber, rest)
    place = int(u[q + AIR_ROW.userdata])
    data[place + CHAMBER_DATA.volume], data[place + CHAMBER_DATA.pressure] = volume, absolute
    data[place + CHAMBER_DATA.by_volume] = by_volume
    from_left, from_pressure, from_pull = 0.0, 0.0, 0.0
    leader = int(u[q + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = int(u[k + MUSCLE_ROW.userdata])
        left, stiffness, by_pressure, tension, slope = lacking(
            m, d, leader, chamber, data[own + LEADER_DATA.contraction], absolute, moved, rest
        )
        data[own + LEADER_DATA.tension], data[own + LEADER_DATA.cable_slope] = tension, slope
        carried = slope
        if held(u, k, data[own + LEADER_DATA.contraction], left):
            left, by_pressure, carried = 0.0, 0.0, 0.0
        if stiffness < SOFTEST:
            stiffness = SOFTEST
        data[own + LEADER_DATA.step] = left / stiffness
        data[own + LEADER_DATA.by_pressure] = by_pressure / stiffness
        data[own + LEADER_DATA.by_pull] = carried * moved_by_pull / stiffness
        data[own + LEADER_DATA.coefficient] = carried * u[k + MUSCLE_ROW.nominal_length] / stiffness
        swell = data[own + LEADER_DATA.volume_slope]
        from_left += swell * data[own + LEADER_DATA.step]
        from_pressure += swell * data[own + LEADER_DATA.by_pressure]
        from_pull += swell * data[own + LEADER_DATA.by_pull]
        leader = int(u[k + MUSCLE_ROW.next])
    falls = by_volume / (1.0 + by_volume * from_pressure)
    pull, change, against = 0.0, 0.0, 0.0
    leader = int(u[q + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own, count = int(u[k + MUSCLE_ROW.userdata]), u[k + MUSCLE_ROW.parallel]
        data[own + LEADER_DATA.step] -= data[own + LEADER_DATA.by_pressure] * falls * from_left
        data[own + LEADER_DATA.by_pull] -= data[own + LEADER_DATA.by_pressure] * falls * from_pull
        # stays soft in series with the chamber's air: for the slope of the tension by the path
        data[own + LEADER_DATA.coefficient] *= (
            1.0 - data[own + LEADER_DATA.by_pressure] * falls * data[own + LEADER_DATA.volume_slope]
        )
        slope, length = data[own + LEADER_DATA.cable_slope], u[k + MUSCLE_ROW.nominal_length]
        pull += count * data[own + LEADER_DATA.tension]
        change += count * slope * length * data[own + LEADER_DATA.step]
        against += count * slope * (moved_by_pull - length * data[own + LEADER_DATA.by_pull])
        leader = int(u[k + MUSCLE_ROW.next])
    return pull, change, against


@register_jitable
def linearise_all(
    m: Any, d: Any, j: int, moved: float, moved_by_pull: float, rest: bool
) -> tuple[float, float, float]:
    """As `linearise`, of all chambers of the network whose row starts at j."""
    pull, change, against = 0.0, 0.0, 0.0
    chamber = int(m.actuator_user[j + NETWORK_ROW.first_chamber])
    while chamber >= 0:
        a, b, c = linearise(m, d, chamber, moved, moved_by_pull, rest)
        pull += a
        change += b
        against += c
        chamber = int(m.actuator_user[m.nuser_actuator * chamber + CHAMBER_ROW.next])
    return pull, change, against


@register_jitable
def calmed(change: float, last: float) -> float:
    """A step of Newton's method, at most half as far back as the last one came."""
    if change * last < 0.0 and abs(change) > 0.5 * abs(last):
        return -0.5 * last
    return change


@register_jitable
def advance(m: Any, d: Any, chamber: int, step: float, first: bool) -> bool:
    """Move a chamber's leaders by Newton's step, the pull by its own: whether they moved no further."""
    u, data, settled = m.actuator_user, d.userdata, True
    leader = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = int(u[k + MUSCLE_ROW.userdata])
        change = data[own + LEADER_DATA.step] + data[own + LEADER_DATA.by_pull] * step
        if not first:
            change = calmed(change, data[own + LEADER_DATA.change])
        data[own + LEADER_DATA.change] = change
        data[own + LEADER_DATA.contraction] = within(u, k, data[own + LEADER_DATA.contraction] + change)
        settled = settled and abs(change) < SETTLED_CONTRACTION
        leader = int(u[k + MUSCLE_ROW.next])
    return settled


@register_jitable
def newton(m: Any, d: Any, j: int, pull: float, rest: bool) -> tuple[float, bool]:
    """Newton's method from the contractions in `userdata` and a pull: (pull [N], whether it settled)."""
    u, step = m.actuator_user, 0.0
    for iteration in range(NEWTON_STEPS):
        moved, moved_by_pull = shift(m, d, j, pull, rest)
        pulled, change, against = linearise_all(m, d, j, moved, moved_by_pull, rest)
        step = calmed((pulled - pull + change) / (1.0 + against), step)
        if pull + step < 0.0:
            step = -pull
        pull += step
        settled = abs(step) < SETTLED_PULL
        chamber = int(u[j + NETWORK_ROW.first_chamber])
        while chamber >= 0:
            there = advance(m, d, chamber, step, iteration == 0)
            settled = settled and there
            chamber = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.next])
        if settled:
            return pull, True
    return pull, False


@register_jitable
def newton_chamber(m: Any, d: Any, chamber: int, moved: float, rest: bool) -> bool:
    """Newton's method on one chamber, its anchors held displaced by `moved`: whether it settled."""
    for iteration in range(NEWTON_STEPS):
        linearise(m, d, chamber, moved, 0.0, rest)
        if advance(m, d, chamber, 0.0, iteration == 0):
            return True
    return False

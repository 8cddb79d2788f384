"""Newton's method on a whole network: each leader eliminated into its chamber, each chamber into the pull."""

from typing import Any

from afo_sim.native.balance import held, lacking, pressure_of, shift, volume_of, within
from afo_sim.native.slots import (
    ANCHOR_FORCE,
    ANCHOR_LENGTH,
    ANCHOR_STIFFNESS,
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_NEXT,
    MUSCLE_COUNT,
    MUSCLE_NEXT,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_STATE,
    MUSCLE_USERDATA,
    NETWORK_ANCHORS,
    NETWORK_FIRST_ANCHOR,
    NETWORK_FIRST_CHAMBER,
    NETWORK_STATE,
)
from afo_sim.native.state import (
    ANCHOR_DISPLACEMENT,
    CABLE_SLOPE,
    CONTRACTION,
    LAST_MOVE,
    OWN_CONTRACTION,
    TENSION,
    WORK_BY_PRESSURE,
    WORK_BY_PULL,
    WORK_CHANGE,
    WORK_COEFFICIENT,
    WORK_STEP,
    WORK_VOLUME_SLOPE,
)
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.series import anchor_force

NEWTON_STEPS = 30  # it takes two to six, more beside kinks and where a friction turns
SOFTEST = 1e-6  # stiffness by κ [N]; slack, undamped and without return force a muscle has none at all
SETTLED_CONTRACTION, SETTLED_PULL = 1e-8, 1e-5  # last step of Newton's method; what is left is its square


@register_jitable
def guess(m: Any, d: Any, i: int, j: int, rest: bool) -> float:
    """First contractions, into `userdata`, as the last step moved them; the pull on the anchors last [N]."""
    u, act, data = m.actuator_user, d.act, d.userdata
    state, pull = int(u[j + NETWORK_STATE]), 0.0
    chamber = int(u[j + NETWORK_FIRST_CHAMBER])
    while chamber >= 0:
        leader = int(u[m.nuser_actuator * chamber + CHAMBER_FIRST_MUSCLE])
        while leader >= 0:
            k = m.nuser_actuator * leader
            last = int(u[k + MUSCLE_STATE])
            moved = 0.0 if rest else act[last + LAST_MOVE]
            first = within(u, k, act[last + CONTRACTION] + moved)
            data[int(u[k + MUSCLE_USERDATA]) + OWN_CONTRACTION] = first
            leader = int(u[k + MUSCLE_NEXT])
        chamber = int(u[m.nuser_actuator * chamber + CHAMBER_NEXT])
    if u[j + NETWORK_ANCHORS] > 0.0:
        a = j + NETWORK_FIRST_ANCHOR
        z = act[state + ANCHOR_DISPLACEMENT]
        pull = anchor_force(z, u[a + ANCHOR_STIFFNESS], u[a + ANCHOR_FORCE], u[a + ANCHOR_LENGTH])
    return pull if pull > 0.0 else 0.0


@register_jitable
def linearise(
    m: Any, d: Any, chamber: int, moved: float, moved_by_pull: float, rest: bool
) -> tuple[float, float, float]:
    """Newton's step of a chamber's leaders as a line over the change of the pull.

    Writes dκ = WORK_STEP + WORK_BY_PULL dP for every leader, from −D dκ + q dp + w dP = −r and
    dp = −B Σ n V' dκ: r is what is left, D and q its slopes by κ and p, w that by the pull.

    Units: returns [N].
    """
    u, data, q = m.actuator_user, d.userdata, m.nuser_actuator * chamber
    absolute, by_volume = pressure_of(m, d, chamber, volume_of(m, d, q), rest)
    from_left, from_pressure, from_pull = 0.0, 0.0, 0.0
    leader = int(u[q + CHAMBER_FIRST_MUSCLE])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = int(u[k + MUSCLE_USERDATA])
        left, stiffness, by_pressure, theta, tension, slope = lacking(
            m, d, leader, chamber, data[own + OWN_CONTRACTION], absolute, moved, rest
        )
        data[own + TENSION], data[own + CABLE_SLOPE] = tension, slope
        if held(u, k, data[own + OWN_CONTRACTION], left):
            left, by_pressure, theta = 0.0, 0.0, 0.0
        if stiffness < SOFTEST:
            stiffness = SOFTEST
        data[own + WORK_STEP] = left / stiffness
        data[own + WORK_BY_PRESSURE] = by_pressure / stiffness
        data[own + WORK_BY_PULL] = theta * slope * moved_by_pull / stiffness
        data[own + WORK_COEFFICIENT] = theta * slope * u[k + MUSCLE_NOMINAL_LENGTH] / stiffness
        swell = data[own + WORK_VOLUME_SLOPE]
        from_left += swell * data[own + WORK_STEP]
        from_pressure += swell * data[own + WORK_BY_PRESSURE]
        from_pull += swell * data[own + WORK_BY_PULL]
        leader = int(u[k + MUSCLE_NEXT])
    falls = by_volume / (1.0 + by_volume * from_pressure)
    pull, change, against = 0.0, 0.0, 0.0
    leader = int(u[q + CHAMBER_FIRST_MUSCLE])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own, count = int(u[k + MUSCLE_USERDATA]), u[k + MUSCLE_COUNT]
        data[own + WORK_STEP] -= data[own + WORK_BY_PRESSURE] * falls * from_left
        data[own + WORK_BY_PULL] -= data[own + WORK_BY_PRESSURE] * falls * from_pull
        # stays soft in series with the chamber's air: for the slope of the tension by the path
        data[own + WORK_COEFFICIENT] *= (
            1.0 - data[own + WORK_BY_PRESSURE] * falls * data[own + WORK_VOLUME_SLOPE]
        )
        slope, length = data[own + CABLE_SLOPE], u[k + MUSCLE_NOMINAL_LENGTH]
        pull += count * data[own + TENSION]
        change += count * slope * length * data[own + WORK_STEP]
        against += count * slope * (moved_by_pull - length * data[own + WORK_BY_PULL])
        leader = int(u[k + MUSCLE_NEXT])
    return pull, change, against


@register_jitable
def linearise_all(
    m: Any, d: Any, j: int, moved: float, moved_by_pull: float, rest: bool
) -> tuple[float, float, float]:
    """As `linearise`, of all chambers of the network whose row starts at j."""
    pull, change, against = 0.0, 0.0, 0.0
    chamber = int(m.actuator_user[j + NETWORK_FIRST_CHAMBER])
    while chamber >= 0:
        a, b, c = linearise(m, d, chamber, moved, moved_by_pull, rest)
        pull += a
        change += b
        against += c
        chamber = int(m.actuator_user[m.nuser_actuator * chamber + CHAMBER_NEXT])
    return pull, change, against


@register_jitable
def calmed(change: float, last: float) -> float:
    """A step of Newton's method, at most half as far back as the last one came.

    Else it would go to and fro for ever about where a friction turns or a braid becomes taut.
    """
    if change * last < 0.0 and abs(change) > 0.5 * abs(last):
        return -0.5 * last
    return change


@register_jitable
def advance(m: Any, d: Any, chamber: int, step: float, first: bool) -> bool:
    """Move a chamber's leaders by Newton's step, the pull by its own: whether they moved no further."""
    u, data, settled = m.actuator_user, d.userdata, True
    leader = int(u[m.nuser_actuator * chamber + CHAMBER_FIRST_MUSCLE])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = int(u[k + MUSCLE_USERDATA])
        change = data[own + WORK_STEP] + data[own + WORK_BY_PULL] * step
        if not first:
            change = calmed(change, data[own + WORK_CHANGE])
        data[own + WORK_CHANGE] = change
        data[own + OWN_CONTRACTION] = within(u, k, data[own + OWN_CONTRACTION] + change)
        settled = settled and abs(change) < SETTLED_CONTRACTION
        leader = int(u[k + MUSCLE_NEXT])
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
        chamber = int(u[j + NETWORK_FIRST_CHAMBER])
        while chamber >= 0:
            there = advance(m, d, chamber, step, iteration == 0)
            settled = settled and there
            chamber = int(u[m.nuser_actuator * chamber + CHAMBER_NEXT])
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

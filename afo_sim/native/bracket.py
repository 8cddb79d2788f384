"""Bisection of a network, which always ends. It takes over where Newton's method does not settle.

The pull on the anchors is bracketed. At each of its values they are held, and Newton's method solves chamber
by chamber; where it does not settle there either, pressure and contractions are bracketed too, which is slow.
"""

from typing import Any

from afo_sim.native.balance import SHORTEST, lacking, pressure_of, shift, volume_of, within
from afo_sim.native.muscle import cable, stretch
from afo_sim.native.newton import newton_chamber
from afo_sim.native.slots import CHAMBER_ROW, LEADER_DATA, MUSCLE_ROW, NETWORK_ROW
from afo_sim.physics.jitable import register_jitable

HALVINGS = 55  # of a bracket of κ or p
NARROW_PULL = 1e-6  # width of a bracket of the pull that is solved [N]


@register_jitable
def bisect_leader(
    m: Any, d: Any, leader: int, chamber: int, absolute: float, moved: float, rest: bool
) -> None:
    """The contraction of a leader at a pressure and a displacement of its anchors, into `userdata`."""
    k = m.nuser_actuator * leader
    low, high = within(m.actuator_user, k, -1.0), SHORTEST
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        left = lacking(m, d, leader, chamber, middle, absolute, moved, rest)[0]
        if left > 0.0:
            low = middle
        elif left <= 0.0:
            high = middle
        else:  # a NaN has no side
            low = high = left
            break
    d.userdata[int(m.actuator_user[k + MUSCLE_ROW.userdata]) + LEADER_DATA.contraction] = 0.5 * (low + high)


@register_jitable
def leaders_at(m: Any, d: Any, chamber: int, absolute: float, moved: float, rest: bool) -> None:
    """The contractions of a chamber's leaders at a pressure and a displacement, into `userdata`."""
    u = m.actuator_user
    leader = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        bisect_leader(m, d, leader, chamber, absolute, moved, rest)
        leader = int(u[m.nuser_actuator * leader + MUSCLE_ROW.next])


@register_jitable
def highest_pressure(m: Any, d: Any, chamber: int) -> float:
    """Absolute pressure of a chamber whose muscles are stretched to their locks [Pa]."""
    u, q = m.actuator_user, m.nuser_actuator * chamber
    leader = int(u[q + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        d.userdata[int(u[k + MUSCLE_ROW.userdata]) + LEADER_DATA.contraction] = within(u, k, -1.0)
        leader = int(u[k + MUSCLE_ROW.next])
    return pressure_of(m, d, chamber, volume_of(m, d, q), False)[0]


@register_jitable
def bisect_chamber(m: Any, d: Any, chamber: int, moved: float, rest: bool) -> None:
    """The contractions of a chamber's leaders at a displacement of their anchors, into `userdata`."""
    if rest:
        leaders_at(m, d, chamber, pressure_of(m, d, chamber, 1.0, rest)[0], moved, rest)
        return
    # p − σ/V(κ(p))^γ rises with p, up to where the muscles are as long as they can be
    low, high = 0.0, highest_pressure(m, d, chamber)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        leaders_at(m, d, chamber, middle, moved, rest)
        if middle < pressure_of(m, d, chamber, volume_of(m, d, m.nuser_actuator * chamber), rest)[0]:
            low = middle
        else:
            high = middle


@register_jitable
def pull_at(m: Any, d: Any, chamber: int, moved: float, rest: bool) -> float:
    """Solve a chamber's leaders at a displacement of their anchors: their pull together [N]."""
    u, data, q = m.actuator_user, d.userdata, m.nuser_actuator * chamber
    if not newton_chamber(m, d, chamber, moved, rest):
        bisect_chamber(m, d, chamber, moved, rest)
    pull, leader = 0.0, int(u[q + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = data[int(u[k + MUSCLE_ROW.userdata]) + LEADER_DATA.contraction]
        pull += u[k + MUSCLE_ROW.parallel] * cable(u, k, stretch(m, d, leader, k, own, moved))[0]
        leader = int(u[k + MUSCLE_ROW.next])
    return pull


@register_jitable
def bisect(m: Any, d: Any, j: int, rest: bool) -> float:
    """Solve a network by bisection, into `userdata`: its pull [N]."""
    u = m.actuator_user
    low, high = 0.0, 0.0
    for halving in range(HALVINGS + 1):
        pull = 0.5 * (low + high)
        moved, _ = shift(m, d, j, pull, rest)
        pulled, chamber = 0.0, int(u[j + NETWORK_ROW.first_chamber])
        while chamber >= 0:
            pulled += pull_at(m, d, chamber, moved, rest)
            chamber = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.next])
        if pulled != pulled or u[j + NETWORK_ROW.anchors] == 0.0:  # nothing moves under the pull
            return pulled
        if halving == 0:  # without displacement they pull the most
            high = pulled
        elif pulled > pull:
            low = pull
        else:
            high = pull
        if high - low < NARROW_PULL:
            break
    return 0.5 * (low + high)

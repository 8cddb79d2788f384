"""What a network must balance at given contractions: anchors, volumes, pressures, forces left over."""

from typing import Any

from afo_sim.native.muscle import cable, imbalance, imbalance_at_rest, stretch
from afo_sim.native.slots import (
    AIR_ROW,
    ANCHOR,
    ANCHOR_ACT,
    CHAMBER_ACT,
    CHAMBER_ROW,
    LEADER_DATA,
    MUSCLE_ROW,
    NETWORK_ROW,
)
from afo_sim.physics import anchor_displacement, chamber_pressure, muscle_volume, register_jitable

LONGEST, SHORTEST = 0.999, 0.9  # of the lock, and the contraction ratio, that a muscle stays between


@register_jitable
def within(u: Any, k: int, contraction: float) -> float:
    """A contraction ratio between the lock of the muscle whose row starts at k and the shortest that is."""
    least = LONGEST * u[k + MUSCLE_ROW.lock]
    if contraction < least:
        return least
    if contraction > SHORTEST:
        return SHORTEST
    return contraction + 0.0 * least  # a NaN stays one


@register_jitable
def held(u: Any, k: int, contraction: float, left: float) -> bool:
    """Whether the muscle whose row starts at k is pushed against an end of its range."""
    if left > 0.0:
        return contraction >= SHORTEST
    return left < 0.0 and contraction <= LONGEST * u[k + MUSCLE_ROW.lock]


@register_jitable
def shift(m: Any, d: Any, j: int, pull: float, rest: bool) -> tuple[float, float]:
    """Displacement of all anchors of the network whose row starts at j under a pull [m], and its slope."""
    u, act = m.actuator_user, d.act
    total, slope = 0.0, 0.0
    a, state = j + NETWORK_ROW.first_anchor, int(u[j + NETWORK_ROW.state])
    for _ in range(int(u[j + NETWORK_ROW.anchors])):
        z, by_pull = anchor_displacement(
            pull,
            u[a + ANCHOR.stiffness],
            u[a + ANCHOR.force],
            u[a + ANCHOR.length],
            0.0 if rest else u[a + ANCHOR.damping],
            act[state + ANCHOR_ACT.displacement],
            act[state + ANCHOR_ACT.loss],
            m.opt.timestep,
        )
        total += z
        slope += by_pull
        a += len(ANCHOR)
        state += len(ANCHOR_ACT)
    return total, slope


@register_jitable
def volume_of(m: Any, d: Any, q: int) -> float:
    """Volume of the chamber whose row starts at q [m³]; writes dV/dκ of its leaders' muscles together."""
    u, data = m.actuator_user, d.userdata
    volume, leader = u[q + AIR_ROW.volume], int(u[q + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = int(u[k + MUSCLE_ROW.userdata])
        part, slope = muscle_volume(
            data[own + LEADER_DATA.contraction],
            u[k + MUSCLE_ROW.nominal_length],
            u[k + MUSCLE_ROW.nominal_radius],
            u[k + MUSCLE_ROW.b],
            u[k + MUSCLE_ROW.dead_volume],
        )
        volume += u[k + MUSCLE_ROW.parallel] * part
        data[own + LEADER_DATA.volume_slope] = u[k + MUSCLE_ROW.parallel] * slope
        leader = int(u[k + MUSCLE_ROW.next])
    return volume


@register_jitable
def pressure_of(m: Any, d: Any, chamber: int, volume: float, rest: bool) -> tuple[float, float]:
    """Absolute pressure of a chamber at a volume [Pa], and −dp/dV [Pa/m³]; at rest the last one."""
    adr = m.actuator_actadr[chamber]
    if rest:
        return d.act[adr + CHAMBER_ACT.last_pressure], 0.0
    gamma = m.actuator_user[m.nuser_actuator * chamber + AIR_ROW.heat_capacity_ratio]
    pressure = chamber_pressure(d.act[adr + CHAMBER_ACT.sigma], volume, gamma)
    return pressure, gamma * pressure / volume


@register_jitable
def lacking(
    m: Any, d: Any, leader: int, chamber: int, contraction: float, absolute: float, moved: float, rest: bool
) -> tuple[float, float, float, float, float, float]:
    """Balance of a leader: (force left, −slope by κ, slope by p, θ, tension, slope of the cable)."""
    u, k = m.actuator_user, m.nuser_actuator * leader
    tension, slope = cable(u, k, stretch(m, d, leader, k, contraction, moved))
    if rest:
        left, stiffness, by_pressure, theta = imbalance_at_rest(m, k, contraction, absolute, tension)
    else:
        last = d.act[m.actuator_actadr[chamber] + CHAMBER_ACT.last_pressure]
        left, stiffness, by_pressure, theta = imbalance(m, d, k, contraction, absolute, last, tension)
    stiffness += theta * slope * u[k + MUSCLE_ROW.nominal_length]
    return left, stiffness, by_pressure, theta, tension, slope

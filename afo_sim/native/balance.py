"""What a network must balance at given contractions: anchors, volumes, pressures, forces left over."""

import math
from typing import Any

from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.native.muscle import cable, damping, friction, law_slopes
from afo_sim.native.slots import (
    AIR_ROW,
    ANCHOR,
    ANCHOR_ACT,
    CHAMBER_ACT,
    CHAMBER_ROW,
    LEADER_ACT,
    LEADER_DATA,
    MUSCLE_ROW,
    NETWORK_ROW,
)
from afo_sim.physics import anchor_displacement, chamber_pressure, muscle_volume, register_jitable

LONGEST, SHORTEST = 0.999, 0.9  # of the lock, and the contraction ratio, that a muscle stays between
PRESSURE_STEPS = 20  # of Newton's method for a pressure that the muscles' volume depends on
SETTLED_PRESSURE = 1e-7  # relative last step of it; what is left is its square
NEAR_PRESSURE = 0.01  # relative change of a pressure over which a volume that kept still keeps so
SOFTEST_AIR = 0.2  # slope of ln σ by ln p that is believed


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
            pull, u[a + ANCHOR.stiffness], u[a + ANCHOR.force], u[a + ANCHOR.length],
            0.0 if rest else u[a + ANCHOR.damping], act[state + ANCHOR_ACT.displacement],
            act[state + ANCHOR_ACT.last_move], m.opt.timestep,
        )  # fmt: skip
        total += z
        slope += by_pull
        a += len(ANCHOR)
        state += len(ANCHOR_ACT)
    return total, slope


@register_jitable
def volume_of(m: Any, d: Any, q: int, absolute: float) -> tuple[float, float]:
    """Volume of the chamber whose row starts at q at a pressure [m³], and its slope by that [m³/Pa]."""
    u, data = m.actuator_user, d.userdata
    volume, by_pressure, leader = u[q + AIR_ROW.volume], 0.0, int(u[q + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = int(u[k + MUSCLE_ROW.userdata])
        part, slope, more = muscle_volume(
            data[own + LEADER_DATA.contraction], absolute - AMBIENT_PRESSURE,
            u[k + MUSCLE_ROW.nominal_length], u[k + MUSCLE_ROW.nominal_radius], u[k + MUSCLE_ROW.b],
            u[k + MUSCLE_ROW.braids], u[k + MUSCLE_ROW.dead_volume], u[k + MUSCLE_ROW.rubber_volume],
            u[k + MUSCLE_ROW.returning], u, k + MUSCLE_ROW.law_volume,
        )  # fmt: skip
        volume += u[k + MUSCLE_ROW.parallel] * part
        by_pressure += u[k + MUSCLE_ROW.parallel] * more
        data[own + LEADER_DATA.volume_slope] = u[k + MUSCLE_ROW.parallel] * slope
        leader = int(u[k + MUSCLE_ROW.next])
    return volume, by_pressure


@register_jitable
def air_of(m: Any, d: Any, chamber: int, rest: bool) -> tuple[float, float, float]:
    """Volume [m³] and absolute pressure [Pa] of a chamber at its leaders' contractions, −dp/dV [Pa/m³]."""
    # Where a muscle's volume depends on its pressure, Newton's method on ln p solves p V(κ, p)^γ = σ. −dp/dV
    # is that of muscles that move, γ p/(V + γ p ∂V/∂p). At rest the pressure is the last one.
    adr, q = m.actuator_actadr[chamber], m.nuser_actuator * chamber
    absolute = d.act[adr + CHAMBER_ACT.last_pressure]
    volume, by_pressure = volume_of(m, d, q, absolute)
    if rest:
        return volume, absolute, 0.0
    gamma, sigma = m.actuator_user[q + AIR_ROW.heat_capacity_ratio], d.act[adr + CHAMBER_ACT.sigma]
    for _ in range(PRESSURE_STEPS):
        wanted, last = chamber_pressure(sigma, volume, gamma), absolute
        if by_pressure == 0.0:
            absolute = wanted
            if abs(absolute - last) <= NEAR_PRESSURE * last:  # so near the volume has no slope either
                break
        else:
            slope = max(1.0 + gamma * last * by_pressure / volume, SOFTEST_AIR)
            absolute *= math.exp(math.log(wanted / last) / slope)
        volume, by_pressure = volume_of(m, d, q, absolute)
        if abs(absolute - last) <= SETTLED_PRESSURE * last:
            break
    stiff = max(volume + gamma * absolute * by_pressure, SOFTEST_AIR * volume)
    return volume, absolute, gamma * absolute / stiff


@register_jitable
def pull_of(m: Any, d: Any, chamber: int, moved: float) -> tuple[float, float]:
    """Pull of a chamber's leaders, their anchors displaced by `moved`, and −its slope by that: [N], [N/m]."""
    u, pull, stiffness = m.actuator_user, 0.0, 0.0
    leader = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = d.userdata[int(u[k + MUSCLE_ROW.userdata]) + LEADER_DATA.contraction]
        tension, slope = cable(m, d, leader, own, moved)
        pull += u[k + MUSCLE_ROW.parallel] * tension
        stiffness += u[k + MUSCLE_ROW.parallel] * slope
        leader = int(u[k + MUSCLE_ROW.next])
    return pull, stiffness


@register_jitable
def lacking(
    m: Any, d: Any, leader: int, chamber: int, contraction: float, absolute: float, moved: float, rest: bool
) -> tuple[float, float, float, float, float]:
    """Balance of a leader: (force left, −slope by κ, slope by p, tension, slope of the cable)."""
    # F_static − T − c κ̇ − F_friction at a step's end, with κ̇ of the second order by two steps back (BDF2);
    # at rest without what moves. The slope of c by the pressure is left out, so that the force always falls
    # as κ rises. Writes what the muscle's law answers.
    u, act, data, k = m.actuator_user, d.act, d.userdata, m.nuser_actuator * leader
    own, state = int(u[k + MUSCLE_ROW.userdata]), int(u[k + MUSCLE_ROW.state])
    tension, slope = cable(m, d, leader, contraction, moved)
    pressure = absolute - AMBIENT_PRESSURE
    static, by_contraction, by_pressure = law_slopes(u, k, contraction, pressure)
    data[own + LEADER_DATA.asked], data[own + LEADER_DATA.static] = contraction, static
    data[own + LEADER_DATA.static_by] = by_contraction
    data[own + LEADER_DATA.static_by_pressure] = by_pressure
    left, damped = static - tension, 0.0
    if not rest:
        per_step, move = 1.0 / m.opt.timestep, contraction - act[state + LEADER_ACT.contraction]
        rate = (1.5 * move - 0.5 * act[state + LEADER_ACT.last_move]) * per_step
        c = damping(m, k, rate, absolute)
        rubbing, by_friction = friction(m, d, k, contraction, move, pressure, static)
        left -= c * rate + rubbing
        damped = 1.5 * c * per_step + by_friction
    stiffness = damped + slope * u[k + MUSCLE_ROW.nominal_length] - by_contraction
    return left, stiffness, by_pressure, tension, slope

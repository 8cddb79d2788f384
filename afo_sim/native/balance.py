"""What a network must balance at given contractions: anchors, volumes, pressures, forces left over."""

from typing import Any

from afo_sim.native.muscle import cable, imbalance, imbalance_at_rest, stretch
from afo_sim.native.slots import (
    AIR_HEAT_CAPACITY_RATIO,
    ANCHOR_DAMPING,
    ANCHOR_FORCE,
    ANCHOR_LENGTH,
    ANCHOR_SLOTS,
    ANCHOR_STIFFNESS,
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_TUBE_VOLUME,
    MUSCLE_B,
    MUSCLE_COUNT,
    MUSCLE_DEAD_VOLUME,
    MUSCLE_LOCK,
    MUSCLE_NEXT,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_NOMINAL_RADIUS,
    MUSCLE_USERDATA,
    NETWORK_ANCHORS,
    NETWORK_FIRST_ANCHOR,
    NETWORK_STATE,
)
from afo_sim.native.state import (
    ANCHOR_DISPLACEMENT,
    ANCHOR_LOSS,
    ANCHOR_STATES,
    LAST_PRESSURE,
    OWN_CONTRACTION,
    SIGMA,
    WORK_VOLUME_SLOPE,
)
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.pneumatics import chamber_pressure, muscle_volume
from afo_sim.physics.series import anchor_displacement

LONGEST, SHORTEST = 0.999, 0.9  # of the lock, and the contraction ratio, that a muscle stays between


@register_jitable
def within(u: Any, k: int, contraction: float) -> float:
    """A contraction ratio between the lock of the muscle whose row starts at k and the shortest that is."""
    least = LONGEST * u[k + MUSCLE_LOCK]
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
    return left < 0.0 and contraction <= LONGEST * u[k + MUSCLE_LOCK]


@register_jitable
def shift(m: Any, d: Any, j: int, pull: float, rest: bool) -> tuple[float, float]:
    """Displacement of all anchors of the network whose row starts at j under a pull [m], and its slope."""
    u, act = m.actuator_user, d.act
    total, slope = 0.0, 0.0
    a, state = j + NETWORK_FIRST_ANCHOR, int(u[j + NETWORK_STATE])
    for _ in range(int(u[j + NETWORK_ANCHORS])):
        z, by_pull = anchor_displacement(
            pull,
            u[a + ANCHOR_STIFFNESS],
            u[a + ANCHOR_FORCE],
            u[a + ANCHOR_LENGTH],
            0.0 if rest else u[a + ANCHOR_DAMPING],
            act[state + ANCHOR_DISPLACEMENT],
            act[state + ANCHOR_LOSS],
            m.opt.timestep,
        )
        total += z
        slope += by_pull
        a += ANCHOR_SLOTS
        state += ANCHOR_STATES
    return total, slope


@register_jitable
def volume_of(m: Any, d: Any, q: int) -> float:
    """Volume of the chamber whose row starts at q [m³]; writes dV/dκ of its leaders' muscles together."""
    u, data = m.actuator_user, d.userdata
    volume, leader = u[q + CHAMBER_TUBE_VOLUME], int(u[q + CHAMBER_FIRST_MUSCLE])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = int(u[k + MUSCLE_USERDATA])
        part, slope = muscle_volume(
            data[own + OWN_CONTRACTION],
            u[k + MUSCLE_NOMINAL_LENGTH],
            u[k + MUSCLE_NOMINAL_RADIUS],
            u[k + MUSCLE_B],
            u[k + MUSCLE_DEAD_VOLUME],
        )
        volume += u[k + MUSCLE_COUNT] * part
        data[own + WORK_VOLUME_SLOPE] = u[k + MUSCLE_COUNT] * slope
        leader = int(u[k + MUSCLE_NEXT])
    return volume


@register_jitable
def pressure_of(m: Any, d: Any, chamber: int, volume: float, rest: bool) -> tuple[float, float]:
    """Absolute pressure of a chamber at a volume [Pa], and −dp/dV [Pa/m³]; at rest the last one."""
    adr = m.actuator_actadr[chamber]
    if rest:
        return d.act[adr + LAST_PRESSURE], 0.0
    gamma = m.actuator_user[m.nuser_actuator * chamber + AIR_HEAT_CAPACITY_RATIO]
    pressure = chamber_pressure(d.act[adr + SIGMA], volume, gamma)
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
        last = d.act[m.actuator_actadr[chamber] + LAST_PRESSURE]
        left, stiffness, by_pressure, theta = imbalance(m, d, k, contraction, absolute, last, tension)
    stiffness += theta * slope * u[k + MUSCLE_NOMINAL_LENGTH]
    return left, stiffness, by_pressure, theta, tension, slope

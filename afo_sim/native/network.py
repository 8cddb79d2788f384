"""A network: muscles, chambers and anchors that hang together, solved for their own lengths in each step.

    e = x − s − L0 (1 − κ) − Σ z(P)       stretch of each cable, x its path
    T = k max(e, 0),  P = Σ n T           tension of a muscle, pull on the anchors
    F_static(κ, p) − T = c κ̇ + F_friction
    p = σ/V(κ)^γ                          pressure of each chamber

Unknowns are κ of every leader and P. Newton's method solves them together, each leader eliminated into its
chamber, each chamber into P. A leader's force falls as its κ rises, and P − Σ n T rises with P, so bisection
always ends: it takes over where Newton's method does not settle.

The states in `act` belong to the posture one step back. So the result follows from position, state, inputs
and step alone: a second `mj_forward` changes nothing.
"""

from typing import Any

from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.native.air import chamber_complaint
from afo_sim.native.balance import SHORTEST, air_of, lacking, pull_of, shift, volume_of, within
from afo_sim.native.error_codes import FINE, NO_LENGTH, NO_NUMBER, NO_VOLUME
from afo_sim.native.guides import friction_carried
from afo_sim.native.muscle import cable, law_slopes
from afo_sim.native.newton import guess, linearise_all, newton, newton_chamber
from afo_sim.native.slots import (
    AIR_ROW,
    ANCHOR,
    ANCHOR_ACT,
    ANCHOR_DATA,
    CHAMBER_ACT,
    CHAMBER_DATA,
    CHAMBER_ROW,
    LEADER_ACT,
    LEADER_DATA,
    MUSCLE_ROW,
    NETWORK_ROW,
)
from afo_sim.physics import anchor_displacement, register_jitable

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
    return air_of(m, d, chamber, False)[1]


@register_jitable
def bisect_chamber(m: Any, d: Any, chamber: int, moved: float, rest: bool) -> None:
    """The contractions of a chamber's leaders at a displacement of their anchors, into `userdata`."""
    if rest:
        leaders_at(m, d, chamber, air_of(m, d, chamber, rest)[1], moved, rest)
        return
    # p − σ/V(κ(p))^γ rises with p, up to where the muscles are as long as they can be
    low, high = 0.0, highest_pressure(m, d, chamber)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        leaders_at(m, d, chamber, middle, moved, rest)
        if middle < air_of(m, d, chamber, rest)[1]:
            low = middle
        else:
            high = middle


@register_jitable
def pull_at(m: Any, d: Any, chamber: int, moved: float, rest: bool) -> float:
    """Solve a chamber's leaders at a displacement of their anchors: their pull together [N]."""
    if not newton_chamber(m, d, chamber, moved, rest):
        bisect_chamber(m, d, chamber, moved, rest)
    return pull_of(m, d, chamber, moved)[0]


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


@register_jitable
def solve(m: Any, d: Any, i: int, j: int, rest: bool) -> tuple[float, bool]:
    """Own lengths of a network's muscles, into `userdata`: (pull on its anchors [N], whether solved)."""
    pull, settled = newton(m, d, j, guess(m, d, i, j, rest), rest)
    if not settled:
        pull = bisect(m, d, j, rest)
        moved, moved_by_pull = shift(m, d, j, pull, rest)
        linearise_all(m, d, j, moved, moved_by_pull, rest)  # for the slopes
    return pull, pull == pull


@register_jitable
def write_back(m: Any, d: Any, i: int, j: int, pull: float, rest: bool) -> None:
    """The solution's volumes, pressures and tensions to `userdata`, and its states' rates to `act_dot`."""
    u, per_step = m.actuator_user, 0.0 if rest else 1.0 / m.opt.timestep
    moved, softness = shift(m, d, j, pull, rest)
    stiffness = 0.0
    chamber = int(u[j + NETWORK_ROW.first_chamber])
    while chamber >= 0:
        stiffness += write_chamber(m, d, chamber, moved, per_step, rest)
        chamber = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.next])
    chamber = int(u[j + NETWORK_ROW.first_chamber])
    while chamber >= 0:
        write_derivatives(m, d, chamber, softness, stiffness)
        chamber = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.next])
    write_anchors(m, d, j, pull, per_step, rest)


@register_jitable
def write_chamber(m: Any, d: Any, chamber: int, moved: float, per_step: float, rest: bool) -> float:
    """A chamber's volume and pressure and its leaders' tensions; Σ n dT/dx of these, anchors held [N/m]."""
    u, data, q = m.actuator_user, d.userdata, m.nuser_actuator * chamber
    place = int(u[q + AIR_ROW.userdata])
    # Newton's last step was so short that what is of second order in it is rounding
    asked = data[place + CHAMBER_DATA.pressure]
    volume, by_pressure = volume_of(m, d, q, asked)
    pressed = data[place + CHAMBER_DATA.by_volume] * (data[place + CHAMBER_DATA.volume] - volume)
    data[place + CHAMBER_DATA.volume] = volume + by_pressure * pressed
    data[place + CHAMBER_DATA.pressure] = asked + pressed
    total, leader = 0.0, int(u[q + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = int(u[k + MUSCLE_ROW.userdata])
        write_leader(m, d, leader, pressed, moved, per_step)
        # dT/dx = k (1 + L0 dκ/dx), with L0 dκ/dx from the last step of Newton's method
        share = 1.0 - data[own + LEADER_DATA.coefficient]
        stiff = u[k + MUSCLE_ROW.parallel] * data[own + LEADER_DATA.cable_slope] * share
        data[own + LEADER_DATA.coefficient] = stiff
        total += stiff
        leader = int(u[k + MUSCLE_ROW.next])
    return total


@register_jitable
def write_derivatives(m: Any, d: Any, chamber: int, softness: float, total: float) -> None:
    """What the gains of a chamber's leaders carry; their velocity to zero, so that they add no force."""
    u, leader = m.actuator_user, int(m.actuator_user[m.nuser_actuator * chamber + CHAMBER_ROW.first_muscle])
    while leader >= 0:
        k = m.nuser_actuator * leader
        stiff = d.userdata[int(u[k + MUSCLE_ROW.userdata]) + LEADER_DATA.coefficient]
        whole = stiff * (1.0 + 2.0 * softness * (total - stiff)) / (1.0 + softness * total)
        rubbing = 0.0
        if u[k + MUSCLE_ROW.wrap_friction] > 0.0:
            tension = d.userdata[int(u[k + MUSCLE_ROW.userdata]) + LEADER_DATA.tension]
            ratio, rubbing = friction_carried(m, d, leader, k, tension)
            whole *= ratio
        d.ctrl[leader] = derivative(m, k, whole) + rubbing
        d.actuator_velocity[leader] = 0.0
        leader = int(u[k + MUSCLE_ROW.next])


@register_jitable
def write_anchors(m: Any, d: Any, j: int, pull: float, per_step: float, rest: bool) -> None:
    """Pull and displacement of a network's anchors to `userdata`, and the rates of their states."""
    u, act, data, act_dot = m.actuator_user, d.act, d.userdata, d.act_dot
    a, state = j + NETWORK_ROW.first_anchor, int(u[j + NETWORK_ROW.state])
    place = int(u[j + NETWORK_ROW.userdata])
    for _ in range(int(u[j + NETWORK_ROW.anchors])):
        k, force, length = u[a + ANCHOR.stiffness], u[a + ANCHOR.force], u[a + ANCHOR.length]
        damper = 0.0 if rest else u[a + ANCHOR.damping]
        last, last_move = act[state + ANCHOR_ACT.displacement], act[state + ANCHOR_ACT.last_move]
        z, _ = anchor_displacement(pull, k, force, length, damper, last, last_move, m.opt.timestep)
        data[place + ANCHOR_DATA.pull], data[place + ANCHOR_DATA.displacement] = pull, z
        act_dot[state + ANCHOR_ACT.displacement] = per_step * (z - last)
        act_dot[state + ANCHOR_ACT.last_move] = per_step * (z - last - last_move)
        a += len(ANCHOR)
        state += len(ANCHOR_ACT)
        place += len(ANCHOR_DATA)


@register_jitable
def derivative(m: Any, k: int, slope: float) -> float:
    """Damping that the gain of a leader carries, α h dT/dx [N·s/m], from the tension's slope by its path."""
    # To what goes to and fro from step to step a damper under BDF2 is 8/3 as stiff as in one step, and the
    # step is stable where (8/3) h² dT/dx ≤ 4 (m + α h² dT/dx).
    if not slope > 0.0:
        return 0.0
    step = m.opt.timestep
    stiff = step * step * slope * m.actuator_user[k + MUSCLE_ROW.inverse_mass]
    return step * slope * (0.25 if stiff <= 2.4 else 2.0 / 3.0 - 1.0 / stiff)


@register_jitable
def write_leader(m: Any, d: Any, leader: int, pressed: float, moved: float, per_step: float) -> None:
    """Tension and rate of a leader to `userdata`, contraction and carried force to its states' rates."""
    u, act, data, act_dot = m.actuator_user, d.act, d.userdata, d.act_dot
    k = m.nuser_actuator * leader
    own, state = int(u[k + MUSCLE_ROW.userdata]), int(u[k + MUSCLE_ROW.state])
    kappa = data[own + LEADER_DATA.contraction]
    tension, _ = cable(m, d, leader, kappa, moved)
    data[own + LEADER_DATA.tension] = tension
    data[own + LEADER_DATA.rate] = per_step * (kappa - act[state + LEADER_ACT.contraction])
    carried = 0.0
    if within(u, k, -1.0) < kappa < SHORTEST:  # at an end of its range something else carries
        carried = data[own + LEADER_DATA.static] - tension
        carried += data[own + LEADER_DATA.static_by] * (kappa - data[own + LEADER_DATA.asked])
        carried += data[own + LEADER_DATA.static_by_pressure] * pressed
    move = kappa - act[state + LEADER_ACT.contraction]
    act_dot[state + LEADER_ACT.contraction] = per_step * move
    act_dot[state + LEADER_ACT.last_move] = per_step * (move - act[state + LEADER_ACT.last_move])
    act_dot[state + LEADER_ACT.carried] = per_step * (carried - act[state + LEADER_ACT.carried])


@register_jitable
def network_complaint(m: Any, d: Any, i: int, j: int) -> tuple[int, int]:
    """The reason for which the network actuator i cannot be stepped, and the actuator; FINE for none."""
    u, act = m.actuator_user, d.act
    chamber = int(u[j + NETWORK_ROW.first_chamber])
    while chamber >= 0:
        complaint = chamber_complaint(m, d, chamber)
        if complaint != FINE:
            return complaint, chamber
        chamber = int(u[m.nuser_actuator * chamber + CHAMBER_ROW.next])
    end = int(u[j + NETWORK_ROW.state]) + len(ANCHOR_ACT) * int(u[j + NETWORK_ROW.anchors])
    for at in range(m.actuator_actadr[i], end):
        if act[at] != act[at]:  # some are only where the solution is looked for, and nothing else would ask
            return NO_NUMBER, i
    return FINE, i


@register_jitable
def unsolved(m: Any, d: Any, i: int, j: int) -> tuple[int, int]:
    """The reason for which nothing balances the network actuator i, and the actuator."""
    u = m.actuator_user
    chamber = int(u[j + NETWORK_ROW.first_chamber])
    while chamber >= 0:
        q = m.nuser_actuator * chamber
        highest_pressure(m, d, chamber)
        if volume_of(m, d, q, d.act[m.actuator_actadr[chamber] + CHAMBER_ACT.last_pressure])[0] <= 0.0:
            return NO_VOLUME, chamber
        gauge = d.act[m.actuator_actadr[chamber] + CHAMBER_ACT.last_pressure] - AMBIENT_PRESSURE
        leader = int(u[q + CHAMBER_ROW.first_muscle])
        while leader >= 0:
            k = m.nuser_actuator * leader
            force = law_slopes(u, k, 0.0, gauge)[0]
            if force != force:
                return NO_NUMBER, leader
            leader = int(u[k + MUSCLE_ROW.next])
        chamber = int(u[q + CHAMBER_ROW.next])
    return NO_LENGTH, i


@register_jitable
def network_dyn(m: Any, d: Any, i: int, j: int) -> tuple[int, int]:
    """Solve the network actuator i, whose row starts at j: (complaint, actuator)."""
    if d.ctrl[i] != d.ctrl[i]:
        return NO_NUMBER, i
    rest = d.ctrl[i] != 0.0
    if not rest:
        complaint, actuator = network_complaint(m, d, i, j)
        if complaint != FINE:
            return complaint, actuator
    pull, solved = solve(m, d, i, j, rest)
    if not solved:
        return unsolved(m, d, i, j)
    write_back(m, d, i, j, pull, rest)
    return FINE, i

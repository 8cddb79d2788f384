"""A network: muscles, chambers and anchors that hang together, solved for their own lengths in each step.

    e = x − s − L0 (1 − κ) − Σ z(P)       stretch of each cable, x its path
    T = k max(e, 0),  P = Σ n T           tension of a muscle, pull on the anchors
    θ G + (1 − θ) G_last = c κ̇ + F_friction    G = F_static(κ, p) − T
    p = σ/V(κ)^γ                          pressure of each chamber

Unknowns are κ of every leader and P. Newton's method solves them together, each leader eliminated into its
chamber, each chamber into P. A leader's force falls as its κ rises, and P − Σ n T rises with P, so bisection
always ends: it takes over where Newton's method does not settle.

The states in `act` belong to the posture one step back. So the result follows from position, state, inputs
and step alone: a second `mj_forward` changes nothing.
"""

from typing import Any

from numba.extending import register_jitable

from afo_sim.common.units import AMBIENT_PRESSURE, HEAT_CAPACITY_RATIO
from afo_sim.native.air import chamber_complaint
from afo_sim.native.complaints import FINE, NO_LENGTH, NO_NUMBER, NO_VOLUME
from afo_sim.native.muscle import cable, imbalance, imbalance_at_rest, law_force, stretch
from afo_sim.native.slots import (
    ANCHOR_DAMPING,
    ANCHOR_FORCE,
    ANCHOR_LENGTH,
    ANCHOR_SLOTS,
    ANCHOR_STIFFNESS,
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_NEXT,
    CHAMBER_TUBE_VOLUME,
    CHAMBER_USERDATA,
    MUSCLE_B,
    MUSCLE_COUNT,
    MUSCLE_DEAD_VOLUME,
    MUSCLE_INVERSE_MASS,
    MUSCLE_LOCK,
    MUSCLE_NEXT,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_NOMINAL_RADIUS,
    MUSCLE_STATE,
    MUSCLE_USERDATA,
    NETWORK_ANCHORS,
    NETWORK_FIRST_ANCHOR,
    NETWORK_FIRST_CHAMBER,
    NETWORK_STATE,
    NETWORK_USERDATA,
)
from afo_sim.native.state import (
    ANCHOR_DATA,
    ANCHOR_DISPLACEMENT,
    ANCHOR_LOSS,
    ANCHOR_STATES,
    CABLE_SLOPE,
    CARRIED,
    CONTRACTION,
    DISPLACEMENT,
    LAST_PRESSURE,
    OWN_CONTRACTION,
    OWN_RATE,
    PRESSURE,
    PULL,
    SIGMA,
    TENSION,
    VOLUME,
    WORK_BY_PRESSURE,
    WORK_BY_PULL,
    WORK_COEFFICIENT,
    WORK_STEP,
    WORK_VOLUME_SLOPE,
)
from afo_sim.physics.pneumatics import chamber_pressure, muscle_volume
from afo_sim.physics.series import anchor_displacement, anchor_force

NEWTON_STEPS = 12
SETTLED_CONTRACTION, SETTLED_PULL = 1e-9, 1e-6  # of the last step of Newton's method [-], [N]
HALVINGS = 55  # of a bracket of κ or p
LONGEST, SHORTEST = 0.999, 0.9  # of the lock, and the contraction ratio, that a muscle stays between


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


@register_jitable
def pressure_of(m: Any, d: Any, chamber: int, volume: float, rest: bool) -> tuple[float, float]:
    """Absolute pressure of a chamber at a volume [Pa], and −dp/dV [Pa/m³]; at rest the last one."""
    adr = m.actuator_actadr[chamber]
    if rest:
        return d.act[adr + LAST_PRESSURE], 0.0
    pressure = chamber_pressure(d.act[adr + SIGMA], volume)
    return pressure, HEAT_CAPACITY_RATIO * pressure / volume


@register_jitable
def linearise(
    m: Any, d: Any, chamber: int, moved: float, moved_by_pull: float, rest: bool
) -> tuple[float, float, float]:
    """Newton's step of a chamber's leaders as a line over the change of the pull.

    Writes dκ = WORK_STEP + WORK_BY_PULL dP for every leader, from −D dκ + q dp + w dP = −r and
    dp = −B Σ n V' dκ: r is what is left, D and q its slopes by κ and p, w that by the pull.

    Returns
    -------
    (Σ n T [N], its change by the leaders' steps [N], −its slope by the pull [-])
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
def newton(m: Any, d: Any, j: int, pull: float, rest: bool) -> tuple[float, bool]:
    """Newton's method from the contractions in `userdata` and a pull: (pull [N], whether it settled)."""
    u, data = m.actuator_user, d.userdata
    for _ in range(NEWTON_STEPS):
        moved, moved_by_pull = shift(m, d, j, pull, rest)
        pulled, change, against = 0.0, 0.0, 0.0
        chamber = int(u[j + NETWORK_FIRST_CHAMBER])
        while chamber >= 0:
            a, b, c = linearise(m, d, chamber, moved, moved_by_pull, rest)
            pulled += a
            change += b
            against += c
            chamber = int(u[m.nuser_actuator * chamber + CHAMBER_NEXT])
        step = (pulled - pull + change) / (1.0 + against)
        if pull + step < 0.0:
            step = -pull
        pull += step
        settled = abs(step) < SETTLED_PULL
        chamber = int(u[j + NETWORK_FIRST_CHAMBER])
        while chamber >= 0:
            leader = int(u[m.nuser_actuator * chamber + CHAMBER_FIRST_MUSCLE])
            while leader >= 0:
                k = m.nuser_actuator * leader
                own = int(u[k + MUSCLE_USERDATA])
                change = data[own + WORK_STEP] + data[own + WORK_BY_PULL] * step
                data[own + OWN_CONTRACTION] = within(u, k, data[own + OWN_CONTRACTION] + change)
                settled = settled and abs(change) < SETTLED_CONTRACTION
                leader = int(u[k + MUSCLE_NEXT])
            chamber = int(u[m.nuser_actuator * chamber + CHAMBER_NEXT])
        if settled:
            return pull, True
    return pull, False


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
    d.userdata[int(m.actuator_user[k + MUSCLE_USERDATA]) + OWN_CONTRACTION] = 0.5 * (low + high)


@register_jitable
def leaders_at(m: Any, d: Any, chamber: int, absolute: float, moved: float, rest: bool) -> None:
    """The contractions of a chamber's leaders at a pressure and a displacement, into `userdata`."""
    u = m.actuator_user
    leader = int(u[m.nuser_actuator * chamber + CHAMBER_FIRST_MUSCLE])
    while leader >= 0:
        bisect_leader(m, d, leader, chamber, absolute, moved, rest)
        leader = int(u[m.nuser_actuator * leader + MUSCLE_NEXT])


@register_jitable
def highest_pressure(m: Any, d: Any, chamber: int) -> float:
    """Absolute pressure of a chamber whose muscles are stretched to their locks [Pa]."""
    u, q = m.actuator_user, m.nuser_actuator * chamber
    leader = int(u[q + CHAMBER_FIRST_MUSCLE])
    while leader >= 0:
        k = m.nuser_actuator * leader
        d.userdata[int(u[k + MUSCLE_USERDATA]) + OWN_CONTRACTION] = within(u, k, -1.0)
        leader = int(u[k + MUSCLE_NEXT])
    return pressure_of(m, d, chamber, volume_of(m, d, q), False)[0]


@register_jitable
def bisect_chamber(m: Any, d: Any, chamber: int, moved: float, rest: bool) -> float:
    """Solve a chamber's leaders at a displacement of their anchors: their pull together [N]."""
    u, data, q = m.actuator_user, d.userdata, m.nuser_actuator * chamber
    if rest:
        leaders_at(m, d, chamber, pressure_of(m, d, chamber, 1.0, rest)[0], moved, rest)
    else:
        # p − σ/V(κ(p))^γ rises with p, up to where the muscles are as long as they can be
        low, high = 0.0, highest_pressure(m, d, chamber)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            leaders_at(m, d, chamber, middle, moved, rest)
            if middle < pressure_of(m, d, chamber, volume_of(m, d, q), rest)[0]:
                low = middle
            else:
                high = middle
    pull, leader = 0.0, int(u[q + CHAMBER_FIRST_MUSCLE])
    while leader >= 0:
        k = m.nuser_actuator * leader
        own = data[int(u[k + MUSCLE_USERDATA]) + OWN_CONTRACTION]
        pull += u[k + MUSCLE_COUNT] * cable(u, k, stretch(m, d, leader, k, own, moved))[0]
        leader = int(u[k + MUSCLE_NEXT])
    return pull


@register_jitable
def bisect(m: Any, d: Any, j: int, rest: bool) -> float:
    """Solve a network by bisection, into `userdata`: its pull [N]."""
    u = m.actuator_user
    low, high = 0.0, 0.0
    for halving in range(HALVINGS + 1):
        pull = 0.5 * (low + high)
        moved, _ = shift(m, d, j, pull, rest)
        pulled, chamber = 0.0, int(u[j + NETWORK_FIRST_CHAMBER])
        while chamber >= 0:
            pulled += bisect_chamber(m, d, chamber, moved, rest)
            chamber = int(u[m.nuser_actuator * chamber + CHAMBER_NEXT])
        if pulled != pulled or u[j + NETWORK_ANCHORS] == 0.0:  # nothing moves under the pull
            return pulled
        if halving == 0:  # without displacement they pull the most
            high = pulled
        elif pulled > pull:
            low = pull
        else:
            high = pull
        if high - low < SETTLED_PULL:
            break
    return 0.5 * (low + high)


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
            data[int(u[k + MUSCLE_USERDATA]) + OWN_CONTRACTION] = act[int(u[k + MUSCLE_STATE]) + CONTRACTION]
            leader = int(u[k + MUSCLE_NEXT])
        chamber = int(u[m.nuser_actuator * chamber + CHAMBER_NEXT])
    if u[j + NETWORK_ANCHORS] > 0.0:
        a = j + NETWORK_FIRST_ANCHOR
        z = act[state + ANCHOR_DISPLACEMENT]
        pull = anchor_force(z, u[a + ANCHOR_STIFFNESS], u[a + ANCHOR_FORCE], u[a + ANCHOR_LENGTH])
    return pull if pull > 0.0 else 0.0


@register_jitable
def solve(m: Any, d: Any, i: int, j: int, rest: bool) -> tuple[float, bool]:
    """Own lengths of a network's muscles, into `userdata`: (pull on its anchors [N], whether solved)."""
    pull, settled = newton(m, d, j, guess(m, d, i, j, rest), rest)
    if not settled:
        pull = bisect(m, d, j, rest)
        if pull == pull:
            # once more for the slopes; beside a kink it may not settle, and the bracket's answer stands
            again, settled = newton(m, d, j, pull, rest)
            pull = again if settled else bisect(m, d, j, rest)
    return pull, pull == pull


@register_jitable
def write_back(m: Any, d: Any, i: int, j: int, pull: float, rest: bool) -> None:
    """The solution's volumes, pressures and tensions to `userdata`, and its states' rates to `act_dot`."""
    u, act, data, act_dot = m.actuator_user, d.act, d.userdata, d.act_dot
    per_step = 0.0 if rest else 1.0 / m.opt.timestep
    moved, moved_by_pull = shift(m, d, j, pull, rest)
    softness = moved_by_pull  # 1/S of the anchors
    total = 0.0
    for second in (False, True):
        chamber = int(u[j + NETWORK_FIRST_CHAMBER])
        while chamber >= 0:
            q = m.nuser_actuator * chamber
            if not second:
                volume = volume_of(m, d, q)
                place = int(u[q + CHAMBER_USERDATA])
                data[place + VOLUME] = volume
                data[place + PRESSURE] = pressure_of(m, d, chamber, volume, rest)[0]
            leader = int(u[q + CHAMBER_FIRST_MUSCLE])
            while leader >= 0:
                k = m.nuser_actuator * leader
                own = int(u[k + MUSCLE_USERDATA])
                if second:
                    stiff = data[own + WORK_COEFFICIENT]
                    # bounds the tension's whole slope by the paths, neighbours on the same anchors included
                    shared = 1.0 + 2.0 * softness * (total - stiff)
                    whole = stiff * shared / (1.0 + softness * total)
                    d.ctrl[leader] = derivative(m, k, whole)
                    d.actuator_velocity[leader] = 0.0
                else:
                    write_leader(m, d, leader, chamber, moved, per_step, rest)
                    slope = data[own + CABLE_SLOPE]
                    stiff = u[k + MUSCLE_COUNT] * slope * (1.0 - data[own + WORK_COEFFICIENT])
                    data[own + WORK_COEFFICIENT] = stiff
                    total += stiff
                leader = int(u[k + MUSCLE_NEXT])
            chamber = int(u[q + CHAMBER_NEXT])
    a, state, place = j + NETWORK_FIRST_ANCHOR, int(u[j + NETWORK_STATE]), int(u[j + NETWORK_USERDATA])
    for _ in range(int(u[j + NETWORK_ANCHORS])):
        k, force, length = u[a + ANCHOR_STIFFNESS], u[a + ANCHOR_FORCE], u[a + ANCHOR_LENGTH]
        z, _ = anchor_displacement(
            pull,
            k,
            force,
            length,
            0.0 if rest else u[a + ANCHOR_DAMPING],
            act[state + ANCHOR_DISPLACEMENT],
            act[state + ANCHOR_LOSS],
            m.opt.timestep,
        )
        data[place + PULL], data[place + DISPLACEMENT] = pull, z
        loss = pull - anchor_force(z, k, force, length)
        act_dot[state + ANCHOR_DISPLACEMENT] = per_step * (z - act[state + ANCHOR_DISPLACEMENT])
        act_dot[state + ANCHOR_LOSS] = per_step * (loss - act[state + ANCHOR_LOSS])
        a += ANCHOR_SLOTS
        state += ANCHOR_STATES
        place += ANCHOR_DATA


@register_jitable
def derivative(m: Any, k: int, slope: float) -> float:
    """Damping that the gain of a leader carries, α h dT/dx [N·s/m], from the tension's slope by its path.

    α = ¼ is Newmark's average acceleration. A cable that becomes taut while it is stiff beside what it moves,
    s = h² dT/dx J M⁻¹ Jᵀ above 4, would throw it back faster than it came; α = ½ − 1/s does not.
    """
    if not slope > 0.0:
        return 0.0
    step = m.opt.timestep
    stiff = step * step * slope * m.actuator_user[k + MUSCLE_INVERSE_MASS]
    return step * slope * (0.25 if stiff <= 4.0 else 0.5 - 1.0 / stiff)


@register_jitable
def write_leader(
    m: Any, d: Any, leader: int, chamber: int, moved: float, per_step: float, rest: bool
) -> None:
    """Tension and rate of a leader to `userdata`, contraction and carried force to its states' rates."""
    u, act, data, act_dot = m.actuator_user, d.act, d.userdata, d.act_dot
    k = m.nuser_actuator * leader
    own, state = int(u[k + MUSCLE_USERDATA]), int(u[k + MUSCLE_STATE])
    kappa = data[own + OWN_CONTRACTION]
    tension, _ = cable(u, k, stretch(m, d, leader, k, kappa, moved))
    data[own + TENSION] = tension
    data[own + OWN_RATE] = per_step * (kappa - act[state + CONTRACTION])
    carried = 0.0
    if within(u, k, -1.0) < kappa < SHORTEST:  # at an end of its range something else carries
        absolute = data[int(u[m.nuser_actuator * chamber + CHAMBER_USERDATA]) + PRESSURE]
        carried = law_force(u, k, kappa, absolute - AMBIENT_PRESSURE) - tension
    act_dot[state + CONTRACTION] = per_step * (kappa - act[state + CONTRACTION])
    act_dot[state + CARRIED] = per_step * (carried - act[state + CARRIED])


@register_jitable
def network_complaint(m: Any, d: Any, i: int, j: int) -> tuple[int, int]:
    """The reason for which the network actuator i cannot be stepped, and the actuator; FINE for none."""
    u, act = m.actuator_user, d.act
    chamber = int(u[j + NETWORK_FIRST_CHAMBER])
    while chamber >= 0:
        complaint = chamber_complaint(m, d, chamber)
        if complaint != FINE:
            return complaint, chamber
        chamber = int(u[m.nuser_actuator * chamber + CHAMBER_NEXT])
    state = int(u[j + NETWORK_STATE])
    for _ in range(int(u[j + NETWORK_ANCHORS])):
        last = act[state + ANCHOR_DISPLACEMENT] + act[state + ANCHOR_LOSS]
        if last != last:  # without a damper nothing else would ask for them
            return NO_NUMBER, i
        state += ANCHOR_STATES
    return FINE, i


@register_jitable
def unsolved(m: Any, d: Any, i: int, j: int) -> tuple[int, int]:
    """The reason for which nothing balances the network actuator i, and the actuator."""
    u = m.actuator_user
    chamber = int(u[j + NETWORK_FIRST_CHAMBER])
    while chamber >= 0:
        q = m.nuser_actuator * chamber
        highest_pressure(m, d, chamber)
        if volume_of(m, d, q) <= 0.0:
            return NO_VOLUME, chamber
        chamber = int(u[q + CHAMBER_NEXT])
    return NO_LENGTH, i


@register_jitable
def network_dyn(m: Any, d: Any, i: int, j: int) -> tuple[int, int]:
    """Solve the network actuator i, whose row starts at j: (complaint, actuator).

    Its input is 0, or 1 for muscles and anchors at rest at the chambers' last pressures.
    """
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

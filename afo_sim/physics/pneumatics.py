"""Air: flow through a valve, volume of a braid, pressure of a chamber, the valve's armature."""

import math

from afo_sim.common import AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO, STANDARD_DENSITY
from afo_sim.physics.jitable import register_jitable

LAMINAR_RATIO = 0.98  # above this pressure ratio the flow is linear in the pressure difference
NO_FLOW = 1e-9  # of the pressure ratio, from 1, at which a flow's relative slope ends
RESTING = 1e-9  # of a valve's armature, and of a step: so near, they are there
NEVER = 2.0  # share of a step at which what does not happen in it happens


@register_jitable
def iso_6358_flow(
    upstream: float, downstream: float, temperature: float, conductance: float, critical: float
) -> float:
    """Mass flow through an open valve from the higher to the lower pressure.

    With r = p_down/p_up: choked for r ≤ b, ṁ = C ρ0 p_up √(T0/T); elliptic up to r = 0.98,
    times √(1 − ((r − b)/(1 − b))²); then linear to zero at r = 1, so that the slope stays finite.

    Parameters
    ----------
    upstream, downstream : absolute pressures [Pa], upstream ≥ downstream
    temperature : T of the upstream air [K]
    conductance : sonic conductance C [m³/(s·Pa)]
    critical : critical pressure ratio b [-], below 0.98

    Returns
    -------
    float : mass flow [kg/s], ≥ 0

    Source
    ------
    ISO 6358-1:2013; laminar end as in the MathWorks orifice block, from r = 0.98.
    """
    ratio = downstream / upstream
    choked = conductance * STANDARD_DENSITY * upstream * math.sqrt(AMBIENT_TEMPERATURE / temperature)
    if ratio <= critical:
        return choked
    if ratio < LAMINAR_RATIO:
        x = (ratio - critical) / (1.0 - critical)
        return choked * math.sqrt(1.0 - x * x)
    x = (LAMINAR_RATIO - critical) / (1.0 - critical)
    return choked * math.sqrt(1.0 - x * x) * (1.0 - ratio) / (1.0 - LAMINAR_RATIO)


def laminar_slope(conductance: float, critical: float) -> float:
    """Slope of a valve's mass flow by the pressure difference where the pressures are equal.

    dṁ/dΔp = C ρ0 √(1 − x²)/(1 − 0.98) with x = (0.98 − b)/(1 − b), at ambient temperature. It is the
    steepest slope of the whole characteristic, so it limits the time step.

    Parameters
    ----------
    conductance : sonic conductance C [m³/(s·Pa)]
    critical : critical pressure ratio b [-], below 0.98

    Returns
    -------
    float : [kg/(s·Pa)]

    Source
    ------
    The laminar end of `iso_6358_flow`.
    """
    x = (LAMINAR_RATIO - critical) / (1.0 - critical)
    return conductance * STANDARD_DENSITY * math.sqrt(1.0 - x * x) / (1.0 - LAMINAR_RATIO)


@register_jitable
def valve_flow(
    pressure_1: float, temperature_1: float, pressure_2: float, temperature_2: float, opening: float,
    conductance: float, critical: float,
) -> float:  # fmt: skip
    """Mass flow from side 1 to side 2 of a valve; negative when it runs back.

    Parameters
    ----------
    pressure_1, pressure_2 : absolute [Pa]
    temperature_1, temperature_2 : [K]
    opening : 0…1 [-], scales the sonic conductance
    conductance, critical : C [m³/(s·Pa)], b [-]

    Returns
    -------
    float : mass flow [kg/s]
    """
    if opening == 0.0:
        return 0.0 * (pressure_1 - pressure_2) + 0.0  # a NaN stays one
    c = opening * conductance
    if pressure_1 >= pressure_2:
        return iso_6358_flow(pressure_1, pressure_2, temperature_1, c, critical)
    return -iso_6358_flow(pressure_2, pressure_1, temperature_2, c, critical)


@register_jitable
def braid_volume(
    contraction: float, nominal_length: float, nominal_radius: float, b: float
) -> tuple[float, float]:
    """Volume enclosed by an ideal braid, and its derivative by the contraction ratio.

    V = π r0² L0 (1 − κ) [1 − cos²α0 (1 − κ)²]/sin²α0, so that −p dV/dL is the geometric force.
    It is zero at κ = 1 − 1/cos α0, where the braid locks, and negative beyond.

    Parameters
    ----------
    contraction : κ [-]
    nominal_length, nominal_radius : L0, r0 [m]
    b : 1/sin²α0 [-]

    Returns
    -------
    (V [m³], dV/dκ [m³])

    Source
    ------
    Chou & Hannaford 1996, doi 10.1109/70.481753: a cylinder of length B cos α and diameter B sin α/(n π).
    """
    x = 1.0 - contraction
    if x < 0.0:  # there is no shorter muscle than none
        x = 0.0
    full = math.pi * nominal_radius * nominal_radius * nominal_length
    return full * x * (b - (b - 1.0) * x * x), full * (3.0 * (b - 1.0) * x * x - b)


@register_jitable
def chamber_pressure(sigma: float, volume: float, gamma: float = HEAT_CAPACITY_RATIO) -> float:
    """Absolute pressure of a chamber from its state σ = p V^γ: p = σ/V^γ.

    A sealed adiabatic chamber keeps σ: its pressure is a function of its volume alone.

    Parameters
    ----------
    sigma : σ [Pa·m^(3γ)]
    volume : V [m³]
    gamma : ratio of the gas' heat capacities [-]; air's by default

    Returns
    -------
    float : absolute pressure [Pa]; of no volume not a number
    """
    if volume <= 0.0:
        return math.nan
    return sigma * volume**-gamma  # a NaN comes out here


@register_jitable
def sigma_rate(
    temperature: float, volume: float, flow_in: float, flow_out: float, conductance: float
) -> float:
    """Rate of a chamber's state σ = p V^γ from its energy balance.

    σ̇ = V^(γ−1) [γ R (ṁ_in T_ambient − ṁ_out T) + (γ − 1) hA (T_ambient − T)]

    Parameters
    ----------
    temperature : T = p V/(m R) [K]
    volume : V [m³]
    flow_in : air coming in at ambient temperature, ≥ 0 [kg/s]
    flow_out : air leaving at T, ≥ 0 [kg/s]
    conductance : wall heat conductance hA [W/K]; 0 adiabatic, large isothermal

    Returns
    -------
    float : σ̇ [Pa·m^(3γ)/s]

    Source
    ------
    First law for an ideal gas, e.g. Carneiro & de Almeida 2006, doi 10.1243/09596518JSCE166, with
    V ṗ + γ p V̇ = V^(1−γ) d(p V^γ)/dt.
    """
    gamma = HEAT_CAPACITY_RATIO
    enthalpy = gamma * GAS_CONSTANT * (flow_in * AMBIENT_TEMPERATURE - flow_out * temperature)
    heat = (gamma - 1.0) * conductance * (AMBIENT_TEMPERATURE - temperature)
    return volume ** (gamma - 1.0) * (enthalpy + heat)


@register_jitable
def seat_switches(
    coil: float, was_on: float, armature: float, opening: float, opening_delay: float, closing_delay: float,
    threshold: float, timestep: float,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """A solenoid valve over one step: the instants at which its seat switches, and its states at the end.

    The armature travels to the open seat at 1/opening delay while the coil is on, and back at 1/closing
    delay while it is off; the seat follows when it arrives. So the opening answers after a dead time, and a
    pulse that is shorter does nothing. With a threshold the seat opens and shuts as the armature passes it,
    on its way to the end of its stroke: a pulse that ends before that holds the seat open the longer, the
    longer it was. A coil that was on is switched off within the step where it is on for
    a share of it; one that was off is switched on. So a pulse, or a gap, within one step lies at its end.

    Parameters
    ----------
    coil : share of the step for which the coil is on, clamped to 0…1 [-]
    was_on : whether it was on at the end of the step before, 1 or 0
    armature, opening : states, 0…1; the seat is open or shut [-]
    opening_delay, closing_delay : dead times, of a coil that stays [s]
    threshold : share of the stroke at which the seat opens and shuts, below 1; 0 for its two ends [-]
    timestep : [s]

    Returns
    -------
    (opening from the start on [-], shares of the step at which it switches once and again, `NEVER` for not,
    armature, opening and coil at the end)
    """
    seat = (1.0 if opening > 0.5 else 0.0 * opening) + 0.0 * was_on  # a NaN stays one
    if coil >= 1.0 and armature > 1.0 - RESTING and seat == 1.0:
        return 1.0, NEVER, NEVER, 1.0, 1.0, 1.0
    if coil <= 0.0 and armature < RESTING and seat == 0.0:
        return 0.0, NEVER, NEVER, 0.0, 0.0, 0.0
    if coil < RESTING:
        coil = 0.0
    elif coil > 1.0 - RESTING:
        coil = 1.0
    on = 1.0 if was_on > 0.5 else 0.0
    turn = coil if on == 1.0 else 1.0 - coil  # share at which the coil switches
    end, first, second = seat, NEVER, NEVER
    up, down = opening_delay / timestep, closing_delay / timestep  # of a whole stroke
    if threshold > 0.0:
        up, down = up / threshold, down / (1.0 - threshold)
    if not turn <= 0.0:
        armature, first = _travel(armature, on, turn, up, down, threshold)
        if first < NEVER:
            end, first = on, (first if end != on else NEVER)
    if not turn >= 1.0:
        on = 1.0 - on
        armature, second = _travel(armature, on, 1.0 - turn, up, down, threshold)
        if second < NEVER:
            end, second = on, (turn + second if end != on else NEVER)
    if first == NEVER:
        first, second = second, NEVER
    if first <= RESTING:
        seat, first, second = 1.0 - seat, second, NEVER
    return seat, first, second, armature, end + 0.0 * armature, on


@register_jitable
def _travel(
    armature: float, on: float, share: float, up: float, down: float, threshold: float
) -> tuple[float, float]:
    """Armature after a share of a step under a coil that stays, and the share after which the seat switches.

    Units: up, down: times of a whole stroke [steps].
    """
    left, stroke, passed = (1.0 - armature, up, 1.0 - threshold) if on == 1.0 else (armature, down, threshold)
    if threshold <= 0.0:
        passed = 0.0
    wait = max((left - passed) * stroke, 0.0)
    reached = on
    if not left * stroke <= share + RESTING:
        reached = armature + share / stroke if on == 1.0 else armature - share / stroke
    return reached, (wait if wait <= share + RESTING else NEVER)


@register_jitable
def ramped(
    opening: float, seat: float, first: float, second: float, opening_ramp: float, closing_ramp: float
) -> tuple[float, float]:
    """Mean opening over one step, and at its end, of a valve that follows its seat at a steady pace [-].

    Parameters
    ----------
    opening : at the step's start [-]
    seat, first, second : as `seat_switches` returns them
    opening_ramp, closing_ramp : time from shut to open, and back [steps]
    """
    mean, begins = 0.0, 0.0
    for switches in (first, second, NEVER):
        share = min(switches, 1.0) - begins
        if share > 0.0:
            ramp = opening_ramp if seat > 0.5 else closing_ramp
            travels, reached = abs(seat - opening) * ramp, seat
            if not travels <= share:
                travels, reached = share, opening + (2.0 * seat - 1.0) * share / ramp
            mean += 0.5 * (opening + reached) * travels + seat * (share - travels)
            opening, begins = reached, begins + share
        seat = 1.0 - seat
    return mean, opening


@register_jitable
def beyond_dead_band(asked: float, dead_band: float) -> float:
    """Opening that a proportional valve gives of the one that is asked for [-]: none within its dead band.

    Parameters
    ----------
    asked : 0…1 [-]
    dead_band : share of the input that does not open it, below 1 [-]
    """
    if dead_band <= 0.0:
        return asked
    if asked <= dead_band:
        return 0.0 * asked  # a NaN stays one
    return (asked - dead_band) / (1.0 - dead_band)

"""A tube as a restriction of ISO 6358, its air's volume and inertia, the time that sound takes through it."""

import math

from afo_sim.common import AMBIENT_TEMPERATURE, GAS_CONSTANT, HEAT_CAPACITY_RATIO, STANDARD_DENSITY
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.pneumatics import LAMINAR_RATIO

CONDUCTANCE = 0.029  # of the formula below [m³/(s·Pa·m²)]
ENDS = 510.0  # what the two ends weigh in it, as a length [m^(−1/4)]
CONDUCTIVITY = 0.0257  # of air's heat at 20 °C [W/(m·K)]
RATIO = 474.0  # critical ratio by conductance and bore [s·Pa/m]
CHOKED = 1e-6  # of 1 − (ṁ/ṁ*)², below which friction grows no steeper [-]


def tube_conductance(bore: float, length: float) -> float:
    """Sonic conductance of a straight smooth tube.

    C = 0.029 d²/√(L/d^1.25 + 510)

    A tube without length is an opening with C = 0.00128 d², which is 0.128 dm³/(s·bar) of 1 mm.

    Parameters
    ----------
    bore : inner diameter d [m], above 0; the formula is used for 2 to 12 mm
    length : L [m], at least 0

    Returns
    -------
    float : C [m³/(s·Pa)]

    Notes
    -----
    This is turbulent friction with a factor that depends on the bore alone, f = 0.0062 d^(−1/4), and losses
    of 3.2 at the ends, by the dynamic pressure at the entry's state: isothermal choked flow through a long
    tube into vacuum is ṁ = A p/√(R T f L/d), A = π d²/4. A slow flow is laminar (64/Re) and meets more
    resistance than this.

    Source
    ------
    Eckersten, as P. Beater gives it (Pneumatic Drives, Springer 2007); from memory. Checked: 4 mm × 10 m has
    C = 0.45 dm³/(s·bar) in Abed 2025, doi 10.1109/IC2AI62984.2025.10932214, and 0.454 here; adiabatic flow
    with the friction of a smooth tube agrees within 8 % for 2 to 6 mm and 0.3 to 10 m.
    """
    return CONDUCTANCE * bore * bore / math.sqrt(length / bore**1.25 + ENDS)


def tube_critical_ratio(bore: float, length: float) -> float:
    """Critical pressure ratio of a tube, b = 474 C/d².

    Parameters
    ----------
    bore, length : d, L [m], as in `tube_conductance`

    Returns
    -------
    float : b [-], 0.61 without length, falling to 0 with it

    Source
    ------
    As `tube_conductance`. The line of 4 mm × 10 m has b = 0.21 there and 0.135 here.
    """
    return RATIO * tube_conductance(bore, length) / (bore * bore)


def tube_volume(bore: float, length: float) -> float:
    """Air volume of a tube, π d² L/4 [m³].

    Parameters
    ----------
    bore, length : d, L [m]
    """
    return 0.25 * math.pi * bore * bore * length


def tube_heat(bore: float, length: float) -> tuple[float, float]:
    """Heat conductance from a tube's air to its wall, at rest and what it grows by with the flow.

    hA = 3.66 π k L + c_p |ṁ| λ L/(2 d), λ = 0.0062 d^(−1/4)

    Parameters
    ----------
    bore, length : d, L [m], as in `tube_conductance`

    Returns
    -------
    at rest [W/K], by flow [J/(kg·K)]

    Source
    ------
    Nusselt number 3.66 of laminar flow in a tube whose wall keeps its temperature; Reynolds' analogy between
    heat and friction, St = λ/8, with the friction of `tube_conductance` (textbook results, from memory).
    """
    heat_capacity = HEAT_CAPACITY_RATIO / (HEAT_CAPACITY_RATIO - 1.0) * GAS_CONSTANT
    by_flow = heat_capacity * 0.0062 * bore**-0.25 * length / (2.0 * bore)
    return 3.66 * math.pi * CONDUCTIVITY * length, by_flow


def sound_delay(
    length: float,
    temperature: float = AMBIENT_TEMPERATURE,
    gas_constant: float = GAS_CONSTANT,
    heat_capacity_ratio: float = HEAT_CAPACITY_RATIO,
) -> float:
    """Time that a change of pressure takes through a tube, L/√(γ R T): 2.91 ms per metre of air at 20 °C.

    Parameters
    ----------
    length : L [m]
    temperature : T [K]
    gas_constant, heat_capacity_ratio : R [J/(kg·K)], γ [-]; of air by default

    Returns
    -------
    float : [s]
    """
    return length / math.sqrt(heat_capacity_ratio * gas_constant * temperature)


@register_jitable
def line_flow(
    flow: float, p1: float, t1: float, p2: float, t2: float, conductance: float, critical: float, push: float
) -> float:
    """Mass flow of a line with inertia a short time later, under pressures that stay [kg/s].

    (L/A) dṁ/dt = p1 − p2 − Δp_f(ṁ), |ṁ| ≤ ṁ* = C ρ0 p_up √(T0/T_up), by Rosenbrock's step of one stage, γ ½.
    Newton's law for the tube's air as one body. Δp_f is the inverse of `iso_6358_flow`, p_up (1 − b)
    (1 − √(1 − (ṁ/ṁ*)²)) and its linear end, so that the steady flow is a tube's without inertia.

    Parameters
    ----------
    flow : ṁ from side 1 to side 2 [kg/s]
    p1, t1, p2, t2 : absolute pressure [Pa] and temperature [K] at both sides
    conductance, critical : C [m³/(s·Pa)], b [-]
    push : time × A/L [s·m]
    """
    forth = flow > 0.0 or (flow == 0.0 and p1 >= p2)
    up, warm = (p1, t1) if forth else (p2, t2)
    most = conductance * STANDARD_DENSITY * up * math.sqrt(AMBIENT_TEMPERATURE / warm)
    y, x = min(abs(flow) / most, 1.0), (LAMINAR_RATIO - critical) / (1.0 - critical)
    slope = (1.0 - LAMINAR_RATIO) / math.sqrt(1.0 - x * x)
    lost = slope * y
    if lost > 1.0 - LAMINAR_RATIO:
        root = math.sqrt(max(1.0 - y * y, CHOKED))
        lost, slope = (1.0 - critical) * (1.0 - root), (1.0 - critical) * y / root
    left = p1 - p2 - (up * lost if forth else -up * lost)
    flow += push * left / (1.0 + 0.5 * push * up * slope / most)
    return min(max(flow, -most), most)

"""Force laws from the geometry of the braid: geometric, with tapered ends, with bladder, with rubber.

Signed forces: negative beyond the first zero, where a real muscle goes slack (`hill.tension` clamps
it), and never positive again beyond it. Symbols: κ contraction ratio [-], p gauge pressure [Pa], L0, r0
nominal length and radius [m], α0 braid angle at rest [rad], a = 3/tan²α0, b = 1/sin²α0.
"""

import math

from numba.extending import register_jitable

SMALLEST_SINE = 0.05  # of the braid angle in the wall terms: 2.9°, flatter than any braid


@register_jitable
def chou_hannaford_1996(
    contraction: float,
    pressure: float,
    nominal_length: float,
    thread_length: float,
    turns: float,
    wall_thickness: float,
) -> float:
    """Geometric model of a braid: F = p (3 L² − B²)/(4 π n²) + π p [D90 t (2 s − 1/s) − t²].

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_length : L0 [m]; L = L0 (1 − κ)
    thread_length : B [m]; D90 = B/(n π), the diameter at a braid angle of 90°
    turns : n [-]
    wall_thickness : t [m]; with 0 the wall is thin. s is the sine of the present braid angle

    Returns
    -------
    float : signed force [N]; of the thin wall, zero at a braid angle of 54.74°.

    Source
    ------
    Chou & Hannaford 1996, IEEE Trans. Robot. Autom. 12(1), doi 10.1109/70.481753; S1, eq. 1. The
    wall term is quoted from memory of the same paper, unverified.
    """
    length = nominal_length * (1.0 - contraction)
    if length < 0.0:
        length = 0.0
    force = (
        pressure * (3.0 * length * length - thread_length * thread_length) / (4.0 * math.pi * turns * turns)
    )
    cosine = length / thread_length
    sine = SMALLEST_SINE
    if 1.0 - cosine * cosine > SMALLEST_SINE * SMALLEST_SINE:
        sine = math.sqrt(1.0 - cosine * cosine)
    across = thread_length / (turns * math.pi) * wall_thickness * (2.0 * sine - 1.0 / sine)
    return force + math.pi * pressure * (across - wall_thickness * wall_thickness)


@register_jitable
def tondu_lopez_2000(contraction: float, pressure: float, nominal_radius: float, b: float, k: float) -> float:
    """Braid with tapered ends: F = π r0² p [a (1 − k κ)² − b], with a = 3 (b − 1).

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_radius : r0 [m]
    b : 1/sin²α0 [-]
    k : end correction [-]; 1 is a cylinder, more lowers the maximum contraction

    Returns
    -------
    float : signed force [N]

    Source
    ------
    Tondu & Lopez 2000, IEEE Control Syst. 20(2), doi 10.1109/37.833638; S1, "Hill spring force".
    """
    x = 1.0 - k * contraction
    if x < 0.0:  # the parabola would rise again
        x = 0.0
    return math.pi * nominal_radius * nominal_radius * pressure * (3.0 * (b - 1.0) * x * x - b)


@register_jitable
def tondu_lopez_2000_bladder(
    contraction: float,
    pressure: float,
    nominal_radius: float,
    b: float,
    k: float,
    bladder_force: float,
    bladder_stiffness: float,
) -> float:
    """Tondu–Lopez less what the rubber bladder takes: F = F_TL − F0 − K_b κ.

    Parameters
    ----------
    contraction, pressure, nominal_radius, b, k : as in `tondu_lopez_2000`
    bladder_force : F0 [N], what it takes to bring the bladder to the braid
    bladder_stiffness : K_b [N] per unit of contraction

    Returns
    -------
    float : signed force [N]

    Source
    ------
    The bladder terms are this project's, derived from S1's tables I and II; not published.
    """
    braid = tondu_lopez_2000(contraction, pressure, nominal_radius, b, k)
    return braid - bladder_force - bladder_stiffness * contraction


@register_jitable
def martens_boblan_2017(
    contraction: float,
    pressure: float,
    nominal_length: float,
    nominal_radius: float,
    fibre_length: float,
    turns: float,
    wall_thickness: float,
    c0: float,
    c1: float,
    c2: float,
    c3: float,
) -> float:
    """Braid and rubber wall: F = p (3 L² − B²)/(4 π n²) + σ_D H0 π L dD/dL − σ_L H0 π D.

    σ_L = E (L − L0)/L0 and σ_D = E (D − D0)/D0 with the modulus E = c0 + c1 L + c2 L² + c3 L³.
    The rubber's terms are held beyond 0.7 L0 ≤ L ≤ 1.05 L0, where the cubic was never fitted.

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_length, nominal_radius : L0, r0 [m]
    fibre_length : B [m]
    turns : n [-]
    wall_thickness : H0 [m]
    c0, c1, c2, c3 : of the modulus, for L in metres [Pa, Pa/m, Pa/m², Pa/m³]

    Returns
    -------
    float : signed force [N]

    Source
    ------
    Martens & Boblan 2017, Actuators 6(4) 40, doi 10.3390/act6040040, read in public code (ModelComparison2
    of the Bipedal_Robot project), signs as there. By virtual work the last term would have a plus.
    """
    length = nominal_length * (1.0 - contraction)
    if length < 0.0:
        length = 0.0
    force = pressure * (3.0 * length * length - fibre_length * fibre_length) / (4.0 * math.pi * turns * turns)
    longest = fibre_length * math.sqrt(1.0 - SMALLEST_SINE * SMALLEST_SINE)
    if length > longest:
        length = longest
    if length < 0.7 * nominal_length:
        length = 0.7 * nominal_length
    elif length > 1.05 * nominal_length:
        length = 1.05 * nominal_length
    diameter = math.sqrt(fibre_length * fibre_length - length * length) / (turns * math.pi)
    modulus = c0 + length * (c1 + length * (c2 + length * c3))
    along = modulus * (length - nominal_length) / nominal_length
    around = modulus * (diameter - 2.0 * nominal_radius) / (2.0 * nominal_radius)
    slope = -length / (diameter * turns * turns * math.pi * math.pi)
    return force + wall_thickness * math.pi * (around * length * slope - along * diameter)

"""The braid's law with the forces of its rubber wall, Martens & Boblan 2017."""

import math

from afo_sim.physics.guards import SMALLEST_SINE
from afo_sim.physics.law import (
    CHARACTERISTIC,
    Braid,
    Coefficients,
    Law,
    LawParameter,
    Values,
    without_default,
)
from afo_sim.physics.law_slope import Slopes, with_slopes


@with_slopes
def martens_boblan_2017(
    contraction: float, pressure: float, nominal_length: float, nominal_radius: float, fibre_length: float,
    turns: float, wall_thickness: float, c0: float, c1: float, c2: float, c3: float,
) -> Slopes:  # fmt: skip
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
    (signed force [N], its slopes by κ [N] and p [N/Pa])

    Source
    ------
    Martens & Boblan 2017, Actuators 6(4) 40, doi 10.3390/act6040040, read in public code (ModelComparison2
    of the Bipedal_Robot project), signs as there. By virtual work the last term would have a plus.
    """
    length = nominal_length * (1.0 - contraction)
    if length < 0.0:
        length = 0.0
    square, around_braid = 3.0 * length * length - fibre_length * fibre_length, 4.0 * math.pi * turns * turns
    force, by_length = pressure * square / around_braid, pressure * 6.0 * length / around_braid
    longest, unheld = fibre_length * math.sqrt(1.0 - SMALLEST_SINE * SMALLEST_SINE), length
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
    force += wall_thickness * math.pi * (around * length * slope - along * diameter)
    if length == unheld:
        softer = c1 + length * (2.0 * c2 + length * 3.0 * c3)
        along_by = softer * (length - nominal_length) / nominal_length + modulus / nominal_length
        around_by = (softer * (diameter - 2.0 * nominal_radius) + modulus * slope) / (2.0 * nominal_radius)
        bend = slope / length - slope * slope / diameter  # d²D/dL²
        rubber_by = (around_by * length + around) * slope + around * length * bend
        by_length += wall_thickness * math.pi * (rubber_by - along_by * diameter - along * slope)
    return force, -nominal_length * by_length, square / around_braid


C = ((1e6, 1e7), (-1e7, 0.0), (0.0, 1e7), (-1e7, 0.0))  # where fits start
PARAMETERS = (
    LawParameter("angle_shift", "δ", "rad", -0.5, 0.5, "added to the braid angle", (-0.12, -0.02)),
    LawParameter("wall_thickness", "H0", "m", 0.0, 5e-3, "of the rubber", (1.8e-3, 1.8e-3), 1.8e-3),
    *(
        LawParameter(f"c{i}", f"c{i}", "", -1e12, 1e12, f"Pa/m^{i}, of the modulus, by L^{i}", start)
        for i, start in enumerate(C)
    ),
)


def _coefficients(braid: Braid, q: Values) -> Coefficients:
    shifted = Braid(braid.nominal_length, braid.nominal_radius, braid.braid_angle + q["angle_shift"])
    rubber = (q[name] for name in ("wall_thickness", "c0", "c1", "c2", "c3"))
    return braid.nominal_length, braid.nominal_radius, shifted.thread_length, shifted.turns, *rubber


MARTENS_BOBLAN_2017 = Law(
    name="martens_boblan_2017",
    native_id=8,
    kernel=martens_boblan_2017,
    parameters=PARAMETERS,
    coefficients=_coefficients,
    fitted=without_default(PARAMETERS),
    formula="p (3 L² − B²)/(4 π n²) + σ_D H0 π L dD/dL − σ_L H0 π D",
    pressure_range=CHARACTERISTIC,
    contraction_range=(0.0, 0.25),
    validity="one length of fluidic muscle: its modulus is a cubic in length",
    source="Martens & Boblan 2017",
    # a muscle of another size and the same moduli: all its lengths grow with the root of the force
    force_powers=(0.5, 0.5, 0.5, 0.0, 0.5, 0.0, -0.5, -1.0, -1.5),
    length="one",
    rubber=True,
)

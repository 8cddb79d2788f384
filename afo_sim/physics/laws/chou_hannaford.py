"""The geometric law of a braid, Chou & Hannaford 1996."""

import math

from afo_sim.physics.guards import SMALLEST_SINE
from afo_sim.physics.law import Law, LawParameter
from afo_sim.physics.law_slope import Slopes, with_slopes


@with_slopes
def chou_hannaford_1996(
    contraction: float, pressure: float, nominal_length: float, thread_length: float, turns: float,
    wall_thickness: float,
) -> Slopes:  # fmt: skip
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
    (signed force [N], its slopes by κ [N] and p [N/Pa]); of the thin wall, zero at a braid angle of 54.74°.

    Source
    ------
    Chou & Hannaford 1996, IEEE Trans. Robot. Autom. 12(1), doi 10.1109/70.481753; S1, eq. 1. The
    wall term is quoted from memory of the same paper, unverified.
    """
    length = nominal_length * (1.0 - contraction)
    if length < 0.0:
        length = 0.0
    square, around = 3.0 * length * length - thread_length * thread_length, 4.0 * math.pi * turns * turns
    cosine = length / thread_length
    sine, sine_by_length = SMALLEST_SINE, 0.0
    if 1.0 - cosine * cosine > SMALLEST_SINE * SMALLEST_SINE:
        sine = math.sqrt(1.0 - cosine * cosine)
        sine_by_length = -cosine / (sine * thread_length)
    wall = thread_length / (turns * math.pi) * wall_thickness
    across = wall * (2.0 * sine - 1.0 / sine)
    force = pressure * square / around + math.pi * pressure * (across - wall_thickness * wall_thickness)
    by_length = 6.0 * length / around + math.pi * wall * (2.0 + 1.0 / (sine * sine)) * sine_by_length
    by_pressure = square / around + math.pi * (across - wall_thickness * wall_thickness)
    return force, -nominal_length * pressure * by_length, by_pressure


WALL = LawParameter("wall_thickness", "t", "m", 0.0, 5e-3, "thickness of braid and bladder", (0.0, 1e-3), 0.0)

CHOU_HANNAFORD_1996 = Law(
    name="chou_hannaford_1996",
    native_id=0,
    kernel=chou_hannaford_1996,
    parameters=(WALL,),
    coefficients=lambda braid, q: (
        braid.nominal_length,
        braid.thread_length,
        braid.turns,
        q["wall_thickness"],
    ),
    fitted=("braid_angle",),
    formula="p (3 L² − B²)/(4 π n²) + π p [D90 t (2 sin α − 1/sin α) − t²]",
    pressure_range=(1e5, 8e5),
    contraction_range=(0.0, 0.4),
    validity="no bladder; poor below about 1 bar",
    source="Chou & Hannaford 1996; S1 eq. 1",
    braids=True,
    force_powers=(0.5, 0.5, 0.0, 0.5),
)

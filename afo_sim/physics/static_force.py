"""Static force laws of pneumatic artificial muscles, and their registry LAWS.

A law gives the force that the braid would exert at a contraction ratio and gauge pressure. It is
*signed*: negative beyond its first zero, where a real muscle goes slack (`hill.tension` clamps it),
and it never rises again beyond that zero. Symbols: κ contraction ratio [-], p gauge pressure [Pa],
L0, r0 nominal length and radius [m], α0 braid angle at rest [rad], a = 3/tan²α0, b = 1/sin²α0.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from numba.extending import register_jitable


@register_jitable
def chou_hannaford_1996(
    contraction: float,
    pressure: float,
    nominal_length: float,
    thread_length: float,
    turns: float,
) -> float:
    """Geometric model of a thin-walled braid: F = p (3 L² − B²) / (4 π n²).

    Parameters
    ----------
    contraction : κ [-]
    pressure : p, gauge [Pa]
    nominal_length : L0 [m]; L = L0 (1 − κ)
    thread_length : B [m]
    turns : n [-]

    Returns
    -------
    float : signed force [N]; zero at a braid angle of 54.74°.

    Source
    ------
    Chou & Hannaford 1996, IEEE Trans. Robot. Autom. 12(1), doi 10.1109/70.481753; S1, eq. 1.
    """
    length = nominal_length * (1.0 - contraction)
    if length < 0.0:
        length = 0.0
    return (
        pressure * (3.0 * length * length - thread_length * thread_length) / (4.0 * math.pi * turns * turns)
    )


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


@dataclass(frozen=True)
class Braid:
    """Geometry that every law shares: L0 [m], r0 [m], α0 [rad]."""

    nominal_length: float
    nominal_radius: float
    braid_angle: float

    @property
    def b(self) -> float:
        """1/sin²α0 [-]."""
        return 1.0 / math.sin(self.braid_angle) ** 2

    @property
    def thread_length(self) -> float:
        """L0/cos α0 [m]."""
        return self.nominal_length / math.cos(self.braid_angle)

    @property
    def turns(self) -> float:
        """L0 tan α0/(2 π r0) [-]."""
        return self.nominal_length * math.tan(self.braid_angle) / (2.0 * math.pi * self.nominal_radius)


@dataclass(frozen=True)
class LawParameter:
    """One parameter of a law beyond the braid's geometry: its symbol, SI unit and bounds."""

    name: str
    symbol: str
    unit: str
    lower: float
    upper: float
    meaning: str


@dataclass(frozen=True)
class Law:
    """A force law: `kernel(contraction, pressure, *coefficients(braid, parameters))` in newtons."""

    kernel: Callable[..., float]
    native_id: int
    parameters: tuple[LawParameter, ...]
    coefficients: Callable[[Braid, Mapping[str, float]], tuple[float, ...]]
    formula: str
    validity: str
    source: str

    @property
    def name(self) -> str:
        return self.kernel.__name__


_K = LawParameter("k", "k", "", 0.5, 3.0, "end correction; 1 is a cylinder")
_F0 = LawParameter("bladder_force", "F0", "N", 0.0, 5000.0, "force taken by the bladder at κ = 0")
_KB = LawParameter("bladder_stiffness", "K_b", "N", 0.0, 5e4, "bladder force per contraction")

LAWS = {
    law.name: law
    for law in (
        Law(
            chou_hannaford_1996,
            0,
            (),
            lambda braid, _: (braid.nominal_length, braid.thread_length, braid.turns),
            "F = p (3 L² − B²)/(4 π n²)",
            "thin wall, no bladder; poor below about 1 bar",
            "Chou & Hannaford 1996; S1 eq. 1",
        ),
        Law(
            tondu_lopez_2000,
            1,
            (_K,),
            lambda braid, q: (braid.nominal_radius, braid.b, q["k"]),
            "F = π r0² p [a (1 − k κ)² − b]",
            "force proportional to pressure; no bladder",
            "Tondu & Lopez 2000; S1",
        ),
        Law(
            tondu_lopez_2000_bladder,
            2,
            (_K, _F0, _KB),
            lambda braid, q: (
                braid.nominal_radius,
                braid.b,
                q["k"],
                q["bladder_force"],
                q["bladder_stiffness"],
            ),
            "F = π r0² p [a (1 − k κ)² − b] − F0 − K_b κ",
            "hand-made muscle with a rubber bladder; fitted over 2–4 bar",
            "Tondu & Lopez 2000, bladder terms derived here",
        ),
    )
}

"""Sonic conductance C of ISO 6358 from the figures that data sheets print instead of it, and back."""

from afo_sim.common import AMBIENT_TEMPERATURE
from afo_sim.physics.pneumatics import iso_6358_flow

# Absolute pressure that makers count as 0 bar gauge [Pa]: SMC writes Q = 600 C (p1 + 0.1) with p1 in MPa.
MAKERS_AMBIENT = 1e5
CV_FACTOR = 3.6e-8  # C/Cv [m³/(s·Pa)], mean of makers who print both
CV_SPREAD = 0.2  # their pairs lie within this share of it
KV_PER_CV = 0.865  # Kv in m³/h of water at 1 bar, Cv in US gallons a minute at 1 psi
AREA_FACTOR = 2e-3  # C/S [m/(s·Pa)]: S in mm² is 5.0 C in dm³/(s·bar)
ORIFICE_FACTOR = 1.28e-3  # C/d² [m/(s·Pa)]: 0.128 dm³/(s·bar) of 1 mm


def nominal_flow(
    conductance: float, critical: float, upstream: float, downstream: float, density: float
) -> float:
    """Volume flow through a valve between two pressures, in litres of a norm.

    Q = C (ρ0/ρ_norm) p1 ψ(p2/p1) at 20 °C, with ψ = 1 for p2/p1 ≤ b, else √(1 − ((p2/p1 − b)/(1 − b))²).

    Parameters
    ----------
    conductance, critical : C [m³/(s·Pa)], b [-]
    upstream, downstream : gauge pressures [Pa]; makers' zero is 1 bar absolute
    density : of air in the norm's state [kg/m³]: 1.185 ANR, 1.293 DIN 1343

    Returns
    -------
    float : Q [m³/s] in the norm's state

    Source
    ------
    ISO 6358-1:2013. SMC's 600 C (p1 + 0.1) ψ is the same with MPa gauge and litres ANR a minute.
    """
    high, low = upstream + MAKERS_AMBIENT, downstream + MAKERS_AMBIENT
    return iso_6358_flow(high, low, AMBIENT_TEMPERATURE, conductance, critical) / density


def conductance_of_nominal_flow(
    flow: float, critical: float, upstream: float, downstream: float, density: float
) -> float:
    """Sonic conductance of a valve whose flow between two pressures is known: C = Q/Q(C = 1).

    b between 0.2 and 0.5 moves C by +6 to −14 % where the flow is measured from 6 to 5 bar gauge.

    Parameters
    ----------
    flow : Q [m³/s] in the norm's state
    critical, upstream, downstream, density : as in `nominal_flow`, upstream above downstream

    Returns
    -------
    float : C [m³/(s·Pa)]

    Source
    ------
    The inverse of `nominal_flow`. SMC's SY series prints C, b and Q: they agree to 0.1 %.
    """
    return flow / nominal_flow(1.0, critical, upstream, downstream, density)


def conductance_of_cv(cv: float) -> float:
    """Sonic conductance from a flow coefficient Cv: C ≈ 3.6 Cv dm³/(s·bar), good to about ±20 %.

    Cv is measured with water. The relation to C depends on the valve.

    Parameters
    ----------
    cv : Cv [-], US gallons of water a minute at 1 psi

    Returns
    -------
    float : C [m³/(s·Pa)]

    Source
    ------
    Pairs that makers print (SMC EUS11-83B-UK, CAT.ES11-107A): 3.79, 3.11, 3.21 and 4.0 for SY3000 to
    SY9000, 3.74 for VT307. Nearby rules from memory, not verified: 3.4 of equal areas, 4.0 of MathWorks.
    A public calculator's Cv ≈ 1.62 C is six times wrong: these pairs refute it.
    """
    return CV_FACTOR * cv


def conductance_of_kv(kv: float) -> float:
    """Sonic conductance from a flow coefficient Kv: Kv = 0.865 Cv, then as `conductance_of_cv`.

    Parameters
    ----------
    kv : Kv [-], m³ of water an hour at 1 bar

    Returns
    -------
    float : C [m³/(s·Pa)]

    Source
    ------
    Kv = 0.865 Cv: MathWorks, Simscape gas pages; C of Cv as there.
    """
    return conductance_of_cv(kv / KV_PER_CV)


def conductance_of_sonic_area(area: float) -> float:
    """Sonic conductance from the effective (sonic) area of JIS: C = S/5.0, mm² to dm³/(s·bar).

    Parameters
    ----------
    area : S [m²]

    Returns
    -------
    float : C [m³/(s·Pa)]

    Source
    ------
    CKD SM-P00077-A/3. An ideal nozzle for air gives 5.03.
    """
    return AREA_FACTOR * area


def conductance_of_orifice(diameter: float) -> float:
    """Sonic conductance of a sharp hole: C = 0.128 d², mm to dm³/(s·bar).

    It is a discharge coefficient of 0.82.

    Parameters
    ----------
    diameter : d [m]

    Returns
    -------
    float : C [m³/(s·Pa)]

    Source
    ------
    Gidlund, in Beater, Pneumatic Drives, 2007: the constant is from memory, not verified.
    """
    return ORIFICE_FACTOR * diameter * diameter

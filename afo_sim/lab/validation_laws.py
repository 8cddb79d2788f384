"""What S0, S3, the authors of the force laws and S2 (Piteľ & Tóthová) printed, and what their texts lost.

At the end flows that makers print beside C and b of their valves, and a printed line, against the flow laws.
"""

from typing import Any

import numpy as np
from scipy.optimize import least_squares

from afo_sim.common import NORMAL_DENSITY, STANDARD_DENSITY, assets
from afo_sim.description import Muscle, reader
from afo_sim.lab.law_fit import fit_law, held_out
from afo_sim.lab.law_problem import pose, select
from afo_sim.lab.measured import Measured, read_measured
from afo_sim.lab.validation_row import Row, rows
from afo_sim.physics import (
    LAWS,
    Braid,
    braid_force,
    forces,
    nominal_flow,
    three_element_damping,
    tube_conductance,
    tube_critical_ratio,
)
from afo_sim.simulation.run import run

BAR, KPA = 1e5, 1e3  # [Pa]
FLUIDIC = {10: "dmsp_10", 20: "dmsp_20"}  # bore [mm] → muscle with the maker's characteristic
S3_A, S3_B = 17.0, 8.0
S3_N = {6.0: 3.2, 5.0: 3.5}  # pressure [bar] → n; printed "3.2/35" and not assigned to pressures
# Sárosi's coefficients of a 10 mm muscle, for which no length is known: N, bar and per cent.
SAROSI_10 = (-9.2194029, 203.7012413, -0.34221042, -3.2255991, 109.2038216, -208.372034)


def characteristic(bore: int) -> Measured:
    """The maker's characteristic of a 10 or 20 mm muscle, all of its points."""
    return read_measured(assets.folder("models") / "muscles" / FLUIDIC[bore] / "characteristic.csv")


def law_force(muscle: Muscle, law: str, contraction: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Signed force of one of a muscle's laws, through the kernel [N]."""
    coefficients = muscle.coefficients_of(law, muscle.laws[law].parameters)
    return forces(LAWS[law].native_id, coefficients, contraction, pressure)


def _s3_fit(data: Measured, bar: float) -> tuple[float, float]:
    """(a, n) of S3's eq. 5 with b = 8, by least squares on the curve of one pressure."""
    here = np.isclose(data.pressure, bar * BAR)

    def error(x: np.ndarray) -> np.ndarray:
        return s3_force(data, x[0], x[1], data.contraction[here], data.pressure[here]) - data.force[here]  # type: ignore[index]

    a, n = least_squares(error, (10.0, 5.0), xtol=1e-12, ftol=1e-12).x
    return float(a), float(n)


def s3_coefficients(data: Measured, a: float, n: float) -> tuple[float, ...]:
    """Coefficients of S3's eq. 5, F = (π D²/4) p [a (1 − κ)^n − b] with b = 8, for the bore of some data."""
    braid = Braid(1.0, data.facts["bore"] / 2.0, 0.4)  # only the bore counts
    return LAWS["takosoglu_2016"].coefficients(braid, {"a": a, "b": S3_B, "n": n})


def s3_force(data: Measured, a: float, n: float, contraction: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Signed force of S3's eq. 5 [N]."""
    return forces(LAWS["takosoglu_2016"].native_id, s3_coefficients(data, a, n), contraction, pressure)


def _one_force(muscle: Muscle, law: str, contraction: float, pressure: float) -> float:
    """Signed force of one of a muscle's laws at one point [N]."""
    return float(law_force(muscle, law, np.array([contraction]), np.array([pressure]))[0])


def s0() -> list[Row]:
    """The numbers of S0, all lost."""
    return rows("laws", "s0")


def _s3() -> list[Row]:
    data, _ = select(characteristic(10))
    assert data.contraction is not None
    drawn = []
    for bar, n in S3_N.items():
        here = np.isclose(data.pressure, bar * BAR)
        force = data.force[here]
        errors = s3_force(data, S3_A, n, data.contraction[here], data.pressure[here]) - force
        drawn.append({"simulated": errors, "tolerance": 0.1 * float(force.max())})
    return rows("laws", "s3", *(x for bar in S3_N for x in _s3_fit(data, bar)), *drawn)


def _sarosi() -> list[Row]:
    law = LAWS["sarosi_2012"].native_id
    short, long = (reader.load("muscle", f"dmsp_20_{n}00n").coefficients for n in (2, 4))
    points = ((short, 0.0, 6.0), (short, 0.1, 4.0), (long, 0.0, 6.0), (SAROSI_10, 0.0, 6.0))
    found = (forces(law, c, np.array([kappa]), np.array([bar * BAR]))[0] for c, kappa, bar in points)
    return rows("laws", "sarosi", *found)


def _lines(muscle: Muscle, low: float, high: float) -> tuple[float, float, float, float]:
    """Of a three-element law, from forces at two pressures [kPa] and two contractions."""
    force, stiffness = [], []
    for pressure in (low, high):
        at_rest, shorter = (_one_force(muscle, muscle.law, kappa, pressure * KPA) for kappa in (0.0, 0.1))
        force.append(at_rest)
        stiffness.append((at_rest - shorter) / (0.1 * muscle.nominal_length * 1e3))
    slopes = [(y[1] - y[0]) / (high - low) for y in (force, stiffness)]
    return force[0] - slopes[0] * low, slopes[0], stiffness[0] - slopes[1] * low, slopes[1]


def _damping(muscle: Muscle, way: float, low: float, high: float) -> tuple[float, float]:
    """B at P = 0 and its slope, from the damping forces at two pressures [kPa], moving at 1 mm/s one way."""
    assert muscle.damper is not None
    rate = 1e-3 / muscle.nominal_length * way
    b = [three_element_damping(p * KPA, rate, *muscle.damper.coefficients) * 1e-3 for p in (low, high)]
    rise = (b[1] - b[0]) / (high - low)
    return b[0] - rise * low, rise


def _reynolds() -> list[Row]:
    muscle = reader.load("muscle", "reynolds_2003")
    ways = (x for way in (1.0, -1.0) for x in _damping(muscle, way, 210.0, 620.0))
    return rows("laws", "reynolds", *_lines(muscle, 210.0, 620.0), *ways)


def _serres() -> list[Row]:
    muscle = reader.load("muscle", "serres_2009")
    below, above = _lines(muscle, 150.0, 300.0), _lines(muscle, 320.0, 550.0)[2:]
    contracting, relaxing = _damping(muscle, 1.0, 150.0, 550.0)[0], _damping(muscle, -1.0, 150.0, 370.0)[0]
    ways = (contracting, relaxing, *_damping(muscle, -1.0, 375.0, 550.0))
    return rows("laws", "serres", *below, *above, *ways)


def _bolen() -> list[Row]:
    """F620 at the ends of the lengths it was published for."""
    found = []
    for bore, lengths in ((10, (0.112, 0.518)), (20, (0.300, 0.509))):
        muscle = reader.load("muscle", FLUIDIC[bore])
        for length in lengths:
            found.append(_one_force(muscle.with_values(total_length=length), "bolen_2026", 0.0, 620.0 * KPA))
    return rows("laws", "bolen", *found)


PARTS = {"s3": _s3, "sarosi": _sarosi, "reynolds": _reynolds, "serres": _serres, "bolen": _bolen}
S2_LAWS = ("kerscher_2006", "maximum_force", "sarosi_2012", "polynomial")  # S2's four approximations


def s2() -> list[Row]:
    missed = (_on_makers_curve(law, bore) for law in S2_LAWS for bore in FLUIDIC)
    swings = np.degrees(run("arm-short")["ankle/angle"])
    return rows("laws", "s2", *_chart_corner(), *missed, swings.min(), swings.max())


def _chart_corner() -> list[float]:
    """S2's chart ends at −3 % and 600 kPa, "up to 2000 N": the maker's table, muscle and laws there [N]."""
    data, muscle = characteristic(20), reader.load("muscle", "dmsp_20")
    stretched = np.isclose(data.contraction, -0.03)  # type: ignore[arg-type]
    line = np.polyfit(data.pressure[stretched], data.force[stretched], 1)
    own = _one_force(muscle, muscle.law, 0.0, 6.0 * BAR) + braid_force(-0.03, muscle.braid_stiffness)
    laws = (_one_force(muscle, law, -0.03, 6.0 * BAR) for law in S2_LAWS)
    return [float(np.polyval(line, 6.0 * BAR)), own, *laws]


def _on_makers_curve(law: str, bore: int) -> dict[str, Any]:
    """A shipped law on the maker's curve that it was fitted to, and what it misses of unseen pressures."""
    data, _ = select(characteristic(bore))
    assert data.contraction is not None
    errors = (
        law_force(reader.load("muscle", FLUIDIC[bore]), law, data.contraction, data.pressure) - data.force
    )
    unseen = held_out(fit_law(pose(law, [data]), starts=4)).held_out["pressure"].rms
    return {"simulated": errors, "held_out": {"pressure": unseen}}


BORE, LENGTH = 4e-3, 10.0  # [m]
LITRES = 6e4  # m³/s in l/min
SONIC = 1e-8  # dm³/(s·bar) in m³/(s·Pa)


def tube() -> list[Row]:
    conductance = tube_conductance(BORE, LENGTH) / SONIC
    return rows("valves", "tube", conductance, tube_critical_ratio(BORE, LENGTH))


def _shipped_flow(name: str, density: float) -> float:
    """Flow of a shipped valve from 6 to 5 bar gauge [l/min of a norm]."""
    valve = reader.load("valve", name)
    return LITRES * nominal_flow(valve.conductance, valve.critical_ratio, 6e5, 5e5, density)


def smc() -> list[Row]:
    flows = [_shipped_flow(f"sy{k}000", STANDARD_DENSITY) for k in (3, 5, 7, 9)]
    return rows("valves", "smc", *flows, LITRES * nominal_flow(2.0 * SONIC, 0.3, 4e5, 3e5, STANDARD_DENSITY))


def festo() -> list[Row]:
    return rows(
        "valves", "festo", *(_shipped_flow(name, NORMAL_DENSITY) for name in ("mpye_1_4", "vuvs_lt25"))
    )

"""What rows ask of a law of force or flow: at a point, on the maker's curve, or back from two points."""

import math
from collections.abc import Mapping

import numpy as np

from afo_sim.common import NORMAL_DENSITY, STANDARD_DENSITY, JsonDict, JsonMapping, assets
from afo_sim.description import Muscle, load
from afo_sim.lab.law_fit import fit_law, held_out
from afo_sim.lab.law_problem import pose, select, take
from afo_sim.lab.measured import Measured, read_measured
from afo_sim.physics import (
    LAWS,
    contractions,
    forces,
    nominal_flow,
    three_element_damping,
    tube_conductance,
    tube_critical_ratio,
)

Told = JsonMapping
Parameters = Mapping[str, float] | None
BAR = 1e5  # [Pa]
SONIC = 1e-8  # dm³/(s·bar) in m³/(s·Pa)
LITRES = 6e4  # m³/s in l/min
NORMS = {"ANR": STANDARD_DENSITY, "DIN 1343": NORMAL_DENSITY}


def characteristic(muscle: str) -> Measured:
    """The maker's characteristic of a muscle, all of its points."""
    return read_measured(assets.folder("models") / "muscles" / muscle / "characteristic.csv")


def law_force(
    muscle: Muscle, law: str, contraction: np.ndarray, pressure: np.ndarray, parameters: Parameters = None
) -> np.ndarray:
    """Signed force of a law, through the kernel [N], by a muscle's own parameters where none are given."""
    values = muscle.laws[law].parameters if parameters is None else parameters
    return forces(LAWS[law].native_id, muscle.coefficients_of(law, values), contraction, pressure)


def _asked(told: Told) -> tuple[Muscle, str, Mapping[str, float]]:
    muscle: Muscle = load("muscle", told["muscle"], told.get("set", {}))
    law = told.get("law", muscle.law)
    return muscle, law, told["parameters"] if "parameters" in told else muscle.laws[law].parameters


def force(told: Told) -> float:
    """Signed force of a law that the row names, else the tension of the muscle as a run has it [N]."""
    muscle, law, parameters = _asked(told)
    kappa, pressure = told["contraction"], told["bar"] * BAR
    if "law" not in told:
        return float(muscle.force(pressure, contraction=kappa))
    return float(law_force(muscle, law, np.array([kappa]), np.array([pressure]), parameters)[0])


def contraction(told: Told) -> dict[str, float]:
    """Contraction without load, of the active length or (`of_total`) of the whole muscle [%]."""
    muscle, law, parameters = _asked(told)
    coefficients, pressure = muscle.coefficients_of(law, parameters), np.array([told["bar"] * BAR])
    free = 100.0 * contractions(LAWS[law].native_id, coefficients, np.zeros(1), pressure)[0]
    share = muscle.nominal_length / muscle.total_length if told.get("of_total") else 1.0
    return {"simulated": float(free * share), "degrees": math.degrees(muscle.braid_angle)}


def line(told: Told) -> float:
    """F_ce [N], K [N/mm] or B [N·s/mm] at P = 0, or its slope by kPa, from two pressures `kpa`."""
    muscle, law, parameters = _asked(told)
    way, (low, high) = {"B contracting": 1e-3, "B relaxing": -1e-3}.get(told["element"]), told["kpa"]

    def element(pressure: float) -> float:
        if way is not None:  # at 1 mm/s
            assert muscle.damper is not None
            rate = way / muscle.nominal_length
            return 1e-3 * three_element_damping(pressure, rate, *muscle.damper.coefficients)
        at_rest, shorter = law_force(muscle, law, np.array([0.0, 0.1]), np.full(2, pressure), parameters)
        stiffness = (at_rest - shorter) / (0.1 * muscle.nominal_length * 1e3)
        return float(at_rest if told["element"] == "F_ce" else stiffness)

    first, second = element(low * 1e3), element(high * 1e3)
    slope = (second - first) / (high - low)
    return slope if told["take"] == "slope" else first - slope * low


def laws_apart(told: Told) -> np.ndarray:
    """The first of two laws less the second over a grid of contractions and pressures [N]."""
    muscle, ends = load("muscle", told["muscle"], told.get("set", {})), (told["contraction"], told["bar"])
    kappa, bar = (x.ravel() for x in np.meshgrid(*(np.linspace(*each) for each in ends)))
    first, second = (law_force(muscle, law, kappa, bar * BAR, x) for law, x in told["laws"].items())
    return first - second


def along(told: Told) -> float:
    """Force at a pressure on the line through the maker's points at a contraction [N]."""
    data = characteristic(told["muscle"])
    here = np.isclose(np.asarray(data.contraction), told["contraction"])
    return float(np.polyval(np.polyfit(data.pressure[here], data.force[here], 1), told["bar"] * BAR))


def curve(told: Told) -> JsonDict:
    """Errors of a law on the maker's points; at one `bar` their bound is a share of the largest force."""
    (muscle, law, parameters), (data, _) = _asked(told), select(characteristic(told["muscle"]))
    if "bar" in told:
        data = take(data, np.isclose(data.pressure, told["bar"] * BAR))
    assert data.contraction is not None
    errors = law_force(muscle, law, data.contraction, data.pressure, parameters) - data.force
    if "bar" in told:
        return {"simulated": errors, "tolerance": told["of_largest"] * float(data.force.max())}
    unseen = held_out(fit_law(pose(law, [data]), starts=4)).held_out["pressure"].rms
    return {"simulated": errors, "held_out": {"pressure": unseen}}


def fit(told: Told) -> float:
    """A parameter of a law that is fitted to the maker's points of one pressure, others `fixed`."""
    problem = pose(told["law"], [select(characteristic(told["muscle"]))[0]], fixed=told["fixed"])
    of_one = problem.take(np.isclose(problem.data[0].pressure, told["bar"] * BAR))
    return fit_law(of_one, starts=4).values[told["take"]]


def tube(told: Told) -> float:
    """C [dm³/(s·bar)] or b of a tube."""
    size = 1e-3 * told["millimetres"], told["metres"]
    return tube_conductance(*size) / SONIC if told["take"] == "C" else tube_critical_ratio(*size)


def flow(told: Told) -> float:
    """Flow of a valve, shipped or of C [dm³/(s·bar)] and b, between two gauge pressures [l/min of a norm]."""
    valve = load("valve", told["valve"]) if "valve" in told else None
    up, down = (x * BAR for x in told["bar"])
    c, b = (told["C"] * SONIC, told["b"]) if valve is None else (valve.conductance, valve.critical_ratio)
    return LITRES * nominal_flow(c, b, up, down, NORMS[told["norm"]])


ASKED = (force, contraction, line, laws_apart, along, curve, fit, tube, flow)  # by these names

"""What S0, S3, the authors of the force laws and S2 (Piteľ & Tóthová) printed, and what their texts lost."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from afo_sim.common import assets
from afo_sim.description import Muscle, reader
from afo_sim.lab.law_fit import fit_law, held_out
from afo_sim.lab.law_problem import pose, select
from afo_sim.lab.measured import Measured, read_measured
from afo_sim.lab.validation_row import About, Row, lost
from afo_sim.physics import LAWS, Braid, braid_force, forces, three_element_damping
from afo_sim.simulation.run import run

BAR, KPA = 1e5, 1e3  # [Pa]
FLUIDIC = {10: "dmsp_10", 20: "dmsp_20"}  # bore [mm] → muscle with the maker's characteristic
MAKER = "maker's, second-hand; fitted here"
SECOND_HAND = "printed, read second-hand"
WHY_MAKER = "the maker states ±10 % of its curves"
WHY_TENTH = "by hand from the printed numbers, to 1 N"
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
    what = (
        "K(P), B(P), F_ce(P) of MAS-20-250N (figures 4.3 to 4.9)",
        "sensor calibration equations (table 3.1)",
        "open-loop and repeatability results (tables 4.1, 4.2)",
    )
    return [lost("S0", each, "chapters 3 to 5 are not in the text") for each in what]


def _s3() -> list[Row]:
    data, _ = select(characteristic(10))
    found = []
    for bar, n in S3_N.items():
        ours = _s3_fit(data, bar)
        for name, printed, simulated in (("a", S3_A, ours[0]), ("n of “n = 3.2/35”", n, ours[1])):
            how = f"printed{'' if name == 'a' else ', its point lost'}; equation restored here"
            what = f"{name}, fitted to the independent 10 mm curve of {bar:g} bar with b = {S3_B:g}"
            about = About("S3 eq. 5", "", how, WHY_MAKER)
            found.append(about.number(what, printed, simulated, 0.1 * printed))
    for bar, n in S3_N.items():
        here = np.isclose(data.pressure, bar * BAR)
        curve_force = data.force[here]
        errors = s3_force(data, S3_A, n, data.contraction[here], data.pressure[here]) - curve_force  # type: ignore[index]
        why = f"{WHY_MAKER}: of its largest force here"
        what = f"a = 17, b = 8, n = {n:g} against the 10 mm curve of {bar:g} bar, RMS"
        figure = About("S3 figure 10", "N", "printed; maker's, second-hand", why)
        found.append(figure.curve(what, errors, 0.1 * float(curve_force.max())))
    why = "the formulas and the table are pictures in the available text"
    form = "S2 quotes the form only; the paper itself could not be read"
    return [
        *found,
        lost("S3", "n(p), a(p) (eq. 6–9); table 2; points of figures 7 to 9", why),
        lost("S3", "Shadow muscle: a(p), n(p) with b = 10 (eq. 10)", why),
        lost("Kerscher 2006", "a_ε, b_ε, a_κ, b_κ, c_κ", form),
    ]


def _sarosi() -> list[Row]:
    def by_coefficients(c: Sequence[float], kappa: float, bar: float) -> float:
        law = LAWS["sarosi_2012"]
        return float(forces(law.native_id, c, np.array([kappa]), np.array([bar * BAR]))[0])

    short, long = (reader.load("muscle", f"dmsp_20_{n}00n") for n in (2, 4))
    sets = {"DMSP-20-200N": short.coefficients, "DMSP-20-400N": long.coefficients, "10 mm muscle": SAROSI_10}
    about = About("Sárosi 2012", "N", SECOND_HAND, WHY_TENTH)
    return [
        about.implied(
            f"{name}: force at {100.0 * kappa:g} %, {bar:g} bar",
            by_hand,
            by_coefficients(sets[name], kappa, bar),
            0.5,
        )
        for name, kappa, bar, by_hand in (
            ("DMSP-20-200N", 0.0, 6.0, 1752.0),
            ("DMSP-20-200N", 0.1, 4.0, 533.0),
            ("DMSP-20-400N", 0.0, 6.0, 1805.0),
            ("10 mm muscle", 0.0, 6.0, 595.0),
        )
    ]


def _lines(muscle: Muscle, low: float, high: float) -> tuple[float, float, float, float]:
    """Of a three-element law, from forces at two pressures [kPa] and two contractions."""
    force, stiffness = [], []
    for pressure in (low, high):
        at_rest, shorter = (_one_force(muscle, muscle.law, kappa, pressure * KPA) for kappa in (0.0, 0.1))
        force.append(at_rest)
        stiffness.append((at_rest - shorter) / (0.1 * muscle.nominal_length * 1e3))
    slopes = [(y[1] - y[0]) / (high - low) for y in (force, stiffness)]
    return force[0] - slopes[0] * low, slopes[0], stiffness[0] - slopes[1] * low, slopes[1]


Coefficient = tuple[str, str, float, str]  # name, printed text, ours, unit


def _coefficients(source: str, values: Sequence[Coefficient], sourcing: str) -> list[Row]:
    """Rows of (name, printed text, ours, unit), right to half of the last printed digit."""
    return [
        About(source, unit, sourcing, "half of the last printed digit").number(
            f"{name}, back from the kernel",
            float(text),
            simulated,
            0.5 * 10.0 ** -len(text.partition(".")[2]),
        )
        for name, text, simulated, unit in values
    ]


def _reynolds() -> list[Row]:
    muscle = reader.load("muscle", "reynolds_2003")
    f0, f1, k0, k1 = _lines(muscle, 210.0, 620.0)
    values = (
        ("F_ce, at P = 0", "179.2", f0, "N"),
        ("F_ce, slope", "1.39", f1, "N/kPa"),
        ("K, at P = 0", "5.71", k0, "N/mm"),
        ("K, slope", "0.0307", k1, "N/(mm·kPa)"),
    )
    sourcing = "printed, quoted; units from memory"
    return _coefficients("Reynolds 2003", (*values, *_damping(muscle, REYNOLDS_B)), sourcing)


# (which way, from and to [kPa], printed at P = 0 and, where it has one, slope) [N·s/mm, N·s/(mm·kPa)]
REYNOLDS_B = (
    ("contracting", 210.0, 620.0, "1.01", "0.00691"),
    ("relaxing", 210.0, 620.0, "0.6", "-0.000803"),
)
SERRES_B = (
    ("contracting", 150.0, 550.0, "2.90", ""),
    ("relaxing, below 372 kPa", 150.0, 370.0, "1.57", ""),
    ("relaxing, above 372 kPa", 375.0, 550.0, "0.311", "0.00338"),
)


def _damping(muscle: Muscle, printed: Sequence[tuple[str, float, float, str, str]]) -> list[Coefficient]:
    """B of the three-element model, from the damping forces at two pressures, moving at 1 mm/s."""
    assert muscle.damper is not None
    found = []
    for way, low, high, at_zero, slope in printed:
        rate = 1e-3 / muscle.nominal_length * (1.0 if way.startswith("contracting") else -1.0)
        b = [three_element_damping(p * KPA, rate, *muscle.damper.coefficients) * 1e-3 for p in (low, high)]
        rise = (b[1] - b[0]) / (high - low)
        found.append((f"B {way}, at P = 0", at_zero, b[0] - rise * low, "N·s/mm"))
        if slope:
            found.append((f"B {way}, slope", slope, rise, "N·s/(mm·kPa)"))
    return found


def _serres() -> list[Row]:
    muscle = reader.load("muscle", "serres_2009")
    f0, f1, k0, k1 = _lines(muscle, 150.0, 300.0)
    k2, k3 = _lines(muscle, 320.0, 550.0)[2:]
    values = (
        ("F_ce, at P = 0", "44.6", f0, "N"),
        ("F_ce, slope", "2.91", f1, "N/kPa"),
        ("K below 314 kPa, at P = 0", "32.7", k0, "N/mm"),
        ("K below 314 kPa, slope", "-0.0321", k1, "N/(mm·kPa)"),
        ("K above 314 kPa, at P = 0", "17", k2, "N/mm"),
        ("K above 314 kPa, slope", "0.0179", k3, "N/(mm·kPa)"),
    )
    return _coefficients("Serres 2009", (*values, *_damping(muscle, SERRES_B)), "printed in the abstract")


def _bolen() -> list[Row]:
    """F620 at the ends of the lengths it was published for."""
    about = About("Bolen 2026", "N", "computed from coefficients printed in the manuscript", WHY_TENTH)
    found = []
    for bore, lengths in ((10, (0.112, 0.518)), (20, (0.300, 0.509))):
        muscle = reader.load("muscle", FLUIDIC[bore])
        f1, f2, f3 = (303.5, 19.03, 0.0075) if bore == 10 else (922.4, 15.37, 0.013)
        for length in lengths:
            what = f"force of {bore} mm × {1e3 * length:g} mm at rest length, 620 kPa"
            by_hand = round(f1 * math.atan(f2 * (length - f3)))
            ours = _one_force(muscle.with_values(total_length=length), "bolen_2026", 0.0, 620.0 * KPA)
            found.append(about.implied(what, by_hand, ours, 0.5))
    return found


PARTS = (_s3, _sarosi, _reynolds, _serres, _bolen)
WHY_BOUND = "bound on the fit's RMS"
WHY_TOO_MANY = (
    "21 coefficients on 33 points: the shipped set is fitted to a grid of `sarosi_2012`; only the error on "
    "unseen pressures counts"
)
# S2's four approximations → bound on the RMS over the maker's curve at 10 and 20 mm [N].
S2_LAWS = {
    "kerscher_2006": ("eq. 3–7", 9.6, 21.5),
    "maximum_force": ("eq. 8–9", 2.4, 3.7),
    "sarosi_2012": ("eq. 10", 1.9, 2.1),
    "polynomial": ("eq. 11", 0.6, None),
}


def s2() -> list[Row]:
    found = [*_chart_corner()]
    for law, (equation, *bounds) in S2_LAWS.items():
        for bore, bound in zip(FLUIDIC, bounds, strict=True):
            found.append(_on_makers_curve(law, equation, bore, bound))
    why = "the paper names Matlab's Curve Fitting Toolbox and prints no value"
    found += _short_period()
    return [*found, lost("S2", "coefficients of eq. 3–11; damping R; the bracket of eq. 8", why)]


def _short_period() -> list[Row]:
    """The angles between which the arm swings at the short period, beside the axis of S2's figure 6."""
    angle = np.degrees(run("arm-short")["ankle/angle"])
    why = (
        "S2 prints no filling times, pulley or inertia; those of `arm-short` are assumed, so only "
        "differences between laws can be compared"
    )
    axis = About("S2 figure 6", "deg", "printed, end of the axis; times assumed here", why)
    return [
        axis.compared(f"arm at a short period: {end} angle", printed, float(swung))
        for end, printed, swung in (("least", -5.0, angle.min()), ("largest", 35.0, angle.max()))
    ]


def _chart_corner() -> list[Row]:
    """S2's chart ends at −3 % and 600 kPa, "up to 2000 N": the maker's table, muscle and laws there."""
    data, muscle = characteristic(20), reader.load("muscle", "dmsp_20")
    stretched = np.isclose(data.contraction, -0.03)  # type: ignore[arg-type]
    line = np.polyfit(data.pressure[stretched], data.force[stretched], 1)
    braid = braid_force(-0.03, muscle.braid_stiffness)
    what = "20 mm, −3 %, 600 kPa"
    along = float(np.polyval(line, 6.0 * BAR))
    own = _one_force(muscle, muscle.law, 0.0, 6.0 * BAR) + braid
    table, fitted = (
        About("S2 figure 4", "N", f"printed (“up to”); {how}", WHY_MAKER)
        for how in ("table second-hand", "muscle fitted here")
    )
    why = "laws are fitted to κ ≥ 0; the simulator never asks them below zero, where the braid carries"
    laws = About("S2 figure 4", "N", "printed (“up to”); fitted here", why)
    its = f"maker's table, along its {stretched.sum()} points at −3 %"
    return [
        table.number(f"{what}: {its}", 2000.0, along, 200.0),
        fitted.number(f"{what}: muscle, law at 0 and the braid's stiffness", 2000.0, own, 200.0),
        *(
            laws.compared(f"{what}: `{law}` continued", 2000.0, _one_force(muscle, law, -0.03, 6.0 * BAR))
            for law in S2_LAWS
        ),
    ]


def _on_makers_curve(law: str, equation: str, bore: int, bound: float | None) -> Row:
    """A shipped law on the maker's curve that it was fitted to, and what it misses of unseen pressures."""
    data, _ = select(characteristic(bore))
    muscle = reader.load("muscle", FLUIDIC[bore])
    assert data.contraction is not None
    errors = law_force(muscle, law, data.contraction, data.pressure) - data.force
    unseen = held_out(fit_law(pose(law, [data]), starts=4)).held_out["pressure"].rms
    about = About(f"S2 {equation}", "N", MAKER, WHY_BOUND if bound else WHY_TOO_MANY)
    return about.curve(f"`{law}` on the {bore} mm curve, RMS", errors, bound, held_out={"pressure": unseen})

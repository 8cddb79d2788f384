"""Findings on one described part: a muscle, a piece of the air path, a person, a shoe."""

from afo_sim import description
from afo_sim.cli.doctor.kinds import Findings
from afo_sim.description.orthosis import Valve
from afo_sim.physics import LAWS, nominal_flow


def muscle(muscle: description.Muscle) -> Findings:
    """Law, braid, mass, fit and sources of a muscle."""
    rows: Findings = [
        ("law", muscle.law),
        ("braid", f"{100 * muscle.nominal_length:.2f} cm of {100 * muscle.total_length:.2f} cm"),
        ("locks at a contraction of", f"{muscle.braid.lock:.4f}"),
    ]
    if muscle.lengths is not None:
        factor = muscle.lengths.factor(muscle.piece.nominal_length)
        against = f"{factor:.4g} of that at {100.0 * muscle.lengths.reference:g} cm"
        rows += [
            ("mass at this length", f"{1e3 * muscle.whole_mass:.4g} g"),
            ("force at this length", against),
        ]
        rows += [("warning", muscle.length_warning)] if muscle.length_warning else []
    if LAWS[muscle.law].braids:
        rows += description.BraidFacts.of(muscle).rows()
    volume = muscle.law_volume
    whose = "of its law" if any(volume.numbers) else "of the braid"
    rows += [
        ("volume", f"{whose}: {volume.reason}" if volume.reason else whose),
        ("covariance of the fit", _covariance(muscle)),
    ]
    return rows + [(name, f"{origin.kind}: {origin.source}") for name, origin in muscle.provenance.items()]


def _covariance(muscle: description.Muscle) -> str:
    """Standard errors, the strongest correlation, freedom; or why there is none."""
    fit = muscle.covariance
    if fit is None:
        return "none"
    names = [key.rpartition(".")[2] for key in fit.parameters]
    errors = [
        f"{name} ± {description.amount(fit.scale * error, unit, 3)}"
        for name, error, unit in zip(names, fit.standard_errors, fit.units, strict=True)
    ]
    line = f"{', '.join(errors)} (standard errors)"
    pairs = [(fit.correlation[i][j], names[j], names[i]) for i in range(len(names)) for j in range(i)]
    if pairs:
        strongest, first, second = max(pairs, key=lambda pair: abs(pair[0]))
        line += f"; strongest correlation {strongest:.3f}, {first} with {second}"
    line += f"; {fit.freedom} degrees of freedom"
    return line + (f"; not in use: {muscle.without_draws}" if muscle.without_draws else "")


def valve(valve: Valve) -> Findings:
    """Conductance of a valve, and of its exhaust."""
    found = []
    for what, path in (("", valve), (" of the exhaust", valve.exhaust)):
        if path is None:
            continue
        origin = path.provenance.get("conductance")
        how = f", {origin.source}" if path.rating is not None and origin is not None else ""
        found.append((f"sonic conductance{what}", f"{path.conductance * 1e8:.4g} dm³/(s·bar){how}"))
        flows = (
            f"{6e4 * nominal_flow(path.conductance, path.critical_ratio, 6e5, 5e5, density):.4g} l/min {norm}"
            for norm, density in description.DENSITIES.items()
        )
        found.append((f"flow from 6 to 5 bar gauge{what}", " or ".join(flows)))
    return found


def tube(tube: description.Tube) -> Findings:
    """What three lengths of a tube do to the air."""
    return [
        (
            f"{length:g} m",
            f"C {1e8 * tube.conductance(length):.3g} dm³/(s·bar), b {tube.critical_ratio(length):.2f}, "
            f"{1e6 * tube.volume(length):.3g} ml, sound takes {1e3 * tube.delay(length):.2g} ms",
        )
        for length in (0.5, 1.0, 2.0)
    ]


def source(source: description.Source) -> Findings:
    """Gas of a source, and what it delivers."""
    needed = 4e5  # gauge pressure of most shipped scenarios [Pa]
    found = [("free gas down to 4 bar", f"{source.free_litres(needed):.3g} l of free gas (ANR)")]
    if source.kind == "compressor":
        flow = 6e4 * source.delivery(needed) * source.real_gas.litres_per_gram
        found.append(("its compressor delivers at 4 bar", f"{flow:.3g} l/min (ANR)"))
    return [("gas", source.gas), ("full", f"{1e3 * source.full_mass:.3g} g"), *found]


def regulator(regulator: description.Regulator) -> Findings:
    """Range and droop of a regulator."""
    flow, low, high = 6e4 * regulator.rated_flow, *(1e-5 * p for p in regulator.set_range)
    return [
        ("set pressure", f"{low:g} to {high:g} bar"),
        ("droop", f"{1e-5 * regulator.droop:g} bar at {flow:.4g} l/min (ANR)"),
        ("sonic conductance", f"{1e8 * regulator.conductance:g} dm³/(s·bar)"),
    ]


def patient(patient: description.Patient) -> Findings:
    """Strength of a patient's muscles."""
    sides = {"dorsiflexors": patient.dorsiflexor_strength, "plantarflexors": patient.plantarflexor_strength}
    return [(f"strength of the {side}", f"{100 * share:g} %") for side, share in sides.items()]


def shoe(shoe: description.Shoe) -> Findings:
    """Heights, stiffness and mass of a shoe."""
    return [
        ("under heel and ball", f"{1e3 * shoe.heel_stack:g} mm and {1e3 * shoe.ball_stack:g} mm"),
        ("drop", f"{1e3 * (shoe.heel_stack - shoe.ball_stack):g} mm"),
        ("toe spring", f"{1e3 * shoe.toe_spring:g} mm"),
        ("stiffness added to the toes", f"{shoe.toe_stiffness:g} N·m/rad"),
        ("mass", f"{shoe.mass:g} kg"),
    ]


def sensor(sensor: description.SensorType) -> Findings:
    """Output line of a sensor."""
    found = [("for columns in", sensor.unit or "no unit")]
    if sensor.calibration is not None:
        line, sign = sensor.line, "/" if sensor.line.inverse else "×"
        found.append(("output", f"{line.slope:g} {sign} quantity + {line.intercept:g} V"))
    return found


def limits(limits: description.Limits) -> Findings:
    """Limits of a run."""
    wanted, trips = (1e3 * height for height in limits.toe_clearance)
    return [
        ("toe clearance", f"{wanted:g} mm wanted, below {trips:g} mm the toe trips"),
        ("bottle", f"{1e3 * limits.bottle_volume:g} l at {1e-5 * limits.bottle_pressure:g} bar"),
        ("pressure on the skin", " and ".join(f"{1e-3 * p:g} kPa" for p in limits.skin_pressure)),
        ("life of a muscle", f"{limits.muscle_life:g} cycles"),
    ]

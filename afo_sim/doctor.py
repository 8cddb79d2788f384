"""Doctor for a user's files: what is it, is it right, what would it do."""

import pathlib
import shlex
from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np

from afo_sim.common import assets
from afo_sim.common.errors import InputError
from afo_sim.description.air.nominal_flow import DENSITIES
from afo_sim.description.air.regulator import Regulator
from afo_sim.description.air.source import Source
from afo_sim.description.air.tube import Tube
from afo_sim.description.attachment import Side
from afo_sim.description.control.sensor import SensorType
from afo_sim.description.handmade import BraidFacts
from afo_sim.description.leg import Leg, Shoe
from afo_sim.description.muscle import Muscle
from afo_sim.description.orthosis import Orthosis, Valve
from afo_sim.description.quantity import Described, amount
from afo_sim.description.reader import SPECS, load
from afo_sim.description.scenario import Scenario
from afo_sim.description.scenario_text import reference
from afo_sim.description.schema import fields_of
from afo_sim.description.walking import Limits, Patient
from afo_sim.gait import file as gait
from afo_sim.gait import norm as gait_norm
from afo_sim.gait.checks import findings
from afo_sim.legs.cutting import cut
from afo_sim.legs.finding import find
from afo_sim.legs.leg_doubts import doubtful_notes
from afo_sim.legs.leg_numbers import LegNumbers
from afo_sim.legs.reading import read_tree
from afo_sim.legs.tree import Tree
from afo_sim.model import stability
from afo_sim.model.build import build
from afo_sim.model.design import design_of, scenario_of
from afo_sim.model.mounting import sweep_ankle
from afo_sim.model.path_words import rows as path_rows
from afo_sim.physics.laws import LAWS
from afo_sim.physics.ratings import nominal_flow
from afo_sim.simulation.checks_file import read_checks
from afo_sim.simulation.loop import described_policy
from afo_sim.simulation.reference import reference_of

SKIN = {"shank": "cuff", "foot": "plate's strap"}


def check_file(path: pathlib.Path) -> list[tuple[str, str]]:
    """Examine a TOML description or the folder that holds one, an MJCF, a URDF or a gait cycle.

    A path at which there is nothing may be the name of a shipped orthosis or scenario.

    Returns
    -------
    list of (what, finding)

    Raises
    ------
    InputError
        The first thing that is wrong.
    """
    for kind in ("orthosis", "scenario"):
        if not path.exists() and str(path) in assets.names(kind):
            path = assets.find(kind, str(path))
    if path.is_dir():
        path = _described_in(path)
    if not path.is_file():
        raise InputError("there is no such file", file=path)
    suffix = path.suffix.lower()
    if suffix == ".toml":
        return _check_toml(path)
    if suffix == ".urdf":
        return _check_urdf(path)
    if suffix in (".xml", ".mjcf"):
        return _check_model(path)
    if suffix == ".csv":
        return _check_gait(path)
    raise InputError(
        "is not a kind of file that can be checked", file=path, allowed=".toml, .xml, .mjcf, .urdf, .csv"
    )


def _described_in(folder: pathlib.Path) -> pathlib.Path:
    """The one description that a folder is the home of, such as orthosis.toml."""
    names = [f"{kind}.toml" for kind in assets.KINDS if kind not in assets.FLAT]
    found = [folder / name for name in names if (folder / name).is_file()]
    if len(found) != 1:
        problem = "the folder holds no description" if not found else "the folder holds several descriptions"
        raise InputError(problem, file=folder, allowed="a file, or a folder with one of " + ", ".join(names))
    return found[0]


def _check_gait(path: pathlib.Path) -> list[tuple[str, str]]:
    if gait_norm.is_norm(path):
        return [("kind", "gait norm"), ("rows", str(len(gait_norm.read(path).phase)))]
    return [("kind", "gait cycle"), *findings(gait.read(path))]


def _check_toml(path: pathlib.Path) -> list[tuple[str, str]]:
    table = assets.read_toml(path)
    if "check" in table:
        return [("kind", "checks"), ("checks", str(len(read_checks(path))))]
    if "objective" in table:
        return _check_search(path)
    if "parameters" in table or table.get("design") == "uncertainty":
        return _check_spreads(path) if _spreads(table) else _check_sweep(path)
    kind = _kind_of(path, table)
    description = load(kind, str(path))
    findings = [("kind", kind), *_FINDINGS[type(description)](description)]
    if kind in ("orthosis", "leg"):
        # neither runs alone: put it into a shipped scenario
        own = {"leg": str(path.resolve())}
        findings += _scenario(scenario_of(path) if kind == "orthosis" else load("scenario", "seated", own))
    return findings


def _kind_of(path: pathlib.Path, table: Mapping[str, Any]) -> str:
    """The kind of description that has most of a file's keys; of several, the file's namesake."""
    shared = {
        kind: len(table.keys() & fields_of(spec).keys() - {"name", "description"})
        for kind, spec in SPECS.items()
    }
    kind = max(shared, key=lambda kind: (shared[kind], kind == path.stem))
    if shared[kind] == 0:
        raise InputError(
            "is not recognised as a description",
            file=path,
            allowed="a scenario (duration, timer), orthosis (muscle, chamber), muscle (law), valve "
            "(conductance), tube (bore), source (kind, volume), regulator (droop), leg (file), patient "
            "(dorsiflexor_strength), shoe (heel_stack), limits (toe_clearance), sensor (unit), a list of "
            "checks ([[check]]), a sweep (scenario, [parameters.NAME]), a search (with [objective]) or "
            "what is not known ([parameters.NAME] without a scenario)",
        )
    return kind


def _check_sweep(path: pathlib.Path) -> list[tuple[str, str]]:
    from afo_sim.study.design import cases_of
    from afo_sim.study.sweep_file import read

    plan = read(path)
    cases = cases_of(plan)
    findings = [
        ("kind", "sweep"),
        ("scenario", plan.scenario_name),
        ("cases", f"{len(cases)} ({plan.design})"),
    ]
    if plan.constraints:
        findings.append(("left out by the constraints", str(cases.dropped)))
    findings += [("note", note) for note in plan.notes]
    return findings + [
        (parameter.name, f"{', '.join(parameter.keys)}{f' [{parameter.unit}]' if parameter.unit else ''}")
        for parameter in plan.parameters
    ]


def _spreads(table: Mapping[str, Any]) -> bool:
    """Whether [parameters.NAME] tables tell what is not known, and not the cases of a sweep."""
    return not table.keys() & {"scenario", "design"}


def _check_spreads(path: pathlib.Path) -> list[tuple[str, str]]:
    from afo_sim.study.uncertainty.spreads import in_words, read

    return [("kind", "uncertainty"), *in_words(read(path))]


def _check_search(path: pathlib.Path) -> list[tuple[str, str]]:
    from afo_sim.study.search.plan import read

    search = read(path)
    patients = search.judging()
    findings = [
        ("kind", "search"),
        ("scenario", search.designs.scenario_name),
        ("patients", str(len(patients)) if patients else "the scenario's own"),
        ("objective", f"{search.objective.goal} {search.objective.metric}"),
    ]
    findings += [("limit", f"{limit.metric} {limit.option} {limit.bound}") for limit in search.limits]
    return findings + [(parameter.name, ", ".join(parameter.keys)) for parameter in search.designs.parameters]


def _scenario(scenario: Scenario) -> list[tuple[str, str]]:
    built = build(scenario)
    _, _, inertia = sweep_ankle(built.model, built.index, np.zeros(1))
    findings = [
        ("foot, plate and muscles about the ankle", f"{inertia[0]:.4f} kg·m²"),
        (
            "air number, rate × time step",
            f"{built.stability['air']:.3g} (accurate to {stability.AIR_ACCURATE:g})",
        ),
    ]
    warnings = list(built.warnings)
    if built.index.muscles:
        found = design_of(built)
        findings += [row for entry in found.facts for row in path_rows(entry)]
        warnings = list(dict.fromkeys([*found.warnings, *warnings]))
    if scenario.controller is not None:
        described_policy(built)  # refuses a rate or columns that do not fit
        found_rate = f"{scenario.controller.rate:g} commands a second"
        findings.append(("controller", f"{scenario.controller.kind}, {found_rate}"))
    if scenario.reference is not None:
        reference_of(scenario)
        findings.append(("compared with", reference(scenario.resolved())))
    return findings + [("warning", warning) for warning in warnings]


def _orthosis(orthosis: Orthosis) -> list[tuple[str, str]]:
    return [
        ("muscles", ", ".join(f"{g.count} × {n} ({g.type.name})" for n, g in orthosis.muscle.items())),
        ("chambers", ", ".join(orthosis.chamber)),
        *_air_path(orthosis),
        *(
            (
                f"skin under the {SKIN[segment]}",
                f"{1e4 * lies.area:g} cm² ({_kind(lies, 'area')}), "
                f"friction {lies.friction:g} ({_kind(lies, 'friction')})",
            )
            for segment, lies in orthosis.interface.items()
        ),
    ]


def _air_path(orthosis: Orthosis) -> Iterator[tuple[str, str]]:
    """Tubes of chambers, volumes and restrictions, where there are any."""
    for name, chamber in orthosis.chamber.items():
        ways = f"{chamber.feed} → {name} → {chamber.exhaust}"
        if chamber.tube is not None and chamber.tube_length is not None:
            ways += f", {chamber.tube_length:g} m of {chamber.tube.name or 'tube'}"
        if chamber.quick_exhaust is not None:
            ways += ", quick exhaust"
        if chamber.tube is not None or (chamber.feed, chamber.exhaust) != ("supply", "ambient"):
            yield f"air of {name}", ways
    for name, volume in orthosis.volume.items():
        yield f"volume {name}", f"{1e6 * volume.volume:.3g} ml"
    for name, each in orthosis.restriction.items():
        yield f"{each.kind} {name}", f"{each.upstream} → {each.downstream}"


def _kind(described: Described, key: str) -> str:
    """Kind of a number's source."""
    origin = described.provenance.get(key)
    return "no source told" if origin is None else origin.kind


def _muscle(muscle: Muscle) -> list[tuple[str, str]]:
    return [
        ("law", muscle.law),
        ("braid", f"{100 * muscle.nominal_length:.2f} cm of {100 * muscle.total_length:.2f} cm"),
        ("locks at a contraction of", f"{muscle.braid.lock:.4f}"),
        *_by_length(muscle),
        *(BraidFacts.of(muscle).rows() if LAWS[muscle.law].braids else ()),
        ("covariance of the fit", _covariance(muscle)),
    ] + [(name, f"{origin.kind}: {origin.source}") for name, origin in muscle.provenance.items()]


def _by_length(muscle: Muscle) -> list[tuple[str, str]]:
    """Mass and force at the muscle's length; nothing where they do not follow from it."""
    if muscle.lengths is None:
        return []
    factor = muscle.lengths.factor(muscle.nominal_length)
    against = f"{factor:.4g} of that at {100.0 * muscle.lengths.reference:g} cm"
    rows = [("mass at this length", f"{1e3 * muscle.whole_mass:.4g} g"), ("force at this length", against)]
    return rows + ([("warning", muscle.length_warning)] if muscle.length_warning else [])


def _covariance(muscle: Muscle) -> str:
    """Standard errors, the strongest correlation, freedom; or why there is none."""
    told = muscle.covariance
    if told is None:
        return "none"
    names = [key.rpartition(".")[2] for key in told.parameters]
    errors = [
        f"{name} ± {amount(error, unit, 3)}"
        for name, error, unit in zip(names, told.standard_errors, told.units, strict=True)
    ]
    line = f"{', '.join(errors)} (standard errors)"
    pairs = [(told.correlation[i][j], names[j], names[i]) for i in range(len(names)) for j in range(i)]
    if pairs:
        strongest, first, second = max(pairs, key=lambda pair: abs(pair[0]))
        line += f"; strongest correlation {strongest:.3f}, {first} with {second}"
    line += f"; {told.freedom} degrees of freedom"
    return line + (f"; not in use: {muscle.without_draws}" if muscle.without_draws else "")


def _valve(valve: Valve) -> list[tuple[str, str]]:
    found = []
    for what, path in (("", valve), (" of the exhaust", valve.exhaust)):
        if path is None:
            continue
        told = path.provenance.get("conductance")
        how = f", {told.source}" if path.rating is not None and told is not None else ""
        found.append((f"sonic conductance{what}", f"{path.conductance * 1e8:.4g} dm³/(s·bar){how}"))
        flows = (
            f"{6e4 * nominal_flow(path.conductance, path.critical_ratio, 6e5, 5e5, density):.4g} l/min {norm}"
            for norm, density in DENSITIES.items()
        )
        found.append((f"flow from 6 to 5 bar gauge{what}", " or ".join(flows)))
    return found


def _tube(tube: Tube) -> list[tuple[str, str]]:
    return [
        (
            f"{length:g} m",
            f"C {1e8 * tube.conductance(length):.3g} dm³/(s·bar), b {tube.critical_ratio(length):.2f}, "
            f"{1e6 * tube.volume(length):.3g} ml, sound takes {1e3 * tube.delay(length):.2g} ms",
        )
        for length in (0.5, 1.0, 2.0)
    ]


def _source(source: Source) -> list[tuple[str, str]]:
    needed = 4e5  # gauge pressure of most shipped scenarios [Pa]
    found = [("gives until 4 bar are left", f"{source.free_litres(needed):.3g} l of free gas (ANR)")]
    if source.kind == "compressor":
        flow = 6e4 * source.delivery(needed) * source.real_gas.litres_per_gram
        found.append(("its compressor delivers at 4 bar", f"{flow:.3g} l/min (ANR)"))
    return [("gas", source.gas), ("full", f"{1e3 * source.full_mass:.3g} g"), *found]


def _regulator(regulator: Regulator) -> list[tuple[str, str]]:
    flow, low, high = 6e4 * regulator.rated_flow, *(1e-5 * p for p in regulator.set_range)
    return [
        ("set pressure", f"{low:g} to {high:g} bar"),
        ("droop", f"{1e-5 * regulator.droop:g} bar at {flow:.4g} l/min (ANR)"),
        ("sonic conductance", f"{1e8 * regulator.conductance:g} dm³/(s·bar)"),
    ]


def _patient(patient: Patient) -> list[tuple[str, str]]:
    sides = {
        "dorsiflexors": patient.dorsiflexor_strength,
        "plantarflexors": patient.plantarflexor_strength,
    }
    return [(f"strength of the {side}", f"{100 * share:g} %") for side, share in sides.items()]


def _shoe(shoe: Shoe) -> list[tuple[str, str]]:
    drop = shoe.heel_stack - shoe.ball_stack
    return [
        ("under heel and ball", f"{1e3 * shoe.heel_stack:g} mm and {1e3 * shoe.ball_stack:g} mm"),
        ("drop", f"{1e3 * drop:g} mm"),
        ("toe spring", f"{1e3 * shoe.toe_spring:g} mm"),
        ("stiffness added to the toes", f"{shoe.toe_stiffness:g} N·m/rad"),
        ("mass", f"{shoe.mass:g} kg"),
    ]


def _sensor(sensor: SensorType) -> list[tuple[str, str]]:
    found = [("for columns in", sensor.unit or "no unit")]
    if sensor.calibration is not None:
        line, sign = sensor.line, "/" if sensor.line.inverse else "×"
        found.append(("output", f"{line.slope:g} {sign} quantity + {line.intercept:g} V"))
    return found


def _limits(limits: Limits) -> list[tuple[str, str]]:
    wanted, trips = (1e3 * height for height in limits.toe_clearance)
    return [
        ("toe clearance", f"{wanted:g} mm wanted, below {trips:g} mm the toe trips"),
        ("bottle", f"{1e3 * limits.bottle_volume:g} l at {1e-5 * limits.bottle_pressure:g} bar"),
        ("pressure on the skin", " and ".join(f"{1e-3 * p:g} kPa" for p in limits.skin_pressure)),
        ("life of a muscle", f"{limits.muscle_life:g} cycles"),
    ]


def _leg(leg: Leg) -> list[tuple[str, str]]:
    return _check_model(leg.file)


_FINDINGS: dict[type, Any] = {
    Scenario: _scenario,
    Orthosis: _orthosis,
    Muscle: _muscle,
    Valve: _valve,
    Tube: _tube,
    Source: _source,
    Regulator: _regulator,
    Leg: _leg,
    Patient: _patient,
    Shoe: _shoe,
    Limits: _limits,
    SensorType: _sensor,
}


def _check_model(path: pathlib.Path) -> list[tuple[str, str]]:
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compiler.fusestatic = False
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"MuJoCo cannot read it: {error}", file=path) from None
    findings = [("mass", f"{model.body_subtreemass[0]:.4g} kg")]
    for body in range(1, model.nbody):
        findings.append((f"body {model.body(body).name}", f"{model.body_mass[body]:.4g} kg"))
    for joint in range(model.njnt):
        kind = mujoco.mjtJoint(int(model.jnt_type[joint])).name.removeprefix("mjJNT_").lower()
        lower, upper = np.degrees(model.jnt_range[joint])
        span = f", {lower:g} to {upper:g} deg" if model.jnt_limited[joint] and kind == "hinge" else ""
        findings.append((f"joint {model.joint(joint).name}", kind + span))
    return findings + (_leg_in(path) if model.njnt else [])


def _leg_in(path: pathlib.Path) -> list[tuple[str, str]]:
    """The leg that `leg import` would cut out of a model, or both."""
    try:
        tree = read_tree(path)
    except InputError as error:
        return [("leg", f"cannot be cut out: {error.problem}")]
    try:
        return _found(tree, None, path)
    except InputError as error:
        if error.field != "side":
            return [("leg", _refused(error))]
    rows = []
    sides: tuple[Side, ...] = ("right", "left")
    for side in sides:
        try:
            rows += _found(tree, side, path)
        except InputError as error:
            rows.append((f"{side} leg", _refused(error)))
    return rows


def _refused(error: InputError) -> str:
    allowed = f"; allowed: {error.allowed}" if error.allowed else ""
    return f"none can be cut out: {error.problem}{allowed}"


def _found(tree: Tree, side: Side | None, path: pathlib.Path) -> list[tuple[str, str]]:
    """What the import would find and note; InputError where it would refuse."""
    leg = find(tree, side=side)
    alone = cut(tree, leg)
    axis = "" if leg.sign > 0.0 else ", its axis to be turned round"
    sole = "" if leg.sole is None else f", sole {np.degrees(leg.sole):+.0f} deg at zero"
    parts = f"shank {leg.shank}, foot {leg.foot}, ankle {leg.ankle}"
    return [
        (f"{leg.side} leg", f"{parts}: tilt {np.degrees(leg.tilt):.0f} deg{axis}{sole}"),
        *(
            (f"note on the {leg.side} leg", note)
            for note in (*leg.notes, *doubtful_notes(alone, LegNumbers.of(alone)))
        ),
        ("cut it out with", f"afo-sim leg import {shlex.quote(str(path))} --side {leg.side}"),
    ]


def _check_urdf(path: pathlib.Path) -> list[tuple[str, str]]:
    """As `leg import` reads it: MuJoCo's own importer knows no packages and no links without mass."""
    tree = read_tree(path)
    findings = [("mass", f"{sum(part.mass for part in tree.parts.values()):.4g} kg")]
    findings += [(f"link {part.name}", f"{part.mass:.4g} kg") for part in tree.parts.values() if part.mass]
    for name, (_, joint) in tree.joints().items():
        span = ""
        if joint.range is not None and joint.kind == "hinge":
            lower, upper = np.degrees(joint.range)
            span = f", {lower:g} to {upper:g} deg"
        findings.append((f"joint {name}", joint.kind + span))
    findings += [("note", note) for note in tree.notes]
    return findings + (_leg_in(path) if tree.joints() else [])

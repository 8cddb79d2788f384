"""Doctor for a user's files: what is it, is it right, what would it do."""

import pathlib
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from afo_sim.common import assets
from afo_sim.common.errors import InputError
from afo_sim.description.leaves import fields_of
from afo_sim.description.limits import Limits
from afo_sim.description.muscle import Muscle
from afo_sim.description.orthosis import Orthosis, Valve
from afo_sim.description.quantity import Described, amount
from afo_sim.description.reader import SPECS, load
from afo_sim.description.scenario import Leg, Scenario
from afo_sim.description.shoe import Shoe
from afo_sim.description.walking import Patient
from afo_sim.description.words import reference
from afo_sim.gait import file as gait
from afo_sim.gait import norm as gait_norm
from afo_sim.gait.checks import findings
from afo_sim.model.build import build
from afo_sim.model.mounting import muscle_names, own_contraction, sweep_ankle
from afo_sim.simulation.checks_file import read_checks
from afo_sim.simulation.reference import reference_of

SKIN = {"shank": "cuff", "foot": "plate's strap"}


def check_file(path: pathlib.Path) -> list[tuple[str, str]]:
    """Examine a TOML description or the folder that holds one, an MJCF, a URDF or a gait cycle.

    Returns
    -------
    list of (what, finding)

    Raises
    ------
    InputError
        The first thing that is wrong.
    """
    if path.is_dir():
        path = _described_in(path)
    if not path.is_file():
        raise InputError("there is no such file", file=path)
    suffix = path.suffix.lower()
    if suffix == ".toml":
        return _check_toml(path)
    if suffix in (".xml", ".mjcf", ".urdf"):
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
        # neither runs alone: put it into the shipped scenario
        sets = {"orthosis": str(path.resolve())} if kind == "orthosis" else {"leg": str(path.resolve())}
        if isinstance(description, Orthosis):
            sets |= _timer_for(description)
        findings += _scenario(load("scenario", "seated", sets))
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
            "(conductance), leg (file), patient (dorsiflexor_strength), shoe (heel_stack), limits "
            "(toe_clearance), a list of checks ([[check]]), a sweep (scenario, [parameters.NAME]), a search "
            "(with [objective]) or what is not known ([parameters.NAME] without a scenario)",
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


def _timer_for(orthosis: Orthosis) -> dict[str, Any]:
    return {"timer": {"period": "8 s"} | {n: {"inlet": [["0 s", "4 s"]]} for n in orthosis.chamber}}


def _scenario(scenario: Scenario) -> list[tuple[str, str]]:
    built = build(scenario)
    lower, upper = scenario.orthosis.range_of_motion
    contraction, arm, inertia = sweep_ankle(built.model, built.index, np.linspace(lower, upper, 41))
    findings = [
        ("foot, plate and muscles about the ankle", f"{inertia[0]:.4f} kg·m²"),
        ("air stability number", f"{built.stability['air']:.3g} (limit 1)"),
    ]
    groups = muscle_names(scenario.orthosis)
    for column, name in enumerate(built.index.muscles):
        k, r = contraction[:, column], arm[:, column]
        own = own_contraction(groups[name], scenario.orthosis, float(k.min()))
        findings.append(
            (
                name,
                f"contraction of its path {k.min():.3f} to {k.max():.3f} over {np.degrees(lower):g} to "
                f"{np.degrees(upper):g} deg, its own without air at least "
                f"{own:.3f}, moment arm {100 * r.min():.1f} to {100 * r.max():.1f} cm",
            )
        )
    if scenario.reference is not None:
        reference_of(scenario)
        findings.append(("compared with", reference(scenario.resolved())))
    return findings + [("warning", warning) for warning in built.warnings]


def _orthosis(orthosis: Orthosis) -> list[tuple[str, str]]:
    return [
        ("muscles", ", ".join(f"{g.count} × {n} ({g.type.name})" for n, g in orthosis.muscle.items())),
        ("chambers", ", ".join(orthosis.chamber)),
        *(
            (
                f"skin under the {SKIN[segment]}",
                f"{1e4 * lies.area:g} cm² ({_kind(lies, 'area')}), "
                f"friction {lies.friction:g} ({_kind(lies, 'friction')})",
            )
            for segment, lies in orthosis.interface.items()
        ),
    ]


def _kind(described: Described, key: str) -> str:
    """Kind of a number's source."""
    origin = described.provenance.get(key)
    return "no source told" if origin is None else origin.kind


def _muscle(muscle: Muscle) -> list[tuple[str, str]]:
    return [
        ("law", muscle.law),
        ("braid", f"{100 * muscle.nominal_length:.2f} cm of {100 * muscle.total_length:.2f} cm"),
        ("locks at a contraction of", f"{muscle.braid.lock:.4f}"),
        ("covariance of the fit", _covariance(muscle)),
    ] + [(name, f"{origin.kind}: {origin.source}") for name, origin in muscle.provenance.items()]


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
    return [("sonic conductance", f"{valve.conductance * 1e8:g} dm³/(s·bar)")]


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
    Leg: _leg,
    Patient: _patient,
    Shoe: _shoe,
    Limits: _limits,
}


def _check_model(path: pathlib.Path) -> list[tuple[str, str]]:
    if path.suffix.lower() == ".urdf":
        _check_urdf(path)
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
    return findings


def _check_urdf(path: pathlib.Path) -> None:
    import yourdfpy

    try:
        urdf = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=False)
    except Exception as error:  # yourdfpy passes its XML parser's errors on
        raise InputError(f"is not a valid URDF: {error}", file=path) from None
    if not urdf.validate():
        raise InputError(f"is not a valid URDF: {urdf.errors[0]}", file=path)

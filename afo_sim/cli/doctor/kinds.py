"""What a user's file is, and which module checks it; the module is imported when such a file comes."""

import importlib
import pathlib
from collections.abc import Iterator

from afo_sim.common import InputError, JsonMapping, assets, nearest_name, refuse

Findings = list[tuple[str, str]]
# {suffix of a file: "module:function" of this package that takes its path}
_OF_SUFFIX = {
    ".toml": "kinds:check_toml",
    ".urdf": "bodies:body",
    ".xml": "bodies:body",
    ".mjcf": "bodies:body",
    ".csv": "kinds:check_gait",
}
# {kind of description: module whose function of that name takes what the reader makes of it}; others: parts
_OF_DESCRIPTION = {"scenario": "scenarios", "orthosis": "scenarios", "leg": "bodies"}


def check_file(path: pathlib.Path) -> Findings:
    """Examine a description, its folder, an MJCF, a URDF, a gait cycle, or a shipped orthosis or scenario."""
    for kind in ("orthosis", "scenario"):
        if not path.exists() and str(path) in assets.names(kind):
            path = assets.find(kind, str(path))
    if path.is_dir():
        names = [f"{kind}.toml" for kind in assets.KINDS if kind not in assets.FLAT]
        there = [path / name for name in names if (path / name).is_file()]
        if len(there) != 1:
            problem = f"the folder holds {'several descriptions' if there else 'no description'}"
            allowed = f"a file, or a folder with one of {', '.join(names)}"
            raise InputError(problem, file=path, allowed=allowed)
        path = there[0]
    if not path.is_file():
        raise InputError("there is no such file", file=path)
    check = _OF_SUFFIX.get(path.suffix.lower())
    if check is None:
        allowed = ".toml, .xml, .mjcf, .urdf, .csv"
        raise InputError("is not a kind of file that can be checked", file=path, allowed=allowed)
    return _checked(check, path)


def _checked(check: str, given: object) -> Findings:
    module, _, function = check.partition(":")
    return getattr(importlib.import_module(f"{__package__}.{module}"), function)(given)


def check_gait(path: pathlib.Path) -> Findings:
    """Findings of a gait cycle's CSV, or a norm's."""
    from afo_sim.common import read_header
    from afo_sim.gait import file, findings, norm

    if read_header(path).get("kind") == "norm":
        return [("kind", "gait norm"), ("rows", str(len(norm.read(path).phase)))]
    return [("kind", "gait cycle"), *findings(file.read(path))]


def check_toml(path: pathlib.Path) -> Findings:
    """Findings of a TOML file of any kind."""
    table = assets.read_toml(path)
    if "check" in table:
        from afo_sim.simulation import read_checks

        return [("kind", "checks"), ("checks", str(len(read_checks(path))))]
    if "objective" in table:
        return search(path)
    if "parameters" in table or table.get("design") == "uncertainty":
        # tables [parameters.NAME] alone say what is not known; with a scenario they are a sweep's
        return sweep(path) if table.keys() & {"scenario", "design"} else spreads(path)
    return _check_description(path, _kind_of(path, table))


def _check_description(path: pathlib.Path, kind: str) -> Findings:
    from afo_sim.description import load

    check = f"{_OF_DESCRIPTION.get(kind, 'parts')}:{kind}"
    try:
        found, problems = load(kind, str(path)), []
    except InputError as error:
        problems = [error, *error.others]
    refuse([*problems, *_lacking(path, kind)])
    findings = [("kind", kind), *_checked(check, found)]
    if kind in ("orthosis", "leg"):
        # neither runs alone: put it into a shipped scenario
        from afo_sim.model import scenario_of

        own = {"leg": str(path.resolve())}
        whole = scenario_of(path) if kind == "orthosis" else load("scenario", "seated", own)
        findings += _checked("scenarios:scenario", whole)
    return findings


def _lacking(path: pathlib.Path, kind: str) -> Iterator[InputError]:
    from afo_sim.description.tree import FILES

    table = assets.read_toml(path)
    for key in FILES.get(kind, ()):
        name = table.get(key)
        if isinstance(name, str) and not pathlib.Path(path.parent / assets.file_beside(name, path)).is_file():
            there = [each.name for each in path.parent.iterdir() if each.suffix in _OF_SUFFIX]
            near = nearest_name(name, there)
            yield InputError("there is no such file", file=path, field=key, value=name, nearest=near)


def _kind_of(path: pathlib.Path, table: JsonMapping) -> str:
    """The kind of description that has most of a file's keys; of several, the file's namesake."""
    from afo_sim.description import fields_of
    from afo_sim.description.schema import SPECS

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


def sweep(path: pathlib.Path) -> Findings:
    """Cases and parameters of a sweep."""
    from afo_sim.study import cases_of
    from afo_sim.study.sweep_plan import read

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


def search(path: pathlib.Path) -> Findings:
    """Patients, objective, limits and parameters of a search."""
    from afo_sim.study.search.plan import read

    plan = read(path)
    patients = plan.judging()
    findings = [
        ("kind", "search"),
        ("scenario", plan.designs.scenario_name),
        ("patients", str(len(patients)) if patients else "the scenario's own"),
        ("objective", f"{plan.objective.goal} {plan.objective.metric}"),
    ]
    findings += [("limit", f"{limit.metric} {limit.option} {limit.bound}") for limit in plan.limits]
    return findings + [(parameter.name, ", ".join(parameter.keys)) for parameter in plan.designs.parameters]


def spreads(path: pathlib.Path) -> Findings:
    """What is not known, and how far."""
    from afo_sim.study import in_words
    from afo_sim.study.uncertainty.spreads import read

    return [("kind", "uncertainty"), *in_words(read(path))]

"""Findings on studies: a sweep, a search, what is not known."""

import pathlib

from afo_sim.cli.doctor.kinds import Findings


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

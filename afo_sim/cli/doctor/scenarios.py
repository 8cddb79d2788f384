"""Findings on what runs: a scenario, an orthosis on its air path."""

from collections.abc import Iterator

import numpy as np

from afo_sim.cli.doctor.kinds import Findings
from afo_sim.description import JOINTS, WORN, Described, Orthosis, Scenario
from afo_sim.description.scenario_text import reference
from afo_sim.model import design_of, slack_everywhere, sweep_ankle, time_step_limits
from afo_sim.model import rows as path_rows
from afo_sim.model.build import build
from afo_sim.simulation import described_policy, reference_of

_SKIN = {"cuff": "cuff", "plate": "plate's strap"}


def scenario(scenario: Scenario) -> Findings:
    """Stability, design, controller and warnings of a scenario that could run."""
    built, words = build(scenario), JOINTS[scenario.leg.joint]
    _, _, inertia = sweep_ankle(built.model, built.index, np.zeros(1))
    findings = [
        (f"{words.below}, plate and muscles about the {scenario.leg.joint}", f"{inertia[0]:.4f} kg·m²"),
        (
            "air number, rate × time step",
            f"{built.stability['air']:.3g} (accurate to {time_step_limits.AIR_ACCURATE:g})",
        ),
    ]
    warnings = list(built.warnings)
    if built.index.muscles:
        design = design_of(built)
        findings += [row for entry in design.facts for row in path_rows(entry)]
        slack = [notice for entry in design.facts if (notice := slack_everywhere(entry)) is not None]
        warnings = list(dict.fromkeys([*design.warnings, *slack, *warnings]))
    if scenario.controller is not None:
        described_policy(built)  # refuses a rate or columns that do not fit
        rate = f"{scenario.controller.rate:g} commands a second"
        findings.append(("controller", f"{scenario.controller.kind}, {rate}"))
    if scenario.reference is not None:
        reference_of(scenario)
        findings.append(("compared with", reference(scenario.resolved())))
    return findings + [("warning", warning) for warning in warnings]


def orthosis(orthosis: Orthosis) -> Findings:
    """Muscles, chambers, air path and skin of an orthosis."""
    return [
        ("muscles", ", ".join(f"{g.count} × {n} ({g.type.name})" for n, g in orthosis.muscle.items())),
        ("chambers", ", ".join(orthosis.chamber)),
        *_air_path(orthosis),
        *(
            (
                f"skin under the {_SKIN[WORN[segment]]}",
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
    origin = described.provenance.get(key)
    return "no source stated" if origin is None else origin.kind

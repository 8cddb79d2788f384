"""A sizing as a table that a terminal of 80 columns holds, and what stands below it."""

import math
import re
from collections.abc import Iterator, Sequence

from afo_sim.metrics.metric_words import UNITS, words
from afo_sim.study.sizing.candidate import Tried
from afo_sim.study.sizing.requirement import Requirement, as_number

Table = tuple[str, list[str], list[list[str]]]  # title, header, rows
ASSUMED = " (assumed)"  # behind a fact
DOUBT = re.compile(r" \((assumed|not measured[^)]*)\)$")  # for which * stands in the table


def table_of(
    kind: str, requirements: Sequence[Requirement], air: str, tried: Sequence[Tried], best: Tried | None
) -> Table:
    """The margin of each candidate that was run to each limit, its air, and which limits it fails."""
    ran = [each for each in tried if each.status == "run"]
    facts = list(dict.fromkeys(name for each in ran for name in each.candidate.facts))
    limits = [_joined(f"{k}", UNITS.get(r.unit, r.unit)) for k, r in enumerate(requirements, 1)]
    header = [kind, *facts, *limits, f"air [{words(air).unit}]", "meets all"]
    rows = []
    for each in ran:
        cells = [DOUBT.sub(" *", each.candidate.facts.get(name, "")) for name in facts]
        cells += [_margin(each, requirement) for requirement in requirements]
        value = each.values.get(air, math.nan)
        cells.append("–" if math.isnan(value) else f"{value:.3f}")
        mark = "▶" if best is not None and each.name == best.name else " "
        rows.append([f"{mark} {each.name}", *cells, _verdict(each, requirements)])
    return f"{kind}: margins to the limits", header, rows


def legend(requirements: Sequence[Requirement]) -> list[str]:
    """What each number stands for."""
    return [f"{k}: {each.label} {each.wanted}" for k, each in enumerate(requirements, 1)]


def remarks_of(tried: Sequence[Tried]) -> Iterator[str]:
    """What was not run, and notes on what was; those that are alike in one line."""
    grouped: dict[str, list[str]] = {}
    for each in tried:
        if each.status != "run":
            grouped.setdefault(f"not run, {each.status}: {each.reason}", []).append(each.name)
        for note in each.notes:
            grouped.setdefault(note, []).append(each.name)
    for text, names in grouped.items():
        yield f"{', '.join(names)}: {text}"


def _margin(each: Tried, requirement: Requirement) -> str:
    margin = each.margin(requirement)
    if not math.isfinite(margin):
        return "–" if math.isnan(margin) else "endless"
    if requirement.unit == "h":
        return f"{margin:+.2f}".replace("-", "−")
    return as_number(margin, requirement.unit)


def _joined(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _verdict(each: Tried, requirements: Sequence[Requirement]) -> str:
    if each.meets:
        return "yes"
    labels = {requirement.label: f"{k}" for k, requirement in enumerate(requirements, 1)}
    return f"no: {', '.join(labels.get(name, name) for name in each.short)}"

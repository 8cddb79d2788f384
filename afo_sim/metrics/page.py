"""The table of metrics for docs/metrics.md, from the registry."""

from collections.abc import Iterator

from afo_sim.metrics.metric import GROUPS, RENAMED, MetricEntry
from afo_sim.metrics.words import METRICS, UNITS

BEGIN, END = "<!-- metrics: begin -->\n", "<!-- metrics: end -->"
OWN = "this project"
SCHULZ = "Schulz 2011"
PERRY = "phases: Perry & Burnfield 2010"
BAKER = "Baker et al. 2009"
STRIKE = "bounds: Altman & Davis 2012"
# Of the metrics whose definition was taken from elsewhere, by the beginning of their name.
SOURCES = {
    "toe_clearance": SCHULZ,
    "lowest_toe_clearance": SCHULZ,
    "ball_clearance": f"as {SCHULZ}",
    "lowest_ball_clearance": f"as {SCHULZ}",
    "swings_without_": SCHULZ,
    "contacts_with_": STRIKE,
    "gvs_": BAKER,
    "needed_swing_torque": PERRY,
    "needed_terminal_swing_torque": PERRY,
    "orthosis_swing_torque": PERRY,
    "free_air_": "ISO 8778",
    "normal_litres_": "DIN 1343",
}
# Of the metrics that kept their name and changed their meaning, what they were before.
BEFORE = {
    "toe_clearance": "minimum between two peaks of a rigid toe",
    "ball_clearance": "minimum between two peaks",
    "swings_with_toe_contact": "clearance below zero",
    "swings_with_ball_contact": "clearance below zero",
    "needed_swing_torque": "to heel strike, with the tight calf",
    "needed_swing_torque_10ms": "to heel strike, with the tight calf",
    "free_air_per_stride": "called normal litres",
}


def markdown() -> str:
    """The registered metrics, one table for each group."""
    return "\n".join(_lines())


def _lines() -> Iterator[str]:
    for group in GROUPS:
        rows = sorted((row for row in METRICS.values() if row.group == group), key=lambda row: row.name)
        if not rows:
            continue
        yield f"### {group}\n"
        yield "| metric | unit | what it is | source | before |"
        yield "|---|---|---|---|---|"
        for row in rows:
            name = row.name.replace("{}", "…")
            cells = f"`{name}`", _unit(row), _told(row), _source(row.name), _before(row.name)
            yield f"| {' | '.join(cells)} |"
        yield ""


def _unit(row: MetricEntry) -> str:
    return UNITS.get(row.unit, row.unit) or "–"


def _told(row: MetricEntry) -> str:
    """Label and meaning as one sentence."""
    label = row.label.replace("{}", "…")
    return f"{label}: {row.meaning}." if row.meaning else f"{label}."


def _source(name: str) -> str:
    found = [source for start, source in SOURCES.items() if name.startswith(start)]
    return found[0] if found else OWN


def _before(name: str) -> str:
    """Names and meanings that a metric had."""
    names = [f"`{old}`" for old, (new, _) in RENAMED.items() if new == name]
    return "; ".join([*names, *filter(None, [BEFORE.get(name)])])

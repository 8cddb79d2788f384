"""Metrics that need the scenario's description beside the rows: what is held against a limit of its own."""

from collections.abc import Collection, Mapping

import numpy as np

from afo_sim.metrics.metric import TOLD, Metric, measured
from afo_sim.metrics.supply import efficiency_metrics, sag_metrics
from afo_sim.model.build import Built
from afo_sim.simulation import bottle, safety, valve_life

# {metric: metrics of a stride that it is computed from}
SAGS: dict[str, frozenset[str]] = {row.name: frozenset() for row in TOLD[sag_metrics]}
EFFICIENCIES = {
    "exergy_efficiency": frozenset({"exergy_taken"}),  # and the energy balance
    "exergy_efficiency_positive": frozenset({"exergy_taken", "positive_work"}),
}
NEEDED: dict[str, frozenset[str]] = bottle.NEEDED | safety.NEEDED | valve_life.NEEDED | SAGS | EFFICIENCIES
NAMES = frozenset(NEEDED)


def held_metrics(
    built: Built,
    columns: Mapping[str, np.ndarray],
    totals: Mapping[str, Metric],
    wanted: Collection[str] | None,
    *,
    solved: bool = False,
) -> dict[str, Metric]:
    """Air by the bottle, the supply's sag, efficiency, safety margins and the valves' life."""
    names = NAMES if wanted is None else NAMES & frozenset(wanted)
    if not names:
        return {}
    margins = safety.safety_metrics(built, columns, solved=solved, wanted=wanted)
    air = bottle.bottle_metrics(built, totals, columns, solved=solved)
    found = air | margins | valve_life.life_metrics(built, columns)
    supply = built.scenario.supply
    fed = supply.source is not None or supply.regulator is not None  # else it never sags
    told = dict(sag_metrics(columns) if fed else ()) | dict(efficiency_metrics(totals))
    found |= {name: measured(name, value) for name, value in told.items()}
    return {name: metric for name, metric in found.items() if name in names}

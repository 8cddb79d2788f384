"""Metrics that need the scenario's description beside the rows: what is held against a limit of its own."""

from collections.abc import Collection, Mapping

import numpy as np

from afo_sim.metrics.metric import Metric
from afo_sim.model.build import Built
from afo_sim.simulation import bottle, safety, valve_life

# {metric: metrics of a stride that it is computed from}
NEEDED: dict[str, frozenset[str]] = bottle.NEEDED | safety.NEEDED | valve_life.NEEDED
NAMES = frozenset(NEEDED)


def held_metrics(
    built: Built,
    columns: Mapping[str, np.ndarray],
    totals: Mapping[str, Metric],
    wanted: Collection[str] | None,
    *,
    solved: bool = False,
) -> dict[str, Metric]:
    """Air by the bottle, safety margins and the valves' life.

    Parameters
    ----------
    built : compiled scenario
    columns : of every step
    totals : metrics of the walk or test
    wanted : names; None for all
    solved : the last whole stride is the settled one, and counts alone
    """
    names = NAMES if wanted is None else NAMES & frozenset(wanted)
    if not names:
        return {}
    margins = safety.safety_metrics(built, columns, solved=solved, wanted=wanted)
    found = bottle.bottle_metrics(built, totals) | margins | valve_life.life_metrics(built, columns)
    return {name: metric for name, metric in found.items() if name in names}

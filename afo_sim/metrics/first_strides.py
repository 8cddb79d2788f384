"""The first strides after a stop, which the wearer walks before the muscles hold the air of later ones.

Strides are counted from the start of the walk: whole ones, from heel strike to heel strike.
"""

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from afo_sim.common import Notice
from afo_sim.metrics.metric import REPORTED, START, Metric, Of, all_measured, made_of, reported
from afo_sim.metrics.strides import strides
from afo_sim.metrics.walking import stride_metric

STRIDES = 10  # from a stop on, over which the lowest clearance is looked for
NEAR = 0.5  # between the last stride and the settled one, from which on those between need no walking [mm]
LEAST, SWING = 3, 0.5  # strides that show how they near the settled one, by the later half of their rows
CLOSE, SAME = math.radians(0.5), math.radians(0.005)  # of the ankle to the settled one's [rad]
ALIKE = 0.02  # two shares in a row that differ by no more are one
CLEARANCE, AIR = "toe_clearance", "air_per_stride"
NUMBERED = "toe_clearance_stride_{}"
LOWEST, UNTIL = "lowest_toe_clearance_first_ten", "strides_until_clear"
AIR_FIRST, AIR_BEFORE = "air_first_stride", "air_before_first_step"
TEN = (
    "of the first ten after a stop; those near the settled one are estimated from the three before them; of "
    "fewer where the last is within 0.5 mm of the settled one, which also counts"
)
CLEAR = (
    "strides from a stop until the toe clears the floor and stays clear in the ten, and in the settled one "
    "where it is solved for; 0: from the first on"
)
NEEDED = {NUMBERED.format(1): 1, NUMBERED.format(2): 2, NUMBERED.format(3): 3, AIR_FIRST: 1, AIR_BEFORE: 1}
NEEDED |= {LOWEST: STRIDES, UNTIL: STRIDES}  # strides from the start


@reported(
    START,
    (NUMBERED.format(1), "mm", "Toe clearance, first stride", "from a stop"),
    (NUMBERED.format(2), "mm", "Toe clearance, second stride", "from a stop"),
    (NUMBERED.format(3), "mm", "Toe clearance, third stride", "from a stop"),
    (LOWEST, "mm", "Toe clearance, lowest of the first ten", TEN),
    (UNTIL, "", "Strides until the toe is clear", CLEAR),
    of=Of.BESIDE,
    made_of=(CLEARANCE,),
)
@reported(
    START, (AIR_FIRST, "g", "Air of the first stride", "taken from the supply"), of=Of.BESIDE, made_of=(AIR,)
)
@reported(
    START,
    (AIR_BEFORE, "g", "Air before the first step", "filled while standing, beyond ambient air"),
    of=Of.BESIDE,
)
def first_stride_metrics(
    begun: Sequence[Mapping[str, float]],
    settled: Mapping[str, Metric] | None = None,
    air_before: float | None = None,
    wanted: Collection[str] | None = None,
    share: float | None = None,
) -> tuple[dict[str, Metric], tuple[Notice, ...]]:
    """Metrics of the strides after a stop."""
    asked = frozenset(NEEDED) if wanted is None else frozenset(wanted)
    values = {} if air_before is None else {AIR_BEFORE: 1e3 * air_before}
    heights = [float(stride.get(CLEARANCE, math.nan)) for stride in begun[:STRIDES]]
    end = float(settled.get(CLEARANCE, math.nan)) if settled is not None else None
    values |= {NUMBERED.format(k): height for k, height in enumerate(heights[:3], 1)}
    if share is not None and heights and end is not None:
        way = heights[-1] - end
        heights += [end + way * share**k for k in range(1, STRIDES - len(heights) + 1)]
    warnings: list[Notice] = []
    if begun:
        values[AIR_FIRST] = float(begun[0].get(AIR, math.nan))
    if len(heights) == STRIDES or (heights and end is not None and abs(heights[-1] - end) <= NEAR):
        among = heights if len(heights) == STRIDES or end is None else [*heights, end]
        values[LOWEST] = float(np.min(among))  # NaN where any is
        values[UNTIL], why = _until_clear(heights, end)
        if why and UNTIL in asked:
            warnings.append(_left_out(UNTIL, why))
    elif math.isfinite(values.get(AIR_FIRST, math.nan)):
        count = "one stride" if len(heights) == 1 else f"{len(heights)} strides"
        why = f"{count} from the start cannot tell, {STRIDES} would (a longer duration)"
        warnings += [_left_out(name, why) for name in (LOWEST, UNTIL) if name in asked]
    kept = {name: value for name, value in values.items() if name in asked and math.isfinite(value)}
    return all_measured(kept.items()), tuple(warnings)


def _left_out(name: str, why: str) -> Notice:
    return Notice("metric-left-out", "{subject} is left out: {why}", subject=name, why=why)


def from_start(
    columns: Mapping[str, np.ndarray], timestep: float, body_mass: float, wanted: Collection[str]
) -> list[dict[str, float]]:
    """Metrics of the first whole strides of a recording, each by itself, however many are walked."""
    whole = strides(columns, timestep, body_mass)[: strides_needed(wanted)]
    return [{name: stride_metric(stride, name) for name in made_of(wanted)} for stride in whole]


def share_left(angles: np.ndarray, settled: np.ndarray) -> float | None:
    """Share of the way to the settled stride that each further stride leaves; None until three show it."""
    if len(angles) < LEAST:
        return None
    first, second, last = angles[-LEAST:] - settled
    far = np.abs(last).max()
    if far <= SAME:
        return 0.0
    before = (second * first).sum() / max((first * first).sum(), 1e-30)
    share = (last * second).sum() / max((second * second).sum(), 1e-30)
    return float(share) if far <= CLOSE and abs(share - before) <= ALIKE and 0.0 <= share <= 1.0 else None


def strides_needed(wanted: Collection[str] | None) -> int:
    """Strides from the start that some metrics need, by their names; None for all of them."""
    names = NEEDED if wanted is None else wanted
    return max((NEEDED.get(name, 0) for name in names), default=0)


def undefined(wanted: Collection[str] | None, has_air: bool, is_filled: bool) -> dict[str, Metric]:
    """The wanted metrics as NaN, of walking with or without chambers and air before the first step."""
    without = (set() if has_air else {AIR_FIRST}) | (set() if is_filled else {AIR_BEFORE})
    names = [n for n in NEEDED if (wanted is None or n in wanted) and n not in without]
    return all_measured((name, math.nan) for name in names)


def _until_clear(heights: Sequence[float], end: float | None) -> tuple[float, str]:
    """Strides until the toe is clear and stays so, or NaN and the reason."""
    if np.isnan(heights).any() or (end is not None and math.isnan(end)):
        return math.nan, "a stride has no toe clearance"
    below = [number for number, height in enumerate(heights, 1) if height < 0.0]
    if end is not None and end < 0.0:
        return math.nan, f"the toe is {-end:.1f} mm below the floor in the settled stride"
    if below and below[-1] == STRIDES:
        return math.nan, f"the toe is still below the floor in stride {STRIDES}"
    return float(below[-1] if below else 0), ""


NAMES = frozenset(row.name for row in REPORTED[first_stride_metrics])

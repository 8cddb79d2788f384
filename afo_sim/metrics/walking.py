"""Numbers that a clinician and a designer ask of a recording of walking, for each stride and over all.

The first stride begun, and those whose air is far from what it is later on, are the transient from the start:
they stand among the strides, but not in the totals (`strides.settled`).
A total is the mean over the strides, but for the `lowest_…` clearances. Swing is from toe-off to the next
heel strike (`Stride.toe_off`). Angles and torques are dorsiflexion positive; peaks and means of a torque
"each way" are positive numbers. A metric that is undefined is left out, and a warning says so. What a stride
reports stands in the modules of its subjects: clearance, push-off, torque, air, switching.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import STANDARD_DENSITY, Doubles, Function, Notice
from afo_sim.metrics.kernel import R, S, base, chambers, kernel
from afo_sim.metrics.metric import (
    ANKLE,
    CLEARANCE,
    TIME,
    Metric,
    Of,
    all_measured,
    functions_of,
    known,
    measured,
    reported,
    reporting,
)
from afo_sim.metrics.peak import greatest
from afo_sim.metrics.strides import LEVEL, Stride, at, below, edge, place, settled, strides
from afo_sim.metrics.window import place_of, places, row_at
from afo_sim.physics import register_jitable

UNSETTLED = 1.0  # change of the toe clearance from stride to stride [mm]
FEWEST = 10  # whole strides from which on the air is taken for known to settle or not
GVS_POINTS = 51  # of a stride, both heel strikes among them

COUNTED = "the solved one; where none was solved for, those after the start's transient"
CHANGE = "from the last but one counted stride to the last, where strides are walked and not solved for"
CHANGES = {"walked_clearance_change": "toe_clearance", "walked_air_change": "air_per_stride"}


@dataclass(frozen=True)
class WalkMetrics:
    """Of a run: metrics over the counted strides, metrics of each whole stride by its number, warnings."""

    totals: dict[str, Metric]
    strides: dict[int, dict[str, Metric]]
    warnings: tuple[Notice, ...]


@reported(
    TIME,
    ("strides_counted", "", "Strides counted", COUNTED),
    ("walked_clearance_change", "mm", "Change of the toe clearance", CHANGE),
    ("walked_air_change", "percent", "Change of the air per stride", CHANGE),
)
@reported(
    CLEARANCE,
    ("lowest_toe_clearance", "mm", "Toe clearance, lowest stride"),
    ("lowest_ball_clearance", "mm", "Ball clearance, lowest stride"),
)
def walk_metrics(
    columns: Mapping[str, np.ndarray], timestep: float, body_mass: float, *, transient: bool = True,
    solved: bool = False, wanted: frozenset[str] | None = None, free_density: float = STANDARD_DENSITY,
) -> WalkMetrics:  # fmt: skip
    """All metrics of a recording of walking."""
    whole = strides(columns, timestep, body_mass, free_density)
    counted = whole[-1:] if solved else settled(columns, whole)
    each_of = None if wanted is None else frozenset(map(_each, wanted)) - {"strides_counted"}
    functions = reporting(_functions(columns), each_of)
    every = {stride.number: stride.values(functions) for stride in (whole if transient else counted)}
    finite = {k: {n: v for n, v in found.items() if math.isfinite(v)} for k, found in every.items()}
    kept = None if each_of is None or None in map(known, each_of) else each_of
    each = {number: _measured(found, kept) for number, found in finite.items()}
    if not counted:
        text = "no whole stride follows the first, which is the start's transient: no gait metrics; a longer "
        return WalkMetrics({}, each, (Notice("no-stride-counts", f"{text}duration would give some"),))
    totals = {"strides_counted": measured("strides_counted", float(len(counted)))}
    warnings: list[Notice] = []
    numbers = [stride.number for stride in counted]
    found = [finite[number] for number in numbers]
    names = dict.fromkeys(name for stride in found for name in stride)
    means = found[0]
    if len(found) > 1:
        means = {name: float(np.mean([each[name] for each in found if name in each])) for name in names}
    totals |= each[numbers[0]] if len(numbers) == 1 else _measured(means, kept)
    for name in dict.fromkeys(n for k in numbers for n in every[k] if n not in finite[k]):
        text, lacking = "{subject} is undefined {extent}", sum(name not in stride for stride in found)
        extent = f"in {lacking} of {len(numbers)} strides" if name in means else "and left out"
        warnings.append(Notice("metric-undefined", text, subject=name, extent=extent))
    for name in ("toe_clearance", "ball_clearance"):
        if name in totals:
            lowest = min(each[s.number][name].value for s in counted if name in each[s.number])
            totals[f"lowest_{name}"] = measured(f"lowest_{name}", lowest)
    if not solved:
        changes, last = dict[str, float](), [finite[number] for number in numbers[-2:]]
        for name, of in CHANGES.items():
            pair = [stride[of] for stride in last if of in stride]
            if len(pair) == 2 and name == "walked_clearance_change":
                changes[name] = pair[1] - pair[0]
            elif len(pair) == 2 and pair[0] > 0.0:
                changes[name] = 100.0 * (pair[1] - pair[0]) / pair[0]
        totals |= all_measured(i for i in changes.items() if kept is None or CHANGES[i[0]] in kept)
        if chambers(columns) and len(whole) < FEWEST:
            text = "{strides} whole strides are too few to tell whether the orthosis' air has settled: walk "
            text += "at least {fewest} (a longer duration)"
            warnings.append(Notice("too-few-strides", text, strides=len(whole), fewest=FEWEST))
        warnings += _unsettled(counted, changes)
    for point in ("toe", "ball"):  # whose swings lack the minimum that the literature calls clearance
        share = means.get(f"swings_without_{point}_event", 0.0)
        if share > 0.0:
            text = "{point} clearance: {share:.0f} % of the swings have no minimum while the foot is fast; "
            text += "there it is the height at the ankle's greatest speed"
            subject = f"{point}_clearance"
            warnings.append(Notice("no-swing-minimum", text, subject=subject, point=point, share=share))
    return WalkMetrics(totals, each, tuple(warnings))


def _measured(found: Mapping[str, float], kept: Collection[str] | None) -> dict[str, Metric]:
    """Metrics, of all names or of those that are kept."""
    return all_measured(each for each in found.items() if kept is None or each[0] in kept)


def _unsettled(counted: list[Stride], changes: Mapping[str, float]) -> Iterator[Notice]:
    """Strides of equal duration that do not repeat: totals are means over a change."""
    change = changes.get("walked_clearance_change")
    if change is None or abs(counted[-1].duration - counted[-2].duration) > counted[-1].timestep:
        return
    if abs(change) > UNSETTLED:
        text = "the strides do not repeat: the last one's toe clearance is {change:+.1f} mm off the one's "
        text += "before (air still settling, or a timer that drifts); totals are means over them"
        yield Notice("strides-differ", text, change=float(change))


def _each(name: str) -> str:
    """The metric of each stride that a total is made of."""
    return CHANGES.get(name) or (name.removeprefix("lowest_") if name.endswith("_clearance") else name)


def stride_metric(stride: Stride, name: str) -> float:
    """One metric of a stride; NaN where it is undefined."""
    functions = reporting(_functions(stride.columns), frozenset([name]), strict=False)
    return stride.values(functions).get(name, math.nan)


def _functions(columns: Iterable[str]) -> tuple[Function, ...]:
    return functions_of(*((Of.STRIDE, Of.WORN) if has_orthosis(columns) else (Of.STRIDE,)))


def has_orthosis(columns: Iterable[str]) -> bool:
    """Whether the leg wears one."""
    return any(name.startswith("muscle/") for name in columns)


@reported(
    TIME,
    ("stride_time", "s", "Stride time", "heel strike to the same foot's next"),
    ("stance", "percent", "Stance", "heel strike to toe-off, of the stride"),
    of=Of.STRIDE,
)
@kernel(R.force)
def _timing(b: Doubles, out: Doubles) -> float:
    """Durations of the stride and of its stance."""
    out[0], out[1] = b[S.duration], 100.0 * b[S.toe_off]
    return 0.0


@reported(
    ANKLE,
    ("peak_swing_dorsiflexion", "deg", "Peak dorsiflexion in swing",
     "a shoe's drop counts as plantarflexion"),
    ("mid_swing_angle", "deg", "Ankle angle at mid-swing",
     "half-way from toe-off to heel strike; a shoe's drop counts"),
    ("ankle_range", "deg", "Ankle range", "highest minus lowest angle of the stride"),
    ("angle_error_recorded", "deg", "Deviation from the recorded walk (RMSE)", "over the whole stride"),
    ("angle_error_norm", "deg", "Deviation from the norm (RMSE)",
     "adults' published mean; zero is upright standing"),
    ("gvs_recorded", "deg", "Gait variable score against the recorded walk", "RMS over 51 points"),
    ("gvs_norm", "deg", "Gait variable score against the norm", "RMS over 51 points"),
    of=Of.STRIDE,
)  # fmt: skip
@kernel(R.force, *LEVEL, R.healthy_angle)
def _ankle(b: Doubles, out: Doubles) -> float:
    """Ankle angle of the stride, and its distance from the recorded walker and from the norm."""
    first, end, toe_off = int(b[S.first]), int(b[S.end]), b[S.toe_off]
    way, own, recorded = base(b, R.phase), base(b, R.angle), base(b, R.healthy_angle)
    if b[way + end - 1] >= toe_off:
        start, strike, most = edge(b, toe_off), edge(b, 1.0), -np.inf
        for k in range(places(start, strike)):
            most = max(most, row_at(b, own, int(b[S.count]), place_of(start, strike, k)))
        out[0], out[1] = math.degrees(most), math.degrees(at(b, R.angle, 0.5 * (1.0 + toe_off)))
    n = end - first
    range_ = greatest(b, own + first, n, 1.0) + greatest(b, own + first, n, -1.0)
    out[2] = math.degrees(range_)
    off_recorded = off_norm = score_recorded = score_norm = 0.0
    for k in range(first, end):
        off_recorded += (b[own + k] - b[recorded + k]) ** 2 / n
        off_norm += (b[own + k] - _norm(b, b[way + k])) ** 2 / n
    for k in range(GVS_POINTS):
        there = place(b, k / (GVS_POINTS - 1.0))
        here = row_at(b, own, int(b[S.count]), there)
        score_recorded += (here - row_at(b, recorded, int(b[S.count]), there)) ** 2 / GVS_POINTS
        score_norm += (here - _norm(b, k / (GVS_POINTS - 1.0))) ** 2 / GVS_POINTS
    out[3], out[4] = math.degrees(math.sqrt(off_recorded)), math.degrees(math.sqrt(off_norm))
    out[5], out[6] = math.degrees(math.sqrt(score_recorded)), math.degrees(math.sqrt(score_norm))
    return 0.0


@register_jitable
def _norm(b: Doubles, phase: float) -> float:
    """Ankle angle of the norm, of a foot that stands flat under an upright shank at `level` [rad]."""
    norm, turned = int(b[S.norm]) + 1, phase - 1.0 if phase >= 1.0 else max(phase, 0.0)
    count = int(b[norm - 1])
    k = below(b, norm, count, turned)
    share = (turned - b[norm + k]) / (b[norm + k + 1] - b[norm + k])
    return b[S.level] + row_at(b, norm + count, count, k + share)

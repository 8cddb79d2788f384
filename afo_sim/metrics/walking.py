"""Numbers that a clinician and a designer ask of a recording of walking, for each stride and over all.

The first stride begun, and those whose air is far from what it is later on, are the transient from the start:
they stand among the strides, but not in the totals (`strides.settled`).
A total is the mean over the strides, but for the `lowest_…` clearances. Swing is from toe-off to the next
heel strike (`Stride.toe_off`). Angles and torques are dorsiflexion positive; peaks and means of a torque
"each way" are positive numbers. A metric that is undefined is left out, and a warning says so. What a stride
reports stands in the modules of its subjects: clearance, push-off, torque, air, switching.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common import STANDARD_DENSITY, Notice
from afo_sim.gait import norm as gait_norm
from afo_sim.metrics.metric import (
    ANKLE,
    CLEARANCE,
    TIME,
    Found,
    Metric,
    Of,
    functions_of,
    measured,
    reported,
    reporting,
)
from afo_sim.metrics.strides import Stride, chambers, settled, strides

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
    columns: Mapping[str, np.ndarray],
    timestep: float,
    body_mass: float,
    *,
    transient: bool = True,
    solved: bool = False,
    wanted: frozenset[str] | None = None,
    free_density: float = STANDARD_DENSITY,
) -> WalkMetrics:
    """All metrics of a recording of walking."""
    whole = strides(columns, timestep, body_mass, free_density)
    counted = whole[-1:] if solved else settled(columns, whole)
    each_of = None if wanted is None else frozenset(map(_each, wanted)) - {"strides_counted"}
    all_of = {stride.number: stride_metrics(stride, each_of) for stride in (whole if transient else counted)}
    each = {
        number: {name: metric for name, metric in metrics.items() if math.isfinite(metric.value)}
        for number, metrics in all_of.items()
    }
    if not counted:
        missing = Notice(
            "no-stride-counts",
            "no whole stride follows the first, which is the start's transient: no gait metrics; a longer "
            "duration would give some",
        )
        return WalkMetrics({}, each, (missing,))
    totals = {"strides_counted": measured("strides_counted", float(len(counted)))}
    warnings: list[Notice] = []
    for name in dict.fromkeys(name for stride in counted for name in all_of[stride.number]):
        found = [each[stride.number][name] for stride in counted if name in each[stride.number]]
        if found:
            totals[name] = found[0] if len(found) == 1 else measured(name, float(np.mean(found)))
        if len(found) < len(counted):
            extent = f"in {len(counted) - len(found)} of {len(counted)} strides" if found else "and left out"
            warnings.append(
                Notice("metric-undefined", "{subject} is undefined {extent}", subject=name, extent=extent)
            )
    for name in ("toe_clearance", "ball_clearance"):
        if name in totals:
            lowest = min(each[s.number][name].value for s in counted if name in each[s.number])
            totals[f"lowest_{name}"] = measured(f"lowest_{name}", lowest)
    if not solved:
        totals |= _changes(counted, each)
        warnings += [*_too_few(columns, whole), *_unsettled(counted, totals)]
    warnings += _without_event(totals)
    return WalkMetrics(totals, each, tuple(warnings))


def _without_event(totals: dict[str, Metric]) -> Iterator[Notice]:
    """Warnings of swings without the minimum that the literature calls clearance."""
    for point in ("toe", "ball"):
        share = totals.get(f"swings_without_{point}_event")
        if share is not None and share.value > 0.0:
            yield Notice(
                "no-swing-minimum",
                "{point} clearance: {share:.0f} % of the swings have no minimum while the foot is fast; "
                "there it is the height at the ankle's greatest speed",
                subject=f"{point}_clearance",
                point=point,
                share=share.value,
            )


def _too_few(columns: Mapping[str, np.ndarray], whole: list[Stride]) -> Iterator[Notice]:
    """A run with air that ends before one can tell that it has settled."""
    if chambers(columns) and len(whole) < FEWEST:
        yield Notice(
            "too-few-strides",
            "{strides} whole strides are too few to tell whether the orthosis' air has settled: walk at "
            "least {fewest} (a longer duration)",
            strides=len(whole),
            fewest=FEWEST,
        )


def _changes(counted: list[Stride], each: dict[int, dict[str, Metric]]) -> dict[str, Metric]:
    """Change of clearance and air from the last but one counted stride to the last."""
    found = {}
    for name, of in CHANGES.items():
        pair = [each[stride.number].get(of) for stride in counted[-2:]]
        if len(pair) < 2 or pair[0] is None or pair[1] is None:
            continue
        change = pair[1].value - pair[0].value
        if name == "walked_clearance_change":
            found[name] = measured(name, change)
        elif pair[0].value > 0.0:
            found[name] = measured(name, 100.0 * change / pair[0].value)
    return found


def _unsettled(counted: list[Stride], totals: dict[str, Metric]) -> Iterator[Notice]:
    """Strides of equal duration that do not repeat: totals are means over a change."""
    change = totals.get("walked_clearance_change")
    if change is None or abs(counted[-1].duration - counted[-2].duration) > counted[-1].timestep:
        return
    if abs(change.value) > UNSETTLED:
        yield Notice(
            "strides-differ",
            "the strides do not repeat: the last one's toe clearance is {change:+.1f} mm off the one's "
            "before (air still settling, or a timer that drifts); totals are means over them",
            change=change.value,
        )


def _each(name: str) -> str:
    """The metric of each stride that a total is made of."""
    return CHANGES.get(name) or (name.removeprefix("lowest_") if name.endswith("_clearance") else name)


def stride_metrics(stride: Stride, wanted: frozenset[str] | None = None) -> dict[str, Metric]:
    """Metrics of one stride, by name; NaN where one is undefined."""
    functions = reporting(_functions(stride), wanted)
    return {name: measured(name, value) for function in functions for name, value in function(stride)}


def stride_metric(stride: Stride, name: str) -> float:
    """One metric of a stride, without those that come along; NaN where it is undefined."""
    functions = reporting(_functions(stride), frozenset([name]), strict=False)
    found = (value for function in functions for each, value in function(stride) if each == name)
    return next(found, math.nan)


def _functions(stride: Stride) -> tuple[Callable[..., Found], ...]:
    scopes = (Of.STRIDE, Of.WORN) if has_orthosis(stride.columns) else (Of.STRIDE,)
    return functions_of(*scopes)


def has_orthosis(columns: Mapping[str, np.ndarray]) -> bool:
    """Whether the leg wears one."""
    return any(name.startswith("muscle/") for name in columns)


@reported(
    TIME,
    ("stride_time", "s", "Stride time", "heel strike to the same foot's next"),
    ("stance", "percent", "Stance", "heel strike to toe-off, of the stride"),
    of=Of.STRIDE,
)
def _timing(stride: Stride) -> Found:
    """Durations of the stride and of its stance."""
    yield "stride_time", stride.duration
    yield "stance", 100.0 * stride.toe_off


@reported(
    ANKLE,
    (
        "peak_swing_dorsiflexion",
        "deg",
        "Peak dorsiflexion in swing",
        "a shoe's drop counts as plantarflexion",
    ),
    (
        "mid_swing_angle",
        "deg",
        "Ankle angle at mid-swing",
        "half-way from toe-off to heel strike; a shoe's drop counts",
    ),
    ("ankle_range", "deg", "Ankle range", "highest minus lowest angle of the stride"),
    ("angle_error_recorded", "deg", "Deviation from the recorded walk (RMSE)", "over the whole stride"),
    (
        "angle_error_norm",
        "deg",
        "Deviation from the norm (RMSE)",
        "adults' published mean; zero is upright standing",
    ),
    ("gvs_recorded", "deg", "Gait variable score against the recorded walk", "RMS over 51 points"),
    ("gvs_norm", "deg", "Gait variable score against the norm", "RMS over 51 points"),
    of=Of.STRIDE,
)
def _ankle(stride: Stride) -> Found:
    """Ankle angle of the stride, and its distance from the recorded walker and from the norm."""
    angle = np.degrees(stride["ankle/angle"])
    if stride.swing.any():
        part = stride.between(stride.toe_off, 1.0)
        yield "peak_swing_dorsiflexion", math.degrees(part.of(stride.columns["ankle/angle"]).max())
        middle = stride.at("ankle/angle", 0.5 * (1.0 + stride.toe_off))
        yield "mid_swing_angle", math.degrees(middle)
    yield "ankle_range", float(np.ptp(angle))
    points = np.linspace(0.0, 1.0, GVS_POINTS)
    norm = gait_norm.read()
    here = np.degrees(stride.at("ankle/angle", points))
    level = stride.level
    for name, rows, score in (
        ("recorded", stride["gait/ankle_angle"], stride.at("gait/ankle_angle", points)),
        ("norm", level + norm.at("ankle_angle", stride.phase), level + norm.at("ankle_angle", points)),
    ):
        yield f"angle_error_{name}", _rms(angle - np.degrees(rows))
        yield f"gvs_{name}", _rms(here - np.degrees(score))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))

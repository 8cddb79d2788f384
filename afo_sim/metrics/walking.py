"""Numbers that a clinician and a designer ask of a recording of walking, for each stride and over all.

The strides before the air has settled, and always the first begun, are the transient from the start: they
stand among the strides, but not in the totals (`strides.settled`).
A total is the mean over the strides, but for the `lowest_…` clearances. Swing is from toe-off to the next
heel strike (`Stride.toe_off`). Angles and torques are dorsiflexion positive; peaks and means of a torque
"each way" are told as positive numbers. What cannot be told is left out, and a warning says so.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common.units import STANDARD_DENSITY
from afo_sim.gait import norm as gait_norm
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.strides import Stride, settled, strides

ROUNDING = 1e-9  # of torques, powers and works
UNSETTLED = 1.0  # change of the toe clearance from stride to stride [mm]
FEWEST = 10  # whole strides from which on the air is taken for known to settle or not
RIPPLE = 1e-3  # depth from which a dip of the clearance is one [m]
MID_SWING = (0.25, 0.75)  # of the swing, where no dip is found [-]
HEEL_PITCH, FOREFOOT_PITCH = 8.0, -1.6  # of the sole at contact; beyond them heel, forefoot come first [deg]
LOADING = 0.12  # end of the loading response [-]
GVS_POINTS = 51  # of a stride, both heel strikes among them
ORTHOSIS = "ankle/moment/orthosis"
SIDES = {"dorsiflexion": 1.0, "plantarflexion": -1.0}  # sign of a torque that way

Found = Iterator[tuple[str, float, str]]  # name, value, unit


@dataclass(frozen=True)
class WalkMetrics:
    """Of a run: metrics over the settled strides, metrics of each whole stride by its number, warnings."""

    totals: dict[str, Metric]
    strides: dict[int, dict[str, Metric]]
    warnings: tuple[str, ...]


def walk_metrics(
    columns: Mapping[str, np.ndarray], timestep: float, body_mass: float, *, transient: bool = True
) -> WalkMetrics:
    """All metrics of a recording of walking.

    Parameters
    ----------
    columns : of a recording at the full step rate, SI
    timestep : [s]
    body_mass : of the patient [kg]
    transient : also of the strides that do not count

    Returns
    -------
    WalkMetrics; without a whole stride after the first there are no totals, but a warning
    """
    whole = strides(columns, timestep, body_mass)
    counted = settled(columns, whole)
    all_of = {stride.number: stride_metrics(stride) for stride in (whole if transient else counted)}
    each = {number: _finite(metrics) for number, metrics in all_of.items()}
    if not counted:
        told = "no whole stride follows the first, which is the start's transient: no gait metrics"
        return WalkMetrics({}, each, (f"{told}; a longer duration would give some",))
    totals = {"strides_counted": Metric(float(len(counted)), "")}
    warnings = []
    for name in dict.fromkeys(name for stride in counted for name in all_of[stride.number]):
        found = [each[stride.number][name] for stride in counted if name in each[stride.number]]
        if found:
            totals[name] = Metric(float(np.mean([metric.value for metric in found])), found[0].unit)
        if len(found) < len(counted):
            told = f"in {len(counted) - len(found)} of {len(counted)} strides" if found else "and left out"
            warnings.append(f"{name} is undefined {told}")
    for name in ("toe_clearance", "ball_clearance"):
        if name in totals:
            lowest = min(each[s.number][name].value for s in counted if name in each[s.number])
            totals[f"lowest_{name}"] = Metric(lowest, "mm")
    warnings += [*_too_few(columns, whole), *_unsettled(counted, each), *_without_dip(totals)]
    return WalkMetrics(totals, each, tuple(warnings))


def _finite(metrics: dict[str, Metric]) -> dict[str, Metric]:
    return {name: metric for name, metric in metrics.items() if math.isfinite(metric.value)}


def _without_dip(totals: dict[str, Metric]) -> Iterator[str]:
    """Where a clearance is not what the literature calls so."""
    for point in ("toe", "ball"):
        share = totals.get(f"swings_without_{point}_dip")
        if share and share.value > 0.0:
            yield (
                f"{point}_clearance: {share.value:.0f} % of the swings have no minimum between two peaks; "
                "there it is the lowest of the middle half of the swing"
            )


def _too_few(columns: Mapping[str, np.ndarray], whole: list[Stride]) -> Iterator[str]:
    """A run with air that ends before one can tell that it has settled."""
    if chambers(columns) and len(whole) < FEWEST:
        yield (
            f"{len(whole)} whole strides are too few to tell whether the orthosis' air has settled: walk at "
            f"least {FEWEST} (a longer duration)"
        )


def _unsettled(counted: list[Stride], each: dict[int, dict[str, Metric]]) -> Iterator[str]:
    """Strides of equal duration that do not repeat: totals are means over a change."""
    if len(counted) < 2 or abs(counted[-1].duration - counted[-2].duration) > counted[-1].timestep:
        return
    before, last = (each[stride.number].get("toe_clearance") for stride in counted[-2:])
    if before and last and abs(last.value - before.value) > UNSETTLED:
        yield (
            f"the strides do not repeat: the last one's toe clearance is {last.value - before.value:+.1f} mm "
            "off the one's before (air still settling, or a timer that drifts); totals are means over them"
        )


def stride_metrics(stride: Stride) -> dict[str, Metric]:
    """All metrics of one stride, by name; NaN where one is undefined.

    Parameters
    ----------
    stride : at the full step rate

    Returns
    -------
    dict of Metric, from `_timing`, `_clearance`, `_contact`, `_ankle`, `_need`, `_torque`, `_work` and `_air`
    """
    parts: list[Callable[[Stride], Found]] = [_timing, _clearance, _contact, _ankle, _need]
    if has_orthosis(stride.columns):
        parts += [_torque, _work, _air]
    return {name: Metric(value, unit) for part in parts for name, value, unit in part(stride)}


def has_orthosis(columns: Mapping[str, np.ndarray]) -> bool:
    """Whether the leg wears one."""
    return any(name.startswith("muscle/") for name in columns)


def chambers(columns: Mapping[str, np.ndarray]) -> list[str]:
    """Names of a recording's chambers."""
    return [name.split("/")[1] for name in columns if name.startswith("chamber/") and name.endswith("/mass")]


def _timing(stride: Stride) -> Found:
    """stride_time [s]; stance [percent]: heel strike to toe-off, of the stride."""
    yield "stride_time", stride.duration, "s"
    yield "stance", 100.0 * stride.toe_off, "percent"


def dip(height: np.ndarray) -> tuple[int, bool]:
    """Where the clearance of a swing is least, and whether that is a minimum between two peaks.

    Parameters
    ----------
    height : of a point of the sole above the floor, toe-off to heel strike [m] (n,)

    Returns
    -------
    (row, True) of the lowest minimum between two peaks, at least 1 mm deep; without one (row, False) of the
    lowest in the middle half of the swing, since at both its ends the foot is on the floor

    Source
    ------
    Minimum toe clearance as a local minimum in mid-swing: Winter 1991; Schulz 2011 (which also counts the
    swings that have none).
    """
    inner = height[1:-1]
    turns = np.flatnonzero((inner < height[:-2]) & (inner <= height[2:])) + 1
    dips = [int(k) for k in turns if min(_rise(height[k::-1]), _rise(height[k:])) >= RIPPLE]
    if dips:
        return min(dips, key=lambda k: height[k]), True
    start, end = (round(share * (len(height) - 1)) for share in MID_SWING)
    return start + int(np.argmin(height[start : end + 1])), False


def _rise(height: np.ndarray) -> float:
    """How far a height climbs above its first value before it falls below it [m]."""
    below = height < height[0]
    end = int(np.argmax(below)) if below.any() else len(height)
    return float(height[:end].max() - height[0])


def _clearance(stride: Stride) -> Found:
    """Of the sole's points toe and ball, in swing:

    <point>_clearance [mm] : least height above the floor, as `dip`
    <point>_clearance_phase [percent] : of the stride, where that is
    <point>_clearance_to_recorded [mm] : the same less that of this foot with the recorded ankle angle
    swings_with_<point>_contact [percent] : share of swings with a clearance below zero
    swings_without_<point>_dip [percent] : share of swings without a minimum between two peaks

    Heights are those of the foot's own sole. A plate worn under it counts as a shoe's sole, and the other
    shoe's as just as thick: the body stands that much higher, and the clearance is that of the plate's
    underside (with the sole level; at a pitch ψ the underside has thickness × (1 − cos ψ) more).
    """
    swing = stride.swing
    for point in ("toe", "ball"):
        height, recorded = stride[f"{point}/height"][swing], stride[f"gait/{point}_height"][swing]
        if len(height) < 3 or not np.isfinite(height).all():
            yield f"{point}_clearance", math.nan, "mm"
            continue
        at, is_dip = dip(height)
        yield f"{point}_clearance", 1e3 * float(height[at]), "mm"
        yield f"{point}_clearance_phase", 100.0 * float(stride.phase[swing][at]), "percent"
        yield f"{point}_clearance_to_recorded", 1e3 * float(height[at] - recorded[dip(recorded)[0]]), "mm"
        yield f"swings_with_{point}_contact", 100.0 * (height[at] < 0.0), "percent"
        yield f"swings_without_{point}_dip", 100.0 * (not is_dip), "percent"


def _contact(stride: Stride) -> Found:
    """At and after the heel strike that begins the stride:

    foot_pitch_at_contact [deg] : of the sole to the floor, toe up
    contacts_with_<heel|flat|forefoot> [percent] : share of strides that begin with a pitch above 8°, between,
        below −1.6° (Altman & Davis 2012: runners' foot-strike angle, from memory)
    foot_slap_velocity [deg/s] : highest plantarflexion velocity in the loading response (0 to 12 %), until
        the ankle is at its most plantarflexed there
    """
    angle, shank = (math.degrees(stride.at(name, 0.0)) for name in ("ankle/angle", "shank/angle"))
    pitch = angle - shank
    yield "foot_pitch_at_contact", pitch, "deg"
    if math.isfinite(pitch):
        yield "contacts_with_heel", 100.0 * (pitch > HEEL_PITCH), "percent"
        yield "contacts_with_flat", 100.0 * (FOREFOOT_PITCH <= pitch <= HEEL_PITCH), "percent"
        yield "contacts_with_forefoot", 100.0 * (pitch < FOREFOOT_PITCH), "percent"
    loading = np.count_nonzero(stride.phase <= LOADING)
    lowest = int(np.argmin(stride["ankle/angle"][:loading]))
    yield "foot_slap_velocity", math.degrees(_highest(-stride["ankle/velocity"][: lowest + 1])), "deg/s"


def _ankle(stride: Stride) -> Found:
    """The ankle's angle:

    peak_swing_dorsiflexion [deg] : highest in swing
    mid_swing_angle [deg] : half-way between toe-off and heel strike
    ankle_range [deg] : highest less lowest of the stride
    angle_error_<recorded|norm> [deg] : RMS over all rows of the angle less the recorded healthy walker's, or
        less the published mean
    gvs_<recorded|norm> [deg] : gait variable score, the same over 51 points of the stride, 0, 2, … 100 %
        (Baker et al. 2009)
    """
    angle = np.degrees(stride["ankle/angle"])
    swing = stride.swing
    if swing.any():
        yield "peak_swing_dorsiflexion", float(angle[swing].max()), "deg"
        middle = stride.at("ankle/angle", 0.5 * (1.0 + stride.toe_off))
        yield "mid_swing_angle", math.degrees(middle), "deg"
    yield "ankle_range", float(np.ptp(angle)), "deg"
    points = np.linspace(0.0, 1.0, GVS_POINTS)
    norm = gait_norm.read()
    here = np.degrees(stride.at("ankle/angle", points))
    for name, rows, score in (
        ("recorded", stride["gait/ankle_angle"], stride.at("gait/ankle_angle", points)),
        ("norm", norm.at("ankle_angle", stride.phase), norm.at("ankle_angle", points)),
    ):
        yield f"angle_error_{name}", _rms(angle - np.degrees(rows)), "deg"
        yield f"gvs_{name}", _rms(here - np.degrees(score)), "deg"


def _need(stride: Stride) -> Found:
    """What the patient lacks: the healthy ankle's active moment less what the patient gives in that motion.

    needed_<dorsiflexion|plantarflexion>_torque [N*m] : highest each way
    needed_swing_torque [N*m] : highest dorsiflexion in swing
    """
    needed = stride["gait/needed_moment"]
    for side, sign in SIDES.items():
        yield f"needed_{side}_torque", _highest(sign * needed), "N*m"
    yield "needed_swing_torque", _highest(needed[stride.swing]), "N*m"


def _torque(stride: Stride) -> Found:
    """The orthosis' torque about the ankle:

    orthosis_<peak|mean>_<dorsiflexion|plantarflexion>_torque [N*m] : highest, and mean over the stride
    share_of_<dorsiflexion|plantarflexion>_moment [percent] : the peak, of the recorded healthy ankle's peak
    torque_covered [percent] : of the needed torque's integral over the stride, what the orthosis gives
    torque_missing [N*m] : highest need that the orthosis leaves open
    torque_unneeded [N*m] : highest torque beyond the need, or against it
    """
    torque, healthy = stride[ORTHOSIS], stride["gait/ankle_moment"]
    for side, sign in SIDES.items():
        peak = _highest(sign * torque)
        yield f"orthosis_peak_{side}_torque", peak, "N*m"
        yield f"orthosis_mean_{side}_torque", _clean(float(np.maximum(sign * torque, 0.0).mean())), "N*m"
        yield f"share_of_{side}_moment", _share(peak, _highest(sign * healthy)), "percent"
    needed = stride["gait/needed_moment"]
    way = np.where(needed < 0.0, -1.0, 1.0)
    given = np.clip(way * torque, 0.0, np.abs(needed))
    if _highest(np.abs(needed)) > 0.0:
        yield "torque_covered", _share(float(given.sum()), float(np.abs(needed).sum())), "percent"
    yield "torque_missing", _highest(np.abs(needed) - given), "N*m"
    yield "torque_unneeded", _highest(np.abs(torque - way * given)), "N*m"


def _work(stride: Stride) -> Found:
    """The orthosis' work on the ankle, torque times ankle velocity:

    orthosis_positive_work, orthosis_negative_work [J/kg] : per stride and body mass
    orthosis_peak_power [W/kg] : highest given
    orthosis_peak_absorption [W/kg] : highest taken, as a positive number
    share_of_positive_work [percent] : of the recorded healthy ankle's positive work
    """
    power = stride[ORTHOSIS] * stride["ankle/velocity"] / stride.body_mass
    velocity = np.gradient(stride["gait/ankle_angle"], stride.timestep)
    healthy = stride["gait/ankle_moment"] * velocity / stride.body_mass
    given, taken, own = (
        _clean(float(np.maximum(flow, 0.0).sum()) * stride.timestep) for flow in (power, -power, healthy)
    )
    yield "orthosis_positive_work", given, "J/kg"
    yield "orthosis_negative_work", 0.0 - taken, "J/kg"
    yield "orthosis_peak_power", _highest(power), "W/kg"
    yield "orthosis_peak_absorption", _highest(-power), "W/kg"
    yield "share_of_positive_work", _share(given, own), "percent"


def _air(stride: Stride) -> Found:
    """Air and pressure:

    air_per_stride, air_per_stride_<chamber> [g] : what the inlet valves take from the supply
    free_air_per_stride [l] : the same at the reference atmosphere of ISO 8778 ("normal litres")
    <peak|lowest>_pressure_<chamber> [bar] : gauge
    """
    total = 0.0
    pressures = []
    for name in chambers(stride.columns):
        inlet = np.maximum(stride[f"valve/{name}_inlet/mass_flow"], 0.0)
        air = 1e3 * float(inlet.sum()) * stride.timestep
        total += air
        yield f"air_per_stride_{name}", air, "g"
        pressure = 1e-5 * stride[f"chamber/{name}/pressure"]
        pressures += [(f"peak_pressure_{name}", float(pressure.max()), "bar")]
        pressures += [(f"lowest_pressure_{name}", float(pressure.min()), "bar")]
    yield "air_per_stride", total, "g"
    yield "free_air_per_stride", total / STANDARD_DENSITY, "l"  # 1 g/l = 1 kg/m³
    yield from pressures


def _highest(values: np.ndarray) -> float:
    """At least zero."""
    return _clean(max(float(values.max()), 0.0)) if len(values) else 0.0


def _clean(value: float) -> float:
    """Without what rounding leaves where there is nothing."""
    return 0.0 if abs(value) < ROUNDING else value


def _share(part: float, whole: float) -> float:
    """[percent]; NaN of nothing."""
    return 100.0 * part / whole if whole > 0.0 else math.nan


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))

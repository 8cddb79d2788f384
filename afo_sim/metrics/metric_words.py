"""Metrics in a clinician's words: what each is called, what it means, how its number is written."""

import math
from collections.abc import Mapping

from afo_sim.metrics.metric import METRICS, OTHER, Metric, MetricEntry, known, load_all

UNITS = {"N*m": "N·m", "N*m/kg": "N·m/kg", "percent": "%", "deg": "°", "deg/s": "°/s", "J/(kg*m)": "J/(kg·m)"}
DIGITS = {"mm": 1, "deg": 1, "percent": 1, "N*m": 2, "N*m/kg": 3, "J/kg": 4, "W/kg": 3, "deg/s": 0, "bar": 2}
DIGITS |= {"g": 3, "l": 3, "l/min": 1, "s": 3, "N": 0, "kPa": 1}
THREE = ("", "h", "d")  # units of counts and times of all sizes: three digits, whole ones as they are
ROUND_OFF = 1e-9  # in any unit of the table

RECORDED = "this same foot with the recorded ankle angle of this walk"

load_all()
WORDS = {name: row for name, row in METRICS.items() if "{}" not in name}


def words(name: str) -> MetricEntry:
    """Words for a metric; one that no function registers goes by its name."""
    return known(name) or MetricEntry(OTHER, name, "", name.replace("_", " "))


def unit(metric: Metric) -> str:
    """Its unit as people write it."""
    return UNITS.get(metric.unit, metric.unit)


def number(value: float, in_unit: str, signed: bool = False) -> str:
    """A value with as many digits as its unit deserves, and a true minus sign."""
    if not math.isfinite(value):
        return "–"
    if abs(value) < ROUND_OFF:
        value = 0.0
    digits = DIGITS.get(in_unit)
    if in_unit in THREE:
        digits = 0 if value == round(value) else max(2 - math.floor(math.log10(abs(value))), 0)
    text = f"{value:+.4g}" if digits is None else f"{round(value, digits) + 0.0:+.{digits}f}"
    if not signed or not text.strip("+-0."):
        text = text.removeprefix("+")
    return text.replace("-", "−")


def in_short(metrics: Mapping[str, Metric], reference: str = "") -> list[str]:
    """Facts of a walk beyond its verdict, as sentences; none for other runs."""
    sentences = [f"In swing {clause}." for clause in lift(metrics, reference)]
    if "toe_clearance_to_recorded" in metrics:
        than = _than(metrics["toe_clearance_to_recorded"].value, RECORDED)
        sentences.append(f"The toe passes {than}.")
    pairs = (("toe_clearance", "ball_clearance"), ("toe_clearance_to_recorded", "ball_clearance_to_recorded"))
    # the ball is the lowest point of the forefoot, so that its clearance is the toe's
    alike = (a in metrics and abs(metrics[a].value - metrics[b].value) < 0.5 for a, b in pairs)
    if "ball_clearance_to_recorded" in metrics and not all(alike):
        than = _than(metrics["ball_clearance_to_recorded"].value, RECORDED)
        sentences.append(f"The ball of the foot passes {_height(metrics['ball_clearance'].value)}, {than}.")
    if "mid_swing_angle" in metrics:
        angle = metrics["mid_swing_angle"].value
        side = "dorsiflexion" if angle >= 0.0 else "plantarflexion"
        sentences.append(f"In mid-swing the ankle is at {number(abs(angle), 'deg')}° of {side}.")
    if "plantarflexion_lost_at_toe_off" in metrics:
        lost = metrics["plantarflexion_lost_at_toe_off"].value
        off = f"{number(abs(lost), 'deg')}° {'less' if lost >= 0.0 else 'more'}"
        how = "as plantarflexed as" if abs(lost) < 0.05 else f"{off} plantarflexed than"
        sentences.append(f"At toe-off the ankle is {how} recorded.")
    if "torque_covered" in metrics:
        text = f"Over the stride the orthosis provides {metrics['torque_covered'].value:.0f} % of the torque "
        text += "that this patient lacks for the recorded ankle motion; this does not show what it hinders."
        sentences.append(text)
    return sentences


def lift(metrics: Mapping[str, Metric], reference: str) -> list[str]:
    """The toe clearance compared with the reference's, as a clause; none without a comparison."""
    if "lift_over_reference" not in metrics or not reference:
        return []
    there = _height(metrics["reference_toe_clearance"].value)
    return [f"the toe passes {_than(metrics['lift_over_reference'].value, reference)} ({there})"]


def _than(off: float, other: str) -> str:
    """A difference in height [mm] from another's."""
    if abs(off) < 0.5:
        return f"as high as that of {other}"
    return f"{abs(off):.0f} mm {'higher' if off >= 0.0 else 'lower'} than that of {other}"


def _height(millimetres: float) -> str:
    side = "above" if millimetres >= 0.0 else "below"
    return f"{abs(millimetres):.0f} mm {side} the floor"

"""Metrics in a clinician's words: what each is called, what it means, how its number is written."""

import math
from collections.abc import Mapping

from afo_sim.metrics import ankle as _ankle  # noqa: F401  # registers its metrics, as do the next three
from afo_sim.metrics import energy as _energy  # noqa: F401
from afo_sim.metrics import settling as _settling  # noqa: F401
from afo_sim.metrics import walking as _walking  # noqa: F401
from afo_sim.metrics.metric import GROUPS as GROUPS
from afo_sim.metrics.metric import METRICS, OTHER, Metric, MetricEntry, entry

UNITS = {"N*m": "N·m", "percent": "%", "deg": "°", "deg/s": "°/s"}
DIGITS = {"mm": 1, "deg": 1, "percent": 1, "N*m": 2, "J/kg": 4, "W/kg": 3, "deg/s": 0, "bar": 2}
DIGITS |= {"g": 3, "l": 3, "s": 3, "": 0}

WORDS = {name: row for name, row in METRICS.items() if "{}" not in name}


def words(name: str) -> MetricEntry:
    """Words for a metric; one that no function registers goes by its name."""
    try:
        return entry(name)
    except KeyError:
        return MetricEntry(OTHER, name, "", name.replace("_", " "))


def unit(metric: Metric) -> str:
    """Its unit as people write it."""
    return UNITS.get(metric.unit, metric.unit)


def number(value: float, in_unit: str, signed: bool = False) -> str:
    """A value with as many digits as its unit deserves, and a true minus sign."""
    if not math.isfinite(value):
        return "–"
    digits = DIGITS.get(in_unit)
    text = f"{value:+.4g}" if digits is None else f"{round(value, digits) + 0.0:+.{digits}f}"
    if not signed or not text.strip("+-0."):
        text = text.removeprefix("+")
    return text.replace("-", "−")


def in_short(metrics: Mapping[str, Metric]) -> list[str]:
    """The main results of a walking run, as sentences; none for other runs."""
    sentences = []
    for name, point in (("toe_clearance", "toe"), ("ball_clearance", "ball of the foot")):
        if name in metrics:
            off = metrics[f"{name}_to_recorded"].value
            than = f"{abs(off):.0f} mm {'higher' if off >= 0.0 else 'lower'} than in the healthy trial"
            than = "as in the healthy trial" if abs(off) < 0.5 else than
            sentences.append(f"In swing the {point} passes {_height(metrics[name].value)}, {than}.")
    parts = {"heel": "with the heel", "flat": "with a flat foot", "forefoot": "with the forefoot"}
    shares = {
        how: metrics[f"contacts_with_{k}"].value
        for k, how in parts.items()
        if f"contacts_with_{k}" in metrics
    }
    begun = {how: share for how, share in shares.items() if share > 0.0}
    if len(begun) == 1:
        sentences.append(f"Every stride begins {next(iter(begun))}.")
    elif begun:
        ways = ", ".join(f"{share:.0f} % {how}" for how, share in begun.items())
        sentences.append(f"Strides begin {ways}.")
    if "mid_swing_angle" in metrics:
        angle = metrics["mid_swing_angle"].value
        side = "dorsiflexion" if angle >= 0.0 else "plantarflexion"
        sentences.append(f"In mid-swing the ankle stands at {number(abs(angle), 'deg')}° of {side}.")
    if "torque_covered" in metrics:
        covered, air = metrics["torque_covered"].value, metrics["air_per_stride"].value
        sentences.append(
            f"The orthosis gives {covered:.0f} % of the torque that the patient lacks and takes "
            f"{number(air, 'g')} g of air per stride."
        )
    return sentences


def _height(millimetres: float) -> str:
    side = "above" if millimetres >= 0.0 else "below"
    return f"{abs(millimetres):.0f} mm {side} the floor"

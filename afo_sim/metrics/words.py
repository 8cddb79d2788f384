"""Metrics in a clinician's words: what each is called, what it means, how its number is written."""

import math
from collections.abc import Mapping

from afo_sim.metrics import ankle as _ankle  # noqa: F401  # registers its metrics, as do the next four
from afo_sim.metrics import energy as _energy  # noqa: F401
from afo_sim.metrics import first_strides as _first_strides  # noqa: F401
from afo_sim.metrics import reference as _reference  # noqa: F401
from afo_sim.metrics import settling as _settling  # noqa: F401
from afo_sim.metrics import walking as _walking  # noqa: F401
from afo_sim.metrics.clearance import EXTENSIONS
from afo_sim.metrics.metric import GROUPS as GROUPS
from afo_sim.metrics.metric import METRICS, OTHER, Metric, MetricEntry, entry
from afo_sim.metrics.push_off import COLOURS, LIMITS, OWN, colour

UNITS = {"N*m": "N·m", "N*m/kg": "N·m/kg", "percent": "%", "deg": "°", "deg/s": "°/s"}
DIGITS = {"mm": 1, "deg": 1, "percent": 1, "N*m": 2, "N*m/kg": 3, "J/kg": 4, "W/kg": 3, "deg/s": 0, "bar": 2}
DIGITS |= {"g": 3, "l": 3, "s": 3, "": 0}
AGAINST = "torque_against_push_off_10ms"

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


def in_short(metrics: Mapping[str, Metric], reference: str = "") -> list[str]:
    """The main results of a walking run, as sentences; none for other runs.

    Parameters
    ----------
    metrics : of the run
    reference : whom it is compared with, as it goes into a sentence
    """
    sentences = []
    for name, point in (("toe_clearance", "toe"), ("ball_clearance", "ball of the foot")):
        if name in metrics:
            off = metrics[f"{name}_to_recorded"].value
            than = _than(off, "this same foot with the healthy trial's ankle angle")
            sentences.append(
                f"In swing the {point} passes {_height(metrics[name].value)}{_band(metrics, name)}, {than}."
            )
    sentences += [f"{told[0].upper()}{told[1:]}." for told in lift(metrics, reference)]
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
    if "work_against_push_off" in metrics:
        shown = [colour(metrics[name], name) for name in LIMITS if name in metrics]
        worst = max((each for each in shown if each), key=COLOURS.index, default="unjudged")
        sentences.append(
            f"In push-off the orthosis holds back with {number(metrics[AGAINST].value, 'N*m')} N·m: {worst} "
            f"by limits that are {OWN}. The ankle leaves the floor {_plantarflexed(metrics)}."
        )
    return sentences


def lift(metrics: Mapping[str, Metric], reference: str) -> list[str]:
    """The toe clearance against the reference's, as a clause; none where nothing was compared.

    Parameters
    ----------
    metrics : of the run
    reference : whom it is compared with, as it goes into a sentence
    """
    if "lift_over_reference" not in metrics or not reference:
        return []
    there = _height(metrics["reference_toe_clearance"].value)
    return [f"the toe passes {_than(metrics['lift_over_reference'].value, reference)} ({there})"]


def _than(off: float, other: str) -> str:
    """A difference in height [mm] from another's."""
    if abs(off) < 0.5:
        return f"as high as that of {other}"
    return f"{abs(off):.0f} mm {'higher' if off >= 0.0 else 'lower'} than that of {other}"


def _plantarflexed(metrics: Mapping[str, Metric]) -> str:
    """Plantarflexion that is lost at toe-off, in words."""
    lost = metrics["plantarflexion_lost_at_toe_off"].value
    return f"{number(abs(lost), 'deg')}° {'less' if lost >= 0.0 else 'more'} plantarflexed than recorded"


def _band(metrics: Mapping[str, Metric], name: str) -> str:
    """Clearances with the toes less and more extended, in words."""
    ends = [metrics.get(f"{name}_{how}") for how in EXTENSIONS]
    if ends[0] is None or ends[1] is None:
        return ""
    return f" ({ends[0].value:.0f} to {ends[1].value:.0f} mm over the assumed toe extension)".replace(
        "-", "−"
    )


def _height(millimetres: float) -> str:
    side = "above" if millimetres >= 0.0 else "below"
    return f"{abs(millimetres):.0f} mm {side} the floor"

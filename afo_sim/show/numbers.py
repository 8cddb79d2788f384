"""Metrics as people read them: digits, units, and the reason where a number is undefined."""

import math

from afo_sim.metrics.metric import Metric
from afo_sim.metrics.words import number

UNDEFINED = {"rise_time": "never rises"}  # why a metric can be no number
STILL = 1e-6  # range of motion below which a joint does not move [deg]


def undefined(name: str, metric: Metric) -> str | None:
    """The reason why a metric says nothing; None where it says something."""
    if not math.isfinite(metric.value):
        return UNDEFINED.get(name, "undefined")
    if name == "range_of_motion" and metric.unit == "deg" and abs(metric.value) < STILL:
        return "does not move"
    return None


def readable(name: str, metric: Metric) -> str:
    """A metric's value with its unit's digits, or a dash with the reason."""
    reason = undefined(name, metric)
    return number(metric.value, metric.unit) if reason is None else f"– ({reason})"


def printed(name: str, metric: Metric) -> str:
    """A metric's value in four digits, or a dash with the reason."""
    reason = undefined(name, metric)
    return f"{metric.value:.4g}" if reason is None else f"– ({reason})"

"""Metrics as people read them: digits, units, and the reason where a number is undefined."""

import math
from collections.abc import Mapping
from typing import Any

from afo_sim.common.errors import InputError
from afo_sim.description.words import body_mass
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.words import number

UNDEFINED = {"rise_time": "never rises"}  # why a metric can be no number
# of a sweep's or search's answer, whose numbers do not know of a start
UNSEEN = (
    "note: the numbers are of settled strides; the wearer walks the first ones after every stop too, and may "
    "trip in them: look at them with afo-sim run"
)
FIRST = 8  # strides of a run whose toe clearance is told
SAME_MASS = 0.05  # of the recorded walker and the patient, as a share; beyond it the two are told
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


def cautions(
    scenario: Mapping[str, Any],
    metrics: Mapping[str, Metric],
    strides: Mapping[int, Mapping[str, Metric]],
) -> list[str]:
    """What a reader of a run's numbers must know: strides that are left out, assumed stiffness that decides.

    Parameters
    ----------
    scenario : resolved, as a recording holds it
    metrics : of the run
    strides : metrics of each whole stride, by its number
    """
    found = []
    if "toe_clearance" in metrics and "strides_counted" in metrics:
        counted = float(metrics["strides_counted"])
        of = (
            "those of the settled stride, which was solved for"
            if "strides_solved" in metrics
            else f"means over the last {counted:.0f} strides"
        )
        found.append(f"the numbers are {of}; the wearer walks the first ones too{_from_start(strides)}")
    anchor = scenario["orthosis"].get("anchor", {}).get("shank", {})
    if any(source["kind"] == "assumed" for source in anchor.get("provenance", {}).values()):
        found.append(
            "how far the cuff gives is assumed (orthosis.anchor.shank), and torque and lift hang on it: "
            "run it with half and double too"
        )
    return found


def of_walker(scenario: Mapping[str, Any]) -> list[str]:
    """What a reader must know of a run's gait cycle: doubts of its import, another mass than the patient's.

    Parameters
    ----------
    scenario : resolved, as a recording holds it; a gait file that was moved away tells nothing
    """
    from afo_sim.common.assets import find_gait
    from afo_sim.gait.file import read

    if not scenario.get("gait"):
        return []
    try:
        cycle = read(find_gait(scenario["gait"]["cycle"]))
    except InputError:
        return []
    found = [f"the gait cycle was imported with a warning: {warning}" for warning in cycle.warnings]
    mass = body_mass(scenario)
    if abs(cycle.body_mass / mass - 1.0) > SAME_MASS:
        found.append(
            f"the recorded walker weighs {cycle.body_mass:.1f} kg, the patient {mass:g} kg: force and moment "
            "are scaled to the patient (patient.body_mass)"
        )
    return found


def _from_start(strides: Mapping[int, Mapping[str, Metric]]) -> str:
    """Toe clearance of the first strides, as a part of a sentence."""
    heights = [metrics["toe_clearance"] for metrics in strides.values() if "toe_clearance" in metrics][:FIRST]
    if len(heights) < 2:
        return ", in which the muscles are not yet full"
    told = ", ".join(number(height.value, height.unit) for height in heights)
    return f", and their toe clearance is {told} {heights[0].unit}"

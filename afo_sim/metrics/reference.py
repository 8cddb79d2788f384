"""How much higher the toe passes than in the same patient's reference walk."""

from collections.abc import Mapping

from afo_sim.metrics.metric import CLEARANCE, Metric, measured, tells

COMPARED = "toe_clearance"  # of both walks


@tells(
    CLEARANCE,
    ("reference_toe_clearance", "mm", "Toe clearance of the reference", "the same patient, otherwise shod"),
    ("lift_over_reference", "mm", "Toe clearance less the reference's", "the same patient, otherwise shod"),
)
def reference_metrics(own: Mapping[str, Metric], reference: Mapping[str, Metric]) -> dict[str, Metric]:
    """Clearance of the reference walk, and how much higher this one's is.

    Parameters
    ----------
    own, reference : metrics of the two walks; one that lacks a toe clearance compares with nothing
    """
    if COMPARED not in own or COMPARED not in reference:
        return {}
    values = {
        "reference_toe_clearance": float(reference[COMPARED]),
        "lift_over_reference": float(own[COMPARED]) - float(reference[COMPARED]),
    }
    return {name: measured(name, value) for name, value in values.items()}

"""A run's numbers as CSV."""

import csv
import pathlib

from afo_sim.metrics.metric_words import words
from afo_sim.simulation.recording import Recording

TITLES = ("name", "value", "unit", "label")
QUANTILES = ("quantile_5", "quantile_50", "quantile_95")  # of the draws of a run with bands


def write_metrics(recording: Recording, path: pathlib.Path) -> None:
    """Write a run's metrics, one a line: name, value in its unit, unit, and what it is called.

    A run with bands has three columns more: 5, 50 and 95 % of its draws, empty where a metric has no band.
    """
    drawn = recording.studies.get("uncertainty", {}).get("metrics", {})
    nothing = {"quantiles": [""] * len(QUANTILES)}
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*TITLES, *(QUANTILES if drawn else ())])
        for name, metric in recording.metrics.items():
            bands = drawn.get(name, nothing)["quantiles"] if drawn else ()
            writer.writerow([name, float(metric), metric.unit, words(name).label, *bands])

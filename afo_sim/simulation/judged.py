"""The verdict of a recording, held against its scenario's limits."""

from typing import Any, Protocol

from afo_sim.description.limits import Limits
from afo_sim.description.reader import USUAL_LIMITS, load
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.verdict import Answer, undecided, verdict, with_draws


class Judged(Protocol):
    """The parts of a recording that its verdict needs."""

    @property
    def ok(self) -> bool: ...
    @property
    def scenario(self) -> dict[str, Any]: ...
    @property
    def metrics(self) -> dict[str, Metric]: ...
    @property
    def strides(self) -> dict[int, dict[str, Metric]]: ...
    @property
    def studies(self) -> dict[str, Any]: ...


def limits_of(recording: Judged) -> Limits:
    """The limits of a recording's scenario; the usual ones of a recording that is older than limits are."""
    return load("limits", recording.scenario.get("limits") or USUAL_LIMITS)


def verdict_of(recording: Judged) -> tuple[Answer, ...]:
    """The answers of a walking run, with what bands tell; none of other runs, none known of a failed one."""
    if not recording.scenario.get("gait"):
        return ()
    limits = limits_of(recording)
    if not recording.ok:
        return undecided(limits, "the simulation stopped early")
    found = verdict(recording.metrics, recording.strides, limits)
    study = recording.studies.get("uncertainty", {})
    if "trips" not in study:
        return found
    draws = study["draws"] - study["failed"]["count"]
    return with_draws(found, study["trips"]["touch"]["share"], draws, limits.drawn_trips)

"""The verdict of a recording, held against its scenario's limits."""

from typing import Any, Protocol

from afo_sim.description.reader import USUAL_LIMITS, load
from afo_sim.description.walking import Limits
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.verdict import Answer, Feed, undecided, verdict, with_draws


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


def feed_of(recording: Judged) -> Feed | None:
    """The source that a recording's scenario names, in words; None of endless air."""
    described = (recording.scenario.get("supply") or {}).get("source")
    if not described:
        return None
    source = load("source", described)
    name = f" {source.name}" if source.name else ""
    if source.kind == "compressor":
        return Feed(f"the compressor{name}", runs=True)
    gas = "CO2" if source.gas == "co2" else "air"
    if source.content is not None:
        return Feed(f"the cartridge{name} of {1e3 * source.content:g} g {gas}")
    full = 1e-5 * (source.filling_pressure or 0.0)
    return Feed(f"the bottle{name} of {1e3 * source.volume:g} l at {full:g} bar")


def verdict_of(recording: Judged) -> tuple[Answer, ...]:
    """The answers of a walking run, with what bands tell; none of other runs, none known of a failed one."""
    if not recording.scenario.get("gait"):
        return ()
    limits = limits_of(recording)
    if not recording.ok:
        return undecided(limits, "the simulation stopped early")
    found = verdict(recording.metrics, recording.strides, limits, feed_of(recording))
    study = recording.studies.get("uncertainty", {})
    if "trips" not in study:
        return found
    draws = study["draws"] - study["failed"]["count"]
    return with_draws(found, study["trips"]["touch"]["share"], draws, limits.drawn_trips)

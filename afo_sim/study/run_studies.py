"""Studies that a run carries as JSON in `Recording.studies`: what to change first, and bands."""

import dataclasses

from afo_sim.common import InputError, Json
from afo_sim.description import Scenario
from afo_sim.metrics import needless
from afo_sim.simulation import Recording, limits_of
from afo_sim.study.effects import effects as effects_of
from afo_sim.study.pool import Report

EFFECTS, UNCERTAINTY = "effects", "uncertainty"
LEFT_OUT = "left_out"  # key of a study that was not made, with the reason
_USUAL = "usual"  # spreads
_RUNS = 60  # of what to change first, about
_LONGEST = 120.0  # that they may take in a run that did not ask for them in so many words [s]


def with_studies(
    recording: Recording, scenario: Scenario, *, effects: bool = False, draws: int = 0,
    spreads: str = "usual", report: Report | None = None,
) -> Recording:  # fmt: skip
    """A walking run with the requested studies; other runs unchanged."""
    if not (recording.ok and scenario.walking):
        return recording
    if draws > 0:
        from afo_sim.study.uncertainty.running import uncertainty  # slow to import

        recording = _told(recording, UNCERTAINTY, uncertainty(scenario, recording, draws, spreads, report))
    if effects and scenario.orthosis.muscle:  # ranked by the verdict, which the bands may have changed
        if needless(recording.metrics, limits_of(recording)):
            return _told(recording, EFFECTS, {LEFT_OUT: "the toe needs no device"})
        seconds = _RUNS * float(recording.timing["wall_seconds"])
        if seconds > _LONGEST:
            why = f"some {_RUNS} runs such as this one would take about {seconds / 60.0:.0f} min"
            return _told(recording, EFFECTS, {LEFT_OUT: why})
        study = effects_of(scenario, recording=recording, progress=report).to_json()
        return _told(recording, EFFECTS, study)
    return recording


def _told(recording: Recording, name: str, study: Json) -> Recording:
    return dataclasses.replace(recording, studies={**recording.studies, name: study})


def check_studies(scenario: Scenario, *, draws: int = 0, spreads: str = "usual") -> None:
    """Refuse studies that cannot be made, before anything is walked."""
    if spreads != _USUAL and not draws:
        problem = "goes with --uncertainty"
        raise InputError(problem, field="spreads", value=spreads, allowed="--uncertainty 200")
    if draws:
        from afo_sim.study.uncertainty.running import check_draws

        check_draws(scenario, draws, spreads)

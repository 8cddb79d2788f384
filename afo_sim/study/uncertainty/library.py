"""Bands from Python: `afo_sim.uncertainty`."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from afo_sim.common.errors import InputError
from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.simulation.recording import Recording
from afo_sim.simulation.run import run
from afo_sim.study.run_studies import UNCERTAINTY
from afo_sim.study.uncertainty import running


def uncertainty(
    scenario: Any,
    sets: Mapping[str, Any] | None = None,
    *,
    draws: int = 200,
    spreads: str = "usual",
    seed: int = 0,
    threads: int = 0,
) -> Recording:
    """A run of walking with bands: what is not known of orthosis and wearer, drawn together.

    Parameters
    ----------
    scenario : a shipped name, a path, a dict or a Scenario, of walking
    sets : dotted keys and values laid over it
    draws : how many, at least 20
    spreads : what is not known: a shipped name, or a TOML file
    seed : of the draws
    threads : as many as processors if 0

    Returns
    -------
    Recording, with the bands in `studies["uncertainty"]`

    Raises
    ------
    InputError
        Nobody walks, too few draws, or the description or the spreads are wrong.

    Examples
    --------
    >>> walk = uncertainty("walk-dropfoot-afo", {"timestep": "4 ms", "duration": "4 s"}, draws=20)
    >>> low, middle, high = walk.studies["uncertainty"]["metrics"]["toe_clearance"]["quantiles"]
    >>> low < middle < high
    True
    """
    if isinstance(scenario, Scenario):
        description = scenario.set(sets) if sets else scenario
    else:
        description = load("scenario", scenario, sets)
    running.check_asked(description, draws, spreads)
    if not isinstance(seed, int) or seed < 0:
        raise InputError("is not a valid seed", field="seed", value=seed, allowed="0, 1, 2, …")
    recording = run(description)
    found = running.uncertainty(description, recording, draws, spreads, seed=seed, threads=threads)
    return dataclasses.replace(recording, studies=recording.studies | {UNCERTAINTY: found})

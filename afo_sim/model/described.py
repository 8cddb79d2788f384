"""A scenario by name, path, dict or object, compiled: `afo_sim.build`."""

import os
from collections.abc import Mapping
from typing import Any

from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.model import build as builder
from afo_sim.model.build import Built


def build(
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any], sets: Mapping[str, Any] | None = None
) -> Built:
    """Compile a scenario: put the orthosis on the leg and check what only the compiled model can tell.

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it, for example {"supply.pressure": "3 bar"}

    Returns
    -------
    Built: `model` (MuJoCo's MjModel, without shapes that only pictures need), `full_model`, `spec` and `xml`
    (self-contained MJCF) with all of them, `scenario`, `warnings`. Its muscles pull only while this package's
    callbacks are installed; `run` sees to that.

    Raises
    ------
    InputError
        The description is wrong; the leg lacks a body or joint; a braid locks within the range of motion;
        air or braid would be unstable at this time step (with the step that would do).

    Examples
    --------
    >>> built = build("seated", {"timestep": "0.5 ms"})
    >>> built.model.opt.timestep, built.model.joint("ankle").name
    (0.0005, 'ankle')
    """
    if isinstance(scenario, Scenario):
        return builder.build(scenario.set(sets) if sets else scenario)
    return builder.build(load("scenario", scenario, sets))

"""`afo_sim.dm_control_physics`: a scenario as a dm_control Physics."""

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from afo_sim.common import JsonMapping
from afo_sim.description import Scenario
from afo_sim.model.build import build

if TYPE_CHECKING:
    from afo_sim.rl.physics import ScenarioPhysics


def dm_control_physics(
    scenario: str | os.PathLike[str] | Scenario | JsonMapping,
    sets: Mapping[str, object] | None = None,
    *,
    timed: bool = True,
) -> "ScenarioPhysics":
    """Compile a scenario and stand it at its start, as a dm_control `mujoco.Physics`.

    Parameters
    ----------
    scenario : a shipped name, a path to a TOML file, a dict of the same shape, or a Scenario
    sets : dotted keys and values laid over it, for example {"supply.pressure": "3 bar"}
    timed : whether valves follow the scenario's timing until they are commanded; otherwise they are shut

    Returns
    -------
    ScenarioPhysics; stepped as it is, it gives the same bits as `run` (of walking: with
    `gait.settled = "walked"`). `close()` it, or use it in a `with` block, to give the muscle callbacks back.

    Raises
    ------
    InputError
        The description is wrong.
    CallbackError
        Another program's callbacks are installed, or muscles would be limp.
    ImportError
        dm_control is not installed.

    Examples
    --------
    >>> with dm_control_physics("seated") as physics:
    ...     physics.step(500)
    ...     round(physics.time(), 9), physics.pressure("dorsiflexor") > 1e5
    (1.0, True)
    """
    from afo_sim.rl.physics import ScenarioPhysics  # needs dm_control

    return ScenarioPhysics(build(scenario, sets), timed=timed)

"""What moment two chambers give when their pressures are moved apart: `afo_sim.pressure_map`."""

import os
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common.errors import InputError, unknown
from afo_sim.common.units import format_quantity
from afo_sim.description.reader import load
from afo_sim.description.scenario import Scenario
from afo_sim.model.build import Built, build
from afo_sim.model.torque_map import chamber_torque

ANGLES = tuple(np.radians(np.arange(-15.0, 15.1, 2.5)))  # [rad]
POINTS = 17  # pressures at each angle
LEAST = 1e-3  # range of moments below which the pressures have no effect: cables hang [N·m]


def pressure_map(
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
    mean: float,
    half_range: float,
    *,
    raises: str = "dorsiflexor",
    lowers: str | None = None,
    angles: Sequence[float] = ANGLES,
) -> list[list[str | float]]:
    """The `torque_map` of an impedance controller, from the compiled model at rest.

    At each angle the orthosis' static moment is computed with mean + d in the one chamber and mean − d in
    the other, none below ambient. Friction of muscles and paths, and what moves, is not in it.

    Parameters
    ----------
    scenario : a shipped name, a path, a dict of the same shape, or a Scenario
    mean : gauge pressure in both chambers at d = 0 [Pa]
    half_range : greatest d [Pa]
    raises, lowers : the two chambers; no second one by default
    angles : rising ankle angles [rad] (n,)

    Returns
    -------
    rows [angle, d, moment] as texts with units; angles at which no pressure has an effect are left out

    Raises
    ------
    InputError
        There is no such chamber, the pressures are no pressures, or the moment follows them at no angle.

    Examples
    --------
    >>> rows = pressure_map("seated", 2e5, 2e5, lowers="plantarflexor", angles=[-0.05, 0.05])
    >>> len(rows), rows[0][1]
    (34, '-200000.0 Pa')
    """
    description = scenario if isinstance(scenario, Scenario) else load("scenario", scenario)
    for field, name in (("raises", raises), ("lowers", lowers)):
        if name is not None and name not in description.orthosis.chamber:
            problem = "the orthosis has no such chamber"
            raise unknown(name, description.orthosis.chamber, field=field, problem=problem)
    for field, value in (("mean", mean), ("half_range", half_range)):
        if not isinstance(value, Real) or not 0.0 <= value <= 2e6 or value == half_range == 0.0:
            raise InputError("is no pressure", field=field, value=value, allowed="above 0 to 2e6 Pa")
    built = build(description)
    apart = np.linspace(-half_range, half_range, POINTS)
    rows: list[list[str | float]] = []
    for angle in angles:
        moments = _moments(built, float(angle), [(raises, mean + apart), (lowers, mean - apart)])
        if moments[-1] - moments[0] > LEAST:
            for row in zip(np.full(POINTS, angle), apart, moments, strict=True):
                units = zip(row, ("rad", "Pa", "N*m"), strict=True)
                rows.append([format_quantity(float(value), unit) for value, unit in units])
    if not rows:
        problem = "gives no moment that rises with its pressure, at any of the angles"
        raise InputError(problem, field="raises", value=raises)
    return rows


def _moments(built: Built, angle: float, pressures: Sequence[tuple[str | None, np.ndarray]]) -> np.ndarray:
    """Moment of all muscles at rest at an angle, for gauge pressures of chambers [N·m] (n,)."""
    model, index = built.model, built.index
    data = mujoco.MjData(model)
    found = []
    with native.installed(built.scenario.callback):
        for k in range(len(pressures[0][1])):
            data.qpos[index.ankle_qpos] = angle
            filled = {index.chambers[c]: max(float(p[k]), 0.0) for c, p in pressures if c is not None}
            native.fill_chambers(model, data, filled)
            mujoco.mj_forward(model, data)
            found.append(sum(chamber_torque(built, data, chamber) for chamber in index.chambers))
    return np.array(found)

"""Static torque over ankle angle and pressure: of each chamber alone, and of two whose pressures differ.

The first answers whether there is enough torque; the second is the `torque_map` of an impedance controller.
"""

import os
import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import InputError, Notice, format_quantity, unknown, write_text
from afo_sim.description import JointName, MuscleGroup, Scenario, load
from afo_sim.model.build import Built, build

# Dorsiflexion torque that a drop foot needs, from and to [N·m] (computed for this project from gait).
NEEDS = {"swing": (4.0, 6.0), "loading response": (10.0, 13.0)}
MAP_ANGLES = tuple(np.radians(np.arange(-15.0, 15.1, 2.5)))  # [rad]
PRESSURE_COUNT = 17  # pressures at each angle
LEAST_MOMENT = 1e-3  # range of moments below which the pressures have no effect: cables hang [N·m]


@dataclass(frozen=True)
class TorqueMap:
    """Static torque of one chamber's muscles alone; the others are at ambient pressure."""

    chamber: str
    angles: np.ndarray
    pressures: np.ndarray
    torque: np.ndarray
    contraction: np.ndarray
    joint: JointName = "ankle"


def torque_map(built: Built, angles: np.ndarray, pressures: np.ndarray) -> list[TorqueMap]:
    """Static orthosis torque over angle and pressure, from the compiled model at rest."""
    model, index = built.model, built.index
    data = mujoco.MjData(model)
    maps = []
    with native.installed(built.scenario.callback):
        for chamber in index.chambers:
            torque = np.empty((len(angles), len(pressures)))
            least = np.empty_like(torque)
            for row, angle in enumerate(angles):
                for column, pressure in enumerate(pressures):
                    data.qpos[index.ankle_qpos] = angle
                    native.fill_chambers(model, data, {index.chambers[chamber]: float(pressure)})
                    mujoco.mj_forward(model, data)
                    torque[row, column] = chamber_torque(built, data, chamber)
                    least[row, column] = min(
                        float(native.read_own(model, data.userdata, muscle).contraction)
                        for muscle in _members_of(built, chamber)
                    )
            maps.append(TorqueMap(chamber, angles, pressures, torque, least, built.scenario.leg.joint))
    return maps


def require_angles(built: Built, angles: np.ndarray) -> None:
    """Refuse angles beyond the joint's stops."""
    lower, upper = np.degrees(built.model.joint("ankle").range)
    if np.degrees(angles.min()) < lower - 1e-6 or np.degrees(angles.max()) > upper + 1e-6:
        raise InputError(
            f"goes beyond the {built.scenario.leg.joint}'s stops",
            field="angles",
            value=f"{np.degrees(angles.min()):g} to {np.degrees(angles.max()):g} deg",
            allowed=f"{lower:g} deg to {upper:g} deg",
        )


def limit_warnings(built: Built, maps: list[TorqueMap]) -> list[Notice]:
    """Warnings of pressures beyond a muscle's limit."""
    found = []
    for entry in maps:
        for name, group in built.scenario.orthosis.muscles_of(entry.chamber).items():
            found += beyond_pressure(name, group, float(entry.pressures.max()))
    return found


def beyond_pressure(name: str, group: MuscleGroup, pressure: float) -> list[Notice]:
    """A warning of a gauge pressure [Pa] beyond the limit of a group's muscles."""
    limit = group.type.limits.pressure
    if pressure <= limit:
        return []
    words = f"{{subject}}: {pressure * 1e-5:g} bar is beyond the muscle's limit of {limit * 1e-5:g} bar"
    return [Notice("pressure-limit", words, subject=name, pressure=pressure, limit=limit)]


def _members_of(built: Built, chamber: str) -> list[int]:
    """Actuator ids of the muscles on a chamber."""
    owner = built.index.chambers[chamber]
    rows = built.model.actuator_user
    return [i for i in built.index.muscles.values() if rows[i, native.MUSCLE_CHAMBER] == owner]


def chamber_torque(built: Built, data: mujoco.MjData, chamber: str) -> float:
    """Torque of one chamber's muscles about the ankle, Σ force × moment arm [N·m]."""
    model, index = built.model, built.index
    jacobian = np.zeros((model.nu, model.nv))
    mujoco.mju_sparse2dense(
        jacobian, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind
    )
    members = _members_of(built, chamber)
    return float(data.actuator_force[members] @ jacobian[members, index.ankle_dof])


def write_csv(maps: list[TorqueMap], path: pathlib.Path) -> None:
    """One row per chamber, angle and pressure."""
    lines = [f"chamber,{maps[0].joint}_angle [deg],pressure [bar],orthosis_torque [N*m]"]
    for found in maps:
        for angle, row in zip(np.degrees(found.angles), found.torque, strict=True):
            for pressure, torque in zip(found.pressures * 1e-5, row, strict=True):
                lines.append(f"{found.chamber},{angle:.6g},{pressure:.6g},{torque:.6g}")
    write_text(path, "\n".join(lines) + "\n")


def answer(maps: list[TorqueMap], pressure: float) -> dict[str, dict[str, tuple[float, float] | None]]:
    """Over which ankle angles each need is met at a pressure, by muscles that are not overstretched."""
    found: dict[str, dict[str, tuple[float, float] | None]] = {}
    for entry in maps:
        column = int(np.argmin(np.abs(entry.pressures - pressure)))
        torque = np.where(entry.contraction[:, column] >= 0.0, entry.torque[:, column], -np.inf)
        if entry.joint != "ankle" or entry.torque.max() <= -entry.torque.min():
            continue
        found[entry.chamber] = {}
        for need, (least, _) in NEEDS.items():
            enough = entry.angles[torque >= least]
            span = (float(enough.min()), float(enough.max())) if len(enough) else None
            found[entry.chamber][need] = span
    return found


def pressure_map(
    scenario: str | os.PathLike[str] | Scenario | Mapping[str, Any],
    mean: float,
    half_range: float,
    *,
    raises: str = "dorsiflexor",
    lowers: str | None = None,
    angles: Sequence[float] = MAP_ANGLES,
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
            raise InputError("is not a valid pressure", field=field, value=value, allowed="above 0 to 2e6 Pa")
    built = build(description)
    apart = np.linspace(-half_range, half_range, PRESSURE_COUNT)
    rows: list[list[str | float]] = []
    for angle in angles:
        moments = _moments(built, float(angle), [(raises, mean + apart), (lowers, mean - apart)])
        if moments[-1] - moments[0] > LEAST_MOMENT:
            for row in zip(np.full(PRESSURE_COUNT, angle), apart, moments, strict=True):
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

"""Static torque over joint angle and pressure of each chamber alone."""

import pathlib
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import Notice, write_text
from afo_sim.description import JointName, MuscleGroup
from afo_sim.model.build import Built


@dataclass(frozen=True)
class TorqueMap:
    """Static torque of one chamber's muscles alone; the others are at ambient pressure."""

    chamber: str  # that is filled
    angles: np.ndarray  # [rad] (n,)
    pressures: np.ndarray  # gauge [Pa] (m,)
    torque: np.ndarray  # positive as the angles are [N·m] (n, m)
    contraction: np.ndarray  # the least of its muscles' own contraction ratios [-] (n, m)
    joint: JointName = "ankle"  # about which


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
    members = _members_of(built, chamber)
    return float(data.actuator_force[members] @ native.jacobian(model, data)[members, index.ankle_dof])


def write_csv(maps: list[TorqueMap], path: pathlib.Path) -> None:
    """One row per chamber, angle and pressure."""
    lines = [f"chamber,{maps[0].joint}_angle [deg],pressure [bar],orthosis_torque [N*m]"]
    for found in maps:
        for angle, row in zip(np.degrees(found.angles), found.torque, strict=True):
            for pressure, torque in zip(found.pressures * 1e-5, row, strict=True):
                lines.append(f"{found.chamber},{angle:.6g},{pressure:.6g},{torque:.6g}")
    write_text(path, "\n".join(lines) + "\n")

"""Names of muscles, chambers and valves, their ids in the model, and its paths swept over the ankle."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.common import JsonDict, Keywords
from afo_sim.description import MuscleGroup, Orthosis

ANKLE = "ankle"


@dataclass(frozen=True, kw_only=True, eq=False)
class Index(native.CircuitIds):
    """Actuator ids and joint addresses by name, in the order they are recorded."""

    passive: int
    walking: dict[str, int]
    ankle_qpos: int
    ankle_dof: int
    joints: dict[str, tuple[int, int]]  # places in qpos and qvel


def muscle_names(orthosis: Orthosis) -> dict[str, MuscleGroup]:
    """Every single muscle by name ("dorsiflexor_1", …), with its group."""
    return {
        f"{name}_{k}": group for name, group in orthosis.muscle.items() for k in range(1, group.count + 1)
    }


def chamber_of(muscle: str, group: MuscleGroup) -> str:
    """The chamber that supplies a single muscle ("dorsiflexor_1") of a group."""
    return group.chamber or muscle.rsplit("_", 1)[0]


# of a gain by the velocity: its input is a state, of which the callbacks give the rate
GAIN_STATE: Keywords = {"actdim": 1, "actearly": True, "dyntype": mujoco.mjtDyn.mjDYN_USER}


def add_motor(
    spec: mujoco.MjSpec, name: str, joint: str, gains: tuple[float, ...], *, callback: bool = False
) -> None:
    """An actuator on a joint: input × (g0 + g1 × coordinate + g2 × velocity), plus the callback's bias."""
    kinds = mujoco.mjtGain
    spec.add_actuator(
        name=name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=joint,
        gaintype=kinds.mjGAIN_FIXED if len(gains) == 1 else kinds.mjGAIN_AFFINE,
        gainprm=[*gains] + [0.0] * (10 - len(gains)),
        biastype=mujoco.mjtBias.mjBIAS_USER if callback else mujoco.mjtBias.mjBIAS_NONE,
        userdata=[0.0] * native.N_USER,
        **GAIN_STATE if len(gains) == 3 else {},
    )


def drawn(colour: Sequence[float], mass: float = 0.0) -> JsonDict:
    """What a shape is given that is there to be seen: it touches nothing."""
    return {"rgba": colour, "contype": 0, "conaffinity": 0, "mass": mass}


def postures(model: mujoco.MjModel, joint: int, angles: np.ndarray) -> Iterator[mujoco.MjData]:
    """The model with a joint, by its place in `qpos`, at each angle; the same data each time."""
    data = native.scratch(model)
    for angle in angles:
        data.qpos[joint] = angle
        mujoco.mj_fwdPosition(model, data)
        yield data


def sweep_ankle(
    model: mujoco.MjModel, index: Index, angles: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Geometry of the muscles over the ankle's angle, from the compiled model."""
    ids = list(index.muscles.values())
    lengths = np.empty((len(angles), len(ids)))
    arm, inertia = np.empty_like(lengths), np.empty(len(angles))
    mass_matrix = np.zeros((model.nv, model.nv))
    for k, data in enumerate(postures(model, index.ankle_qpos, angles)):
        lengths[k] = data.actuator_length[ids]
        arm[k] = -native.jacobian(model, data)[ids, index.ankle_dof]
        mujoco.mj_fullM(model, data, mass_matrix)
        inertia[k] = mass_matrix[index.ankle_dof, index.ankle_dof]
    return contractions(model.actuator_user, ids, lengths), arm, inertia


def contractions(rows: np.ndarray, muscles: list[int], lengths: np.ndarray) -> np.ndarray:
    """Contraction ratios of paths of these lengths [m] (n, n_muscle), by all actuators' rows [-]."""
    rows = rows[muscles]
    own = rows[:, native.MUSCLE_NOMINAL_LENGTH]
    return (own + rows[:, native.MUSCLE_SERIES_LENGTH] - lengths) / own


def sweep_lengths(model: mujoco.MjModel, muscles: list[int], ankle: int, angles: np.ndarray) -> np.ndarray:
    """Lengths of the muscles' paths over the ankle's angle [m] (n, n_muscle)."""
    return np.array([data.actuator_length[muscles] for data in postures(model, ankle, angles)])

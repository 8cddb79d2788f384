"""Places and turns as 4 × 4 matrices."""

import mujoco
import numpy as np


def pose_of(position: np.ndarray, quaternion: np.ndarray) -> np.ndarray:
    """A pose (4, 4).

    Units: position [m] (3,), quaternion (4,).
    """
    found = np.eye(4)
    found[:3, :3] = turn_of(quaternion)
    found[:3, 3] = position
    return found


def turn_of(quaternion: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) of a quaternion w, x, y, z (4,)."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, np.asarray(quaternion, dtype=float))
    return turn.reshape(3, 3)


def shift(position: np.ndarray) -> np.ndarray:
    """A pose without a turn (4, 4)."""
    found = np.eye(4)
    found[:3, 3] = position
    return found

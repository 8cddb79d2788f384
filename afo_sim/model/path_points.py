"""The path of a muscle in space, as MuJoCo finds it: points, and arcs where it bends around a surface."""

import mujoco
import numpy as np

ARC = 9  # points of an arc


def path_points(model: mujoco.MjModel, data: mujoco.MjData, muscle: str) -> np.ndarray:
    """Corners of a muscle's path from origin to insertion, with points along its arcs.

    Parameters
    ----------
    model, data : after `mj_fwdPosition`
    muscle : name of its tendon

    Returns
    -------
    [m], world axes (n, 3); of a muscle over a pulley, which has no path in space, (0, 3)
    """
    tendon = model.tendon(muscle).id
    start, count = int(data.ten_wrapadr[tendon]), int(data.ten_wrapnum[tendon])
    places = data.wrap_xpos.reshape(-1, 3)[start : start + count]
    around = data.wrap_obj.reshape(-1)[start : start + count]
    found: list[np.ndarray] = []
    for k, place in enumerate(places):
        if k and around[k] >= 0 and around[k] == around[k - 1]:
            found.extend(_arc(model, data, int(around[k]), places[k - 1], place))
        found.append(place)
    return np.array(found).reshape(-1, 3)


def _arc(
    model: mujoco.MjModel, data: mujoco.MjData, geom: int, start: np.ndarray, end: np.ndarray
) -> list[np.ndarray]:
    """Points between two on a sphere or cylinder, about its middle by the shorter way."""
    centre, axis = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)[:, 2]
    first, last = start - centre, end - centre
    heights = np.zeros(2)
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER:
        heights = np.array([first @ axis, last @ axis])
        first, last = first - heights[0] * axis, last - heights[1] * axis
    cosine = first @ last / (np.linalg.norm(first) * np.linalg.norm(last))
    turn = float(np.arccos(np.clip(cosine, -1.0, 1.0)))
    if turn < 1e-6:
        return []
    shares = np.linspace(0.0, 1.0, ARC + 2)[1:-1]
    return [
        centre
        + (np.sin((1.0 - s) * turn) * first + np.sin(s * turn) * last) / np.sin(turn)
        + ((1.0 - s) * heights[0] + s * heights[1]) * axis
        for s in shares
    ]


def along(points: np.ndarray) -> np.ndarray:
    """Length of a path from its first point to each [m] (n,)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def at_lengths(points: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Places on a path at lengths from its first point [m] (m, 3)."""
    way = along(points)
    return np.column_stack([np.interp(lengths, way, points[:, k]) for k in range(3)])

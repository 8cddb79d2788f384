"""Support points of MuJoCo's shapes: the outermost point of each in a direction."""

import mujoco
import numpy as np


def support(model: mujoco.MjModel, data: mujoco.MjData, geom: int, directions: np.ndarray) -> np.ndarray:
    """Outermost points of a shape.

    Parameters
    ----------
    model, data : after the kinematics
    geom : sphere, capsule, cylinder, ellipsoid, box or mesh
    directions : unit vectors, world axes (n, 3)

    Returns
    -------
    world axes [m] (n, 3)
    """
    turn, size = data.geom_xmat[geom].reshape(3, 3), model.geom_size[geom]
    d = directions @ turn
    types, kind = mujoco.mjtGeom, model.geom_type[geom]
    if kind == types.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]].astype(float)
        local = vertices[np.argmax(d @ vertices.T, axis=1)]
    elif kind == types.mjGEOM_BOX:
        local = np.sign(d) * size
    elif kind == types.mjGEOM_ELLIPSOID:
        local = d * size**2 / np.linalg.norm(d * size, axis=1)[:, None]
    elif kind == types.mjGEOM_CYLINDER:
        radial = np.hypot(d[:, 0], d[:, 1]).clip(1e-12)
        local = np.column_stack([size[0] * d[:, :2] / radial[:, None], np.sign(d[:, 2]) * size[1]])
    elif kind == types.mjGEOM_CAPSULE:
        local = size[0] * d
        local[:, 2] += np.sign(d[:, 2]) * size[1]
    else:
        local = size[0] * d  # a sphere
    return np.asarray(data.geom_xpos[geom] + local @ turn.T)

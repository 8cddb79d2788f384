"""The shoe's sole: the parts under the foot's own sole, such as an orthosis' plate."""

import mujoco
import numpy as np

from afo_sim.model.foot import foot_of


def sole_thickness(model: mujoco.MjModel, body: str, joint: str) -> float:
    """Thickness of the parts that are worn below the foot's flat sole [m].

    It counts as a shoe's sole, and the other foot's shoe has one as thick. The whole body then stands higher
    by this thickness: a height of the foot's own sole above the floor of a barefoot walk is the clearance of
    the shoe's underside above the floor.

    Parameters
    ----------
    model : compiled; the foot is flat where all its joints are at zero
    body, joint : names of foot and ankle

    Returns
    -------
    from the foot's sole down to the lowest point of the bodies on the foot; 0 where they are all above it
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    foot = model.body(body).id
    sole = data.xanchor[model.joint(joint).id][2] - foot_of(model, body, joint).ankle_height
    worn = [g for g in range(model.ngeom) if _is_on(model, int(model.geom_bodyid[g]), foot)]
    return max(0.0, *(float(sole) - lowest(model, data, g) for g in worn)) if worn else 0.0


def _is_on(model: mujoco.MjModel, body: int, foot: int) -> bool:
    """True for a body that hangs on the foot and is not the foot."""
    parent = int(model.body_parentid[body])
    return body != 0 and (parent == foot or _is_on(model, parent, foot))


def lowest(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Height of a geometry's lowest point, with the kinematics computed [m]."""
    types, size = mujoco.mjtGeom, model.geom_size[geom]
    along = np.abs(data.geom_xmat[geom].reshape(3, 3)[2])  # how far its axes point up or down
    kind = model.geom_type[geom]
    if kind == types.mjGEOM_SPHERE:
        reach = size[0]
    elif kind == types.mjGEOM_ELLIPSOID:
        reach = np.linalg.norm(along * size)
    elif kind == types.mjGEOM_CAPSULE:
        reach = size[0] + along[2] * size[1]
    elif kind == types.mjGEOM_CYLINDER:
        reach = np.hypot(along[0], along[1]) * size[0] + along[2] * size[1]
    elif kind == types.mjGEOM_MESH:
        first = model.mesh_vertadr[model.geom_dataid[geom]]
        points = model.mesh_vert[first : first + model.mesh_vertnum[model.geom_dataid[geom]]]
        reach = -(points @ data.geom_xmat[geom].reshape(3, 3)[2]).min()
    else:  # a box; of all others the box about them
        reach = along @ (size if kind == types.mjGEOM_BOX else model.geom_aabb[geom, 3:])
    return float(data.geom_xpos[geom][2] - reach)

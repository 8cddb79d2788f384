"""Parts of a compiled model as elements of PyMJCF, number by number.

PyMJCF writes 17 digits, which is every bit of a number; MuJoCo's own text would keep six.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np

from afo_sim.native import N_USER
from afo_sim.rl.dm import mjcf

JOINTS = {
    int(mujoco.mjtJoint.mjJNT_HINGE): "hinge",
    int(mujoco.mjtJoint.mjJNT_SLIDE): "slide",
    int(mujoco.mjtJoint.mjJNT_BALL): "ball",
    int(mujoco.mjtJoint.mjJNT_FREE): "free",
}
SHAPES = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}
GAINS = {int(mujoco.mjtGain.mjGAIN_FIXED): "fixed", int(mujoco.mjtGain.mjGAIN_AFFINE): "affine"}
BIASES = {int(mujoco.mjtBias.mjBIAS_NONE): "none", int(mujoco.mjtBias.mjBIAS_USER): "user"}
DYNAMICS = {int(mujoco.mjtDyn.mjDYN_NONE): "none", int(mujoco.mjtDyn.mjDYN_USER): "user"}
TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
JOINT, SITE, PULLEY = (
    int(kind)
    for kind in (mujoco.mjtWrap.mjWRAP_JOINT, mujoco.mjtWrap.mjWRAP_SITE, mujoco.mjtWrap.mjWRAP_PULLEY)
)


@dataclass
class Copied:
    """Elements that stand for those of a compiled model, by their numbers there."""

    model: mujoco.MjModel
    sites: dict[int, Any] = field(default_factory=dict)
    geoms: dict[int, Any] = field(default_factory=dict)
    joints: dict[int, Any] = field(default_factory=dict)

    def body(self, parent: Any, body: int, skip: Callable[[str], bool] = lambda name: False) -> Any:
        """Add a body with all that is attached to it; those whose name is skipped stay out."""
        m = self.model
        made = parent.add("body", name=m.body(body).name, pos=m.body_pos[body], quat=m.body_quat[body])
        if m.body_mass[body] > 0.0:
            made.add(
                "inertial",
                pos=m.body_ipos[body],
                quat=m.body_iquat[body],
                mass=m.body_mass[body],
                diaginertia=m.body_inertia[body],
            )
        for joint in np.flatnonzero(m.jnt_bodyid == body):
            self._joint(made, int(joint))
        for geom in np.flatnonzero(m.geom_bodyid == body):
            self._geom(made, int(geom))
        for site in np.flatnonzero(m.site_bodyid == body):
            self._site(made, int(site))
        for child in np.flatnonzero(m.body_parentid == body):
            if not skip(m.body(child).name):
                self.body(made, int(child), skip)
        return made

    def _joint(self, parent: Any, joint: int) -> None:
        m = self.model
        dof = int(m.jnt_dofadr[joint])
        single = JOINTS[int(m.jnt_type[joint])] in ("hinge", "slide")
        limited = bool(m.jnt_limited[joint])
        at = int(m.jnt_qposadr[joint])
        self.joints[joint] = parent.add(
            "joint",
            name=m.joint(joint).name or None,
            type=JOINTS[int(m.jnt_type[joint])],
            pos=m.jnt_pos[joint],
            axis=m.jnt_axis[joint],
            limited="true" if limited else "false",
            range=m.jnt_range[joint] if limited else None,
            ref=m.qpos0[at] if single else None,
            springref=m.qpos_spring[at] if single else None,
            stiffness=m.jnt_stiffness[joint],
            damping=m.dof_damping[dof],
            armature=m.dof_armature[dof],
            frictionloss=m.dof_frictionloss[dof],
            margin=m.jnt_margin[joint],
            solreflimit=m.jnt_solref[joint],
            solimplimit=m.jnt_solimp[joint],
            solreffriction=m.dof_solref[dof],
            solimpfriction=m.dof_solimp[dof],
        )

    def _geom(self, parent: Any, geom: int) -> None:
        m = self.model
        kind = int(m.geom_type[geom])
        if kind not in SHAPES:
            return  # planes and height fields are the arena's
        shape: dict[str, Any] = {"size": m.geom_size[geom]}
        if SHAPES[kind] == "mesh":
            shape = {"mesh": self._mesh(parent.root, int(m.geom_dataid[geom]))}
        self.geoms[geom] = parent.add(
            "geom",
            name=m.geom(geom).name or None,
            type=SHAPES[kind],
            pos=m.geom_pos[geom],
            quat=m.geom_quat[geom],
            mass=0.0,  # the body's inertial has it
            rgba=m.geom_rgba[geom],
            group=m.geom_group[geom],
            contype=m.geom_contype[geom],
            conaffinity=m.geom_conaffinity[geom],
            condim=m.geom_condim[geom],
            friction=m.geom_friction[geom],
            solref=m.geom_solref[geom],
            solimp=m.geom_solimp[geom],
            margin=m.geom_margin[geom],
            gap=m.geom_gap[geom],
            **shape,
        )

    def _mesh(self, root: Any, mesh: int) -> Any:
        m = self.model
        name = m.mesh(mesh).name or f"mesh_{mesh}"
        found = root.find("mesh", name)
        if found is not None:
            return found
        vertices = m.mesh_vert[m.mesh_vertadr[mesh] :][: m.mesh_vertnum[mesh]]
        faces = m.mesh_face[m.mesh_faceadr[mesh] :][: m.mesh_facenum[mesh]]
        return root.asset.add("mesh", name=name, vertex=vertices.ravel(), face=faces.ravel())

    def _site(self, parent: Any, site: int) -> None:
        m = self.model
        self.sites[site] = parent.add(
            "site",
            name=m.site(site).name or None,
            pos=m.site_pos[site],
            quat=m.site_quat[site],
            size=m.site_size[site],
            rgba=m.site_rgba[site],
            group=m.site_group[site],
        )

    def tendon(self, root: Any, tendon: int, joints: Mapping[int, tuple[Any, float]]) -> Any:
        """Add a tendon."""
        m = self.model
        first = int(m.tendon_adr[tendon])
        parts = range(first, first + int(m.tendon_num[tendon]))
        fixed = int(m.wrap_type[first]) == JOINT
        look = {} if fixed else {"width": m.tendon_width[tendon], "rgba": m.tendon_rgba[tendon]}
        made = root.tendon.add("fixed" if fixed else "spatial", name=m.tendon(tendon).name, **look)
        for k in parts:
            kind, number, value = int(m.wrap_type[k]), int(m.wrap_objid[k]), float(m.wrap_prm[k])
            if kind == JOINT:
                joint, sign = joints[number]
                made.add("joint", joint=joint, coef=sign * value)
            elif kind == SITE:
                made.add("site", site=self.sites[number])
            elif kind == PULLEY:
                made.add("pulley", divisor=value)
            else:
                beside = self.sites[round(value)] if value >= 0.0 else None
                made.add("geom", geom=self.geoms[number], sidesite=beside)
        return made

    def actuator(self, root: Any, actuator: int, joint: Any) -> Any:
        """Add an actuator of the callbacks', without parameters; those on a joint stand on `joint`."""
        m = self.model
        name = m.actuator(actuator).name
        on_tendon = int(m.actuator_trntype[actuator]) == TENDON
        states = int(m.actuator_actnum[actuator])
        return root.actuator.add(
            "general",
            name=name,
            **({"tendon": root.find("tendon", name)} if on_tendon else {"joint": joint}),
            gear=m.actuator_gear[actuator],
            gaintype=GAINS[int(m.actuator_gaintype[actuator])],
            gainprm=m.actuator_gainprm[actuator],
            biastype=BIASES[int(m.actuator_biastype[actuator])],
            dyntype=DYNAMICS[int(m.actuator_dyntype[actuator])],
            ctrllimited="false",
            forcelimited="false",
            actlimited="false",
            user=np.zeros(N_USER),
            **({"actdim": states} if states else {}),
        )


def new_model(name: str) -> Any:
    """An empty PyMJCF model; its defaults are its own, whatever it is attached to."""
    return mjcf.RootElement(model=name)

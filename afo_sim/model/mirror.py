"""The other side's leg: a spec mirrored at its x–z plane.

A place and a direction (x, y, z) become (x, −y, z). A hinge's axis becomes (−x, y, −z): the mirror image of a
turn about a is a turn about −M a with M = diag(1, −1, 1), so that a joint's angle, and what moves it, keep
their signs. By the same rule the orientation (w, x, y, z) becomes (w, −x, y, −z), M R M. Axes stay
right-handed: x forward, y left, z up.
"""

from collections.abc import Iterable

import mujoco
import numpy as np

from afo_sim.common import Foreign, InputError
from afo_sim.description import Scenario

PLACE = np.array([1.0, -1.0, 1.0])
AXIS = -PLACE
QUATERNION = np.array([1.0, -1.0, 1.0, -1.0])
FULL_INERTIA = np.array([1.0, 1.0, 1.0, -1.0, 1.0, -1.0])  # xx, yy, zz, xy, xz, yz
CAMERA = np.array([0.0, 0.0, 0.0, 1.0])  # a mirrored camera's picture is upright again half a turn on


def orthosis_mirrored(scenario: Scenario) -> bool:
    """Whether the orthosis is simulated on the other side than it is described for."""
    return scenario.simulated_side != scenario.orthosis.side


def mirror(spec: mujoco.MjSpec) -> None:
    """Mirror all of a spec at its x–z plane."""
    others = [("a height field", spec.hfields), ("a skin", spec.skins), ("a flexible part", spec.flexes)]
    others.append(("a constraint between bodies", [e for e in spec.equalities if e.type in _BETWEEN_BODIES]))
    others.append(("a free or ball joint", [joint for joint in spec.joints if joint.type in _MANY_AXES]))
    for what, found in others:
        if len(found):
            problem = f"has {what}, of which no mirror image is made: name the side that the file is for"
            raise InputError(problem, field="side", allowed='side = "left" beside file, for a left leg\'s')
    for mesh in spec.meshes:
        mesh.scale = _flipped(mesh.scale, PLACE)
    for frame in spec.frames:
        _mirror_pose(frame)
    for body in spec.bodies:
        _mirror_pose(body)
        _turn(body, "iquat", "ialt")
        body.ipos = _flipped(body.ipos, PLACE)
        body.fullinertia = _flipped(body.fullinertia, FULL_INERTIA)
        mirror_shapes(body)
        for joint in body.joints:
            joint.pos = _flipped(joint.pos, PLACE)
            slides = joint.type == mujoco.mjtJoint.mjJNT_SLIDE
            joint.axis = _flipped(joint.axis, PLACE if slides else AXIS)
        for camera in body.cameras:
            _mirror_pose(camera)
            turned = np.empty(4)
            mujoco.mju_mulQuat(turned, np.array(camera.quat), CAMERA)
            camera.quat = turned
        for light in body.lights:
            light.pos, light.dir = _flipped(light.pos, PLACE), _flipped(light.dir, PLACE)


_BETWEEN_BODIES = (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD)
_MANY_AXES = (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL)


def mirror_shapes(body: mujoco.MjsBody) -> None:
    """Mirror the shapes and sites of one body at the x–z plane of its axes."""
    for element in (*body.geoms, *body.sites):
        _mirror_pose(element)
        element.fromto = _flipped(element.fromto, np.tile(PLACE, 2))


def _mirror_pose(element: Foreign) -> None:
    """Mirror place and orientation of a body, frame, shape, site or camera."""
    element.pos = _flipped(element.pos, PLACE)
    _turn(element, "quat", "alt")


def _turn(element: Foreign, name: str, instead: str) -> None:
    """Mirror an orientation, which may be stated in another way than by a quaternion."""
    stated, quaternion = getattr(element, instead), np.array(getattr(element, name))
    if stated.type != mujoco.mjtOrientation.mjORIENTATION_QUAT:
        compiler = element.compiler
        resolve = mujoco.MjSpec().resolve_orientation
        quaternion = np.array(resolve(compiler.degree, compiler.eulerseq, stated))
        stated.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    setattr(element, name, _flipped(quaternion, QUATERNION))


def _flipped(values: Iterable[float], signs: np.ndarray) -> np.ndarray:
    """Values with some signs turned, and never a −0."""
    return np.asarray(values, dtype=float) * signs + 0.0

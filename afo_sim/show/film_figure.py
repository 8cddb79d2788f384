"""What walking adds to a film's pictures: the whole figure, the ground's force, the height of the toes."""

from typing import Any

import mujoco
import numpy as np

from afo_sim.show.ground_force import SIDE, GroundForce
from afo_sim.show.moving_parts import Carriage
from afo_sim.show.walking_figure import APART, LIMBS, Pose, WalkingFigure

_AZIMUTH, _ELEVATION = 93.0, -4.0  # of the camera, from the side [deg]
_TALL, _WIDE, _MIDDLE = 1.24, 0.8, 0.46  # what is seen, and its middle's height, in body heights [-]
_GREY, _GREEN, _PALE = (0.55, 0.57, 0.6, 0.5), (0.1, 0.6, 0.2, 1.0), (0.1, 0.6, 0.2, 0.3)  # RGBA
_ABOVE, _BELOW = (0.1, 0.5, 0.3, 1.0), (0.75, 0.1, 0.1, 1.0)
_HEAD = 0.1  # radius [m]
_SOLE, _ARROW, _MARK = 0.016, 0.014, 0.006  # radii: of the other foot, the arrow, the toes' height [m]
_CAPSULE, _ROUND = mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_SPHERE


class FilmFigure:
    """Adds to a film's pictures what a walker has beyond shank, foot and device."""

    def __init__(self, figure: WalkingFigure) -> None:
        self.figure, self.number, recording = figure, figure.stride.number, figure.view.recording
        walked = recording["gait/stride"] + recording["gait/phase"]
        self.carriage = Carriage.beside(recording["time"], walked, recording["ankle/position/x"])
        self.height = figure.limbs.height

    def set_up(
        self, model: mujoco.MjModel, scene: mujoco.MjvScene, camera: mujoco.MjvCamera, aspect: float
    ) -> None:
        """A camera without perspective: foot, floor and arrow stand over one another as they are."""
        model.vis.global_.orthographic = 1
        model.vis.global_.fovy = self.height * max(_TALL, _WIDE * aspect)
        camera.azimuth, camera.elevation, camera.distance = _AZIMUTH, _ELEVATION, 3.0
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0  # in software as slow as all else

    def look_at(self, phase: float) -> tuple[float, float, float]:
        """The camera's aim [m]."""
        return float(self.carriage.at(np.array(self.number + phase))), 0.0, _MIDDLE * self.height

    def add(self, scene: mujoco.MjvScene, phase: float) -> str:
        """Add all to a scene, and return what is to be read below it."""
        pose, stride = self.figure.pose(phase), self.figure.stride
        self._add_limbs(scene, pose)
        if phase > stride.toe_off:
            x, z = min(pose.sole[1:], key=lambda point: float(point[1]))
            ends, low = np.array([[x, SIDE, 0.0], [x, SIDE, z]]), self.figure.lowest(phase)
            _add(scene, _CAPSULE, _MARK, ends, _BELOW if low < 0.0 else _ABOVE)
            return f"toe {_height(low)}"
        view = self.figure.view
        force = GroundForce.of(lambda name: stride.at(name, phase), view.recording.columns, view.body_mass)
        if not force.stands:
            return ""
        # MuJoCo draws an arrow at half its stated length.
        ends = np.array([force.start, force.start + 2.0 * force.vector])
        _add(scene, mujoco.mjtGeom.mjGEOM_ARROW, _ARROW, ends, _GREEN if force.borne else _PALE)
        return "" if force.borne else f"recorded force; sole {_height(float(force.sole))}"

    def _add_limbs(self, scene: mujoco.MjvScene, pose: Pose) -> None:
        """Trunk between the legs, the other leg beyond it."""
        for lower, upper, radius, aside in LIMBS:
            ends = [_at(getattr(pose, end), aside) for end in (lower, upper)]
            _add(scene, _CAPSULE, radius, np.array(ends), _GREY)
        _add(scene, _ROUND, _HEAD, np.array([_at(pose.head, 0.5 * APART)]), _GREY)
        above = np.array([0.0, 0.0, _SOLE])
        heel, ball, _, tip = (_at(point, APART) + above for point in pose.other_sole)
        ankle = _at(pose.other_ankle, APART)
        for start, end in ((heel, ball), (ball, tip), (ankle, heel), (ankle, ball)):
            _add(scene, _CAPSULE, _SOLE, np.array([start, end]), _GREY)


def _height(height: float) -> str:
    return f"{abs(1e3 * height):.0f} mm {'below' if height < 0.0 else 'above'} the floor"


def _at(point: np.ndarray, aside: float) -> np.ndarray:
    """A point of the sagittal plane in space, so far from the camera's side [m] (3,)."""
    return np.array([point[0], aside, point[1]])


def _add(scene: mujoco.MjvScene, kind: Any, radius: float, ends: np.ndarray, colour: Any) -> None:
    """A shape from one end to the other; a sphere at the first."""
    geom, size = scene.geoms[scene.ngeom], np.full(3, radius)
    mujoco.mjv_initGeom(geom, kind, size, ends[0], np.eye(3).ravel(), np.array(colour, np.float32))
    if kind != _ROUND:
        mujoco.mjv_connector(geom, kind, radius, *ends)
    scene.ngeom += 1

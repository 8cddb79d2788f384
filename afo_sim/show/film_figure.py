"""What walking adds to a film's pictures: the whole figure, the ground's force, the height of the toes."""

import mujoco
import numpy as np

from afo_sim.common import FloatOrArray
from afo_sim.show.ground_force import SIDE, GroundForce
from afo_sim.show.moving_parts import Carriage
from afo_sim.show.walking_figure import RADII, WalkingFigure, capsules, height_words

_AZIMUTH, _ELEVATION = 93.0, -4.0  # of the camera, from the side [deg]
_TALL, _WIDE, _MIDDLE = 1.24, 0.8, 0.46  # what is seen, and its middle's height, in body heights [-]
_GREY, _GREEN = (0.55, 0.57, 0.6, 0.5), (0.1, 0.6, 0.2, 1.0)  # RGBA
_ABOVE, _BELOW = (0.1, 0.5, 0.3, 1.0), (0.75, 0.1, 0.1, 1.0)
_ARROW, _MARK = 0.014, 0.006  # radii: of the arrow, of the toes' height [m]
_CAPSULE = mujoco.mjtGeom.mjGEOM_CAPSULE


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
        for radius, ends in zip(RADII, capsules(vars(pose)), strict=True):
            _add(scene, _CAPSULE, radius, ends, _GREY)
        if phase > stride.toe_off:
            x, z = min(pose.sole[1:], key=lambda point: float(point[1]))
            ends, low = np.array([[x, SIDE, 0.0], [x, SIDE, z]]), self.figure.lowest(phase)
            deep = self.figure.lowest(phase, floor=False)
            _add(scene, _CAPSULE, _MARK, ends, _BELOW if deep < 0.0 else _ABOVE)
            return height_words(low, deep)
        force = GroundForce.of(lambda name: stride.at(name, phase), self.figure.view.body_mass)
        if force.stands:
            # MuJoCo draws an arrow at half its stated length.
            ends = np.array([force.start, force.start + 2.0 * force.vector])
            _add(scene, mujoco.mjtGeom.mjGEOM_ARROW, _ARROW, ends, _GREEN)
        return ""


def _add(
    scene: mujoco.MjvScene, kind: mujoco.mjtGeom, radius: float, ends: np.ndarray, colour: FloatOrArray
) -> None:
    geom = scene.geoms[scene.ngeom]
    still = np.zeros(3), np.zeros(3), np.zeros(9)
    mujoco.mjv_initGeom(geom, kind, *still, np.array(colour, np.float32))
    mujoco.mjv_connector(geom, kind, radius, ends[0], ends[1] + 1e-6)  # without a length nothing is drawn
    scene.ngeom += 1

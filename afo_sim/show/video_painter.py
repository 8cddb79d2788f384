"""Pictures of a recording's rows through MuJoCo's renderer: leg, muscles by force, ground force."""

from typing import Self

import mujoco
import numpy as np

from afo_sim.common.units import GRAVITY
from afo_sim.description.reader import load
from afo_sim.description.scenario_text import body_mass
from afo_sim.metrics.strides import loaded
from afo_sim.model.mounting import muscle_names
from afo_sim.show.carriage import Carriage
from afo_sim.show.mountings import Mountings
from afo_sim.show.video_scenery import (
    AZIMUTH,
    DISTANCE,
    DRAWN,
    ELEVATION,
    LOOK_AT,
    opengl_context,
    scenery,
)
from afo_sim.simulation.recording import Recording

FORCE_SCALE = 50.0  # tension at which a muscle is fully coloured [N]
SLACK, PULLING = np.array([0.62, 0.64, 0.68, 1.0]), np.array([0.84, 0.20, 0.05, 1.0])  # RGBA
# Beside somebody walking, from the carriage.
WALK_LOOK_AT, WALK_DISTANCE, WALK_AZIMUTH, WALK_ELEVATION = (0.02, 0.0, 0.24), 1.25, 99.0, -9.0
ARROW = 0.5  # length of a ground force of one body weight [m]
ARROW_COLOUR, SIDE = [0.1, 0.6, 0.2, 1.0], -0.065  # drawn beside the foot, towards the camera [m]


class Painter:
    """Pictures of a recording's rows. A context manager: OpenGL's memory is given back at its end."""

    def __init__(self, recording: Recording, width: int, height: int):
        self.recording = recording
        self.walk = WalkView(recording) if "gait/phase" in recording.columns else None
        ends = None if self.walk is None else self.walk.carriage.ends
        self.model = model = scenery(recording.model_xml, width, height, ends)
        self.data = mujoco.MjData(model)
        self.coordinates = [
            (model.jnt_qposadr[j], recording[f"qpos/{model.joint(j).name}"]) for j in range(model.njnt)
        ]
        names = [model.tendon(t).name.removesuffix(DRAWN) for t in range(model.ntendon)]
        self.forces = [recording[f"muscle/{name}/force"] for name in names]
        groups = muscle_names(load("orthosis", recording.scenario["orthosis"]))
        self.mountings = Mountings(model, groups, recording.columns)
        self.scene = mujoco.MjvScene(model, maxgeom=1000)
        self.options, self.camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self.options.sitegroup[:] = 0
        self.camera.lookat, self.camera.distance = LOOK_AT, DISTANCE
        self.camera.azimuth, self.camera.elevation = AZIMUTH, ELEVATION
        if self.walk is not None:
            self.camera.distance = WALK_DISTANCE
            self.camera.azimuth, self.camera.elevation = WALK_AZIMUTH, WALK_ELEVATION
        self.viewport = mujoco.MjrRect(0, 0, width, height)
        self.pixels = np.empty((height, width, 3), np.uint8)
        self.opengl, self.context = opengl_context(model, width, height)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.context.free()
        self.opengl.free()

    def picture(self, row: int) -> np.ndarray:
        """The leg, its muscles coloured by force, and the time and angle of a row (height, width, 3)."""
        for address, values in self.coordinates:
            self.data.qpos[address] = values[row]
        for tendon, force in enumerate(self.forces):
            share = np.clip(force[row] / FORCE_SCALE, 0.0, 1.0) ** 0.5
            self.model.tendon_rgba[tendon] = SLACK + share * (PULLING - SLACK)
        given = {a: float(self.recording[column][row]) for a, column in self.mountings.columns.items()}
        self.mountings.place(given)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        mujoco.mj_tendon(self.model, self.data)
        if self.walk is not None:
            self.camera.lookat = self.walk.look_at(row)
        mujoco.mjv_updateScene(
            self.model, self.data, self.options, None, self.camera, mujoco.mjtCatBit.mjCAT_ALL, self.scene
        )
        if self.walk is not None:
            self.walk.add_force(self.scene, row)
        mujoco.mjr_render(self.viewport, self.scene, self.context)
        caption = self._caption(row)
        mujoco.mjr_overlay(
            mujoco.mjtFont.mjFONT_NORMAL,
            mujoco.mjtGridPos.mjGRID_TOPLEFT,
            self.viewport,
            *caption,
            self.context,
        )
        mujoco.mjr_readPixels(self.pixels, None, self.viewport, self.context)
        return self.pixels[::-1]  # OpenGL counts rows from below

    def _caption(self, row: int) -> tuple[str, str]:
        recording = self.recording
        joint = recording.scenario["leg"]["ankle"]
        lines = {
            "time": f"{recording['time'][row]:.2f} s",
            f"{joint} angle": f"{np.degrees(recording['ankle/angle'][row]):+.1f} deg",
        }
        if self.walk is not None:
            stride, phase = (recording[f"gait/{name}"][row] for name in ("stride", "phase"))
            lines["stride"] = f"{stride + 1:.0f}, {100.0 * phase:.0f} %"
        for chamber in recording.scenario["orthosis"]["chamber"]:
            lines[f"{chamber} pressure"] = f"{recording[f'chamber/{chamber}/pressure'][row] * 1e-5:.2f} bar"
        return "\n".join(lines), "\n".join(lines.values())


class WalkView:
    """Additions of walking to the pictures: a camera that keeps up, and the ground's force."""

    def __init__(self, recording: Recording):
        self.recording = recording
        self.walked = recording["gait/stride"] + recording["gait/phase"]
        self.carriage = Carriage.beside(recording["time"], self.walked, recording["ankle/position/x"])
        self.body_mass = body_mass(recording.scenario)  # [kg]

    def look_at(self, row: int) -> tuple[float, float, float]:
        """The camera's aim [m]."""
        x, y, z = WALK_LOOK_AT
        return x + float(self.carriage.at(self.walked[row])), y, z

    def add_force(self, scene: mujoco.MjvScene, row: int) -> None:
        """An arrow at the centre of pressure, where the foot stands."""
        place, forward, upward = (
            self.recording[f"ground/{name}"][row] for name in ("position/x", "force/x", "force/z")
        )
        if not loaded(upward, self.body_mass):
            return
        start = np.array([place, SIDE, 0.0])
        # MuJoCo draws an arrow at half its stated length.
        end = start + 2.0 * np.array([forward, 0.0, upward]) * ARROW / (self.body_mass * GRAVITY)
        kind, geom = mujoco.mjtGeom.mjGEOM_ARROW, scene.geoms[scene.ngeom]
        colour = np.array(ARROW_COLOUR, np.float32)
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), colour)
        mujoco.mjv_connector(geom, kind, 0.014, start, end)
        scene.ngeom += 1

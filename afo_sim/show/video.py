"""Recording → MP4: the run replayed in MuJoCo, in real time, encoded by ffmpeg."""

import importlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import IO, Any, Self

import mujoco
import numpy as np

from afo_sim.common import GRAVITY, InputError, child_environment, replacing
from afo_sim.description import body_mass, load
from afo_sim.metrics import loaded
from afo_sim.model import muscle_names
from afo_sim.show.moving_parts import Carriage, Mountings
from afo_sim.simulation import Recording

_LOOK_AT, _DISTANCE, _AZIMUTH, _ELEVATION = (0.03, 0.0, 0.43), 1.1, 120.0, -12.0  # [m], [deg]
_EDGE, _FAR, _MARGIN = -0.06, 1.2, 3.0  # sides of the walkway, and its length beyond both ends [m]
_DRAWN = "_drawn"  # suffix of a tendon that is there for the picture only
_PULLEY_MUSCLE = 0.01  # radius at which a muscle over a pulley is drawn [m]


def scenery(
    xml: str,
    width: int,
    height: int,
    walkway: tuple[float, float] | None = None,
) -> mujoco.MjModel:
    """The model of a run with a floor, a light and a background, for pictures of a size [pixel].

    A walkway reaches from one x to another [m], and has squares of 25 cm. Outsoles stand at height 0.
    """
    spec = mujoco.MjSpec.from_string(xml)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.5] * 3, [0.25] * 3
    spec.visual.headlight.specular = [0.1] * 3
    spec.stat.center, spec.stat.extent = _LOOK_AT, 1.0
    spec.add_texture(
        name="background",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.86, 0.90, 0.94],
        rgb2=[0.97, 0.97, 0.97],
        width=256,
        height=1536,
    )
    plane, sun = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    if walkway is None:
        spec.worldbody.add_geom(name="floor", type=plane, size=[0.0, 0.0, 0.1], rgba=[0.97, 0.97, 0.97, 1.0])
    else:
        _add_walkway(spec, *walkway)
    spec.worldbody.add_light(type=sun, pos=[0.6, -0.8, 2.0], dir=[-0.3, 0.4, -1.0], diffuse=[0.4] * 3)
    _draw_pulley_muscles(spec)
    return spec.compile()


def _add_walkway(spec: mujoco.MjSpec, start: float, end: float) -> None:
    """A floor cut along the foot's side, as in a section: what sinks below it is seen."""
    spec.add_texture(
        name="squares",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.90, 0.90, 0.90],
        rgb2=[0.80, 0.81, 0.83],
        width=256,
        height=256,
    )
    squares = spec.add_material(name="squares", texuniform=True, texrepeat=[2.0, 2.0])
    squares.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "squares"
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=[0.5 * (start + end), 0.5 * (_EDGE + _FAR), 0.0],
        size=[0.5 * (end - start) + _MARGIN, 0.5 * (_FAR - _EDGE), 0.1],
        material="squares",
    )


def _draw_pulley_muscles(spec: mujoco.MjSpec) -> None:
    """A path beside each fixed tendon, which MuJoCo does not draw."""
    plain = mujoco.MjModel.from_xml_string(spec.to_xml())
    for t in range(plain.ntendon):
        name = plain.tendon(t).name
        if plain.wrap_type[plain.tendon_adr[t]] == mujoco.mjtWrap.mjWRAP_JOINT:
            drawn = spec.add_tendon(name=name + _DRAWN, width=_PULLEY_MUSCLE)
            for end in ("origin", "insertion"):
                drawn.wrap_site(f"{name}_{end}")


def opengl_context(model: mujoco.MjModel, width: int, height: int) -> tuple[Any, mujoco.MjrContext]:
    """An OpenGL context off the screen, and MuJoCo's drawing context in it.

    MUJOCO_GL names the backend, whenever it was set; without it and without a display, EGL is taken.
    """
    headless = sys.platform.startswith("linux") and not os.environ.get("DISPLAY")
    backend = os.environ.get("MUJOCO_GL", "").lower().strip() or ("egl" if headless else "")
    try:
        if backend in ("egl", "osmesa"):
            opengl = importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
        else:
            opengl = mujoco.GLContext(width, height)
        opengl.make_current()
        context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, context)
    except Exception as error:  # each backend has errors of its own
        raise InputError(
            f"there is no OpenGL to draw with ({backend or 'default'} backend: {error}); "
            "set MUJOCO_GL=egl or MUJOCO_GL=osmesa and install its libraries "
            "(Debian, Ubuntu: libegl1 libegl-mesa0 libgl1-mesa-dri, or libosmesa6)"
        ) from error
    return opengl, context


_FORCE_SCALE = 50.0  # tension at which a muscle is fully coloured [N]
_SLACK, _PULLING = np.array([0.62, 0.64, 0.68, 1.0]), np.array([0.84, 0.20, 0.05, 1.0])  # RGBA
# Beside somebody walking, from the carriage.
_WALK_LOOK_AT, _WALK_DISTANCE, _WALK_AZIMUTH, _WALK_ELEVATION = (0.02, 0.0, 0.24), 1.25, 99.0, -9.0
_ARROW = 0.5  # length of a ground force of one body weight [m]
_ARROW_COLOUR, _SIDE = [0.1, 0.6, 0.2, 1.0], -0.065  # drawn beside the foot, towards the camera [m]


class Painter:
    """Pictures of a recording's rows. A context manager: OpenGL's memory is given back at its end."""

    def __init__(self, recording: Recording, width: int, height: int):
        self.recording = recording
        self.walk = _WalkView(recording) if "gait/phase" in recording.columns else None
        ends = None if self.walk is None else self.walk.carriage.ends
        self.model = model = scenery(recording.model_xml, width, height, ends)
        self.data = mujoco.MjData(model)
        self.coordinates = [
            (model.jnt_qposadr[j], recording[f"qpos/{model.joint(j).name}"]) for j in range(model.njnt)
        ]
        names = [model.tendon(t).name.removesuffix(_DRAWN) for t in range(model.ntendon)]
        self.forces = [recording[f"muscle/{name}/force"] for name in names]
        groups = muscle_names(load("orthosis", recording.scenario["orthosis"]))
        self.mountings = Mountings(model, groups, recording.columns)
        self.scene = mujoco.MjvScene(model, maxgeom=1000)
        self.options, self.camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self.options.sitegroup[:] = 0
        self.camera.lookat, self.camera.distance = _LOOK_AT, _DISTANCE
        self.camera.azimuth, self.camera.elevation = _AZIMUTH, _ELEVATION
        if self.walk is not None:
            self.camera.distance = _WALK_DISTANCE
            self.camera.azimuth, self.camera.elevation = _WALK_AZIMUTH, _WALK_ELEVATION
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
            share = np.clip(force[row] / _FORCE_SCALE, 0.0, 1.0) ** 0.5
            self.model.tendon_rgba[tendon] = _SLACK + share * (_PULLING - _SLACK)
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


class _WalkView:
    """Additions of walking to the pictures: a camera that keeps up, and the ground's force."""

    def __init__(self, recording: Recording):
        self.recording = recording
        self.walked = recording["gait/stride"] + recording["gait/phase"]
        self.carriage = Carriage.beside(recording["time"], self.walked, recording["ankle/position/x"])
        self.body_mass = body_mass(recording.scenario)  # [kg]

    def look_at(self, row: int) -> tuple[float, float, float]:
        """The camera's aim [m]."""
        x, y, z = _WALK_LOOK_AT
        return x + float(self.carriage.at(self.walked[row])), y, z

    def add_force(self, scene: mujoco.MjvScene, row: int) -> None:
        """An arrow at the centre of pressure, where the foot stands."""
        place, forward, upward = (
            self.recording[f"ground/{name}"][row] for name in ("position/x", "force/x", "force/z")
        )
        if not loaded(upward, self.body_mass):
            return
        start = np.array([place, _SIDE, 0.0])
        # MuJoCo draws an arrow at half its stated length.
        end = start + 2.0 * np.array([forward, 0.0, upward]) * _ARROW / (self.body_mass * GRAVITY)
        kind, geom = mujoco.mjtGeom.mjGEOM_ARROW, scene.geoms[scene.ngeom]
        colour = np.array(_ARROW_COLOUR, np.float32)
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), colour)
        mujoco.mjv_connector(geom, kind, 0.014, start, end)
        scene.ngeom += 1


_Progress = Callable[[int, int], None]


def write_video(
    recording: Recording,
    path: pathlib.Path,
    *,
    rate: float = 30.0,
    width: int = 1280,
    height: int = 720,
    progress: _Progress | None = None,
) -> None:
    """Replay a run as an MP4 video, in real time.

    Parameters
    ----------
    recording : a finished recording
    path : file to write, whole or not at all
    rate : frames per second [1/s]
    width, height : of the picture, even numbers [pixel]
    progress : called with (frames done, frames in all)

    Raises
    ------
    InputError
        The recording has no rows, a number is out of range, ffmpeg is missing or refuses, or there
        is no OpenGL to draw with.
    """
    rows = _rows(recording, rate)
    for field, pixels in (("width", width), ("height", height)):
        if pixels < 2 or pixels % 2:
            raise InputError(
                "is not a valid size of a picture", field=field, value=pixels, allowed="even, at least 2"
            )
    program = _ffmpeg()
    with (
        Painter(recording, width, height) as painter,
        replacing(path) as temporary,
        _encoder(program, temporary, rate, width, height) as frames,
    ):
        for done, row in enumerate(rows, start=1):
            frames.write(painter.picture(int(row)).tobytes())
            if progress is not None:
                progress(done, len(rows))


def _rows(recording: Recording, rate: float) -> np.ndarray:
    """Row of the recording in each frame."""
    time = recording["time"]
    if not len(time):
        raise InputError(f"there is nothing to draw: the recording has no rows ({recording.status})")
    if not 0.0 < rate <= 1000.0:
        raise InputError("is not a valid frame rate", field="rate", value=rate, allowed="above 0 to 1000")
    count = int((time[-1] - time[0]) * rate + 1e-6) + 1
    return np.minimum(np.searchsorted(time, time[0] + np.arange(count) / rate - 1e-9), len(time) - 1)


def _ffmpeg() -> str:
    program = shutil.which("ffmpeg", path=child_environment().get("PATH"))
    if program is None or not pathlib.Path(program).is_absolute():  # Windows takes the current folder first
        raise InputError(
            "videos are encoded by the program ffmpeg, which is not installed; install the package "
            "ffmpeg (Debian, Ubuntu: apt install ffmpeg; macOS: brew install ffmpeg)"
        )
    return program


@contextmanager
def _encoder(program: str, path: pathlib.Path, rate: float, width: int, height: int) -> Iterator[IO[bytes]]:
    """A stream that takes raw RGB frames, of which ffmpeg makes an MP4."""
    command = [program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{width}x{height}", "-r", repr(rate), "-i", "-"]
    command += ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"]
    command += ["-f", "mp4", f"file:{path}"]
    quiet = {"stdout": subprocess.DEVNULL, "env": child_environment()}
    with (
        tempfile.TemporaryFile() as log,
        subprocess.Popen(command, stdin=subprocess.PIPE, stderr=log, **quiet) as process,  # type: ignore[call-overload]
    ):
        assert process.stdin is not None
        try:
            yield process.stdin
        except BrokenPipeError:
            pass  # ffmpeg ended early; its exit code and message say why
        except BaseException:
            process.kill()
            raise
        finally:
            with suppress(BrokenPipeError):
                process.stdin.close()
        if process.wait() != 0:
            log.seek(0)
            raise InputError(f"ffmpeg failed: {log.read().decode(errors='replace').strip()[-500:]}")

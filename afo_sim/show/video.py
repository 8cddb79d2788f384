"""Recordings → MP4: a seated run in real time, a stride of walks side by side in slow motion."""

import importlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from typing import IO, Self

import mujoco
import numpy as np

from afo_sim.common import Foreign, InputError, Keywords, child_environment, replacing
from afo_sim.description import load, worn
from afo_sim.model import muscle_names
from afo_sim.show.film_figure import FilmFigure
from afo_sim.show.ground_force import EDGE
from afo_sim.show.moving_parts import Mountings
from afo_sim.show.run_view import alone
from afo_sim.show.walking_figure import WalkingFigure, reference_view
from afo_sim.simulation import Recording

_LOOK_AT, _DISTANCE, _AZIMUTH, _ELEVATION = (0.03, 0.0, 0.43), 1.1, 120.0, -12.0  # [m], [deg]
_FAR, _MARGIN = 1.2, 3.0  # far side of the walkway, and its length beyond both ends [m]
_DRAWN = "_drawn"  # suffix of a tendon that is there for the picture only
_PULLEY_MUSCLE = 0.01  # radius at which a muscle over a pulley is drawn [m]
_LINE = 40  # height of the title [pixel]
_FORCE_SCALE = 50.0  # tension at which a muscle is fully coloured [N]
_SLACK, _PULLING = np.array([0.62, 0.64, 0.68, 1.0]), np.array([0.84, 0.20, 0.05, 1.0])  # RGBA
_Shot = tuple[str, Recording, WalkingFigure | None]  # title, run, and who walks
_MOST = 3  # walks beside one another
_SLOW = 4.0  # slow motion of a walk [-]


def scenery(xml: str, width: int, height: int, walkway: tuple[float, float] | None = None) -> mujoco.MjModel:
    """The model of a run with a floor, a light and a background, for pictures of a size [pixel]."""
    spec = mujoco.MjSpec.from_string(xml)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    spec.visual.quality.shadowsize = 1024  # in software a shadow of 4096 takes as long as the picture
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [0.5] * 3, [0.25] * 3
    spec.visual.headlight.specular = [0.1] * 3
    spec.stat.center, spec.stat.extent = _LOOK_AT, 1.0
    kinds, patterns = mujoco.mjtTexture, mujoco.mjtBuiltin
    sky: Keywords = {"rgb1": [0.86, 0.90, 0.94], "rgb2": [0.97] * 3, "width": 256, "height": 1536}
    box, shade = kinds.mjTEXTURE_SKYBOX, patterns.mjBUILTIN_GRADIENT
    spec.add_texture(name="background", type=box, builtin=shade, **sky)
    floor: Keywords = {"size": [0.0, 0.0, 0.1], "rgba": [0.97, 0.97, 0.97, 1.0]}
    if walkway is not None:
        tiles: Keywords = {"rgb1": [0.9] * 3, "rgb2": [0.8, 0.81, 0.83], "width": 256, "height": 256}
        spec.add_texture(name="squares", type=kinds.mjTEXTURE_2D, builtin=patterns.mjBUILTIN_CHECKER, **tiles)
        squares = spec.add_material(name="squares", texuniform=True, texrepeat=[2.0, 2.0])
        squares.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "squares"
        (start, end), wide = walkway, _FAR - EDGE
        place = {"pos": [0.5 * (start + end), EDGE + 0.5 * wide, 0.0], "material": "squares"}
        floor = place | {"size": [0.5 * (end - start) + _MARGIN, 0.5 * wide, 0.1]}
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, **floor)
    sun = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    spec.worldbody.add_light(type=sun, pos=[0.6, -0.8, 2.0], dir=[-0.3, 0.4, -1.0], diffuse=[0.4] * 3)
    plain = mujoco.MjModel.from_xml_string(spec.to_xml())  # a path beside each fixed tendon, not drawn itself
    for t in range(plain.ntendon):
        name = plain.tendon(t).name
        if plain.wrap_type[plain.tendon_adr[t]] == mujoco.mjtWrap.mjWRAP_JOINT:
            drawn = spec.add_tendon(name=name + _DRAWN, width=_PULLEY_MUSCLE)
            for site in ("origin", "insertion"):
                drawn.wrap_site(f"{name}_{site}")
    return spec.compile()


def opengl_context(model: mujoco.MjModel, width: int, height: int) -> tuple[Foreign, mujoco.MjrContext]:
    """An OpenGL context off the screen, and MuJoCo's drawing context in it."""
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
        text = f"there is no OpenGL to draw with ({backend or 'default'} backend: {error}); "
        text += "set MUJOCO_GL=egl or MUJOCO_GL=osmesa and install its libraries "
        text += "(Debian, Ubuntu: libegl1 libegl-mesa0 libgl1-mesa-dri, or libosmesa6)"
        raise InputError(text) from error
    return opengl, context


class Painter:
    """Pictures of a run. A context manager: OpenGL's memory is given back at its end."""

    def __init__(
        self,
        recording: Recording,
        width: int,
        height: int,
        figure: WalkingFigure | None = None,
        title: str = "",
    ):
        self.recording, self.title = recording, title
        self.walk = None if figure is None else FilmFigure(figure)
        ends = None if self.walk is None else self.walk.carriage.ends
        self.model = model = scenery(recording.model_xml, width, height, ends)
        self.data = mujoco.MjData(model)
        names = [model.tendon(t).name.removesuffix(_DRAWN) for t in range(model.ntendon)]
        self.forces = [f"muscle/{name}/force" for name in names]
        groups = muscle_names(load("orthosis", recording.described["orthosis"]))
        self.mountings = Mountings(model, groups, recording.columns)
        self.scene = mujoco.MjvScene(model, maxgeom=1000)
        self.options, self.camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self.options.sitegroup[:] = 0
        self.camera.lookat, self.camera.distance = _LOOK_AT, _DISTANCE
        self.camera.azimuth, self.camera.elevation = _AZIMUTH, _ELEVATION
        if self.walk is not None:
            self.walk.set_up(model, self.scene, self.camera, height / width)
        self.viewport = mujoco.MjrRect(0, 0, width, height)
        self.pixels = np.empty((height, width, 3), np.uint8)
        self.opengl, self.context = opengl_context(model, width, height)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.opengl.make_current()
        self.context.free()
        self.opengl.free()

    def picture(self, moment: float) -> np.ndarray:
        """The run at a phase of the stride [-], or a time of sitting [s], with numbers (height, width, 3)."""
        self.opengl.make_current()
        at = self._at(moment)
        for tendon, name in enumerate(self.forces):
            share = np.clip(at(name) / _FORCE_SCALE, 0.0, 1.0) ** 0.5
            self.model.tendon_rgba[tendon] = _SLACK + share * (_PULLING - _SLACK)
        self.mountings.pose(self.data, at)
        mujoco.mj_camlight(self.model, self.data)
        if self.walk is not None:
            self.camera.lookat = self.walk.look_at(moment)
        mujoco.mjv_updateScene(
            self.model, self.data, self.options, None, self.camera, mujoco.mjtCatBit.mjCAT_ALL, self.scene
        )
        below = "" if self.walk is None else self.walk.add(self.scene, moment)
        mujoco.mjr_render(self.viewport, self.scene, self.context)
        places, caption = mujoco.mjtGridPos, {"time": f"{moment:.2f} s"}
        if self.walk is not None:
            caption = {f"stride {self.walk.number + 1}": f"{100.0 * moment:.0f} %"}
        joint, angle = self.recording.described["leg"]["ankle"], np.degrees(at("ankle/angle"))
        caption[f"{joint} angle"] = f"{angle:+.1f} deg"
        for chamber in self.recording.described["orthosis"]["chamber"]:
            caption[chamber] = f"{1e-5 * at(f'chamber/{chamber}/pressure') + 0.0:z.2f} bar"
        self._write(places.mjGRID_TOPLEFT, self.title)
        self._write(places.mjGRID_BOTTOM, below)
        lower = mujoco.MjrRect(0, 0, self.viewport.width, self.viewport.height - (_LINE if self.title else 0))
        self._write(places.mjGRID_TOPLEFT, "\n".join(caption), "\n".join(caption.values()), lower)
        mujoco.mjr_readPixels(self.pixels, None, self.viewport, self.context)
        return self.pixels[::-1]  # OpenGL counts rows from below

    def _at(self, moment: float) -> Callable[[str], float]:
        if self.walk is not None:
            stride = self.walk.figure.stride
            return lambda name: float(stride.at(name, moment))
        time = self.recording["time"]
        row = min(int(np.searchsorted(time, moment - 1e-9)), len(time) - 1)
        return lambda name: float(self.recording[name][row])

    def _write(self, place: int, text: str, values: str = "", where: mujoco.MjrRect | None = None) -> None:
        """Words over the picture or a part of it, in the letters that MuJoCo has."""
        if text:
            shown = (part.encode("ascii", "replace").decode() for part in (text, values))
            font = mujoco.mjtFont.mjFONT_NORMAL
            mujoco.mjr_overlay(font, place, where or self.viewport, *shown, self.context)


def write_video(
    runs: Recording | Mapping[str, Recording],
    path: pathlib.Path,
    *,
    stride: int | None = None,
    slow: float | None = None,
    reference: bool = True,
    rate: float = 25.0,
    width: int = 1280,
    height: int = 720,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[str, ...]:
    """Film one stride of a walk in slow motion, or a seated run from its beginning to its end, as MP4."""
    shots = _shots({"": runs} if isinstance(runs, Recording) else runs, stride, reference)
    moments = _moments(shots[-1], slow, rate)
    wide = width // len(shots)
    widths = [width - wide * (len(shots) - 1), *[wide] * (len(shots) - 1)]
    for field, pixels in (("width", width), ("height", height)):
        if pixels < 2 or pixels % 2:
            raise InputError("is not a size of a picture", field=field, value=pixels, allowed="even, from 2")
    program = shutil.which("ffmpeg", path=child_environment().get("PATH"))
    if program is None or not pathlib.Path(program).is_absolute():  # Windows takes the current folder first
        text = "videos are encoded by the program ffmpeg, which is not installed; install the package "
        raise InputError(f"{text}ffmpeg (Debian, Ubuntu: apt install ffmpeg; macOS: brew install ffmpeg)")
    with ExitStack() as stack:
        painters = [
            stack.enter_context(Painter(run, pixels, height, figure, title))
            for (title, run, figure), pixels in zip(shots, widths, strict=True)
        ]
        temporary = stack.enter_context(replacing(path))
        frames = stack.enter_context(_encoder(program, temporary, rate, width, height))
        for done, moment in enumerate(moments.tolist(), start=1):
            frames.write(np.hstack([painter.picture(moment) for painter in painters]).tobytes())
            if progress is not None:
                progress(done, len(moments))
    return tuple(title for title, _, figure in shots if figure)


def _shots(given: Mapping[str, Recording], stride: int | None, reference: bool) -> list[_Shot]:
    """What is filmed, from left to right."""
    if not 1 <= len(given) <= _MOST:
        raise InputError("is not a valid number of runs", value=len(given), allowed=f"1 to {_MOST}")
    for run in given.values():
        if not len(run["time"]):
            raise InputError(f"there is nothing to draw: the recording has no rows ({run.status})")
    views = {title: alone(run) for title, run in given.items()}
    if not all(view.walks for view in views.values()):
        if len(views) > 1:
            raise InputError("are not all walks", field="runs", allowed="walks, or one seated run")
        if stride is not None:
            raise InputError("is of a walk; this run has no strides", field="stride", value=stride)
        return [(title, run, None) for title, run in given.items()]
    shots: list[_Shot] = []
    for title, view in views.items():
        figure = WalkingFigure.of(view)
        if stride is not None:  # the same walker in the stride of a number from 1
            strides = {each.number + 1: each for each in view.whole_strides}
            if stride not in strides:
                usual = f"by default {figure.stride.number + 1}, the settled one"
                allowed = f"{min(strides)} to {max(strides)}; {usual}"
                raise InputError("is not a stride of the run", field="stride", value=stride, allowed=allowed)
            figure = replace(figure, stride=strides[stride])
        shots.append((title or _title(view.recording), view.recording, figure))
    other = reference_view(shots[0][1], "", "") if len(shots) == 1 and reference else None
    if other is None:
        return shots
    off = ", no air" if shots[0][1].described["reference"] == "orthosis-off" else ""
    return [(_title(other.recording) + off, other.recording, WalkingFigure.of(other)), *shots]


def _title(run: Recording) -> str:
    orthosis = run.described["orthosis"]
    if orthosis.get("muscle"):
        return f"with {orthosis.get('name') or 'the device'}"
    return f"without the device, {worn(run.described)}"


def _moments(shot: _Shot, slow: float | None, rate: float) -> np.ndarray:
    """Gait phase, or time [s] where nobody walks, of each frame."""
    _, run, figure = shot
    slow = slow if slow is not None else _SLOW if figure else 1.0
    for field, value, most in (("rate", rate, 1000.0), ("slow", slow, 100.0)):
        if not 0.0 < value <= most:
            raise InputError("is not in range", field=field, value=value, allowed=f"above 0 to {most:g}")
    if figure is not None:
        count = max(1, round(figure.stride.duration * slow * rate))
        return np.arange(count) / count
    start, end = run["time"][[0, -1]]
    return start + np.arange(int((end - start) * slow * rate + 1e-6) + 1) / (slow * rate)


@contextmanager
def _encoder(program: str, path: pathlib.Path, rate: float, width: int, height: int) -> Iterator[IO[bytes]]:
    """A stream that takes raw RGB frames, of which ffmpeg makes an MP4."""
    command = [program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{width}x{height}", "-r", repr(rate), "-i", "-"]
    command += ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-preset", "veryfast", "-crf", "20"]
    command += ["-movflags", "+faststart"]
    command += ["-f", "mp4", f"file:{path}"]
    with (
        tempfile.TemporaryFile() as log,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=log, env=child_environment()
        ) as process,
    ):
        assert process.stdin is not None
        try:
            yield process.stdin
        except BrokenPipeError:
            pass  # ffmpeg ended early; its exit code and message say why
        except BaseException:  # whatever ends the frames, nobody waits for the film
            process.kill()
            raise
        finally:
            with suppress(BrokenPipeError):
                process.stdin.close()
        if process.wait() != 0:
            log.seek(0)
            raise InputError(f"ffmpeg failed: {log.read().decode(errors='replace').strip()[-500:]}")

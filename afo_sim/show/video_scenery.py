"""The scenery of a video: floor, light, background, drawn tendons; and an OpenGL context to draw it in."""

import importlib
import os
import sys
from typing import Any

import mujoco

from afo_sim.common.errors import InputError

LOOK_AT, DISTANCE, AZIMUTH, ELEVATION = (0.03, 0.0, 0.43), 1.1, 120.0, -12.0  # [m], [deg]
EDGE, FAR, MARGIN = -0.06, 1.2, 3.0  # sides of the walkway, and its length beyond both ends [m]
DRAWN = "_drawn"  # suffix of a tendon that is there for the picture only
PULLEY_MUSCLE = 0.01  # radius at which a muscle over a pulley is drawn [m]


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
    spec.stat.center, spec.stat.extent = LOOK_AT, 1.0
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
        pos=[0.5 * (start + end), 0.5 * (EDGE + FAR), 0.0],
        size=[0.5 * (end - start) + MARGIN, 0.5 * (FAR - EDGE), 0.1],
        material="squares",
    )


def _draw_pulley_muscles(spec: mujoco.MjSpec) -> None:
    """A path beside each fixed tendon, which MuJoCo does not draw."""
    plain = mujoco.MjModel.from_xml_string(spec.to_xml())
    for t in range(plain.ntendon):
        name = plain.tendon(t).name
        if plain.wrap_type[plain.tendon_adr[t]] == mujoco.mjtWrap.mjWRAP_JOINT:
            drawn = spec.add_tendon(name=name + DRAWN, width=PULLEY_MUSCLE)
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

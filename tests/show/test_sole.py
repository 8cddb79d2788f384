"""The sole that is worn under the foot: how thick it is, from the shapes of the compiled model."""

import mujoco
import numpy as np
import pytest

from afo_sim.description.reader import load
from afo_sim.model.build import build
from afo_sim.model.mounting import ANKLE
from afo_sim.show.sole import lowest, sole_thickness

SHAPES = {
    "box": ("0.06 0.02 0.01", np.array([0.06, 0.02, 0.01])),
    "ellipsoid": ("0.06 0.02 0.01", np.array([0.06, 0.02, 0.01])),
    "sphere": ("0.03", np.full(3, 0.03)),
    "capsule": ("0.02 0.05", None),
    "cylinder": ("0.02 0.05", None),
}


def thickness(scenario: str, sets: dict[str, object] | None = None) -> float:
    built = build(load("scenario", scenario, sets))
    return sole_thickness(built.full_model, built.scenario.leg.foot, ANKLE)


def test_s1s_plate_is_as_thick_as_its_file_says() -> None:
    """The box ends 79 + 11 mm below the ankle, the leg's own sole 68 mm."""
    assert thickness("walk-dropfoot-afo") == pytest.approx(0.079 + 0.011 - 0.068, abs=1e-9)
    assert thickness("seated") == pytest.approx(0.022, abs=1e-9)


def test_a_bare_foot_wears_nothing() -> None:
    assert thickness("walk-dropfoot") == 0.0


def surface(kind: str, sizes: np.ndarray | None) -> np.ndarray:
    """Points densely on a shape, in its own frame."""
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0.0, np.pi, 721), np.linspace(0.0, 2.0 * np.pi, 721)))
    ball = np.column_stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)])
    if kind == "box":
        assert sizes is not None
        return np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T * sizes
    if sizes is not None:
        return ball * sizes
    if kind == "capsule":
        return 0.02 * ball + np.sign(ball[:, 2:]) * [0.0, 0.0, 0.05]
    rim = np.column_stack([0.02 * np.cos(v), 0.02 * np.sin(v), np.full_like(v, 0.05)])
    return np.vstack([rim, rim * [1.0, 1.0, -1.0]])


@pytest.mark.slow
@pytest.mark.parametrize("kind", SHAPES)
def test_the_lowest_point_is_the_surfaces(kind: str) -> None:
    size, sizes = SHAPES[kind]
    points = surface(kind, sizes)
    for euler in ("0 0 0", "20 50 10", "90 0 40", "-70 33 5"):
        xml = f'<mujoco><worldbody><geom type="{kind}" size="{size}" pos="0 0 1" euler="{euler}"/>'
        model = mujoco.MjModel.from_xml_string(xml + "</worldbody></mujoco>")
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        space = points @ data.geom_xmat[0].reshape(3, 3).T + data.geom_xpos[0]
        assert lowest(model, data, 0) == pytest.approx(space[:, 2].min(), abs=1e-6)


def test_a_mesh_ends_at_its_vertices() -> None:
    xml = """<mujoco><asset><mesh name="wedge" vertex="0 0 0  .2 0 0  0 .1 0  0 0 .03"/></asset>
    <worldbody><geom type="mesh" mesh="wedge" pos="0 0 1" euler="0 90 0"/></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert lowest(model, data, 0) == pytest.approx(1.0 - 0.2, abs=1e-6)  # its x axis points down

"""The toes' hinge in the model: its spring, where it is welded, what is refused."""

import pathlib
import shutil

import mujoco
import numpy as np
import pytest

import afo_sim
from afo_sim.common import InputError, assets
from afo_sim.description import load
from afo_sim.model.build import build


def test_toes_are_welded_where_nobody_walks() -> None:
    model = build(load("scenario", "seated")).model
    assert [model.joint(k).name for k in range(model.njnt)] == ["ankle"]
    assert model.body("toes").mass[0] > 0.0


def test_the_hinge_rings_at_the_rate_of_its_spring_and_inertia() -> None:
    """Free vibration of the undamped hinge with the ankle held: √(k/I)."""
    spec = mujoco.MjSpec.from_file(str(load("leg", "adult_75kg").file))
    spec.joint("ankle").damping = [1e6, 0.0, 0.0]
    spec.joint("toe").stiffness = [25.0, 0.0, 0.0]
    spec.option.timestep, spec.option.gravity = 1e-5, [0.0, 0.0, 0.0]
    model = spec.compile()
    data = mujoco.MjData(model)
    data.joint("toe").qpos[0] = 0.05
    signs = []
    for _ in range(20_000):
        mujoco.mj_step(model, data)
        signs.append(data.joint("toe").qpos[0] > 0.0)
    crossings = np.flatnonzero(np.diff(np.array(signs, dtype=int)))
    period = 2.0 * np.diff(crossings).mean() * 1e-5
    # 0.161 kg, 34.6 mm ahead of the hinge, 1e-4 kg·m² about its centre: walker_facts' toes
    assert 2.0 * np.pi / period == pytest.approx(np.sqrt(25.0 / (1e-4 + 0.161 * 0.0346**2)), rel=2e-3)


def test_toes_follow_their_rest_angle_in_walking() -> None:
    """Weight and inertia bend them by less than half a degree in swing: the rest angle does the work."""
    run = afo_sim.run("walk-healthy", {"duration": "3 s"})
    swing = (run["gait/phase"] > 0.75) & (run["gait/phase"] < 0.95)
    sag = np.degrees(run["toe/extension"] - run["gait/toe_extension"])
    assert np.abs(sag[swing]).max() < 0.5
    assert np.degrees(run["toe/extension"][swing]).mean() == pytest.approx(11.0, abs=1.5)


def test_stiff_soles_keep_the_toes_straight() -> None:
    """A sole of 25 N·m/rad beside toes of 25 halves their extension; a plate of 1e4 takes it."""
    sole = {"heel_stack": "0 mm", "ball_stack": "0 mm"}
    told = {}
    for stiffness in (0.0, 25.0, 1e4):
        worn = {**sole, "toe_stiffness": f"{stiffness} N*m/rad", "mass": "0 kg", "centre": ["0 m", "0 m"]}
        run = afo_sim.run("walk-dropfoot", {"duration": "3 s", "shoe": worn | {"inertia": "0 kg*m^2"}})
        told[stiffness] = run["gait/toe_extension"]
        assert np.isfinite(run["ankle/angle"]).all()
    assert told[25.0] == pytest.approx(0.5 * told[0.0], abs=1e-9)
    assert np.abs(told[1e4]).max() < 0.003


def test_a_hinge_that_is_not_there_is_refused_with_the_nearest_name(tmp_path: pathlib.Path) -> None:
    sets = {"leg.toes.joint": "tow"}
    with pytest.raises(InputError, match=r"leg\.toes\.joint.*toe"):
        build(load("scenario", "walk-healthy", sets))
    folder = pathlib.Path(shutil.copytree(assets.find("leg", "adult_75kg").parent, tmp_path / "leg"))
    file = folder / "leg.xml"
    text = file.read_text(encoding="utf-8")
    file.write_text(
        text.replace('name="toe" type="hinge" axis="0 -1 0"', 'name="toe" type="hinge" axis="0 1 0"')
    )
    with pytest.raises(InputError, match="extension is positive"):
        build(load("scenario", "walk-healthy", {"leg": str(folder)}))


def test_a_rigid_foot_still_walks(tmp_path: pathlib.Path) -> None:
    """A leg with the sites heel, ball and toe and no hinge: as of a laboratory that has no toes."""
    folder = pathlib.Path(shutil.copytree(assets.find("leg", "adult_75kg").parent, tmp_path / "leg"))
    spec = mujoco.MjSpec.from_file(str(folder / "leg.xml"))
    spec.delete(spec.joint("toe"))
    spec.delete(spec.site("pulp"))
    spec.delete(spec.site("tip"))
    spec.body("foot").add_site(name="toe", pos=[0.19, 0.0, -0.068])
    (folder / "leg.xml").write_text(spec.to_xml(), encoding="utf-8")
    described = folder / "leg.toml"
    text = described.read_text(encoding="utf-8")
    described.write_text(text[: text.index("[toes]")], encoding="utf-8")
    sets = {"leg": str(folder), "duration": "3 s", "ground.mode": "recorded"}
    run = afo_sim.run("walk-healthy", sets)
    assert np.degrees(np.abs(run["ankle/angle"] - run["gait/ankle_angle"])).max() < 1e-6
    assert "toe/extension" not in run.columns
    assert run["toe/height"] == pytest.approx(run["gait/toe_height"], abs=1e-9)

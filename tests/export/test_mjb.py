"""The model that ran as MuJoCo's binary file: it steps to the run's own rows."""

import dataclasses
import pathlib

import mujoco
import numpy as np

from afo_sim import native
from afo_sim.description.reader import load
from afo_sim.model.build import build
from afo_sim.model.start import equilibrium
from afo_sim.simulation.recording import Recording

STEPS = 500


def test_its_steps_are_the_runs_rows_to_the_bit(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    (file,) = seated_second.export(tmp_path / "seated.mjb")
    model = mujoco.MjModel.from_binary_path(str(file))
    built = dataclasses.replace(build(load("scenario", seated_second.scenario)), model=model)
    inputs = np.zeros((STEPS, model.nu))
    for name in seated_second.scenario["orthosis"]["chamber"]:
        inputs[:, built.index.chambers[name]] = seated_second["supply/pressure"][:STEPS]
        for side in ("inlet", "outlet"):
            coil = seated_second[f"valve/{name}_{side}/coil"][:STEPS]
            inputs[:, built.index.valves[f"{name}_{side}"]] = coil
    inputs[:, built.index.passive] = built.scenario.shank.knee_angle or 0.0
    data = mujoco.MjData(model)
    ankle = model.joint("ankle")
    with native.installed():
        mujoco.mj_setState(model, data, equilibrium(built, inputs[0]), mujoco.mjtState.mjSTATE_INTEGRATION)
        for k in range(STEPS):
            assert data.qpos[ankle.qposadr[0]] == seated_second["ankle/angle"][k]
            assert data.qvel[ankle.dofadr[0]] == seated_second["ankle/velocity"][k]
            data.ctrl[:] = inputs[k]
            mujoco.mj_step(model, data)
            for name, i in built.index.muscles.items():
                assert 0.0 - data.actuator_force[i] == seated_second[f"muscle/{name}/force"][k], name
    assert seated_second["muscle/dorsiflexor_1/force"][:STEPS].max() > 1.0  # something has pulled


def test_file_is_the_kept_model(walked: Recording, tmp_path: pathlib.Path) -> None:
    walked.export(tmp_path / "walk.mjb")
    assert (tmp_path / "walk.mjb").read_bytes() == walked.model_binary


def test_rows_are_not_its_matter(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    nothing = dataclasses.replace(
        seated_second, columns={name: values[:0] for name, values in seated_second.columns.items()}
    )
    nothing.export(tmp_path / "a.mjb")
    assert (tmp_path / "a.mjb").is_file()

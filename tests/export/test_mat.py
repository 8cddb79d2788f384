"""MATLAB's .mat, read back by scipy."""

import dataclasses
import json
import pathlib

import mujoco
import numpy as np
import pytest
from scipy.io import loadmat

from afo_sim import native
from afo_sim.description import as_found, load
from afo_sim.model import equilibrium
from afo_sim.model.build import build
from afo_sim.simulation import Recording, describe


@pytest.fixture
def mat(walked: Recording, tmp_path: pathlib.Path) -> dict:
    walked.export(tmp_path / "walk.mat")
    found: dict = loadmat(tmp_path / "walk.mat", simplify_cells=True)["run"]
    return found


def text(value: object) -> str:
    """An empty text comes back as an empty array."""
    return "" if isinstance(value, np.ndarray) and not value.size else str(value)


def test_columns_are_the_same_doubles_under_legal_names(mat: dict, walked: Recording) -> None:
    names = {original: field for field, original in mat["names"].items()}
    assert list(names) == list(walked.columns)
    assert all(field.isidentifier() and len(field) <= 63 for field in names.values())
    for name, field in names.items():
        assert mat["columns"][field].dtype == np.float64
        assert np.array_equal(mat["columns"][field], walked[name]), name
        if not name.startswith("qpos/"):
            assert (text(mat["units"][field]), text(mat["signs"][field])) == describe(name)
    assert np.array_equal(mat["time"], walked["time"])


def test_metrics_strides_and_scenario_go_with_them(mat: dict, walked: Recording) -> None:
    assert list(mat["metrics"]) == list(walked.metrics)
    for name, metric in walked.metrics.items():
        found = mat["metrics"][name]
        assert np.array_equal(found["value"], float(metric), equal_nan=True)
        assert text(found["unit"]) == metric.unit
    assert mat["strides"]["stride"].tolist() == list(walked.strides)
    expected = [float(told["toe_clearance"]) for told in walked.strides.values()]
    assert mat["strides"]["toe_clearance"].tolist() == expected
    stored = json.loads(mat["scenario"])
    assert stored["leg"]["file"] == "models/legs/adult_75kg/leg.xml"
    assert as_found(stored, pathlib.Path()) == json.loads(json.dumps(walked.described))
    assert mat["scenario"].isascii()  # all that Octave's jsondecode takes
    assert (mat["name"], mat["status"]) == (walked.scenario["name"], "ok")


def test_a_column_stands_upright(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    seated_second.export(tmp_path / "a.mat", rate=100.0)
    run = loadmat(tmp_path / "a.mat")["run"]
    assert run["time"][0, 0].shape == (100, 1)


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

"""MATLAB's .mat, read back by scipy."""

import json
import pathlib

import numpy as np
import pytest
from scipy.io import loadmat

from afo_sim.simulation.columns import describe
from afo_sim.simulation.recording import Recording


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
    assert json.loads(mat["scenario"]) == json.loads(json.dumps(walked.scenario))
    assert mat["scenario"].isascii()  # all that Octave's jsondecode takes
    assert (mat["name"], mat["status"]) == (walked.scenario["name"], "ok")


def test_a_column_stands_upright(seated_second: Recording, tmp_path: pathlib.Path) -> None:
    seated_second.export(tmp_path / "a.mat", rate=100.0)
    run = loadmat(tmp_path / "a.mat")["run"]
    assert run["time"][0, 0].shape == (100, 1)

"""The table of walking controllers: what it counts, and that all are set to the same windows."""

import importlib.util
import pathlib
import sys
import types
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from afo_sim.description import load
from afo_sim.model import stride_time_of

SCRIPT = pathlib.Path(__file__).parents[2] / "scripts" / "controllers_table.py"


@pytest.fixture(scope="module")
def script() -> types.ModuleType:
    spec = importlib.util.spec_from_file_location("controllers_table", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


@dataclass(frozen=True)
class Counted:
    """What of a recording is counted."""

    strides: dict[int, Any]
    columns: dict[str, np.ndarray]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.columns[name]


def row(script: types.ModuleType, **changed: Any) -> Any:
    told = {
        name: np.array([1.0, 2.0, 3.0]) for name in ("duration", "clearance", "torque", "air", "switched")
    }
    return script.Row("x", **(told | changed))


def test_litres_are_of_the_reference_atmosphere(script: types.ModuleType) -> None:
    # 1.185 g fill a litre at 20 °C, 1 bar and 65 % humidity: three strides of 0.1185 g in 6 s
    given = row(script, air=np.full(3, 0.1185))
    assert given.litres_a_minute == pytest.approx(3.0)


def test_first_strides_count_beside_all(script: types.ModuleType) -> None:
    given = row(script, clearance=np.array([9.0, 4.0, 8.0, -2.5, 6.5]))
    cells = script.table([given]).splitlines()[-1].split("|")
    assert [cell.strip() for cell in cells[2:5]] == ["−2.5", "4.0", "5.0"]


def test_switching_is_counted_stride_by_stride(script: types.ModuleType) -> None:
    columns = {
        "gait/stride": np.array([0, 0, 0, 1, 1, 1, 2, 2, 2, 3]),
        "valve/a_inlet/coil": np.array([1, 0, 1, 1, 0, 1, 1, 1, 1, 1.0]),
        "valve/a_outlet/coil": np.array([0, 1, 0, 0, 1, 0, 0, 0, 0, 1.0]),
        "valve/a_outlet/opening": np.array([0, 1, 0, 1, 0, 1, 0, 1, 0, 1.0]),
    }
    run = Counted(dict.fromkeys([0, 1, 2]), columns)
    # the inlet in rows 2 and 5, the outlet in 1 and 4; what was on at first was not switched on
    assert script.switched(run).tolist() == [2.0, 2.0, 0.0]


def test_all_are_set_to_the_windows_of_the_true_phase(script: types.ModuleType) -> None:
    scenario = load("scenario", script.SCENARIO)
    stride, phases = stride_time_of(scenario), scenario.phases
    assert phases is not None
    told = phases.chambers["dorsiflexor"]
    clock = script.CONTROLLERS["fixed clock"]["timer"]
    assert float(clock["period"].split()[0]) == pytest.approx(stride, abs=1e-4)
    for side, windows in (("inlet", told.inlet), ("outlet", told.outlet)):
        begun, ended = (float(text.split()[0]) for text in clock["dorsiflexor"][side][0])
        assert (begun / stride, ended / stride) == pytest.approx(windows[0], abs=1e-3)
        estimated = script.CONTROLLERS["gait phase, foot switch"]["gait_phase"]["dorsiflexor"][side]
        assert [tuple(window) for window in estimated] == list(windows)
    for _, controller in list(script.CONTROLLERS.items())[1:]:
        sets = script.WALK | {"phases": None, "controller": {"rate": script.RATE} | controller}
        assert load("scenario", script.SCENARIO, sets).controller is not None


def test_wider_valves_are_those_of_the_shipped_device(script: types.ModuleType) -> None:
    shipped, wide = (load("scenario", script.SCENARIO, sets) for sets in script.DEVICES.values())
    for side in ("inlet", "outlet"):
        valves = [getattr(s.orthosis.chamber["dorsiflexor"], side).conductance for s in (shipped, wide)]
        assert valves[1] == pytest.approx(script.WIDER * valves[0])

"""Rows a second of a recording: as told, or else as many as the step allows up to 1 kHz."""

import pathlib

import numpy as np
import pytest

import afo_sim
from afo_sim import load
from afo_sim.common import InputError, assets
from afo_sim.description import toml_text

STRIDES = {"10 ms": 1, "2 ms": 1, "1 ms": 1, "0.7 ms": 2, "0.5 ms": 2, "0.3 ms": 4, "0.25 ms": 4}
STRIDES |= {"0.1 ms": 10, "0.03 ms": 34, "10 us": 100}  # by hand: 1 ms over the step, rounded up


@pytest.mark.parametrize(("step", "stride"), STRIDES.items())
def test_rows_follow_the_step(step: str, stride: int) -> None:
    scenario = load("scenario", "seated", {"timestep": step})
    assert (scenario.record_rate, scenario.record_stride) == (None, stride)
    rate = 1.0 / (scenario.timestep * stride)
    assert rate <= 1000.0 * (1.0 + 1e-12)
    faster = 1.0 / (scenario.timestep * max(1, stride - 1))
    assert faster > 1000.0 * (1.0 + 1e-12) or stride == 1


def test_what_is_told_holds(tmp_path: pathlib.Path) -> None:
    told = load("scenario", "seated", {"record_rate": "100 Hz"})
    assert (told.record_rate, told.record_stride) == (100.0, 5)  # of 500 steps a second
    for sets in ({"record_rate": "1 kHz", "timestep": "2 ms"}, {"record_rate": "200 Hz"}):
        with pytest.raises(InputError, match="whole fraction"):
            load("scenario", "seated", sets)


def test_a_resolved_scenario_keeps_following_its_step(tmp_path: pathlib.Path) -> None:
    scenario = load("scenario", "seated", {"timestep": "0.3 ms"})
    assert load("scenario", scenario.resolved()) == scenario
    (tmp_path / "seated.toml").write_text(toml_text(scenario.resolved()), encoding="utf-8")
    again = load("scenario", tmp_path / "seated.toml")
    assert again == scenario
    assert again.set({"timestep": "2 ms"}).record_stride == 1


def test_a_run_of_2_ms_records_every_step() -> None:
    run = afo_sim.run("seated", {"timestep": "2 ms", "duration": "40 ms"})
    assert run["time"] == pytest.approx(2e-3 * np.arange(20), abs=1e-12)


@pytest.mark.parametrize("name", assets.names("scenario"))
def test_shipped_scenarios_follow_their_step(name: str) -> None:
    assert load("scenario", name).record_rate is None

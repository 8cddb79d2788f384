"""What a controller tells is drawn, and only where there is one."""

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure

import afo_sim
from afo_sim.show import panels
from afo_sim.show.run_figure import electronics, told
from afo_sim.show.run_view import alone
from afo_sim.simulation.recording import Recording

SINE = {"amplitude": "3 deg", "frequency": "1 Hz"}
PID = {
    "rate": "100 Hz",
    "pid": {
        "angle": {"proportional_band": "5 deg", "reference": {"amplitude": "3 deg", "frequency": "1 Hz"}}
    },
}


@pytest.fixture(scope="module")
def run() -> Recording:
    return afo_sim.run("seated", {"timer": None, "controller": PID, "duration": "1 s"})


def test_the_output_is_drawn_over_time(run: Recording) -> None:
    axis = Figure().subplots()
    electronics(axis, [alone(run)])
    (line,) = axis.lines
    assert line.get_label() == "output" and np.array_equal(line.get_ydata(), run["controller/output"])


def test_the_angle_that_is_asked_for_stands_beside_the_angle(run: Recording) -> None:
    axis = Figure().subplots()
    panels.angle(axis, [alone(run)])
    asked = next(line for line in axis.lines if line.get_label() == "asked for")
    assert np.max(asked.get_ydata()) == pytest.approx(3.0, abs=1e-6)  # [deg], the sine's amplitude


def test_a_run_without_controller_has_no_such_panel(run: Recording) -> None:
    columns = {name: values for name, values in run.columns.items() if "controller" not in name}
    assert told(run) == ["controller/output"]
    assert told(dataclasses.replace(run, columns=columns)) == []

"""Controllers of a user's own that scenarios name: functions, classes, their parameters, what is refused."""

import pathlib
import subprocess
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from command import Call

import afo_sim as afo
from afo_sim.common import identities, packed
from afo_sim.control import OwnController

PRESSURE = "chamber/dorsiflexor/pressure"
SHORT: dict[str, Any] = {"duration": "0.4 s", "timer": None}
SHUT = {"plantarflexor": "shut"}  # as a controller in a scenario begins
MINE = """import afo_sim as afo

@afo.controller("fill_below")
def fill_below(seen, pressure=1e5):
    return {"dorsiflexor": "inlet" if seen["chamber/dorsiflexor/pressure"] < pressure else "outlet"}

@afo.controller("bug")
def bug(seen):
    return {"dorsiflexor": {}["inlet"]}
"""


@afo.controller("fill_below")
def fill_below(seen: Any, pressure: float = 1e5) -> dict[str, str]:
    return {"dorsiflexor": "inlet" if seen[PRESSURE] < pressure else "outlet"}


@afo.controller("counted")
class Counted:
    """Opens the inlet for so many commands."""

    def __init__(self, scenario: Any, commands: float):
        self.left, self.chamber = commands, next(iter(scenario.orthosis.chamber))

    def __call__(self, seen: Any) -> dict[str, str]:
        self.left -= 1
        return {self.chamber: "inlet" if self.left >= 0 else "shut"}


def named(name: str, **parameters: float) -> dict[str, Any]:
    return SHORT | {"controller": {"function": name, "rate": "100 Hz", "parameters": parameters}}


def test_a_function_that_a_scenario_names_commands_as_in_python() -> None:
    afo.register(fill_below)
    run = afo.run("seated", named("fill_below"))
    timed = {"duration": SHORT["duration"]}
    told = afo.run("seated", timed, controller=lambda seen: fill_below(seen) | SHUT, rate=100)
    assert 0.5e5 < run[PRESSURE].max() < 2e5 and np.array_equal(run[PRESSURE], told[PRESSURE])
    again = afo.run(run.scenario)  # as it was recorded
    assert np.array_equal(run[PRESSURE], again[PRESSURE])
    given = afo.run("seated", timed, controller=fill_below, rate=100)
    assert np.array_equal(given[PRESSURE], run[PRESSURE])


def test_parameters_are_keys_of_a_sweep() -> None:
    afo.register(fill_below)
    base = afo.load("scenario", "seated", named("fill_below", pressure=1e5))
    over: dict[str, Any] = {"controller.parameters.pressure": [0.5e5, 1e5]}
    cases = afo.sweep(base, over, metrics=["peak_pressure_dorsiflexor"], threads=1).to_pandas()
    found = cases[next(name for name in cases if str(name).startswith("peak_pressure"))]
    alone = [afo.run("seated", named("fill_below", pressure=p)) for p in (0.5e5, 1e5)]
    expected = [run.metrics["peak_pressure_dorsiflexor"].value for run in alone]
    assert expected[1] > 1.5 * expected[0] and np.allclose(found, expected, rtol=1e-9)


def test_a_class_is_made_anew_for_every_simulation_with_its_scenario() -> None:
    afo.register(Counted)
    runs = [afo.run("seated", named("counted", commands=n)) for n in (10, 10, 20)]
    ends = [run["chamber/dorsiflexor/mass_flow_in"].nonzero()[0][-1] for run in runs]
    step = runs[0]["time"][1]
    assert ends[0] == ends[1] and (ends[2] - ends[0]) * step == pytest.approx(0.1, abs=0.01)  # at 100 Hz


@pytest.mark.parametrize(
    ("name", "parameters", "field", "nearest"),
    [
        ("fill_belo", {}, "controller.function", "fill_below"),
        ("fill_below", {"pressur": 1e5}, "controller.parameters.pressur", "pressure"),
        ("counted", {}, "controller.parameters.commands", None),
    ],
)
def test_what_is_not_there_is_refused_before_it_runs(
    name: str, parameters: dict[str, float], field: str, nearest: str | None
) -> None:
    afo.register(fill_below, Counted)
    with pytest.raises(afo.InputError) as refused:
        afo.run("seated", named(name, **parameters))
    assert refused.value.field == field and refused.value.nearest == nearest


def test_parameters_go_with_a_function_alone() -> None:
    pid = {"emg": {}, "parameters": {"gain": 1.0}}
    with pytest.raises(afo.InputError) as refused:
        afo.load("scenario", "walk-dropfoot-afo", {"controller": pid, "phases": None})
    assert refused.value.field == "controller.parameters"
    with pytest.raises(afo.InputError) as refused:
        afo.load("scenario", "seated", named("mine") | {"controller.parameters.gain": "much"})
    assert refused.value.field == "controller.parameters.gain"


def test_a_recording_is_read_where_its_controller_is_not_registered(tmp_path: pathlib.Path) -> None:
    afo.register(fill_below)
    folder = afo.run("seated", named("fill_below")).save(tmp_path / "run", rrd=False)
    from afo_sim.control import function

    function.OWN.clear()
    assert afo.read_recording(folder).metrics
    with pytest.raises(afo.InputError) as refused:
        afo.run(afo.read_recording(folder).scenario)
    assert refused.value.field == "controller.function" and "--extension" in refused.value.allowed


def test_another_method_is_another_identity() -> None:
    class Same:
        def __init__(self, scenario: Any): ...

        def __call__(self, seen: Any) -> Mapping[str, str]:
            return {"dorsiflexor": "inlet"}

    class Other(Same):
        def __call__(self, seen: Any) -> Mapping[str, str]:
            return {"dorsiflexor": "shut"}

    Other.__name__ = "Same"
    found = []
    for kind in (Same, Same, Other):
        afo.register(OwnController("mine", kind))
        found.append(identities()["OwnController mine"])
    assert found[0] == found[1] != found[2]


def test_another_process_runs_it_without_any_file() -> None:
    afo.register(fill_below)
    code = "import sys, afo_sim; from afo_sim.common import take; take(sys.stdin.buffer.read());"
    code += f"from afo_sim.control.function import OWN; print(OWN['fill_below']({{{PRESSURE!r}: 0.0}}))"
    done = subprocess.run([sys.executable, "-c", code], input=packed(), capture_output=True, check=True)
    assert done.stdout.decode().strip() == "{'dorsiflexor': 'inlet'}"


def test_the_command_line_runs_it(
    call: Call, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    pathlib.Path("mine.py").write_text(MINE)
    lines = ['leg = "adult_75kg"', 'orthosis = "s1"', 'duration = "0.4 s"', 'supply.pressure = "4 bar"']
    lines += ['shank.knee_angle = "90 deg"']
    pathlib.Path("own.toml").write_text("\n".join([*lines, "[controller]", 'function = "fill_below"']))
    words = ("run", "own.toml", "--step", "fixed", "--no-rrd", "--force", "--out", "run")
    code, _, err = call(*words)
    assert code == 2 and "fill_below" in err and "--extension" in err
    words = (*words, "--extension", "mine.py")
    code, _, err = call(*words, "--set", "controller.parameters.pressure=5e4")
    assert code == 0, err
    lower = afo.read_recording("run")[PRESSURE].max()
    assert call(*words)[0] == 0 and afo.read_recording("run")[PRESSURE].max() > 1.5 * lower
    code, out, _ = call("keys", "own.toml", "controller.", "--extension", "mine.py")
    assert code == 0 and "controller.function" in out

"""The scripts that measure speed: what they compare and how; what they measured is no test's matter."""

import importlib.util
import json
import math
import os
import pathlib
import subprocess
import sys
from types import ModuleType
from typing import Any

import mujoco
import numpy as np
import pytest

from afo_sim.description import load
from afo_sim.model.build import build
from afo_sim.physics.laws.tondu_lopez import tondu_lopez_2000
from afo_sim.physics.passive_ankle import riener_edrich_1999

SCRIPTS = pathlib.Path(__file__).parents[1] / "scripts" / "benchmarks"
MACHINE = {"processor": "A", "cores": 2, "system": "Linux", "versions": {"numpy": "2.0"}}


def script(name: str, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(SCRIPTS))
    spec = importlib.util.spec_from_file_location(name, SCRIPTS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def file_of(path: pathlib.Path, **changed: Any) -> str:
    """A file with one figure of each kind: a time, a rate, an error that has no better direction."""
    figures = [
        {"name": "step", "unit": "µs", "better": "lower", "best": changed.pop("step", 2.0)},
        {"name": "rate", "unit": "1/s", "better": "higher", "best": changed.pop("rate", 10.0)},
        {"name": "error", "unit": "deg", "better": "", "best": changed.pop("error", 1.0)},
        *changed.pop("more", []),
    ]
    content = {"benchmark": "b", "machine": MACHINE, "options": {"repeats": 5}, "figures": figures} | changed
    path.write_text(json.dumps(content), encoding="utf-8")
    return str(path)


@pytest.fixture
def compare(monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path) -> Any:
    """Exit code of a comparison with a file in which something changed."""
    module = script("compare_benchmarks", monkeypatch)
    old = file_of(tmp_path / "old.json")

    def against(*words: str, **changed: Any) -> int:
        return int(module.main([old, file_of(tmp_path / "new.json", **changed), *words]))

    return against


@pytest.mark.parametrize(
    ("changed", "code", "said"),
    [
        ({}, 0, ["0 slower, 0 faster, 2 alike"]),
        (
            {"step": 2.5, "rate": 12.5},  # half a µs on two; a case takes 80 ms instead of 100
            1,
            [
                "slower: step: 2 → 2.5 µs (25.0%)",
                "faster: rate: 10 → 12.5 1/s (20.0%)",
                "1 slower, 1 faster, 0 alike",
            ],
        ),
        ({"rate": 8.0}, 1, ["slower: rate: 10 → 8 1/s (25.0%)", "1 slower, 0 faster, 1 alike"]),
        ({"error": 99.0}, 0, ["0 slower, 0 faster, 2 alike"]),  # has no better direction
        *(({"step": noise}, 0, ["0 slower, 0 faster, 1 alike"]) for noise in (0.0, -0.1)),  # has no share
    ],
)
def test_what_changed_is_named_with_its_share(
    compare: Any, changed: dict[str, float], code: int, said: list[str],
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert compare(**changed) == code
    assert capsys.readouterr().out.splitlines() == said


@pytest.mark.parametrize(("words", "code"), [("5%", 1), ("10%", 0), ("0.1", 0), ("0", 1)])
def test_the_tolerance_is_no_change(compare: Any, words: str, code: int) -> None:
    assert compare("--tolerance", words, step=2.12) == code


@pytest.mark.parametrize("words", ["-1%", "much", "inf", "nan"])
def test_a_tolerance_that_is_none_is_refused(compare: Any, words: str) -> None:
    with pytest.raises(SystemExit, match="2"):
        compare(f"--tolerance={words}")


def test_other_machines_are_refused_unless_meant(compare: Any, capsys: pytest.CaptureFixture[str]) -> None:
    other = {**MACHINE, "processor": "B"}
    assert compare(machine=other, step=4.0) == 2
    assert "other machines (processor 'A', 'B')" in capsys.readouterr().err
    assert compare("--other-machine", machine=other, step=4.0) == 1


def test_another_benchmark_is_refused(compare: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert compare("--other-machine", benchmark="c") == 2
    assert "'b', the other of 'c'" in capsys.readouterr().err


def test_a_file_of_something_else_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path, capsys: pytest.CaptureFixture[str]
) -> None:
    module, old = script("compare_benchmarks", monkeypatch), file_of(tmp_path / "old.json")
    for content in ("[]", "{}", "no JSON"):
        (tmp_path / "new.json").write_text(content)
        assert module.main([old, str(tmp_path / "new.json")]) == 2
        assert "new.json is no file of a benchmark" in capsys.readouterr().err
    assert module.main([old, str(tmp_path / "missing.json")]) == 2


def test_other_versions_settings_and_figures_are_told(
    compare: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    new = {"name": "new", "unit": "s", "better": "lower", "best": 1.0}
    assert compare(machine=MACHINE | {"versions": {"numpy": "2.1"}}, options={"repeats": 1}, more=[new]) == 0
    said = capsys.readouterr().out
    assert "differs: numpy 2.0, 2.1\n" in said
    assert "differs: repeats 5, 1\n" in said
    assert "only in the new: new\n" in said


def test_figures_of_repeats(monkeypatch: pytest.MonkeyPatch) -> None:
    m = script("measuring", monkeypatch)
    repeats = [3.0, 1.0, 8.0]
    assert (m.figure("a", "s", "lower", repeats).best, m.figure("a", "s", "higher", repeats).best) == (
        1.0,
        8.0,
    )
    assert m.figure("a", "s", "", repeats).best == m.figure("a", "s", "lower", repeats).median == 3.0
    # round by round 2, 4, 2: one disturbed round does not make it 8/2
    assert m.ratio("r", [6.0, 4.0, 8.0], [3.0, 1.0, 4.0], "").best == 2.0


def test_measurements_take_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    m, order = script("measuring", monkeypatch), iter(range(100))
    found = m.in_turn({"a": lambda: next(order), "b": lambda: next(order)}, 2)
    assert found == {"a": [2, 4], "b": [3, 5]}


def test_opensims_leg_is_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    leg = script("opensim_seated", monkeypatch)
    built = build(load("scenario", "seated"))
    braid = built.scenario.orthosis.muscle["dorsiflexor"].type.braid
    bare = tondu_lopez_2000(0.1, 2e5, braid.nominal_radius, braid.b, 1.0)  # OpenSim's law, derived otherwise
    assert 2e5 * leg.braid_area(braid, 0.9 * braid.nominal_length) == pytest.approx(bare, rel=1e-12)
    words = leg.passive_expression(built)
    for angle, velocity in ((-0.2, 0.0), (0.1, 0.5)):
        moment = eval(words, {"exp": math.exp, "q": angle, "qdot": velocity})
        passive = riener_edrich_1999(angle, 0.5 * math.pi)
        assert moment == pytest.approx(passive - 0.5 * velocity, rel=1e-12)  # the leg's 0.5 N·m·s/rad
    mass, centre, inertia = leg.foot_of(built)
    data = mujoco.MjData(built.model)
    mujoco.mj_forward(built.model, data)
    swing = np.empty((1, 1))
    mujoco.mj_fullM(built.model, data, swing)
    assert inertia + mass * (centre[0] ** 2 + centre[2] ** 2) == pytest.approx(swing[0, 0], rel=1e-12)


@pytest.mark.slow
def test_opensim_is_not_needed(tmp_path: pathlib.Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import importlib.util as u\nfind = u.find_spec\n"
        "u.find_spec = lambda name, *rest: None if name == 'opensim' else find(name, *rest)\n"
    )
    said = run("opensim_seated.py", tmp_path, PYTHONPATH=str(tmp_path)).stdout
    assert said.startswith("skipped: the wheel `opensim` is not installed")


@pytest.mark.slow
def test_one_run_is_measured(tmp_path: pathlib.Path) -> None:
    out = tmp_path / "found.json"
    small = ["--simulations", "2", "--steps", "50", "--repeats", "1", "--parts", "motors"]
    run("benchmark.py", tmp_path, "run", *small, "--out", str(out))
    found = json.loads(out.read_text(encoding="utf-8"))
    assert found["machine"]["cores"] and found["machine"]["versions"]["mujoco"] and found["date"]
    names = {figure["name"] for figure in found["figures"]}
    assert "native over motors, 1 thread" in names


@pytest.mark.slow
def test_designs_are_measured(monkeypatch: pytest.MonkeyPatch, tmp_path: pathlib.Path) -> None:
    """In this process, which has compiled the muscles; one step, few designs."""
    out = tmp_path / "found.json"
    designs = script("designs", monkeypatch)
    monkeypatch.setattr(designs, "STEPS", designs.STEPS[1:2])
    monkeypatch.setattr(designs, "SOLVED", 1)
    small = ["--cases", "2", "--repeats", "1", "--parts", "designs", "--out", str(out)]
    monkeypatch.setattr(sys, "argv", ["benchmark.py", "designs", *small])
    script("benchmark", monkeypatch).main()
    figures = json.loads(out.read_text(encoding="utf-8"))["figures"]
    rates = {figure["name"]: figure["best"] for figure in figures if figure["unit"] == "designs/s"}
    assert rates.keys() >= {f"settled designs, 2 ms, threads {n}" for n in (1, 2)}
    assert all(rate > 0.0 for rate in rates.values())


def run(name: str, folder: pathlib.Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([environment.get("PYTHONPATH", ""), str(SCRIPTS.parents[1])])
    return subprocess.run(
        [sys.executable, str(SCRIPTS / name), *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )

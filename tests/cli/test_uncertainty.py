"""Bands on the command line: what is printed, and what is refused before anything is walked."""

import json
import pathlib
import re
import signal
import subprocess
import sys
import tomllib
from typing import Any

import pytest
from campaign import size
from command import Call

from afo_sim import read_recording, run
from afo_sim.description import toml_text

SHORT = ("--set", "timestep=4 ms", "--set", "duration=4 s", "--no-rrd", "--no-change")


@pytest.mark.slow
def test_a_run_prints_its_bands(call: Call, tmp_path: pathlib.Path) -> None:
    words = ("run", "walk-dropfoot-afo", *SHORT, "--uncertainty", 20, "--out", tmp_path / "run", "--force")
    code, out, _ = call(*words)
    assert code == 0 and "5 to 95 % of 20 draws: toe clearance" in out
    code, out, _ = call(*words, "--numbers")
    assert code == 0 and "What is not known, drawn together (20 draws)" in out
    assert "too few to show what explains the bands" in " ".join(out.split())
    told = read_recording(tmp_path / "run").studies["uncertainty"]
    called = run("walk-dropfoot-afo", {"timestep": "4 ms", "duration": "4 s"}, uncertainty=20)
    assert json.dumps(told) == json.dumps(called.studies["uncertainty"])


def test_a_file_of_spreads_is_listed_and_checked(call: Call, tmp_path: pathlib.Path) -> None:
    assert "factor_sd" in call("list", "usual")[1]
    file = tmp_path / "mine.toml"
    text = (
        '[parameters.cuff]\nkey = "patient.passive_scale"\ndistribution = "normal"\nsd = 0.1\n'
        'kind = "assumed"\nsource = ""\n'
    )
    file.write_text(text, encoding="utf-8")
    code, _, err = call("check", file)
    assert code == 2 and "parameters.cuff.source" in err
    file.write_text(text.replace('source = ""', 'source = "a guess"'), encoding="utf-8")
    code, out, _ = call("check", file)
    assert code == 0 and "a guess" in out


CUFF: dict[str, Any] = {
    "key": "orthosis.anchor.shank.stiffness",
    "distribution": "normal",
    "sd": "0.5 kN/m",
    "kind": "user",
    "source": "a spring scale",
}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"sdd": 1.0}, r"parameters\.cuff\.sdd = 1.0: is an unknown key.*did you mean 'sd'"),
        ({"sd": "-1 kN/m"}, r"parameters\.cuff\.sd = '-1 kN/m': is below zero"),
        ({"sd": float("nan")}, r"parameters\.cuff\.sd = nan: is not finite"),
        ({"sd": ["1 kN/m"]}, r"parameters\.cuff\.sd = \['1 kN/m'\]: is not a quantity"),
        ({"sd": "wide"}, r"parameters\.cuff\.sd = 'wide': is not a quantity"),
        ({"at_least": "nan kN/m"}, r"parameters\.cuff\.at_least = 'nan kN/m': is not"),
        ({"relative_sd": 0.1}, r"takes one width; allowed: sd or relative_sd"),
        ({"sd": None, "relative_sd": 2.0}, r"relative_sd = 2.0: is out of range; allowed: at most 1"),
        (
            {"distribution": "gaussian"},
            r"distribution = 'gaussian': is not a valid choice; allowed: 'normal'",
        ),
        ({"kind": None}, r"parameters\.cuff\.kind: is missing"),
        ({"source": ""}, r"parameters\.cuff\.source = '': is empty"),
        ({"key": "orthosis.anchor.shank.stifness"}, r"fits no key.*'stifness'.*did you mean 'stiffness'"),
        ({"key": "orthosis.muscle.*.foo"}, r"orthosis\.muscle\.\*\.foo': fits no key of any scenario"),
        ({"key": "timestep"}, r"cuff = 'timestep': is not a property of orthosis, wearer or walk"),
        ({"key": "limits.bottle_volume"}, r"is not a property of orthosis, wearer or walk"),
        (
            {"key": None, "distribution": None, "sd": None, "fit": "orthosis.muscle"},
            r"is not a place of a muscle",
        ),
    ],
)
def test_what_spreads_nothing_is_refused_by_check_and_by_run(
    call: Call, tmp_path: pathlib.Path, changed: dict[str, Any], said: str
) -> None:
    file = tmp_path / "mine.toml"
    table = {name: value for name, value in (CUFF | changed).items() if value is not None}
    file.write_text(toml_text({"parameters": {"cuff": table}}), encoding="utf-8")
    assert tomllib.loads(file.read_text(encoding="utf-8"))
    walk = ("run", "walk-dropfoot-afo", "--uncertainty", 20, "--spreads", file, "--out", tmp_path / "run")
    for words in (("check", file), walk):
        code, _, err = call(*words)
        assert code == 2 and re.search(said, err), err
        assert err.startswith(f"afo-sim: {file}: ") and len(err.strip().splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


@pytest.mark.parametrize(
    "key", ["phases.dorsiflexor.inlet[0][0]", "supply.pressure", "orthosis.muscle.*.slack"]
)
def test_any_number_of_the_walk_can_spread(key: str, call: Call, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "mine.toml"
    table = CUFF | {"key": key, "sd": 0.01 if "phases" in key else "5 kPa" if "supply" in key else "1 mm"}
    file.write_text(toml_text({"parameters": {"one": table}}), encoding="utf-8")
    assert call("check", file)[0] == 0
    walk = ("run", "walk-dropfoot-afo", *SHORT, "--uncertainty", 20, "--spreads", file)
    assert call(*walk, "--out", tmp_path / "run")[0] == 0


def test_bounds_that_leave_out_the_own_value_are_named(call: Call, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(toml_text({"parameters": {"cuff": CUFF | {"at_least": "8 kN/m"}}}), encoding="utf-8")
    walk = ("run", "walk-dropfoot-afo", "--uncertainty", 20, "--spreads", file, "--out", tmp_path / "run")
    code, _, err = call(*walk)
    assert code == 2 and "parameters.cuff.at_least = '8 kN/m': leaves out" in err
    assert "allowed: at most 4000 N/m" in err


STOPPED = """
import os, signal, sys, threading
from afo_sim import cli
from afo_sim.study.pool import Pool
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where tests run in the background
in_order, number = Pool.in_order, int(sys.argv.pop(1))
def stopped(*arguments):
    *rest, report = arguments
    def told(done, count, doing):
        report(done, count, doing)
        if done == 3:  # others are rolled out in their threads, more wait
            threading.Timer(0.05, os.kill, (os.getpid(), number)).start()
    return in_order(*rest, told)
Pool.in_order = stopped
cli.main()
"""


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)][: size(1, 2)])
def test_draws_that_are_stopped_leave_nothing(number: int, code: int, tmp_path: pathlib.Path) -> None:
    walk = ["run", "walk-dropfoot-afo", "--no-rrd", "--no-change", "--uncertainty", "2000"]
    command = [sys.executable, "-c", STOPPED, str(int(number)), *walk, "--out", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (code, "", "afo-sim: stopped\n")
    assert not list(tmp_path.iterdir())

"""Bands on the command line: what is printed, and what is refused before anything is walked."""

import json
import pathlib
import signal
import subprocess
import sys
from typing import Any

import pytest
from campaign import size
from command import Call

from afo_sim import read_recording, run
from afo_sim.description import toml_text
from afo_sim.simulation.parts import PARTS

SHORT = ("--set", "timestep=4 ms", "--set", "duration=4 s", "--no-rrd", "--no-change")


@pytest.mark.slow
def test_a_run_prints_its_bands(call: Call, tmp_path: pathlib.Path) -> None:
    words = ("run", "walk-dropfoot-afo", *SHORT, "--uncertainty", 20, "--out", tmp_path / "run", "--force")
    code, out, _ = call(*words)
    assert code == 0 and "5 to 95 % of 20 draws of uncertain inputs: " in out
    code, out, _ = call(*words, "--numbers")
    assert code == 0 and "All uncertain inputs varied together (20 draws)" in out
    assert "too few to show what explains the bands" in " ".join(out.split())
    told = read_recording(tmp_path / "run").studies["uncertainty"]
    sets = {"timestep": "4 ms", "duration": "4 s"}
    called = run("walk-dropfoot-afo", sets, step="controlled", uncertainty=20)
    assert json.dumps(told) == json.dumps(called.studies["uncertainty"])


def test_a_file_of_spreads_is_listed_and_checked(call: Call, tmp_path: pathlib.Path) -> None:
    assert "factor_sd" in call("list", "usual")[1]
    file = tmp_path / "mine.toml"
    text = (
        '[parameters.cuff]\nkey = "patient.passive_scale"\ndistribution = "normal"\nsd = 0.1\n'
        'kind = "assumed"\nsource = ""\n'
    )
    file.write_text(text, encoding="utf-8")
    for words in (("check", file), ("run", "walk-dropfoot-afo", "--uncertainty", 20, "--spreads", file)):
        code, _, err = call(*words)
        assert code == 2 and err.startswith(f"afo-sim: {file}: parameters.cuff.source")
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


@pytest.mark.slow
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
def test_draws_that_are_stopped_leave_their_parts(number: int, code: int, tmp_path: pathlib.Path) -> None:
    walk = ["run", "walk-dropfoot-afo", "--no-rrd", "--no-change", "--uncertainty", "2000"]
    command = [sys.executable, "-c", STOPPED, str(int(number)), *walk, "--out", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (code, "", "afo-sim: stopped\n")
    assert [path.name for path in (tmp_path / "run").iterdir()] == [PARTS]

"""Long commands that are killed at any moment go on: the same command ends as if nothing had happened."""

import json
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import campaign
import faults
import pyarrow.parquet as pq
import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
# Short variants of the commands that can take over a minute.
WALK = ("walk-dropfoot-afo", "--no-rrd")
LINES = {
    "run with bands": ("run", *WALK, "--uncertainty", "20", "--no-change"),
    "run with changes": ("run", *WALK),
    "size": ("size", "pressure", "walk-dropfoot-afo", "--between", "2 bar", "2.4 bar"),
    "credibility": (
        *("credibility", "walk-dropfoot-afo", "--question", "q", "--context", "c", "--influence", "low"),
        *("--consequence", "low", "--draws", "20"),
    ),
    "walk of one": ("walk", *WALK, "--patients", "one", "--duration", "4 s", "--starts", "4"),
    "walk of one who adapts": (
        *("walk", *WALK, "--patients", "one", "--duration", "4 s", "--starts", "0"),
        *("--generations", "1", "--set", 'timestep="1 ms"'),
    ),
    "walk of patients": (
        "walk",
        "walk-dropfoot-afo",
        "--patients",
        "TWO",
        "--duration",
        "4 s",
        "--starts",
        "1",
    ),
    "fit of a run": ("fit", "LOG", "--scenario", "seated", "--free", "damping", "--hold-out", "0"),
    "sweep": ("sweep", "SWEEP"),
    "optimise": ("optimise", "SEARCH"),
    "torque-map": ("torque-map",),
    "compare": ("compare", "seated", "--no-rrd"),
    "both": ("both", *WALK),
}
MEASURED = re.compile(r'"(wall_seconds|steps_per_second|seconds_per_case|seconds|digest)": [^\n]*')
FILES = {
    "TWO": 'patients = 2\n[drawn]\ntibialis = { from = 0.7, to = 1.0, source = "assumed" }\n',
    "SWEEP": 'scenario = "seated"\ndesign = "grid"\nchunk = 2\n[set]\nduration = "4 s"\n'
    '[parameters.pressure]\nkey = "supply.pressure"\nfrom = "2 bar"\nto = "3 bar"\nsteps = 8\n',
    "SEARCH": 'scenario = "seated"\nmethod = "cma-es"\ngenerations = 3\nstarts = 1\npopulation = 4\n'
    '[set]\nduration = "4 s"\n[parameters.pressure]\nkey = "supply.pressure"\nfrom = "2 bar"\nto = "3 bar"\n'
    '[objective]\nmetric = "air_per_cycle"\ngoal = "lowest"\n',
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What the commands read, by the word that stands for it."""
    folder, found = tmp_path_factory.mktemp("files"), {}
    for name, text in FILES.items():
        (folder / f"{name.lower()}.toml").write_text(text, encoding="utf-8")
        found[name] = str(folder / f"{name.lower()}.toml")
    log = ["time [s], angle [deg], pressure dorsiflexor [bar]"]
    log += [f"{0.05 * k:.2f}, {10.0 + k % 7 * 0.3:.2f}, {0.3 + k % 5 * 0.02:.3f}" for k in range(60)]
    (folder / "log.csv").write_text("\n".join(log) + "\n", encoding="utf-8")
    return found | {"LOG": str(folder / "log.csv")}


def started(line: list[str], out: pathlib.Path) -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", "afo_sim", *line, "--out", str(out)]
    env = os.environ | {"PYTHONPATH": str(pathlib.Path(__file__).parents[2]), "MUJOCO_GL": "disable"}
    how: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, env=env, cwd=out.parent, start_new_session=True, **how)


def whole(folder: pathlib.Path) -> dict[str, object]:
    """What the files say but for the seconds that were measured."""
    found: dict[str, object] = {}
    for name, content in faults.contents(folder).items():
        found[name] = content
        if name.endswith(".json"):
            found[name] = MEASURED.sub("", content.decode())
        elif name.endswith(".parquet"):
            table = pq.read_table(folder / name)
            columns = {c: table[c].to_pylist() for c in table.column_names}
            found[name] = json.dumps(columns, default=str)
        elif name.endswith((".pdf", ".html", ".gif")):  # which say when they were made
            found[name] = len(content) > 0
    return found


def nobody(group: int) -> bool:
    """No process of a group lives on, or it ends soon."""
    until = time.monotonic() + 10.0
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


def told(name: str, kills: int, files: dict[str, str], folder: pathlib.Path, seed: int) -> Iterator[str]:
    """A line on each kill after which the command does not end as it does without one."""
    line, draw = [files.get(word, word) for word in LINES[name]], random.Random(f"{name} {seed}")
    begun = time.monotonic()
    first = started(line, folder / "whole")
    complaint = first.communicate()[1]
    took, asked = time.monotonic() - begun, whole(folder / "whole")
    if first.returncode not in (0, 1) or not asked:
        yield f"{name}: {complaint}"
        return
    for kill in range(kills):
        out = folder / f"{kill}"
        process = started(line, out)
        try:
            process.communicate(timeout=draw.uniform(0.1, 1.0) * took)
        except subprocess.TimeoutExpired:
            os.kill(process.pid, signal.SIGKILL)
            process.communicate()
        again = started(line, out)
        complaint = again.communicate()[1]
        hidden = faults.hidden(out)
        if again.returncode != first.returncode or "Traceback" in complaint or hidden:
            yield f"{name}, kill {kill}: {again.returncode} {hidden} {complaint}"
        elif other := [k for k, x in asked.items() if whole(out).get(k) != x] or whole(out).keys() - asked:
            yield f"{name}, kill {kill}: {sorted(other)} differ"
        elif not (nobody(process.pid) and nobody(again.pid)):
            yield f"{name}, kill {kill}: a process lives on"


@pytest.mark.parametrize("name", LINES if campaign.NIGHTLY else ["size"])
def test_a_killed_command_ends_as_if_it_had_not_been(
    name: str, files: dict[str, str], tmp_path: pathlib.Path
) -> None:
    assert not list(told(name, campaign.size(1, 16), files, tmp_path, campaign.SEED))

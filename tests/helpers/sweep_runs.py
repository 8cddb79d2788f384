"""Small sweeps that run in a second, and how their rows are compared."""

import json
import pathlib
import shutil
import signal
import subprocess
import sys
import time
from typing import Any

import pyarrow.parquet as pq

from afo_sim.common import assets
from afo_sim.study import Store, cases_of, runner, sweep_plan
from afo_sim.study.engine import Outcome

# Two numbers, cases of three layouts, words, strides that differ with the case's seed. At 1 kN·m the
# ankle goes through its stops. Without a link, on a cuff and a plate that give little, the braid locks.
SWEEP = """
scenario = "walk-dropfoot-afo"
design = "random"
cases = 14
chunk = {chunk}
seed = 5
[set]
duration = "2.6 s"
timestep = "1 ms"
gait.variability = 0.05
orthosis.anchor.shank.stiffness = "400 kN/m"
orthosis.anchor.foot.stiffness = "400 kN/m"
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "4 bar"
[parameters.count]
key = "orthosis.muscle.dorsiflexor.count"
values = [1, 2, 3]
[parameters.patient]
key = "patient"
values = ["drop-foot", "healthy"]
[parameters.load]
key = "load_moment"
values = ["0 N*m", "0.5 N*m", "1 N*m", "1000 N*m"]
[parameters.link]
key = "orthosis.muscle.dorsiflexor.link_length"
values = ["120 mm", "125 mm", "130 mm", "0 mm"]
[parameters.variation]
key = "gait.seed"
from_seed = true
"""
SEATED = """
scenario = "seated"
design = "grid"
chunk = {chunk}
[set]
duration = "0.3 s"
[parameters.pressure]
key = "supply.pressure"
from = "2 bar"
to = "4 bar"
steps = 12
"""


def exact(outcome: Outcome) -> tuple[Any, ...]:
    """An outcome to the last bit; a number that is undefined equals another one."""
    numbers = {name: (metric.unit, float(metric).hex()) for name, metric in outcome.metrics.items()}
    return outcome.status, outcome.reason, outcome.warnings, numbers


def killed(command: list[str], parts: pathlib.Path) -> bool:
    """Run a study, and kill it once it has written one more part; whether it was killed in time."""
    before = len(list(parts.glob("*.parquet")))
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    while process.poll() is None:
        if len(list(parts.glob("*.parquet"))) > before:
            process.send_signal(signal.SIGKILL)
            break
        time.sleep(0.002)
    process.communicate()
    return process.returncode == -signal.SIGKILL


COMMAND = [sys.executable, "-m", "afo_sim", "sweep"]


def written(folder: pathlib.Path, text: str = SWEEP, chunk: int = 4) -> pathlib.Path:
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "sweep.toml"
    file.write_text(text.replace("{chunk}", str(chunk)), encoding="utf-8")
    return file


def opened(file: pathlib.Path, out: pathlib.Path, **options: Any) -> Store:
    chosen = sweep_plan.read(file)
    return runner.open_store(chosen, cases_of(chosen), out, **options)


def swept(folder: pathlib.Path, text: str = SWEEP, chunk: int = 4, **options: Any) -> Any:
    """The table of a sweep that is run in a folder."""
    runner.run(opened(written(folder, text, chunk), folder / "out"), **options)
    return table(folder / "out")


def table(out: pathlib.Path) -> Any:
    assert not (out / "chunks").exists()
    return pq.read_table(out / "results.parquet")


def assert_same(table: Any, other: Any, but: tuple[str, ...] = ()) -> None:
    """Row for row, bit for bit, NaN where NaN is; and the same words about columns and sweep, but `but`."""
    assert table.column_names == other.column_names
    for name in table.column_names:
        one, two = (t[name].to_numpy(zero_copy_only=False) for t in (table, other))
        same = one.tobytes() == two.tobytes() if one.dtype.kind in "fiu" else one.tolist() == two.tolist()
        assert same, name
    sweeps = []
    for each in (table, other):
        told = json.loads(each.schema.metadata[b"sweep"])
        sweeps.append({key: value for key, value in told.items() if key not in but})
    assert sweeps[0] == sweeps[1]
    for name in table.column_names:
        assert table.field(name).equals(other.field(name), check_metadata=True), name


def own_scenario(folder: pathlib.Path) -> None:
    """A scenario with a leg, cuff and plate of its own."""
    for kind, name in (("leg", "adult_75kg"), ("orthosis", "s1")):
        shutil.copytree(assets.find(kind, name).parent, folder / kind)
    text = assets.find("scenario", "seated").read_text(encoding="utf-8")
    text = text.replace('"adult_75kg"', '"leg/leg.toml"').replace('"s1"', '"orthosis/orthosis.toml"')
    (folder / "mine.toml").write_text(text, encoding="utf-8")

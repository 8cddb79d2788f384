"""docs/dm_control.md and its script do as they say."""

import os
import pathlib
import re
import subprocess
import sys

import pytest
from documents import PAGES, ROOT

pytest.importorskip("dm_control")

BLOCKS = re.findall(r"```python\n(.*?)```", PAGES["dm_control"], re.S)
ENVIRONMENT = {**os.environ, "MUJOCO_GL": "disabled"}


def run(*command: str) -> str:
    ended = subprocess.run([sys.executable, *command], capture_output=True, text=True, env=ENVIRONMENT)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.mark.parametrize("block", BLOCKS, ids=["physics", "tasks", "composer", "hold"])
def test_every_block_runs(block: str, tmp_path: pathlib.Path) -> None:
    run("-c", block)


def test_the_humanoids_foot_is_lifted_and_lowered() -> None:
    rows = [line.split() for line in run(str(ROOT / "scripts" / "composer_humanoid.py")).splitlines()[2:]]
    angles = {float(row[0]): float(row[-1]) for row in rows}
    assert angles[4.0] > 5.0  # dorsiflexors filled [deg]
    assert angles[8.0] < -4.0  # plantarflexors filled
    assert len((ROOT / "scripts" / "composer_humanoid.py").read_text("utf-8").splitlines()) < 60

"""docs/dm_control.md does as it says."""

import os
import re
import subprocess
import sys

import pytest
from documents import PAGES

pytest.importorskip("dm_control")

BLOCKS = re.findall(r"```python\n(.*?)```", PAGES["dm_control"], re.S)
ENVIRONMENT = {**os.environ, "MUJOCO_GL": "disabled"}


@pytest.mark.slow
@pytest.mark.parametrize("block", BLOCKS, ids=["physics", "tasks", "hold"])
def test_every_block_runs(block: str) -> None:
    subprocess.run([sys.executable, "-c", block], env=ENVIRONMENT, check=True)

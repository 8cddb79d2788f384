"""The doctor imports what a file's kind needs, and no more."""

import pathlib
import subprocess
import sys

import pytest

from afo_sim.common import assets

BLOCKED = """
import pathlib, sys
from afo_sim.cli.doctor.kinds import check_file
for name in ("legs", "study", "lab", "gait_lab", "show"):
    sys.modules[f"afo_sim.{name}"] = None
for what, finding in check_file(pathlib.Path(sys.argv[1])):
    print(what, finding)
print("heavy:", "mujoco" in sys.modules)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "name", "heavy"),
    [("muscle", "dmsp_20", False), ("valve", "mh1", False), ("orthosis", "s1", True)],
)
def test_part_is_checked_without_the_rooms_of_other_kinds(kind: str, name: str, heavy: bool) -> None:
    file = assets.find(kind, name)
    done = subprocess.run([sys.executable, "-c", BLOCKED, str(file)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert f"kind {kind}" in done.stdout
    assert ("heavy: True" in done.stdout) is heavy


def test_gait_is_checked_without_a_laboratory(tmp_path: pathlib.Path) -> None:
    file = assets.find_gait("opensim_walk")
    done = subprocess.run([sys.executable, "-c", BLOCKED, str(file)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "kind gait cycle" in done.stdout

"""Names of the tasks and older names of the rooms; libraries that are missing are one sentence each."""

import subprocess
import sys

import pytest

from afo_sim.common import MissingExtra

HIDDEN = "import sys; sys.modules[{library!r}] = None; import afo_sim.rl.environments; "
MISSING = [
    ("gymnasium", "afo_sim.rl.environments.gym_env", "pip install 'afo-sim[rl]'"),
    ("dm_control", "afo_sim.rl.environments.suite", "pip install 'afo-sim[rl]'"),
    ("dm_control", "afo_sim.rl.entity", "pip install 'afo-sim[rl]'"),
]


@pytest.mark.parametrize(("library", "module", "words"), MISSING)
def test_a_missing_library_is_one_sentence(library: str, module: str, words: str) -> None:
    code = HIDDEN.format(library=library) + f"import {module}"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    last = found.stderr.strip().splitlines()[-1]
    assert found.returncode == 1 and words in last and "MissingExtra: " in last
    assert issubclass(MissingExtra, ImportError)


def test_older_names_are_the_same_modules() -> None:
    pytest.importorskip("dm_control")
    from afo_sim.environments import suite as older_suite
    from afo_sim.rl import OrthosisEntity
    from afo_sim.rl import OrthosisEntity as older_entity
    from afo_sim.rl.environments import suite

    assert older_entity is OrthosisEntity and older_suite is suite


def test_gymnasium_finds_a_task_behind_the_older_name() -> None:
    gymnasium = pytest.importorskip("gymnasium")
    made = gymnasium.make("afo_sim.environments:afo_sim/SeatedTracking-v0")
    made.close()

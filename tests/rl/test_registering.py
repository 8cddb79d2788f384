"""Libraries that are missing: one sentence each, and all else works."""

import subprocess
import sys

import pytest

HIDDEN = "import sys; sys.modules[{library!r}] = None; import afo_sim.rl.environments; "
MISSING = [
    ("gymnasium", "afo_sim.rl.environments.gym_env", "pip install 'afo-sim[gym]'"),
    ("dm_control", "afo_sim.rl.environments.suite", "pip install 'dm-control"),
]


@pytest.mark.parametrize(("library", "module", "words"), MISSING)
def test_a_missing_library_is_one_sentence(library: str, module: str, words: str) -> None:
    code = HIDDEN.format(library=library) + f"import {module}"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    last = found.stderr.strip().splitlines()[-1]
    assert found.returncode == 1 and last.startswith("ImportError: ") and words in last

"""Small inputs of gait laboratories that once failed, each in a folder of its own.

They are not part of the repository: `AFO_SIM_INPUTS` names their folder, else they are looked for beside the
repository in `shared/data/faults/trials`.
"""

import os
import pathlib

import pytest

ROOT = pathlib.Path(__file__).parents[2]
FOLDER = pathlib.Path(os.environ.get("AFO_SIM_INPUTS", ROOT.parent / "shared" / "data" / "faults" / "trials"))


def kept(name: str) -> pytest.MarkDecorator:
    """The mark of a test that needs one of them."""
    reason = f"the input is not at {FOLDER / name}; AFO_SIM_INPUTS names its folder"
    return pytest.mark.skipif(not (FOLDER / name).exists(), reason=reason)

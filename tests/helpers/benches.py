"""Measured logs that lie beside the repository, and the script that converts them."""

import os
import pathlib

import pytest
from documents import ROOT, script

BENCHES = pathlib.Path(os.environ.get("AFO_SIM_BENCH", ROOT.parent / "shared" / "data" / "bench"))
needed = pytest.mark.skipif(not BENCHES.is_dir(), reason="measured logs lie beside the repository")
SCRIPT = script("bench_logs")

"""Build hook: machine code of the kernels is compiled, for a wheel and for an editable install alike.

A wheel carries it, models/ and gait_data/ inside the package; an editable install reads the checkout.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

IMPORTS = {"lazy-loader", "mujoco", "numba", "numpy", "pydantic"}  # of the core's dependencies, by PROGRAM
PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])  # pip takes folders of editable installs out of PYTHONPATH
from afo_sim.metrics import kernel
from afo_sim.model import contact, muscle_weakness
from afo_sim.native import between_strides, compiled, sensing
from afo_sim.physics import curves, energy, in_series, jitable
from afo_sim.simulation import settle
loads = compiled.callbacks, compiled.planar_steps, kernel.compiled, *jitable.KERNELS
for load in loads[:1] if sys.argv[2] == "callbacks" else loads[1:]:  # each takes about half of the time
    load()
"""


class DataFolders(BuildHookInterface):
    def dependencies(self) -> list[str]:
        return [each for each in self.metadata.core.dependencies if re.split(r"[<>=]", each)[0] in IMPORTS]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        root = pathlib.Path(self.root)
        try:
            compile_kernels(root)
        except (OSError, subprocess.CalledProcessError) as error:
            self.app.display_warning(f"{error}: no machine code is shipped; the first run compiles its own")
        if version != "standard":
            return
        for name in ("models", "gait_data", "machine_code"):
            for path in sorted((root / name).rglob("*")):
                if path.is_file() and path.suffix != ".png":  # pictures are the documents'
                    build_data["force_include"][str(path)] = f"afo_sim/{path.relative_to(root).as_posix()}"


def compile_kernels(root: pathlib.Path) -> None:
    """Machine code in a checkout's folder `machine_code`; what is there of these sources stays.

    Whoever reads it knows by its digest whether it is whole, and of the sources that are then there.
    """
    with tempfile.TemporaryDirectory() as cache:
        there = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
        started = []
        for part in ("callbacks", "others"):  # side by side, in folders of their own: one locks its folder
            own = pathlib.Path(cache, part)
            own.mkdir(mode=0o700)
            command = [sys.executable, "-P", "-c", PROGRAM, str(root), part]
            environment = {**there, "AFO_SIM_CACHE": str(own)}
            started.append(subprocess.Popen(command, cwd=cache, env=environment))
        if failed := [process.args for process in started if process.wait()]:
            raise subprocess.CalledProcessError(1, failed[0])
        (root / "machine_code").mkdir(exist_ok=True)
        for made in pathlib.Path(cache).glob("*/*-*"):  # KIND-KEY
            (root / "machine_code" / made.name.partition("-")[0]).write_bytes(made.read_bytes())

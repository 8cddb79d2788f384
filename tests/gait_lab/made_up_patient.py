"""The patient of `gait_data/drop_foot_made_up.c3d`: a drop foot who steps high.

PYTHONPATH=tests:tests/helpers python -m gait_lab.made_up_patient gait_data/drop_foot_made_up.c3d
"""

import pathlib
import sys
import tempfile
from typing import Any

import numpy as np
from compensating_patient import write_patient
from gait_lab.c3d_writer import write_c3d
from gait_lab.known_walker import Walker
from gait_lab.laboratory import Laboratory

from afo_sim.common import assets

DROP, KNEE, HIP = 20.0, 12.0, 12.0  # that the ankle hangs, and knee and hip are more bent, in swing [deg]
MASS, HEIGHT = 67.0, 1.69  # [kg, m]


def recorded(folder: pathlib.Path) -> Laboratory:
    """The walk, z up, along −y, with two plates."""
    stride = write_patient(assets.find_gait("gatk_stride1"), folder / "stride.csv", DROP, KNEE, HIP)
    walker = Walker(gait=str(stride), mass=MASS)
    return Laboratory(walker, forward="-y", up="z", seconds=3.6, origin=(0.0, 2.0, 0.0))


def write(path: pathlib.Path, laboratory: Laboratory) -> pathlib.Path:
    """As Plug-in Gait has it, in whole numbers."""

    def change(file: Any) -> None:
        file.add_parameter("PROCESSING", "Bodymass", [MASS])
        file.add_parameter("PROCESSING", "Height", [1e3 * HEIGHT])
        file.add_parameter("ANALOG", "SCALE", np.abs(file.analogs).max(axis=0) / 32000.0)
        file.residuals = np.where(np.isnan(file.points).any(axis=-1), -1.0, 0.0)
        file.points, file.floating = np.nan_to_num(file.points), False

    points, plates = laboratory.markers("plug-in gait"), laboratory.plates("single")
    return write_c3d(path, laboratory.time, points, plates, change=change)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        write(pathlib.Path(sys.argv[1]), recorded(pathlib.Path(scratch)))

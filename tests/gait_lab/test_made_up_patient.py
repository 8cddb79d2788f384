"""The shipped C3D file is the known patient's, and an import finds that patient again."""

import pathlib

import numpy as np
import pytest
from gait_lab.gait_truth import differences
from gait_lab.made_up_patient import DROP, HEIGHT, MASS, recorded

from afo_sim.common import assets
from afo_sim.gait.file import read
from afo_sim.gait_lab import Choices, import_gait


def test_the_shipped_patient_is_read_as_the_walker_is(tmp_path: pathlib.Path) -> None:
    done = import_gait([assets.folder("gait_data") / "drop_foot_made_up.c3d"], Choices(walker="patient"))
    off = differences(done, recorded(tmp_path), "right")
    assert off["ankle [deg]"] < 2.2 and off["moment peak [%]"] < 6.0  # of one malleolus: docs/gait_data.md
    assert done.mass.mass == pytest.approx(MASS) and done.cycle.body_height == pytest.approx(HEIGHT)
    assert not [check.fault for check in done.checks if check.notice]
    healthy, swing = read(assets.find_gait("gatk_stride1")), np.array([0.82])
    level, hanging = (cycle.signal("ankle_angle", swing) for cycle in (healthy, done.cycle))
    assert np.degrees(level - hanging) == pytest.approx(DROP, abs=2.0)

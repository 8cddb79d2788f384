"""Plates and markers whose clocks differ are told, by how much; those that agree are not."""

import dataclasses
import pathlib

import numpy as np
import pytest
from walking import known_walk, write_forces, write_trc

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.importing import import_gait

SLOW, FAST = np.arange(0.0, 3.2, 0.01), np.arange(0.0, 3.2, 0.001)


@pytest.mark.parametrize(("late", "word"), [(0.0, ""), (0.02, ""), (0.045, "after"), (-0.08, "before")])
def test_clocks_that_differ_are_told(tmp_path: pathlib.Path, late: float, word: str) -> None:
    walk = known_walk()
    forces = write_forces(tmp_path / "grf.mot", walk, FAST)
    lines = forces.read_text().splitlines()
    head = lines.index("endheader") + 2
    moved = []
    for line in lines[head:]:
        time, rest = line.split("\t", 1)
        moved.append(f"{float(time) + late:.6f}\t{rest}")
    forces.write_text("\n".join([*lines[:head], *moved]) + "\n")
    done = import_gait([write_trc(tmp_path / "walk.trc", walk, SLOW), forces], Choices(mass=67.2))
    told = [warning for warning in done.warnings if "clock" in warning]
    assert len(told) == (word != "")
    if word:
        found = float(told[0].split(" ms")[0].split()[-1])
        assert found == pytest.approx(
            1e3 * abs(late), abs=25.0
        )  # events by kinematics are sure to some 20 ms
        assert f"ms {word} the motion does" in told[0]


def test_plates_that_are_far_too_late_are_refused_with_the_cause(tmp_path: pathlib.Path) -> None:
    walk = known_walk()
    forces = write_forces(tmp_path / "grf.mot", dataclasses.replace(walk, start=walk.start + 0.08), FAST)
    with pytest.raises(InputError, match="the clocks differ"):
        import_gait([write_trc(tmp_path / "walk.trc", walk, SLOW), forces], Choices(mass=67.2))

"""A foot that stands on two plates at once: its stride is left out, and the mass does not suffer."""

import dataclasses
import pathlib

import numpy as np
import pytest
from gait.gait_truth import beyond, differences
from gait.laboratory import Laboratory, Recorded
from gait.trial_files import write_forces, write_trc

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.importing import import_gait

SHARE = 0.3  # of the right foot's force that the left plate carries


def shared(laboratory: Laboratory, stances: tuple[int, ...]) -> list[Recorded]:
    """One plate a side; in some of the right foot's stances a part of its force is on the left plate."""
    right, left = laboratory.plates("feet")
    over = np.zeros(len(right.time))
    for number in stances:
        start = laboratory.walker.heel_strike("right", number)
        over += SHARE * ((right.time > start) & (right.time < start + 0.6 * laboratory.walker.stride_time))
    moved = over[:, None] * right.force
    force = left.force + moved
    place = left.place * left.force[:, 1:2] + right.place * moved[:, 1:2]
    place = np.where(force[:, 1:2] > 0.0, place / np.maximum(force[:, 1:2], 1e-9), 0.0)
    return [
        dataclasses.replace(right, force=right.force - moved),
        dataclasses.replace(left, force=force, place=place),
    ]


def files(folder: pathlib.Path, laboratory: Laboratory, stances: tuple[int, ...]) -> list[pathlib.Path]:
    return [
        write_trc(folder / "walk.trc", laboratory.time, laboratory.markers("cast")),
        write_forces(folder / "grf.mot", shared(laboratory, stances)),
    ]


def test_another_stride_is_taken(tmp_path: pathlib.Path) -> None:
    laboratory = Laboratory()
    done = import_gait(files(tmp_path, laboratory, (0,)), Choices())
    first, second = (stride for stride in done.strides if stride.side == "right")
    assert (first.loaded, second.loaded) == (False, True)
    assert "30 % of the weight stands on another plate" in first.by
    assert not beyond(differences(done, laboratory, "right")), done.warnings
    assert done.mass.estimated == pytest.approx(laboratory.walker.mass, rel=0.06)


def test_without_another_it_is_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="30 % of the weight stands on another plate"):
        import_gait(files(tmp_path, Laboratory(), (-1, 0, 1, 2)), Choices())


def test_clean_steps_are_not_doubted(tmp_path: pathlib.Path) -> None:
    done = import_gait(files(tmp_path, Laboratory(), ()), Choices())
    assert all(stride.loaded for stride in done.strides)

"""Plates that disagree with the motion: in their place, their floor, their direction."""

import dataclasses
import pathlib

import numpy as np
import pytest
from gait_lab.gait_truth import beyond, differences
from gait_lab.laboratory import Laboratory, Recorded
from gait_lab.trial_files import write_forces, write_trc, write_trial

from afo_sim.common import InputError, with_code
from afo_sim.gait_lab import Choices, import_gait

PLAIN = Laboratory()


def test_plates_without_a_force_forward(tmp_path: pathlib.Path) -> None:
    plates = [dataclasses.replace(p, force=p.force * np.array([0.0, 1.0, 0.0])) for p in PLAIN.plates()]
    done = import_gait(write_trial(tmp_path, PLAIN, "opensim c3d", plates), Choices())
    assert with_code(done.warnings, "no-shear-force")


@pytest.mark.parametrize("blank", [np.nan, 0.0])
def test_places_that_are_blank_below_50_newtons(tmp_path: pathlib.Path, blank: float) -> None:
    """In a laboratory whose origin is 5 m away, a place at the origin would have a lever of 5 m."""
    recorded = Laboratory(origin=(5.0, 0.0, 0.0))
    plates = [
        dataclasses.replace(plate, place=np.where(plate.force[:, 1:2] < 50.0, blank, plate.place))
        for plate in recorded.plates()
    ]
    done = import_gait(write_trial(tmp_path, recorded, "opensim c3d", plates), Choices())
    assert beyond(differences(done, recorded, "right")) == {}


@pytest.mark.parametrize("height", [0.3, 0.05, -0.04])
def test_a_floor_that_is_not_at_zero(tmp_path: pathlib.Path, height: float) -> None:
    """A treadmill's deck: heights and moments are about the plates' surface."""
    recorded = Laboratory(origin=(0.0, height, 0.0))
    done = import_gait(write_trial(tmp_path, recorded, "opensim c3d"), Choices())
    assert beyond(differences(done, recorded, "right")) == {}
    assert any(f"{1e3 * height:+.0f} mm above the laboratory's zero" in each for each in done.remarks)


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
    return write_trial(folder, laboratory, "cast", shared(laboratory, stances))


@pytest.mark.slow
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


def test_plates_and_steps_that_agree_are_not_doubted(tmp_path: pathlib.Path) -> None:
    done = import_gait(files(tmp_path, Laboratory(), ()), Choices())
    assert all(stride.loaded for stride in done.strides) and done.warnings == ()


def test_spikes_are_no_steps_and_not_said_to_be_too_weak(tmp_path: pathlib.Path) -> None:
    laboratory = Laboratory()
    spiked = []
    for own in laboratory.plates("feet"):
        force = np.zeros_like(own.force)
        force[300:303] = [0.0, 1640.0, 0.0]
        spiked.append(dataclasses.replace(own, force=force))
    walk = write_trc(tmp_path / "walk.trc", laboratory.time, laboratory.markers("plug-in gait"))
    with pytest.raises(InputError) as caught:
        import_gait([walk, write_forces(tmp_path / "grf.mot", spiked)], Choices())
    assert caught.value.field == "plate" and "1640" in caught.value.problem

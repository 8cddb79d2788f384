"""Degrees or radians: a walking knee bends by some 60 degrees."""

import pathlib

import numpy as np
import pytest

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.opensim_table import OpenSimTable
from afo_sim.gait_lab.readers.unit_checks import angle_unit

TIME = np.arange(0.0, 1.0, 0.01)
KNEE = 32.0 - 30.0 * np.cos(2.0 * np.pi * TIME)  # 2 to 62 deg


def table(degrees: bool, header: bool | None, bend: float = 1.0) -> OpenSimTable:
    values = bend * KNEE if degrees else np.radians(bend * KNEE)
    return OpenSimTable(pathlib.Path("ik.mot"), TIME, {"knee_angle_r": values}, header)


@pytest.mark.parametrize("degrees", [True, False])
@pytest.mark.parametrize("header", [True, False, None])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_knee_outvotes_the_header(degrees: bool, header: bool | None, sign: float) -> None:
    found, warnings = angle_unit(table(degrees, header, sign), ["knee_angle_r"], None)
    assert found is degrees
    assert bool(warnings) is (header is not degrees)
    if warnings:
        assert "a knee that bends by 60 deg" in warnings[0]
        assert f"a range of {60 if degrees else 1.05:g}" in warnings[0]


def test_what_a_person_says_goes_first_unless_it_cannot_be() -> None:
    assert angle_unit(table(True, False), ["knee_angle_r"], True) == (True, ())
    assert angle_unit(table(False, True), ["knee_angle_r"], False) == (False, ())
    found, (warning,) = angle_unit(table(False, False), ["knee_angle_r"], True)
    assert found is True
    assert "bend by 60 deg" in warning
    with pytest.raises(InputError, match="reaches 62, which cannot be radians"):
        angle_unit(table(True, True), ["knee_angle_r"], False)


def test_a_locked_knee_tells_nothing() -> None:
    locked = table(True, True, bend=0.005)
    assert angle_unit(locked, ["knee_angle_r"], None) == (True, ())
    with pytest.raises(InputError, match="its knee does not tell"):
        angle_unit(table(True, None, bend=0.005), ["knee_angle_r"], None)
    with pytest.raises(InputError, match="its knee does not tell"):
        angle_unit(table(True, None), ["knee_angle_l"], None)


def test_a_stiff_knee_is_enough_and_gaps_do_not_matter() -> None:
    stiff = table(False, True, bend=0.4)  # 24 deg
    stiff.columns["knee_angle_r"][3:9] = np.nan
    assert angle_unit(stiff, ["knee_angle_l", "knee_angle_r"], None)[0] is False

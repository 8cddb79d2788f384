"""Walkers between the members of a family."""

import pathlib
import shutil

import numpy as np
import pytest

from afo_sim.common import GRAVITY, InputError, assets
from afo_sim.gait import COP_FORCE, at_speed, examine
from afo_sim.gait import file as gait
from afo_sim.gait.cycle import COLUMNS
from afo_sim.gait.family import family_of

MEMBERS = ("bovi2011_xs", "bovi2011_s", "bovi2011_natural", "bovi2011_m", "bovi2011_l")
ANY = assets.find_gait("bovi2011_natural")


def test_family_is_found_by_rising_speed_from_any_member() -> None:
    for name in MEMBERS:
        assert tuple(member for member, _ in family_of(assets.find_gait(name))) == MEMBERS


@pytest.mark.parametrize("name", MEMBERS)
def test_at_a_members_speed_it_is_that_member(name: str) -> None:
    member = gait.read(assets.find_gait(name))
    found = at_speed(ANY, member.walking_speed)
    assert found.notes == member.notes and found.stride_time == member.stride_time
    for field, _ in COLUMNS.values():
        assert np.array_equal(getattr(found, field), getattr(member, field), equal_nan=True)


def test_halfway_is_the_mean_of_the_two_beside_it() -> None:
    slow, fast = (gait.read(assets.find_gait(name)) for name in ("bovi2011_m", "bovi2011_l"))
    speed = 0.5 * (slow.walking_speed + fast.walking_speed)
    found = at_speed(ANY, speed)
    for field in ("shank_angle", "knee_angle", "ankle_angle", "ankle_x", "ankle_z", "grf_x", "ankle_moment"):
        assert getattr(found, field) == pytest.approx(0.5 * (getattr(slow, field) + getattr(fast, field)))
    assert found.walking_speed == speed
    assert found.body_height == pytest.approx(1.71)
    assert "bovi2011_m" in found.notes["description"] and "bovi2011_l" in found.notes["description"]


@pytest.mark.parametrize("speed", np.linspace(0.85, 1.97, 15))
def test_each_speed_between_is_a_stride_that_fits_together(speed: float) -> None:
    found = at_speed(ANY, speed)
    examine(found)
    length = found.ankle_x[-1] - found.ankle_x[0]
    assert length == pytest.approx(speed * found.stride_time)
    # stride length of people who walk: 0.909 (v/H)^0.441 of body height, to 1.3 % of it (fit of five tasks)
    assert length / 1.71 == pytest.approx(0.909 * (speed / 1.71) ** 0.441, abs=0.015)
    on = (found.grf_z > 2.0 * COP_FORCE) & np.isfinite(found.cop_x)
    moment = GRAVITY * (found.cop_x * found.grf_z + found.ankle_z * found.grf_x)
    assert (
        np.abs(moment + found.ankle_moment)[on].max() < 0.05
    )  # statics; the product of two means is no mean


def test_a_member_left_out_is_predicted_by_its_neighbours(tmp_path: pathlib.Path) -> None:
    """The measured mean at natural speed, against those of slower and faster walking."""
    for name in ("bovi2011_s", "bovi2011_m"):
        shutil.copy(assets.find_gait(name), tmp_path)
    left_out = gait.read(ANY)
    found = at_speed(tmp_path / "bovi2011_s.csv", left_out.walking_speed)
    for field in ("shank_angle", "knee_angle", "ankle_angle"):
        error = np.degrees(getattr(found, field) - getattr(left_out, field))
        assert np.sqrt(np.mean(error**2)) < 2.0  # between people it is 4 to 8 deg
    assert np.sqrt(np.mean((found.ankle_moment - left_out.ankle_moment) ** 2)) < 0.05


def test_speeds_beyond_the_family_are_refused_with_its_range() -> None:
    for speed in (0.5, 2.5):
        with pytest.raises(InputError, match=r"0\.84\d* to 1\.97\d* m/s"):
            at_speed(ANY, speed)


def test_a_stride_of_no_family_is_refused() -> None:
    with pytest.raises(InputError, match="no family") as caught:
        at_speed(assets.find_gait("gatk_stride1"), 1.0)
    assert "bovi2011_natural" in str(caught.value)


def test_a_file_that_changes_is_read_again(tmp_path: pathlib.Path) -> None:
    for name in ("bovi2011_s", "bovi2011_m"):
        shutil.copy(assets.find_gait(name), tmp_path)
    first = at_speed(tmp_path / "bovi2011_s.csv", 1.3)
    assert first.body_mass == pytest.approx(68.5)
    for file in tmp_path.glob("*.csv"):
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace("body_mass_kg: 68.5", "body_mass_kg: 70.25"), encoding="utf-8")
    assert at_speed(tmp_path / "bovi2011_s.csv", 1.3).body_mass == pytest.approx(70.25)


def test_members_of_other_rows_are_refused(tmp_path: pathlib.Path) -> None:
    shutil.copy(assets.find_gait("bovi2011_s"), tmp_path)
    lines = assets.find_gait("bovi2011_m").read_text(encoding="utf-8").splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("phase"))
    kept = lines[: start + 1] + lines[start + 1 :: 2]
    (tmp_path / "bovi2011_m.csv").write_text("\n".join(kept) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="other rows"):
        at_speed(tmp_path / "bovi2011_s.csv", 1.3)

"""What a person chooses counts, or is said not to."""

import pathlib
from typing import Any

import pytest
from gait.laboratory import Laboratory
from gait.osim_writer import write_osim
from gait.trial_files import write_forces, write_trc

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.importing import Imported, import_gait

SET = "gait2392"
RECORDED = Laboratory()


def imported(folder: pathlib.Path, without: tuple[str, ...] = (), **choices: Any) -> Imported:
    points = {n: p for n, p in RECORDED.markers(SET).items() if not n.startswith(without)}
    markers = write_trc(folder / "walk.trc", RECORDED.time, points)
    return import_gait([markers, write_forces(folder / "grf.mot", RECORDED.plates())], Choices(**choices))


def test_markers_make_no_use_of_lengths(tmp_path: pathlib.Path) -> None:
    done = imported(tmp_path, thigh=0.4, shank=0.4, hip=(-0.06, -0.07), degrees=True)
    assert [w for w in done.warnings if w.startswith("thigh, shank, hip, degrees: not used")]


def test_a_model_makes_no_use_of_named_markers(tmp_path: pathlib.Path) -> None:
    model = write_osim(tmp_path / "scaled.osim", RECORDED.walker, SET)
    done = imported(tmp_path, model=model, markers={"ankle": ("R.Heel",)})
    assert [w for w in done.warnings if w.startswith("markers: not used")]


def test_no_choice_no_word(tmp_path: pathlib.Path) -> None:
    assert imported(tmp_path, markers={"ankle": ("R.Ankle.Lat",)}).warnings == ()


def test_both_legs_need_both(tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match=r"left foot.*its leg has no whole stride.*right"):
        imported(tmp_path, without=("L.Knee", "L.Ankle", "L.Heel"), both=True)


def test_one_stride_is_no_mean() -> None:
    for mean in ({"mean": True}, {"both": True}):
        with pytest.raises(InputError, match="a mean is asked for"):
            Choices(stride=2, **mean)

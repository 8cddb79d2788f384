"""The picture of an imported trial: what it says, and that nothing lies over anything else."""

import itertools
import pathlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from figures import lay_out
from matplotlib.figure import Figure
from understood_trial import stand_in

from afo_sim.common import find_gait
from afo_sim.gait.file import read
from afo_sim.show import NORM, draw_gait


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Figure]:
    """A trial of two legs, and its page as it was laid out."""
    done = stand_in()
    with pytest.MonkeyPatch.context() as patch:
        figures = lay_out(patch)
        draw_gait(done.cycle, tmp_path_factory.mktemp("usual") / "a.png", done)
    return done, figures[0]


def panels(figure: Figure) -> list[Any]:
    return [axis for part in figure.subfigs for axis in part.axes]


def panel(figure: Figure, words: str) -> Any:
    (found,) = [axis for axis in panels(figure) if words in axis.get_xlabel() + axis.get_ylabel()]
    return found


def closed() -> Any:
    done = stand_in(duration=2.2)
    stride = done.strides[0]
    stride.closed = SimpleNamespace(window=(stride.start + 0.05, stride.end), gap=0.05, residual={})
    return done


def mean_of_many() -> Any:
    done = stand_in(duration=12.0, side="left", reference=None)
    done.chosen = tuple(k for k, stride in enumerate(done.strides) if stride.side == "left")
    return done


def one_leg() -> Any:
    done = stand_in(duration=2.2, band=None, reference=None)
    del done.legs["left"], done.grounds["left"]
    own = [k for k, stride in enumerate(done.strides) if stride.side == "right"]
    done.strides, done.cycles = (tuple(values[k] for k in own) for values in (done.strides, done.cycles))
    return done


CASES = {"two legs": stand_in, "closed": closed, "mean of many": mean_of_many, "one leg": one_leg}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_nothing_lies_over_anything_else(case: str, tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    done = CASES[case]()
    draw_gait(done.cycle, tmp_path / "a.png", done)
    (figure,) = drawn
    page = figure.bbox.padded(1.0)
    legends = [legend for part in figure.subfigs for legend in part.legends]
    boxes = {id(axis): axis.get_tightbbox().padded(-2.0) for axis in panels(figure)}
    boxes |= {id(legend): legend.get_window_extent().padded(-2.0) for legend in legends}
    for box in boxes.values():
        assert page.x0 <= box.x0 and box.x1 <= page.x1
        assert page.y0 <= box.y0 and box.y1 <= page.y1
    for one, other in itertools.combinations(boxes.values(), 2):
        assert not one.overlaps(other)


@pytest.mark.slow
def test_points_are_labelled_with_their_errors(usual: tuple[Any, Figure]) -> None:
    words = {text.get_text() for text in panel(usual[1], "ahead of the ankle").texts}
    assert words == {"hip ±20 mm", "knee ±10 mm", "ankle ±8 mm", "heel", "toe"}


@pytest.mark.slow
def test_events_by_force_are_filled_and_others_open(usual: tuple[Any, Figure]) -> None:
    """The stand-in's heel strikes are where force begins; its toe-offs are not where force ends."""
    events = usual[1].subfigs[0].axes[0]
    filling = {
        mark: {line.get_markerfacecolor() for line in events.lines if line.get_marker() == mark}
        for mark in "v^"
    }
    assert filling == {"v": {"black"}, "^": {"white"}}


@pytest.mark.slow
def test_the_moment_is_drawn_as_laboratories_do_over_its_band(
    usual: tuple[Any, Figure], tmp_path: pathlib.Path, drawn: list[Figure]
) -> None:
    done, page = usual
    draw_gait(done.cycle, tmp_path / "b.png")
    for axis in (panel(page, "ankle moment"), next(a for a in drawn[0].axes if "moment" in a.get_ylabel())):
        assert "plantarflexion +" in axis.get_ylabel()
        (line,) = [line for line in axis.lines if line.get_label() in ("taken", "of the file")]
        assert np.allclose(line.get_ydata(), -done.cycle.ankle_moment)
        faces = [(c, c.get_facecolor()) for c in axis.collections]
        (grey,) = [c for c, face in faces if len(face) and np.allclose(face[0, :3], float(NORM))]
        (band,) = [path.vertices for path in grey.get_paths()]
        assert 1.0 < band[:, 1].max() < 1.6  # published push-off, N·m/kg, upward
        assert 40.0 < band[np.argmax(band[:, 1]), 0] < 55.0


@pytest.mark.slow
def test_warnings_and_the_mean_stand_on_the_page(tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    done = stand_in()
    left = next(k for k, s in enumerate(done.strides) if s.side == "left" and s.loaded)
    done.chosen = (0, left)
    draw_gait(done.cycle.with_warnings([f"doubt {k}" for k in range(5)]), tmp_path / "a.png", done)
    (figure,) = drawn
    assert "mean of both legs" in figure.get_suptitle()
    words = figure.get_supxlabel()
    assert words.startswith("5 warnings:") and "doubt 2" in words and "doubt 3" not in words
    assert "2 more" in words


@pytest.mark.slow
def test_the_view_from_above_ends_where_the_walk_does(tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    done = stand_in()
    far = SimpleNamespace(name="far", corners=np.add(done.trial.plates[0].corners, [0.0, 0.0, 20.0]))
    done.trial.plates = (*done.trial.plates, far)
    draw_gait(done.cycle, tmp_path / "a.png", done)
    above = panel(drawn[0], "seen from above")
    ways = np.concatenate([line.get_xydata() for line in above.lines if "ankle" in line.get_label()])
    low, high = above.get_xlim()
    assert (
        ways[:, 0].min() - 1.0 < low < ways[:, 0].min() and ways[:, 0].max() < high < ways[:, 0].max() + 1.0
    )
    assert {text.get_text() for text in above.texts} <= {"1", "2"}


@pytest.mark.slow
def test_the_way_from_above_has_left_on_the_left(usual: tuple[Any, Figure]) -> None:
    ways = {line.get_label(): line.get_xydata() for line in panel(usual[1], "seen from above").lines}
    assert ways["left ankle"][:, 1].mean() > ways["pelvis"][:, 1].mean() > ways["right ankle"][:, 1].mean()
    assert all(ways[name][-1, 0] > ways[name][0, 0] + 1.0 for name in ("left ankle", "right ankle", "pelvis"))


def test_toes_of_the_drawn_foot_bend_instead_of_sinking(tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    """Rigid toes' tip would be 5 and 17 mm below the floor at 50 and 60 % of the stride, the heel off it."""
    cycle = read(find_gait("gatk_stride1"))
    draw_gait(cycle, tmp_path / "a.png")
    feet = [line.get_xydata() for line in drawn[-1].axes[0].lines if len(line.get_xydata()) == 6]
    assert len(feet) == 11  # every 10 %
    for foot in feet[5:7]:
        _, heel, hinge, tip, *_ = foot
        along, toes = hinge - heel, tip - hinge
        assert np.arctan2(toes[1], toes[0]) > np.arctan2(along[1], along[0]) + np.radians(10.0)
        assert tip[1] > -0.005

"""Figures and films of walking: what they draw is the run's, with and without an orthosis."""

import dataclasses
import pathlib
import re
import shutil
from typing import Any

import numpy as np
import pytest
from figures import lines, opengl_missing, panel
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

import afo_sim
from afo_sim.common import InputError
from afo_sim.show import panels, run_figure, video
from afo_sim.show.ground_force import ARROW
from afo_sim.show.moving_parts import Carriage
from afo_sim.show.run_view import alone
from afo_sim.show.walking_figure import WalkingFigure
from afo_sim.simulation import Recording

STANDING = 0.05 * 75.0 * 9.80665  # 5 % of the body weight [N]


@pytest.fixture(scope="module")
def bare(walks: dict[str, Recording]) -> Recording:
    return walks["bare"]


@pytest.fixture(scope="module")
def helped() -> Recording:
    """From empty muscles, so that the air jumps to the settled stride's."""
    return afo_sim.run("walk-dropfoot-afo", {"duration": "2.4 s", "start": {}})


@pytest.mark.slow
def test_figures_are_those_that_have_something_to_show(
    bare: Recording, helped: Recording, tmp_path: pathlib.Path, drawn: list[Figure]
) -> None:
    assert set(run_figure.figures_of(bare)) == {"overview", "angle", "torque", "clearance"}
    assert set(run_figure.figures_of(helped)) == set(run_figure.FIGURES)
    for run in (bare, helped):
        for name in run_figure.figures_of(run):
            run_figure.FIGURES[name](run, tmp_path / f"{name}.png")
            assert drawn[-1].axes and (tmp_path / f"{name}.png").is_file()


def test_clearance_panel_draws_both_feet(bare: Recording) -> None:
    """Own heights are the columns; the healthy ones are those that the same walk has when healthy."""
    axis = panel(panels.sole, bare)
    drawn = lines(axis)
    assert np.array_equal(drawn["toe"], 1e3 * bare["toe/height"])
    assert np.array_equal(drawn["ball"], 1e3 * bare["ball/height"])
    healthy = afo_sim.run("walk-healthy", {"duration": "4 s"})
    expected = 1e3 * healthy["toe/height"]
    carried = 1e3 * bare["shank/sink"]  # by the floor, where the toe drags
    assert axis.lines[1].get_ydata() - carried == pytest.approx(expected, abs=5.0)
    assert np.abs(expected - drawn["toe"]).max() > 20.0  # which the drop foot's are not


def test_stance_is_shaded_where_the_ground_pushes(bare: Recording) -> None:
    axis = panel(panels.sole, bare)
    spans = [patch.get_extents().transformed(axis.transData.inverted()) for patch in axis.patches]
    assert len(spans) == len(bare.strides) >= 3  # one a stride
    for time, force in zip(bare["time"][::50], bare["gait/ground_force_z"][::50], strict=True):
        assert any(span.x0 <= time < span.x1 for span in spans) == (force > STANDING)


def test_where_solved_strides_begin_a_line_says_so_once_in_a_figure(helped: Recording) -> None:
    """The air jumps there, to what it has at the same instant a stride later."""
    first = int(np.flatnonzero(helped["gait/solved"])[0])
    figure = Figure()
    above, below = figure.subplots(2, 1)
    panels.angle(above, [alone(helped)])
    panels.pressures(below, [alone(helped)])
    for axis in (above, below):
        [(line,)] = [c.get_segments() for c in axis.collections if isinstance(c, LineCollection)]
        assert line[:, 0].tolist() == [helped["time"][first]] * 2
    words = [text.get_text() for axis in (above, below) for text in axis.texts]
    assert words.count("settled") == 1
    walked = {name: values[:first] for name, values in helped.columns.items()}
    axis = panel(panels.pressures, dataclasses.replace(helped, columns=walked))
    assert not axis.texts and not any(isinstance(c, LineCollection) for c in axis.collections)


def test_force_over_contraction_has_a_gap_where_the_air_jumps(helped: Recording) -> None:
    first = int(np.flatnonzero(helped["gait/solved"])[0])
    figure = Figure()
    run_figure._force_contraction(figure, alone(helped))
    [curve] = [c for c in figure.axes[0].collections if isinstance(c, LineCollection)]
    jump = 100.0 * helped["muscle/dorsiflexor_1/contraction"][[first - 1, first]]
    assert jump[1] - jump[0] > 10.0
    assert not any(start < jump.mean() < end for start, end in (s[[0, -1], 0] for s in curve.get_segments()))


def test_a_toe_that_drags_does_not_shade_the_swing() -> None:
    run = afo_sim.run("walk-dropfoot", {"duration": "2.4 s", "ground.mode": "contact"})
    axis = panel(panels.sole, run)
    recorded = run["gait/ground_force_z"] > STANDING
    assert len(axis.patches) == int(recorded[0]) + int(np.sum(recorded[1:] & ~recorded[:-1]))
    assert np.any(~recorded & (run["ground/force/z"] > STANDING))


def test_moment_panel_has_all_of_walkings_moments(bare: Recording, helped: Recording) -> None:
    for run, names in ((bare, ()), (helped, ("orthosis",))):
        drawn = lines(panel(panels.moments, run))
        drawn.pop("_child0")  # the line at zero
        assert set(drawn) == {"passive", "gravity", "biological", "ground", "frame", *names}
        for name, values in drawn.items():
            assert np.array_equal(values, run[f"ankle/moment/{name}"])


def test_carriage_has_no_part_in_strides_of_varied_duration() -> None:
    walked = np.linspace(0.3, 5.3, 500) + 0.02 * np.sin(np.linspace(0.0, 9.0, 500))
    x = 0.4 + 1.3 * walked
    ride = Carriage.beside(np.linspace(0.0, 6.0, 500), walked, x)
    assert ride.at(walked) == pytest.approx(x, abs=1e-9)
    assert ride.length == pytest.approx(1.3)
    assert ride.stride_time == pytest.approx(6.0 / np.ptp(walked))


def green(picture: np.ndarray) -> np.ndarray:
    return picture[..., 1].astype(int) - picture[..., [0, 2]].max(axis=2) > 40


def skin(picture: np.ndarray) -> np.ndarray:
    return (picture[..., 0].astype(int) - picture[..., 2] > 50) & (picture[..., 0] > 150)


def rows_of(mask: np.ndarray) -> np.ndarray:
    return np.flatnonzero(mask.any(axis=1))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_film_keeps_up_with_the_leg_and_shows_the_ground_force(bare: Recording, helped: Recording) -> None:
    """The arrow is short at the end of push-off, and away in swing."""
    if reason := opengl_missing():
        pytest.skip(reason)
    for run in (bare, helped):
        with video.Painter(run, 640, 480, WalkingFigure.of(alone(run)), "who") as painter:
            stance, late, swing = (painter.picture(phase)[60:-60].copy() for phase in (0.4, 0.61, 0.8))
        assert green(stance).sum() > 200
        assert 0 < green(late).sum() < green(stance).sum() / 2
        assert green(swing).sum() < green(stance).sum() / 4  # the line of the toes' height
        for picture in (stance, late, swing):
            assert skin(picture).sum() > 1000
            assert 160 < np.flatnonzero(skin(picture).any(axis=0)).mean() < 480


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_films_arrow_is_to_scale_and_stands_where_the_sole_does(bare: Recording) -> None:
    if reason := opengl_missing():
        pytest.skip(reason)
    figure = WalkingFigure.of(alone(bare))
    with video.Painter(bare, 640, 960, figure) as painter:
        picture, metre = painter.picture(0.3), 960.0 / painter.model.vis.global_.fovy
    arrow, foot = rows_of(green(picture)), rows_of(skin(picture))
    length = ARROW * float(figure.stride.at("ground/force/z", 0.3)) / (68.5 * 9.80665)
    assert np.ptp(arrow) / metre == pytest.approx(length, rel=0.03)
    assert abs(arrow[-1] - foot[-1]) / metre < 0.005


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_film_of_a_walk_is_one_stride_beside_the_reference(
    walks: dict[str, Recording], tmp_path: pathlib.Path
) -> None:
    if shutil.which("ffmpeg") is None:
        pytest.skip("ffmpeg is not installed")
    if reason := opengl_missing():
        pytest.skip(reason)
    done: list[tuple[int, int]] = []
    run, small = walks["worn"], {"width": 64, "height": 48, "rate": 10.0}
    titles = video.write_video(run, tmp_path / "a.mp4", slow=2.0, progress=lambda *n: done.append(n), **small)
    assert titles == ("without the device, shoe trainer", "with s1")
    frames = round(2.0 * 10.0 * alone(run).strides[-1].duration)
    assert done == [(k + 1, frames) for k in range(frames)]
    both = {"short": run, "bare": walks["bare"]}
    assert video.write_video(both, tmp_path / "b.mp4", stride=2, slow=0.5, **small) == ("short", "bare")


@pytest.mark.parametrize(
    ("names", "options", "said"),
    [
        ("worn", {"stride": 99}, "stride = 99: is not a stride of the run; allowed: 1 to"),
        ("worn", {"slow": 0.0}, "slow = 0.0: is not in range; allowed: above 0 to 100"),
        ("sitting", {"stride": 1}, "stride = 1: is of a walk; this run has no strides"),
        ("sitting worn", {}, "runs: are not all walks; allowed: walks, or one seated run"),
        ("bare worn bare worn", {}, "4: is not a valid number of runs; allowed: 1 to 3"),
    ],
)
def test_film_says_what_it_cannot_show(
    walks: dict[str, Recording], tmp_path: pathlib.Path, names: str, options: dict[str, Any], said: str
) -> None:
    runs = {f"{k}": walks[name] for k, name in enumerate(names.split())}
    with pytest.raises(InputError, match=re.escape(said)):
        video.write_video(runs, tmp_path / "a.mp4", **options)
    assert not list(tmp_path.iterdir())

"""Figures and films of walking: what they draw is the run's, with and without an orthosis."""

import dataclasses
import pathlib

import numpy as np
import pytest
from figures import lines, opengl_missing, panel
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

import afo_sim
from afo_sim.show import panels, run_figure, video
from afo_sim.show.moving_parts import Carriage
from afo_sim.show.run_view import alone
from afo_sim.simulation import Recording

STANDING = 0.05 * 75.0 * 9.80665  # 5 % of the body weight [N]


@pytest.fixture(scope="module")
def bare() -> Recording:
    return afo_sim.run("walk-dropfoot", {"duration": "2.4 s"})


@pytest.fixture(scope="module")
def helped() -> Recording:
    """From empty muscles, so that the air jumps to the settled stride's."""
    return afo_sim.run("walk-dropfoot-afo", {"duration": "2.4 s", "start": {}})


@pytest.mark.slow
def test_figures_are_those_that_have_something_to_show(
    bare: Recording, helped: Recording, tmp_path: pathlib.Path
) -> None:
    assert set(run_figure.figures_of(bare)) == {"overview", "angle", "torque", "clearance"}
    assert set(run_figure.figures_of(helped)) == set(run_figure.FIGURES)
    for run in (bare, helped):
        for name in run_figure.figures_of(run):
            run_figure.FIGURES[name](run, tmp_path / f"{name}.png")
            assert (tmp_path / f"{name}.png").stat().st_size > 1000


def test_clearance_panel_draws_both_feet(bare: Recording) -> None:
    """Own heights are the columns; the healthy ones are those that the same walk has when healthy."""
    axis = panel(panels.sole, bare)
    drawn = lines(axis)
    assert np.array_equal(drawn["toe"], 1e3 * bare["toe/height"])
    assert np.array_equal(drawn["ball"], 1e3 * bare["ball/height"])
    healthy = afo_sim.run("walk-healthy", {"duration": "2.4 s"})
    expected = 1e3 * healthy["toe/height"]
    assert axis.lines[1].get_ydata() == pytest.approx(expected, abs=5.0)
    assert np.abs(expected - drawn["toe"]).max() > 50.0  # which the drop foot's are not


def test_stance_is_shaded_where_the_ground_pushes(bare: Recording) -> None:
    axis = panel(panels.sole, bare)
    spans = [patch.get_extents().transformed(axis.transData.inverted()) for patch in axis.patches]
    assert len(spans) == len(bare.strides) == 3  # one a stride
    for time, force in zip(bare["time"][::50], bare["ground/force/z"][::50], strict=True):
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


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_film_keeps_up_with_the_leg_and_shows_the_ground_force(bare: Recording, helped: Recording) -> None:
    if reason := opengl_missing():
        pytest.skip(reason)
    for run in (bare, helped):
        with video.Painter(run, 640, 480) as painter:
            later = run["gait/stride"] + run["gait/phase"]
            rows = (100, *np.searchsorted(later, [1.3, 1.8]))
            first, stance, swing = (painter.picture(int(row)).copy() for row in rows)
        assert green(stance).sum() > 200 > 10 > green(swing).sum()
        for picture in (first, stance, swing):
            assert skin(picture).sum() > 3000
            assert 160 < np.flatnonzero(skin(picture).any(axis=0)).mean() < 480


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_films_arrow_is_half_a_metre_for_a_body_weight(bare: Recording) -> None:
    """Held against the leg beside it, which is 0.55 m tall with its knee."""
    if reason := opengl_missing():
        pytest.skip(reason)
    stance = np.flatnonzero((bare["gait/stride"] == 1.0) & (bare["gait/phase"] < 0.5))
    row = int(stance[np.argmin(np.abs(bare["shank/angle"][stance]))])  # upright
    with video.Painter(bare, 640, 480) as painter:
        picture = painter.picture(row)
    arrow, leg = (np.ptp(np.flatnonzero(mask(picture).any(axis=1))) for mask in (green, skin))
    length = 0.5 * bare["ground/force/z"][row] / (68.5 * 9.80665)
    assert arrow / leg == pytest.approx(length / 0.55, rel=0.1)

"""Figures and films of walking: what they draw is the run's, with and without an orthosis."""

import pathlib

import numpy as np
import pytest
from figures import lines, opengl_missing, panel

import afo_sim
from afo_sim.show import panels, run_figure, video_painter
from afo_sim.show.carriage import Carriage
from afo_sim.simulation.recording import Recording

STANDING = 0.05 * 75.0 * 9.80665  # 5 % of the body weight [N]


@pytest.fixture(scope="module")
def bare() -> Recording:
    return afo_sim.run("walk-dropfoot", {"duration": "2.4 s"})


@pytest.fixture(scope="module")
def helped() -> Recording:
    return afo_sim.run("walk-dropfoot-afo", {"duration": "2.4 s"})


@pytest.mark.slow
def test_figures_are_those_that_have_something_to_show(
    bare: Recording, helped: Recording, tmp_path: pathlib.Path
) -> None:
    names = {path.stem for path in run_figure.write_figures(bare, tmp_path / "bare")}
    assert names == {"overview", "angle", "torque", "clearance"}
    names = {path.stem for path in run_figure.write_figures(helped, tmp_path / "helped")}
    assert names == set(run_figure.FIGURES)


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
    assert len(spans) == 2  # strides of 1.2 s; the third's force is still below 5 % in the last rows
    for time, force in zip(bare["time"][::50], bare["ground/force/z"][::50], strict=True):
        assert any(span.x0 <= time < span.x1 for span in spans) == (force > STANDING)


def test_a_toe_that_drags_does_not_shade_the_swing() -> None:
    run = afo_sim.run("walk-dropfoot", {"duration": "2.4 s", "ground.mode": "contact"})
    axis = panel(panels.sole, run)
    recorded = run["gait/ground_force_z"] > STANDING
    assert len(axis.patches) == 1 + int(np.sum(recorded[1:] & ~recorded[:-1]))
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
        with video_painter.Painter(run, 640, 480) as painter:
            first, stance, swing = (painter.picture(row).copy() for row in (100, 1700, 2200))
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
    row = int(np.argmin(np.abs(bare["shank/angle"][1400:1800]))) + 1400  # upright
    with video_painter.Painter(bare, 640, 480) as painter:
        picture = painter.picture(row)
    arrow, leg = (np.ptp(np.flatnonzero(mask(picture).any(axis=1))) for mask in (green, skin))
    length = 0.5 * bare["ground/force/z"][row] / (75.0 * 9.80665)
    assert arrow / leg == pytest.approx(length / 0.55, rel=0.1)

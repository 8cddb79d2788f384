"""Figures and videos: they show the data, appear whole or not at all, and say what is missing."""

import copy
import dataclasses
import functools
import pathlib
import shutil
import subprocess
from typing import Any

import matplotlib
import numpy as np
import pytest
from figures import lines, opengl_missing, panel
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread
from yielding import rigid_run

import afo_sim
from afo_sim.common import InputError
from afo_sim.show import panels, run_figure, style, video
from afo_sim.show.run_view import alone
from afo_sim.simulation import Recording

FILES = {
    f"{name}.{suffix}"
    for name in ("overview", "angle", "torque", "pressure", "muscles", "force_contraction")
    for suffix in ("png", "pdf")
}

SEATED_MOMENTS = [style.MOMENTS[name] for name in ("orthosis", "passive", "gravity")]


def rows(recording: Recording, count: int) -> Recording:
    """The first rows only, as a run that failed leaves them."""
    columns = {name: values[:count] for name, values in recording.columns.items()}
    return dataclasses.replace(recording, columns=columns, status="failed: for a test")


@functools.cache
def pixels(path: pathlib.Path) -> np.ndarray:
    return imread(path)[:, :, :3]


def has_colour(path: pathlib.Path, colour: str, least: int = 50) -> bool:
    image = pixels(path)
    return int((np.abs(image - to_rgb(colour)).max(axis=2) < 0.01).sum()) >= least


@pytest.fixture(scope="module")
def folder(antagonist: Recording, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    target = tmp_path_factory.mktemp("figures") / "new"
    thin = {name: values[::8] for name, values in antagonist.columns.items()}
    written = run_figure.write_figures(dataclasses.replace(antagonist, columns=thin), target)
    assert {path.name for path in written} == FILES
    return target


@pytest.mark.slow
def test_every_figure_is_there_in_both_formats_and_nothing_else(folder: pathlib.Path) -> None:
    assert {path.name for path in folder.iterdir()} == FILES
    for path in folder.glob("*.pdf"):
        assert path.read_bytes().startswith(b"%PDF")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "colours"),
    [
        ("overview", [style.RUNS[0], *SEATED_MOMENTS, *style.COLOURS[:2]]),
        ("angle", [style.RUNS[0]]),
        ("torque", SEATED_MOMENTS),
        ("pressure", list(style.COLOURS[:2])),
    ],
)
def test_pictures_show_the_curves(folder: pathlib.Path, name: str, colours: list[str]) -> None:
    for colour in colours:
        assert has_colour(folder / f"{name}.png", colour)


def test_force_over_contraction_is_coloured_by_pressure(folder: pathlib.Path) -> None:
    scale = matplotlib.colormaps[style.SCALE]
    for share in (0.0, 0.4, 0.8):
        assert has_colour(folder / "force_contraction.png", scale(style.SCALE_END * share), least=5)


def test_angle_panel_draws_the_angle_and_the_range_of_motion(antagonist: Recording) -> None:
    axis = panel(panels.angle, antagonist)
    curve = axis.lines[-1]
    assert np.array_equal(curve.get_xdata(), antagonist["time"])
    assert np.array_equal(curve.get_ydata(), np.degrees(antagonist["ankle/angle"]))
    band = axis.patches[0].get_extents().transformed(axis.transData.inverted())
    assert [band.y0, band.y1] == pytest.approx([-20.0, 20.0])


def test_moments_pressures_and_forces_are_the_columns(antagonist: Recording) -> None:
    moments = lines(panel(panels.moments, antagonist))
    for name in ("orthosis", "passive", "gravity"):
        assert np.array_equal(moments[name], antagonist[f"ankle/moment/{name}"])
    pressures = lines(panel(panels.pressures, antagonist))
    assert set(pressures) == {"supply", "dorsiflexor", "plantarflexor"}
    assert pressures["plantarflexor"] == pytest.approx(antagonist["chamber/plantarflexor/pressure"] / 1e5)
    forces = lines(panel(panels.forces, antagonist))
    assert set(forces) == {"dorsiflexor 1–3", "plantarflexor 1–2"}
    assert np.array_equal(forces["dorsiflexor 1–3"], antagonist["muscle/dorsiflexor_1/force"])


def test_valve_bars_cover_the_time_their_valves_are_open(antagonist: Recording) -> None:
    axis = panel(panels.valves, antagonist)
    labels = [label.get_text() for label in axis.get_yticklabels()]
    assert labels == [f"{c} {s}" for c in ("dorsiflexor", "plantarflexor") for s in ("inlet", "outlet")]
    time = antagonist["time"]
    for lane, (label, bar) in enumerate(zip(labels, axis.collections, strict=True)):
        opening = antagonist[f"valve/{label.replace(' ', '_')}/opening"]
        path = bar.get_paths()[0]
        for at in (0.2, 2.0, 5.0, 7.0, 9.0, 13.0):
            is_open = opening[np.searchsorted(time, at)] > 0.5
            assert path.contains_point((at, lane)) == is_open, (label, at)


def test_muscles_of_a_group_that_differ_are_drawn_apart(seated: Recording) -> None:
    second = {"muscle/dorsiflexor_2/force": 1.1 * seated["muscle/dorsiflexor_2/force"]}
    other = dataclasses.replace(seated, columns=seated.columns | second)
    forces = lines(panel(panels.forces, other))
    assert set(forces) == {"dorsiflexor 1", "dorsiflexor 2", "dorsiflexor 3", "plantarflexor 1–2"}
    assert np.array_equal(forces["dorsiflexor 2"], other["muscle/dorsiflexor_2/force"])


def test_loop_runs_through_rows_of_the_recording(seated: Recording) -> None:
    page = Figure()
    run_figure._force_contraction(page, alone(seated))
    segments = np.array(page.axes[0].collections[0].get_segments())
    contraction, force = (seated[f"muscle/dorsiflexor_1/{x}"] for x in ("contraction", "force"))
    recorded = np.column_stack([100.0 * contraction, force])
    assert np.array_equal(segments[0, 0], recorded[0])
    assert np.isin(segments[:, 1, 1], force).all()
    assert np.array_equal(segments.max(axis=(0, 1)), recorded.max(axis=0))


def drawn_once(recording: Recording, folder: pathlib.Path, drawn: list[Figure]) -> None:
    """Each figure of a seated run, in one format: the others save the same page."""
    names = run_figure.figures_of(recording)
    assert set(names) == {name.partition(".")[0] for name in FILES}
    for name in names:
        run_figure.FIGURES[name](recording, folder / f"{name}.png")
        assert drawn[-1].axes and (folder / f"{name}.png").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2])
def test_few_rows_of_a_failed_run_are_drawn(
    seated: Recording, tmp_path: pathlib.Path, drawn: list[Figure], count: int
) -> None:
    drawn_once(rows(seated, count), tmp_path, drawn)


@pytest.mark.slow
def test_one_chamber_with_one_muscle(seated: Recording, tmp_path: pathlib.Path, drawn: list[Figure]) -> None:
    scenario = copy.deepcopy(seated.described)
    for part in ("muscle", "chamber"):
        del scenario["orthosis"][part]["plantarflexor"]
    scenario["orthosis"]["muscle"]["dorsiflexor"]["count"] = 1
    one = dataclasses.replace(
        seated, described=scenario, columns={n: v for n, v in seated.columns.items() if "plantar" not in n}
    )
    drawn_once(one, tmp_path, drawn)
    assert set(lines(panel(panels.forces, one))) == {"dorsiflexor"}


def test_nothing_to_draw_is_refused(seated: Recording, tmp_path: pathlib.Path) -> None:
    empty = rows(seated, 0)
    for draw in (
        lambda: run_figure.write_figures(empty, tmp_path / "new"),
        lambda: run_figure.draw_run(empty, tmp_path / "a.png"),
        lambda: video.write_video(empty, tmp_path / "a.mp4"),
    ):
        with pytest.raises(InputError, match="nothing to draw"):
            draw()
    assert not list(tmp_path.iterdir())


def test_failure_leaves_the_old_file_and_no_half_of_a_new_one(
    seated: Recording, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = tmp_path / "a.pdf"
    old.write_text("old")

    def full(self: Figure, path: pathlib.Path, **_: object) -> None:
        path.write_text("half")
        raise OSError("no space left on device")

    monkeypatch.setattr(Figure, "savefig", full)
    with pytest.raises(InputError, match="no space"):
        run_figure.FIGURES["angle"](seated, old)
    assert [path.name for path in tmp_path.iterdir()] == ["a.pdf"]
    assert old.read_text() == "old"


def test_unknown_format_names_the_known_ones(seated: Recording, tmp_path: pathlib.Path) -> None:
    with pytest.raises(InputError, match="png, pdf, svg"):
        run_figure.draw_run(seated, tmp_path / "a.docx")


def test_global_style_of_matplotlib_stays(seated: Recording, tmp_path: pathlib.Path) -> None:
    names = sorted(matplotlib.rcParams.keys() - {"backend"})  # which is found out by asking for it
    before = [matplotlib.rcParams[name] for name in names]
    run_figure.FIGURES["angle"](seated, tmp_path / "a.svg")
    assert [matplotlib.rcParams[name] for name in names] == before


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_video_has_a_picture_for_every_time(tmp_path: pathlib.Path) -> None:
    if shutil.which("ffmpeg") is None or shutil.which("ffprobe") is None:
        pytest.skip("ffmpeg is not installed")
    if reason := opengl_missing():
        pytest.skip(reason)
    run = afo_sim.run("seated", {"duration": "0.5 s"})
    path, done = tmp_path / "a.mp4", []
    video.write_video(run, path, width=320, height=240, progress=lambda *part: done.append(part))
    assert done == [(k, 13) for k in range(1, 14)]  # 25 a second
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]
    probe = ["ffprobe", "-v", "error", "-show_entries", "stream=width,height,nb_frames", "-of", "csv=p=0"]
    found = subprocess.run([*probe, str(path)], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "320,240,13"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_pictures_follow_the_ankle_and_the_force() -> None:
    if reason := opengl_missing():
        pytest.skip(reason)
    run = rigid_run("4 s")
    with video.Painter(run, 320, 240) as painter:
        rest, again, up = (painter.picture(time).astype(int) for time in (0.0, 0.001, 3.9))
    leg = np.s_[100:]  # below the caption

    def red(picture: np.ndarray) -> int:
        return int((picture[leg][..., 0] - picture[leg][..., 1:].max(axis=2) > 80).sum())

    assert np.abs(rest - again)[leg].max() < 10
    assert (np.abs(rest - up)[leg].max(axis=2) > 60).sum() > 200
    assert red(rest) < 10 < 50 < red(up)


def test_missing_ffmpeg_is_named(
    seated: Recording, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda _, path: None)
    with pytest.raises(InputError, match=r"apt install ffmpeg.*brew install ffmpeg"):
        video.write_video(seated, tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


def test_missing_opengl_says_what_to_install(
    seated: Recording, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(_: str) -> None:
        raise ImportError("no libEGL")

    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setattr(
        shutil, "which", lambda _, path: shutil.__file__
    )  # is not started before there is a picture
    monkeypatch.setattr(video.importlib, "import_module", none)
    with pytest.raises(InputError, match=r"no libEGL.*MUJOCO_GL=osmesa.*libegl1.*libosmesa6"):
        video.write_video(seated, tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("wrong", "field"), [({"rate": 0.0}, "rate"), ({"rate": np.nan}, "rate"), ({"width": 321}, "width")]
)
def test_wrong_numbers_are_named(
    seated: Recording, tmp_path: pathlib.Path, wrong: dict[str, Any], field: str
) -> None:
    with pytest.raises(InputError) as caught:
        video.write_video(seated, tmp_path / "a.mp4", **wrong)
    assert caught.value.field == field


def test_what_ffmpeg_says_is_told(tmp_path: pathlib.Path) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho 'Unknown encoder libx264' >&2\nexit 1\n")
    program.chmod(0o755)
    with (
        pytest.raises(InputError, match="Unknown encoder libx264"),
        video._encoder(str(program), tmp_path / "a.mp4", 30.0, 16, 16) as frames,
    ):
        for _ in range(1000):
            frames.write(bytes(16 * 16 * 3))

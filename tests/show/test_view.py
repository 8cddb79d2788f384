"""What the Rerun file holds is what the run holds; it is healthy, repeatable, and small in memory."""

import dataclasses
import json
import pathlib
import socket
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from campaign import size
from rerun_files import needs_vulkan, read

import afo_sim
from afo_sim.common import InputError
from afo_sim.description import load
from afo_sim.simulation import Recording
from afo_sim.simulation.files import write_parquet

LONG = size(180_000, 600_000)  # rows


@pytest.fixture(scope="module")
def folders(
    seated: Recording, antagonist: Recording, tmp_path_factory: pytest.TempPathFactory
) -> list[pathlib.Path]:
    base = tmp_path_factory.mktemp("runs")
    return [run.save(base / run.scenario["name"]) for run in (seated, antagonist)]


@pytest.fixture(scope="module")
def file(folders: list[pathlib.Path]) -> pathlib.Path:
    return folders[0] / "recording.rrd"


def test_scalars_are_the_runs_bit_for_bit(file: pathlib.Path, seated: Recording) -> None:
    stamps = np.round(seated["time"] * 1e9).astype(np.int64)
    muscles = ["dorsiflexor_1", "plantarflexor_1"]  # for their groups, whose muscles are alike
    groups = load("scenario", seated.scenario).orthosis.muscle
    plotted = {
        "/angle/ankle": [np.degrees(seated["ankle/angle"])],
        "/moment/ankle": [seated[f"ankle/moment/{m}"] for m in ("orthosis", "passive", "gravity")],
        "/pressure/chambers": [
            seated[f"chamber/{c}/pressure"] * 1e-5 for c in ("dorsiflexor", "plantarflexor")
        ],
        "/force/muscles": [seated[f"muscle/{m}/force"] for m in muscles],
        "/contraction/muscles": [seated[f"muscle/{m}/contraction"] * 100.0 for m in muscles],
        "/length/muscles": [
            length
            for group in ("dorsiflexor", "plantarflexor")
            for length in (
                seated[f"muscle/{group}_1/length"] * 1e3,
                (seated[f"muscle/{group}_1/path_length"] - groups[group].series_length) * 1e3,
            )
        ],
    }
    for entity, columns in plotted.items():
        time, values = read(file, entity, "Scalars:scalars")
        assert np.array_equal(time, stamps)
        assert np.array_equal(values, np.column_stack(columns))


def test_poses_are_the_models_to_float32(file: pathlib.Path, seated: Recording) -> None:
    model = mujoco.MjModel.from_xml_string(seated.model_xml)
    data = mujoco.MjData(model)
    time, turned = read(file, "/world/bodies/foot", "Transform3D:quaternion")
    _, moved = read(file, "/world/bodies/shank", "Transform3D:translation")
    rows = np.searchsorted(seated["time"], time * 1e-9 - 1e-6)
    assert len(time) == 1600
    for k in range(0, 1600, 100):
        data.qpos[0] = seated["ankle/angle"][rows[k]]
        mujoco.mj_kinematics(model, data)
        assert time[k] == 10_000_000 * k
        assert turned[k] == pytest.approx(data.body("foot").xquat[[1, 2, 3, 0]], abs=1e-7)
        assert moved[k] == pytest.approx(data.body("shank").xpos, abs=1e-7)


def test_tubes_are_as_long_and_thick_as_the_muscles(file: pathlib.Path, seated: Recording) -> None:
    group = load("scenario", seated.scenario).orthosis.muscle["dorsiflexor"]
    time, radius = read(file, "/world/muscles/dorsiflexor_1", "Capsules3D:radii")
    _, length = read(file, "/world/muscles/dorsiflexor_1", "Capsules3D:lengths")
    rows = np.searchsorted(seated["time"], time * 1e-9 - 1e-6)
    tube = seated["muscle/dorsiflexor_1/length"][rows] + group.type.end_length
    assert length[:, 0] + 2.0 * radius[:, 0] == pytest.approx(tube, abs=1e-6)
    assert radius.max() > 1.3 * radius.min()


def test_tube_encloses_the_braids_volume() -> None:
    """π r² L equals the ideal braid's volume at any contraction up to the fattest."""
    from afo_sim.show.rerun.muscle_shapes import tube_radius

    group = load("orthosis", "s1").muscle["dorsiflexor"]
    muscle = group.type
    for kappa in (0.0, 0.1, 0.2, 0.3):
        x, b = 1.0 - kappa, 1.0 / np.sin(muscle.braid_angle) ** 2
        volume = np.pi * (muscle.bore / 2) ** 2 * muscle.nominal_length * x * (b - (b - 1.0) * x * x)
        radius = tube_radius(np.array([kappa]), group.type)[0]
        assert np.pi * radius**2 * muscle.nominal_length * x == pytest.approx(volume, rel=1e-12)


def test_valve_lanes_and_events(file: pathlib.Path, seated: Recording) -> None:
    time, _ = read(file, "/valves/dorsiflexor_inlet", "StateChange:state")
    assert (time // 1_000_000).tolist() == [0, 4, 4004, 8004, 12004]  # ms
    texts = read(file, "/events/run", "TextLog:text")[1].ravel().tolist()
    assert any("dorsiflexor inlet opens" in t for t in texts)
    highest = np.degrees(seated["ankle/angle"].max())
    assert any(f"greatest dorsiflexion: {highest:.1f}" in t for t in texts)
    assert any("extrapolated" in t for t in texts)


def test_rate_thins_signals_and_poses(
    folders: list[pathlib.Path], tmp_path: pathlib.Path, seated: Recording
) -> None:
    from afo_sim.show.rerun import write_rrd

    write_rrd(folders[0], tmp_path / "thin.rrd", rate=50.0)
    time, angle = read(tmp_path / "thin.rrd", "/angle/ankle", "Scalars:scalars")
    every = round(0.02 / seated["time"][1])
    assert np.array_equal(angle[:, 0], np.degrees(seated["ankle/angle"][::every]))
    assert np.array_equal(time, np.arange(800) * 20_000_000)
    poses, _ = read(tmp_path / "thin.rrd", "/world/bodies/foot", "Transform3D:translation")
    assert np.array_equal(poses, time)


@pytest.mark.slow
def test_comparison_holds_every_run_and_tells_same_names_apart(
    folders: list[pathlib.Path], tmp_path: pathlib.Path, seated: Recording, antagonist: Recording
) -> None:
    from afo_sim.show.rerun import write_comparison

    file = tmp_path / "all.rrd"
    write_comparison([folders[0], *folders], file)
    for label, run in (("seated_1", seated), ("seated_2", seated), ("seated-antagonist", antagonist)):
        _, angle = read(file, f"/angle/{label}", "Scalars:scalars")
        assert np.array_equal(angle[:, 0], np.degrees(run["ankle/angle"]))
        poses, _ = read(file, f"/world/runs/{label}/bodies/foot", "Transform3D:quaternion")
        assert len(poses) == 1600


@pytest.mark.skipif(sys.platform != "linux", reason="threads of the system are counted")
def test_files_leave_no_threads_behind(tmp_path: pathlib.Path) -> None:
    short, threads = afo_sim.run("seated", {"duration": "0.1 s"}), []
    for k in range(4):
        short.save(tmp_path / str(k))
        threads.append(len(list(pathlib.Path("/proc/self/task").iterdir())))
    assert threads[-1] <= threads[0]


def test_run_without_rows_is_refused(seated: Recording, tmp_path: pathlib.Path) -> None:
    from afo_sim.show.rerun import write_rrd

    empty = dataclasses.replace(seated, columns={n: v[:0] for n, v in seated.columns.items()})
    with pytest.raises(InputError, match="no rows"):
        write_rrd(empty, tmp_path / "x.rrd")


@pytest.fixture(scope="module")
def ten_minutes(seated: Recording, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The seated run over and over; in the suite three minutes of it."""
    repeats = -(-LONG // len(seated["time"]))
    columns = {name: np.tile(values, repeats)[:LONG] for name, values in seated.columns.items()}
    columns["time"] = np.arange(LONG) * 1e-3
    folder = tmp_path_factory.mktemp("long")
    write_parquet(dataclasses.replace(seated, columns=columns), folder / "recording.parquet")
    return folder


@pytest.mark.slow
def test_ten_minutes_are_written_in_little_memory(ten_minutes: pathlib.Path) -> None:
    """Under 300 MB for the whole process, libraries included."""
    code = """
import pathlib, sys
from afo_sim.show.rerun import write_rrd
folder = pathlib.Path(sys.argv[1])
write_rrd(folder, folder / "recording.rrd")
status = pathlib.Path("/proc/self/status").read_text()
print(int(status.split("VmHWM:")[1].split()[0]) / 1024)
"""
    if not sys.platform.startswith("linux"):
        pytest.skip("memory is told otherwise here")
    done = subprocess.run(
        [sys.executable, "-c", code, str(ten_minutes)], capture_output=True, text=True, timeout=200
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) < 300.0
    time, _ = read(ten_minutes / "recording.rrd", "/angle/ankle", "Scalars:scalars")
    assert len(time) == LONG


@pytest.mark.slow
@needs_vulkan
def test_ten_minutes_open_in_the_headless_viewer(ten_minutes: pathlib.Path, tmp_path: pathlib.Path) -> None:
    from afo_sim.show.rerun import screenshot, write_rrd

    if not (ten_minutes / "recording.rrd").exists():
        write_rrd(ten_minutes, ten_minutes / "recording.rrd")
    screenshot(ten_minutes / "recording.rrd", tmp_path / "long.png", 300.0)
    assert (tmp_path / "long.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
@needs_vulkan
def test_screenshot_shows_the_leg_at_the_time_asked_for(file: pathlib.Path, tmp_path: pathlib.Path) -> None:
    from matplotlib import image

    from afo_sim.show.rerun import screenshot

    pictures = []
    for at in (0.0, 3.5):
        screenshot(file, tmp_path / f"{at}.png", at)
        pictures.append(image.imread(tmp_path / f"{at}.png")[..., :3])
    height, width, _ = pictures[0].shape
    left = [p[: int(0.95 * height), : int(0.42 * width)] for p in pictures]
    skin = np.array([0.87, 0.69, 0.56]) / 0.87
    for scene in left:
        bright = scene.max(axis=-1) > 0.3
        tone = np.abs(scene / scene.max(axis=-1, keepdims=True).clip(1e-3) - skin).max(axis=-1) < 0.06
        assert (bright & tone).mean() > 0.05  # a leg stands there
    assert np.abs(left[0] - left[1]).max(axis=-1).mean() > 0.003  # and has moved


@needs_vulkan
def test_viewer_listens_on_this_machine_only() -> None:
    from afo_sim.show.rerun.viewer import viewer_process

    with viewer_process(["--headless"]) as url:
        port = int(url.split(":")[-1].split("/")[0])
        with socket.create_connection(("127.0.0.1", port), timeout=2):
            pass
        if sys.platform.startswith("linux"):
            sockets = pathlib.Path("/proc/net/tcp").read_text() + pathlib.Path("/proc/net/tcp6").read_text()
            listening = [
                line.split()[1] for line in sockets.splitlines() if f":{port:04X} " in line and " 0A " in line
            ]
            assert listening == [f"0100007F:{port:04X}"]


def test_missing_driver_is_said_with_the_packages_name(
    file: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from afo_sim.show.rerun import screenshot

    monkeypatch.setenv("VK_DRIVER_FILES", str(tmp_path / "none.json"))
    monkeypatch.setenv("VK_ICD_FILENAMES", str(tmp_path / "none.json"))
    monkeypatch.setenv("WGPU_BACKEND", "vulkan")
    with pytest.raises(InputError, match="mesa-vulkan-drivers"):
        screenshot(file, tmp_path / "x.png")
    assert not (tmp_path / "x.png").exists()


@needs_vulkan
def test_live_stream_reaches_a_viewer(tmp_path: pathlib.Path) -> None:
    """Headless here; the rows watched, put together, are the run."""
    from afo_sim.model.build import build
    from afo_sim.show import live_viewer
    from afo_sim.simulation import run_built

    seen: list[Recording] = []
    with live_viewer(headless=True) as watch:

        def both(stretch: Recording) -> None:
            seen.append(stretch)
            watch(stretch)

        whole = run_built(build(load("scenario", "seated", {"duration": "1.1 s"})), watch=both)
    assert len(seen) > 2
    for name in whole.columns:
        assert np.array_equal(np.concatenate([s[name] for s in seen]), whole[name])


def test_watched_run_is_the_unwatched_run(seated: Recording) -> None:
    from afo_sim.model.build import build
    from afo_sim.simulation import run_built

    watched = run_built(build(load("scenario", "seated", {"duration": "9 s"})), watch=lambda stretch: None)
    for name, values in watched.columns.items():
        assert np.array_equal(values, seated[name][: len(values)])
    assert watched["time"][-1] == pytest.approx(9.0, abs=0.003)


def test_a_leg_with_a_mesh_is_shown(tmp_path: pathlib.Path) -> None:
    """The MJCF that a run keeps to look at names the mesh; the kept model holds it."""
    source = afo_sim.load("scenario", "seated").leg.file
    mesh = '<asset><mesh name="shoe" file="shoe.obj"/></asset><worldbody>'
    text = source.read_text(encoding="utf-8").replace("<worldbody>", mesh, 1)
    faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    (tmp_path / "shoe.obj").write_text(f"v 0 0 0\nv .1 0 0\nv 0 .02 0\nv 0 0 .013\n{faces}")
    shoe = '<geom type="mesh" mesh="shoe" mass="0" contype="0" conaffinity="0"/>'
    (tmp_path / "leg.xml").write_text(text.replace('<body name="foot">', f'<body name="foot">{shoe}', 1))
    (tmp_path / "leg.toml").write_text((source.parent / "leg.toml").read_text(encoding="utf-8"))
    run = afo_sim.run("seated", {"leg": str(tmp_path / "leg.toml"), "duration": "0.2 s"})
    assert (run.save(tmp_path / "run", rrd=True) / "recording.rrd").stat().st_size > 10_000

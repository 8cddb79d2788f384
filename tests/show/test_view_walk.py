"""Walking in the Rerun file: ghost, ground force, trails, lanes and clearance are the run's own."""

import pathlib

import mujoco
import numpy as np
import pyarrow as pa
import pytest
from rerun_files import lists, needs_vulkan, read, rerun

import afo_sim
from afo_sim.description import load
from afo_sim.model.build import build
from afo_sim.show.ground_force import ARROW, SIDE
from afo_sim.show.run_view import alone
from afo_sim.show.walking_figure import WalkingFigure, capsules
from afo_sim.simulation import Recording, read_recording, run_built

BODY = {"patient.body_mass": "75 kg", "patient.body_height": "1.75 m"}  # the leg's own
BODY_WEIGHT = 75.0 * 9.80665
STANDING = 0.05 * BODY_WEIGHT  # ground force of stance [N]


@pytest.fixture(scope="module")
def bare() -> Recording:
    return afo_sim.run("walk-dropfoot", {"duration": "3 s"} | BODY)


@pytest.fixture(scope="module")
def folders(bare: Recording, tmp_path_factory: pytest.TempPathFactory) -> list[pathlib.Path]:
    """With the orthosis, without it, and faster with strides of varied duration."""
    base = tmp_path_factory.mktemp("walks")
    with_orthosis = afo_sim.run("walk-dropfoot-afo", {"duration": "3 s"} | BODY)
    varied = {"duration": "3 s", "gait.stride_time": "0.9 s", "gait.variability": 0.05}
    faster = afo_sim.run("walk-dropfoot-afo", varied)
    return [
        run.save(base / name)
        for name, run in (("orthosis", with_orthosis), ("bare", bare), ("faster", faster))
    ]


@pytest.fixture(scope="module")
def file(folders: list[pathlib.Path]) -> pathlib.Path:
    return folders[1] / "recording.rrd"


def rows_of(bare: Recording, time: np.ndarray) -> dict[str, np.ndarray]:
    """The recording's rows at times [ns]."""
    rows = row_numbers(bare, time)
    return {name: values[rows] for name, values in bare.columns.items()}


def row_numbers(run: Recording, time: np.ndarray) -> np.ndarray:
    """Of the rows that stand at times [ns]."""
    rows = np.searchsorted(run["time"], 1e-9 * time - 1e-6)
    assert run["time"][rows] == pytest.approx(1e-9 * time, abs=1e-8)
    return rows


def nanoseconds(run: Recording, rows: np.ndarray) -> np.ndarray:
    """Times of rows, as Rerun counts them."""
    return np.round(1e9 * run["time"][rows]).astype(np.int64)


def entities(file: pathlib.Path) -> set[str]:
    import rerun as rr

    return set(rr.chunk.RrdReader(str(file)).store().schema().entity_paths())


@pytest.mark.slow
def test_files_are_healthy_and_the_same_from_memory_and_disk(
    folders: list[pathlib.Path], tmp_path: pathlib.Path
) -> None:
    from afo_sim.show.rerun import write_rrd

    for folder in folders[:2]:
        again = tmp_path / f"{folder.name}.rrd"
        write_rrd(folder, again)
        assert rerun("verify", str(again)).returncode == 0
        same = rerun("compare", "--unordered", str(folder / "recording.rrd"), str(again))
        assert same.returncode == 0, same.stderr
    other = rerun("compare", "--unordered", str(folders[0] / "recording.rrd"), str(again))
    assert other.returncode != 0


@pytest.mark.slow
def test_ghost_is_the_foot_at_the_recorded_angle_its_toes_at_rest(
    file: pathlib.Path, bare: Recording
) -> None:
    time, bent = read(file, "/world/recorded/toes", "Transform3D:quaternion")
    _, turned = read(file, "/world/recorded/foot", "Transform3D:quaternion")
    _, moved = read(file, "/world/recorded/foot", "Transform3D:translation")
    rows = rows_of(bare, time)
    pitch = rows["gait/ankle_angle"] - rows["shank/angle"]
    for half, seen in ((0.5 * pitch, turned), (0.5 * (pitch + rows["gait/toe_extension"]), bent)):
        expected = np.column_stack([0.0 * half, -np.sin(half), 0.0 * half, np.cos(half)])  # about −y
        assert np.abs(np.sum(seen * expected, axis=1)) == pytest.approx(1.0, abs=1e-6)
    assert len(time) == len(bare["time"][::10])  # 100 Hz
    assert moved[:, 0] == pytest.approx(rows["ankle/position/x"], abs=1e-6)
    assert moved[:, 2] == pytest.approx(rows["ankle/position/z"], abs=1e-6)
    _, own = read(file, "/world/bodies/foot", "Transform3D:quaternion")
    apart = 2.0 * np.arccos(np.abs(np.sum(own * turned, axis=1)).clip(0.0, 1.0))
    assert apart == pytest.approx(np.abs(rows["ankle/angle"] - rows["gait/ankle_angle"]), abs=2e-3)
    assert np.degrees(apart.max()) > 15.0  # the foot drops


def test_arrow_is_the_ground_force_at_the_centre_of_pressure(file: pathlib.Path, bare: Recording) -> None:
    time, vectors = lists(file, "/world/ground_force", "Arrows3D:vectors")
    _, origins = lists(file, "/world/ground_force", "Arrows3D:origins")
    rows = rows_of(bare, time)
    stands = rows["ground/force/z"] > STANDING
    assert [len(v) for v in vectors] == stands.astype(int).tolist()
    assert 0.2 < 1.0 - stands.mean() < 0.4  # swing is there, and without an arrow
    for k in np.flatnonzero(stands):
        force = np.array([rows["ground/force/x"][k], 0.0, rows["ground/force/z"][k]])
        assert vectors[k][0] == pytest.approx(force * ARROW / BODY_WEIGHT, abs=1e-6)
        assert origins[k][0] == pytest.approx([rows["ground/position/x"][k], SIDE, 0.0], abs=1e-6)


def test_whole_figure_is_the_one_that_films_draw(file: pathlib.Path, bare: Recording) -> None:
    """Each capsule begins and ends where the film's does."""
    figure = WalkingFigure.of(alone(bare))
    time, starts = lists(file, "/world/figure", "Capsules3D:translations")
    _, turned = lists(file, "/world/figure", "Capsules3D:quaternions")
    rows = rows_of(bare, time)
    for k in np.flatnonzero(rows["gait/stride"] == figure.stride.number)[5::20]:
        ends = capsules(vars(figure.pose(float(rows["gait/phase"][k]))))
        assert np.array(starts[k]) == pytest.approx(ends[:, 0], abs=1e-5)
        _, sine, _, cosine = np.array(turned[k]).T
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        upward = np.column_stack([2.0 * sine * cosine, 0.0 * sine, cosine**2 - sine**2])  # the turned z
        assert length[:, None] * upward == pytest.approx(ends[:, 1] - ends[:, 0], abs=1e-4)


def test_trails_end_at_the_points_and_are_red_below_the_floor(file: pathlib.Path, bare: Recording) -> None:
    from afo_sim.show.rerun.walk_scene import SUNK

    for point in ("toe", "ball"):
        time, strips = lists(file, f"/world/trail/{point}", "LineStrips3D:strips")
        _, colours = read(file, f"/world/trail/{point}", "LineStrips3D:colors")
        rows = rows_of(bare, time)
        ends = np.array([strip[0] for strip in strips])  # (n, 2, 3)
        assert ends[:, 1, 2] == pytest.approx(rows[f"{point}/height"], abs=1e-6)
        assert np.array_equal(ends[1:, 0], ends[:-1, 1])  # without a gap
        red = colours[:, 0] == int.from_bytes(bytes([*SUNK, 255]), "big")
        assert np.array_equal(
            red, (rows["gait/ground_force_z"] <= STANDING) & (rows[f"{point}/height"] < 0.0)
        )
        assert red.any() or point == "ball"  # the toe presses into the floor by a millimetre where it drags


def floor_height(file: pathlib.Path) -> float:
    """Of the floor's upper side, as drawn."""
    import rerun as rr

    chunks = rr.chunk.RrdReader(str(file)).stream().filter(content="/world/floor", is_static=True).to_chunks()
    found = {
        name: c.to_record_batch().column(name) for c in chunks for name in c.to_record_batch().schema.names
    }
    centre, half = (
        next(np.array(found[name].to_pylist()[0][0]) for name in found if part in name)
        for part in ("centers", "half_sizes")
    )
    return float(centre[2] + half[2])


def underside(model: mujoco.MjModel, data: mujoco.MjData, geom: str) -> np.ndarray:
    """Heights of a box's lower corners, back and front, as the kinematics have it (2,)."""
    box = model.geom(geom).id
    corners = np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0]]) * model.geom_size[box]
    space = corners @ data.geom_xmat[box].reshape(3, 3).T + data.geom_xpos[box]
    return space[:, 2]


def test_what_is_drawn_has_the_heights_of_the_outsole(folders: list[pathlib.Path]) -> None:
    """The plate's underside from heel to ball, and the sole ahead of it, bent with the toes."""
    assert [floor_height(folder / "recording.rrd") for folder in folders[:2]] == pytest.approx([0.0, 0.0])
    run = read_recording(folders[0])
    model = mujoco.MjModel.from_xml_string(run.model_xml)
    data = mujoco.MjData(model)
    bent = 0.0
    for k in range(0, len(run["time"]), 97):
        for joint in ("shank_x", "shank_z", "sink", "shank_angle", "ankle", "toe"):
            data.joint(joint).qpos[0] = run[f"qpos/{joint}"][k]
        mujoco.mj_kinematics(model, data)
        plate, toe = underside(model, data, "plate_sole"), underside(model, data, "shoe_tip")
        assert plate == pytest.approx([run["heel/height"][k], run["ball/height"][k]], abs=2e-6)
        assert toe.min() == pytest.approx(run["toe/height"][k], abs=2e-6)  # from pulp to tip
        bent = max(bent, run["toe/extension"][k])
    assert np.degrees(bent) > 20.0
    _, origins = lists(folders[0] / "recording.rrd", "/world/ground_force", "Arrows3D:origins")
    assert {round(start[0][2], 6) for start in origins if start} == {0.0}
    time, strips = lists(folders[0] / "recording.rrd", "/world/trail/toe", "LineStrips3D:strips")
    ends = np.array([strip[0][1] for strip in strips])[:, 2]
    assert ends == pytest.approx(rows_of(run, time)["toe/height"], abs=2e-6)


def test_runs_with_and_without_a_plate_walk_on_one_floor(
    folders: list[pathlib.Path], tmp_path: pathlib.Path
) -> None:
    from afo_sim.show.rerun import write_comparison

    write_comparison(folders[:2], tmp_path / "both.rrd")
    assert floor_height(tmp_path / "both.rrd") == pytest.approx(0.0, abs=1e-6)
    for folder in folders[:2]:
        _, moved = read(
            tmp_path / "both.rrd", f"/world/carriage/runs/{folder.name}", "Transform3D:translation"
        )
        assert moved[:, 2] == pytest.approx(np.zeros(len(moved)), abs=1e-6)


def test_clearance_is_the_runs_and_the_healthy_foots(file: pathlib.Path, bare: Recording) -> None:
    """The healthy heights are those of the model's own sites at the recorded angle."""
    _, own = read(file, "/clearance/foot", "Scalars:scalars")
    assert np.array_equal(own, 1e3 * np.column_stack([bare["toe/height"], bare["ball/height"]]))
    _, healthy = read(file, "/clearance/recorded", "Scalars:scalars")
    model = mujoco.MjModel.from_xml_string(bare.model_xml)
    data = mujoco.MjData(model)
    for k in range(0, 3000, 250):
        for joint in ("shank_x", "shank_z", "sink", "shank_angle"):
            data.joint(joint).qpos[0] = bare[f"qpos/{joint}"][k]
        data.joint("ankle").qpos[0] = bare["gait/ankle_angle"][k]
        data.joint("toe").qpos[0] = bare["gait/toe_extension"][k]
        mujoco.mj_kinematics(model, data)
        heights = {name: 1e3 * data.site(f"sole_{name}").xpos[2] for name in ("pulp", "tip", "ball")}
        toe = min(heights["pulp"], heights["tip"])
        assert healthy[k] == pytest.approx([toe, heights["ball"]], abs=1e-6)
    _, floor = read(file, "/clearance/floor", "Scalars:scalars")
    assert not floor.any()
    _, recorded = read(file, "/angle/recorded", "Scalars:scalars")
    assert np.array_equal(recorded[:, 0], np.degrees(bare["gait/ankle_angle"]))


def test_lanes_are_stance_and_strides(file: pathlib.Path, bare: Recording) -> None:
    time, support = read(file, "/gait/support", "StateChange:state")
    stands = bare["gait/ground_force_z"] > STANDING
    changes = np.r_[0, np.flatnonzero(stands[1:] != stands[:-1]) + 1]
    assert np.array_equal(time, nanoseconds(bare, changes))
    assert support[:, 0].tolist() == ["stance" if stands[k] else "swing" for k in changes]
    time, strides = read(file, "/gait/stride", "StateChange:state")
    assert strides[:, 0].tolist() == ["stride 1", "stride 2, settled", "stride 3, settled"]
    assert np.array_equal(bare["gait/stride"][row_numbers(bare, time)], [0.0, 1.0, 2.0])


def test_an_event_tells_where_solved_strides_begin(file: pathlib.Path, bare: Recording) -> None:
    time, texts = read(file, "/events/run", "TextLog:text")
    told = [at for at, text in zip(time, texts.ravel(), strict=True) if text.startswith("settled: ")]
    assert told == nanoseconds(bare, np.flatnonzero(bare["gait/solved"])[:1]).tolist()


def test_the_viewer_plays_all_strides_over_and_over(bare: Recording) -> None:
    """Whole ones, though a part of one was asked."""
    from afo_sim.show.rerun.run_rows import from_recording

    source = from_recording(bare)
    assert source.cycle == pytest.approx(3 * bare.metrics["stride_time"].value, rel=1e-12)
    assert 1.0 / source.rate == pytest.approx(bare["time"][-1] / (len(bare["time"]) - 1), rel=1e-12)


def test_a_toe_that_drags_does_not_make_stance_of_swing(tmp_path: pathlib.Path) -> None:
    """In contact: one stance and one swing a stride, by the recorded ground, as the metrics count them."""
    from afo_sim.show.rerun.walk_scene import SUNK

    run = afo_sim.run(
        "walk-dropfoot", {"duration": "2.4 s", "ground.mode": "contact", "gait.settled": "walked"} | BODY
    )
    stands = run["gait/ground_force_z"] > STANDING
    dragged = ~stands & (run["ground/force/z"] >= 20.0)
    assert dragged.any()
    file = run.save(tmp_path / "dragged") / "recording.rrd"
    time, support = read(file, "/gait/support", "StateChange:state")
    changes = np.r_[0, np.flatnonzero(stands[1:] != stands[:-1]) + 1]
    assert np.array_equal(time, changes * 1_000_000)
    assert support[:, 0].tolist() == ["stance" if stands[k] else "swing" for k in changes]
    # the lowest toe of the swing is the dragging one, drawn in red
    lowest = np.where(stands, np.inf, run["toe/height"]).argmin()
    assert dragged[lowest]
    texts = read(file, "/events/run", "TextLog:text")[1].ravel().tolist()
    told = f"toe lowest in swing: {1e3 * run['toe/height'][lowest]:.0f} mm"
    assert any(told in text for text in texts), texts
    time, _ = lists(file, "/world/trail/toe", "LineStrips3D:strips")
    _, colours = read(file, "/world/trail/toe", "LineStrips3D:colors")
    red = colours[:, 0] == int.from_bytes(bytes([*SUNK, 255]), "big")
    rows = rows_of(run, time)
    assert np.array_equal(red, (rows["gait/ground_force_z"] <= STANDING) & (rows["toe/height"] < 0.0))


def test_every_row_has_its_time_in_strides(file: pathlib.Path, bare: Recording) -> None:
    import rerun as rr

    strides = np.round((bare["gait/stride"] + bare["gait/phase"]) * 1e9).astype(np.int64)
    for entity in ("/angle/ankle", "/world/bodies/foot", "/world/carriage", "/gait/support"):
        stream = rr.chunk.RrdReader(str(file)).stream().filter(content=entity, is_static=False)
        for batch in (chunk.to_record_batch() for chunk in stream.to_chunks()):
            time, walked = (batch.column(n).cast(pa.int64()).to_numpy() for n in ("sim_time", "strides"))
            assert walked == pytest.approx(strides[row_numbers(bare, time)], abs=1e4)


def test_carriage_goes_evenly_beside_the_ankle(file: pathlib.Path, bare: Recording) -> None:
    time, places = read(file, "/world/carriage", "Transform3D:translation")
    speed = np.diff(places[:, 0]) / np.diff(time * 1e-9)
    assert speed == pytest.approx(speed.mean(), rel=1e-3)
    away = rows_of(bare, time)["ankle/position/x"] - places[:, 0]
    assert np.abs(away).max() < 0.5
    assert abs(away.mean()) < 1e-3


def test_without_an_orthosis_nothing_of_one_is_shown(file: pathlib.Path, folders: list[pathlib.Path]) -> None:
    """With one there is; the test would see it."""
    parts = ("muscle", "cable", "valve", "pressure", "force/", "contraction", "range")
    assert not [e for e in entities(file) if any(part in e for part in parts)]
    found = entities(folders[0] / "recording.rrd")
    assert all(any(part in entity for entity in found) for part in parts)


@pytest.mark.slow
def test_runs_of_different_cadence_stay_side_by_side(
    folders: list[pathlib.Path], tmp_path: pathlib.Path
) -> None:
    from afo_sim.show.rerun import write_comparison

    path = tmp_path / "all.rrd"
    write_comparison(folders, path)
    assert rerun("verify", str(path)).returncode == 0
    for folder in folders:
        root = f"/world/carriage/runs/{folder.name}"
        _, back = read(path, root, "Transform3D:translation")
        _, foot = read(path, f"{root}/bodies/foot", "Transform3D:translation")
        assert np.abs(foot[:, 0] + back[:, 0]).max() < 0.5
    found = entities(path)
    assert [e for e in found if e.endswith("/ground_force")] == ["/world/carriage/runs/orthosis/ground_force"]
    assert {e.rsplit("/", 1)[1] for e in found if "/trail/" in e} == {"toe"}


@pytest.mark.slow
def test_sitting_and_walking_side_by_side(
    seated: Recording, folders: list[pathlib.Path], tmp_path: pathlib.Path
) -> None:
    from afo_sim.show.rerun import write_comparison

    write_comparison([seated.save(tmp_path / "seated"), folders[1]], tmp_path / "both.rrd")
    assert rerun("verify", str(tmp_path / "both.rrd")).returncode == 0
    assert {"/clearance/recorded", "/angle/range", "/clearance/floor"} <= entities(tmp_path / "both.rrd")


@pytest.mark.parametrize("changes", [{"duration": "1 ms"}, {"duration": "0.2 s", "gait.start_phase": 0.7}])
def test_a_single_row_and_swing_alone_are_shown(changes: dict[str, object], tmp_path: pathlib.Path) -> None:
    from afo_sim.show.rerun import write_rrd

    write_rrd(afo_sim.run("walk-dropfoot", changes), tmp_path / "short.rrd")
    assert rerun("verify", str(tmp_path / "short.rrd")).returncode == 0


@pytest.mark.slow
@needs_vulkan
def test_picture_shows_leg_arrow_and_trail(
    file: pathlib.Path, bare: Recording, tmp_path: pathlib.Path
) -> None:
    from matplotlib import image

    from afo_sim.show.rerun import screenshot

    shares = {}
    stride = bare.metrics["stride_time"].value
    for moment in (1.58, 1.83):  # in strides: push-off, and swing
        screenshot(file, tmp_path / "a.png", moment * stride)
        scene = image.imread(tmp_path / "a.png")[60:700, :790, :3]
        red, green, blue = np.moveaxis(scene, 2, 0)
        bright = scene.max(axis=2) > 0.35
        shares[moment] = [
            (bright & (np.abs(green / red.clip(1e-3) - 0.79) < 0.06) & (blue < 0.85 * red)).mean(),  # skin
            (bright & (green > 1.5 * red) & (green > 1.5 * blue)).mean(),  # arrow
            (bright & (red > 3.0 * green) & (red > 3.0 * blue)).mean(),  # sunken trail
        ]
    assert min(shares[1.58][0], shares[1.83][0]) > 0.01
    assert shares[1.58][1] > 0.002 > 20.0 * shares[1.83][1]
    assert shares[1.83][2] > 0.001


@needs_vulkan
def test_live_walk_reaches_a_viewer() -> None:
    from afo_sim.show import live_viewer

    with live_viewer(headless=True) as watch:
        run = run_built(build(load("scenario", "walk-dropfoot", {"duration": "0.6 s"})), watch=watch)
    assert run.ok

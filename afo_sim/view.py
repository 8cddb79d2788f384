"""Recording → Rerun: one recording file, made by replay, with its layout inside."""

import pathlib
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from afo_sim.errors import InputError
from afo_sim.recording import Recording

APPLICATION = "afo_sim"
TIMELINE = "sim_time"
POSE_RATE = 100.0  # poses and tendon paths per second; signals keep the recording's rate
BLOCK = 8192  # rows per message, so that the viewer need not take it all at once
DORSIFLEXOR_COLOURS = ([230, 90, 70], [240, 150, 60], [235, 200, 80], [200, 70, 110], [250, 120, 120])
PLANTARFLEXOR_COLOURS = ([80, 150, 235], [90, 205, 220], [130, 120, 230], [70, 190, 150], [150, 180, 250])
FORCE_SCALE = 150.0  # force at which a tendon is fully coloured [N]


def write_rrd(recording: Recording, path: pathlib.Path) -> None:
    """Write a recording, with its blueprint, as a Rerun file.

    Parameters
    ----------
    recording : a finished recording
    path : file to write
    """
    rr.set_strict_mode(True)
    name = str(recording.scenario["name"])
    stream = rr.RecordingStream(APPLICATION)
    stream.set_log_time_enabled(False)
    stream.save(path, default_blueprint=_blueprint())
    stream.send_recording_name(name)
    model = mujoco.MjModel.from_xml_string(recording.model_xml)
    _log_scene(stream, model)
    _log_poses(stream, model, recording)
    _log_signals(stream, recording)
    _log_text(stream, recording)
    stream.flush()
    stream.disconnect()


def open_recordings(paths: Sequence[pathlib.Path]) -> None:
    """Show recordings in the Rerun viewer, which listens on this machine only."""
    import os

    if sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise InputError(
            "there is no display here to open the viewer on; copy the file to a machine that has one "
            "and open it there with `rerun FILE`",
            file=paths[0],
        )
    import rerun_cli

    binary = pathlib.Path(rerun_cli.__file__).with_name("rerun")
    if sys.platform == "win32":
        binary = binary.with_suffix(".exe")
    subprocess.run([str(binary), *map(str, paths), "--bind", "127.0.0.1"], check=False)


def _times(time: np.ndarray) -> np.ndarray:
    return np.round(time * 1e9).astype(np.int64).astype("timedelta64[ns]")


def _send(stream: rr.RecordingStream, entity: str, time: np.ndarray, columns: Any) -> None:
    stream.send_columns(entity, [rr.TimeColumn(TIMELINE, duration=time)], columns)


def _log_scene(stream: rr.RecordingStream, model: mujoco.MjModel) -> None:
    """Everything that does not move within its body, once."""
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    stream.log(
        "world/floor",
        rr.Boxes3D(
            half_sizes=[[0.6, 0.4, 0.002]],
            centers=[[0.05, 0.0, -0.002]],
            colors=[[70, 74, 80]],
            fill_mode="solid",
        ),
        static=True,
    )
    for geom in range(model.ngeom):
        body = model.body(model.geom_bodyid[geom]).name
        name = model.geom(geom).name or f"geom_{geom}"
        entity = f"world/bodies/{body}/{name}"
        quaternion = model.geom_quat[geom][[1, 2, 3, 0]]
        pose = rr.Transform3D(translation=model.geom_pos[geom], quaternion=quaternion)
        shape = _shape(model, geom)
        if shape is not None:
            stream.log(entity, pose, shape, static=True)


def _shape(model: mujoco.MjModel, geom: int) -> Any:
    size, kind = model.geom_size[geom], model.geom_type[geom]
    colour = [(255 * model.geom_rgba[geom]).astype(np.uint8)]
    look: dict[str, Any] = {"colors": colour, "fill_mode": "solid"}
    types = mujoco.mjtGeom
    if kind == types.mjGEOM_SPHERE:
        return rr.Ellipsoids3D(half_sizes=[[size[0]] * 3], **look)
    if kind == types.mjGEOM_ELLIPSOID:
        return rr.Ellipsoids3D(half_sizes=[size], **look)
    if kind == types.mjGEOM_BOX:
        return rr.Boxes3D(half_sizes=[size], **look)
    if kind == types.mjGEOM_CYLINDER:
        return rr.Cylinders3D(lengths=[2 * size[1]], radii=[size[0]], **look)
    if kind == types.mjGEOM_CAPSULE:  # Rerun's starts at its origin, MuJoCo's is centred
        return rr.Capsules3D(lengths=[2 * size[1]], radii=[size[0]], translations=[[0, 0, -size[1]]], **look)
    return None


def _log_poses(stream: rr.RecordingStream, model: mujoco.MjModel, recording: Recording) -> None:
    """Replay the coordinates through the kinematics, at the pose rate."""
    time = recording["time"]
    rate = 1.0 / (time[1] - time[0]) if len(time) > 1 else POSE_RATE
    rows = np.arange(0, len(time), max(1, round(rate / POSE_RATE)))
    data = mujoco.MjData(model)
    coordinates = [
        (model.jnt_qposadr[j], recording[f"qpos/{model.joint(j).name}"]) for j in range(model.njnt)
    ]
    position = np.empty((len(rows), model.nbody, 3), np.float32)
    quaternion = np.empty((len(rows), model.nbody, 4), np.float32)
    paths = np.empty((len(rows), model.ntendon, 2, 3), np.float32)
    for k, row in enumerate(rows):
        for address, values in coordinates:
            data.qpos[address] = values[row]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        position[k], quaternion[k] = data.xpos, data.xquat[:, [1, 2, 3, 0]]
        points = data.wrap_xpos.reshape(-1, 3)
        for tendon in range(model.ntendon):
            start = data.ten_wrapadr[tendon]
            paths[k, tendon] = points[start : start + 2]
    stamps = _times(time[rows])
    for body in range(1, model.nbody):
        pose = rr.Transform3D.columns(translation=position[:, body], quaternion=quaternion[:, body])
        _send(stream, f"world/bodies/{model.body(body).name}", stamps, pose)
    for tendon in range(model.ntendon):
        name = model.tendon(tendon).name
        entity = f"world/muscles/{name}"
        stream.log(entity, rr.LineStrips3D.from_fields(radii=[0.006]), static=True)
        strips = rr.LineStrips3D.columns(
            strips=list(paths[:, tendon]), colors=_force_colours(recording[f"muscle/{name}/force"][rows])
        )
        _send(stream, entity, stamps, strips)


def _force_colours(force: np.ndarray) -> np.ndarray:
    """Grey when slack, through orange to red with tension."""
    share = np.clip(force / FORCE_SCALE, 0.0, 1.0)[:, None] ** 0.5
    slack, pulling = np.array([150, 155, 165]), np.array([240, 60, 30])
    return np.round(slack + share * (pulling - slack)).astype(np.uint8)


def _log_signals(stream: rr.RecordingStream, recording: Recording) -> None:
    muscles = _names(recording, "muscle")
    chambers = _names(recording, "chamber")
    by_role = {name: _colour(name) for name in muscles}
    moments = ("orthosis", "passive", "gravity")
    plots: dict[str, tuple[list[str], list[Any], list[np.ndarray]]] = {
        "ankle/angle": (["angle"], [[235, 235, 235]], [np.degrees(recording["ankle/angle"])]),
        "ankle/moment": (
            list(moments),
            [[240, 150, 60], [90, 205, 140], [150, 150, 240]],
            [recording[f"ankle/moment/{name}"] for name in moments],
        ),
        "pressure": (
            chambers,
            [_colour(f"{name}_1") for name in chambers],
            [recording[f"chamber/{name}/pressure"] * 1e-5 for name in chambers],
        ),
        "force": (muscles, list(by_role.values()), [recording[f"muscle/{m}/force"] for m in muscles]),
        "contraction": (
            muscles,
            list(by_role.values()),
            [100.0 * recording[f"muscle/{m}/contraction"] for m in muscles],
        ),
    }
    stamps = _times(recording["time"])
    for entity, (names, colours, signals) in plots.items():
        stream.log(
            entity, rr.SeriesLines(names=names, colors=colours, widths=[1.5] * len(names)), static=True
        )
        values = np.column_stack(signals)
        for start in range(0, len(stamps), BLOCK):
            block = slice(start, start + BLOCK)
            _send(stream, entity, stamps[block], rr.Scalars.columns(scalars=values[block]))
    _log_valves(stream, recording, stamps)


def _log_valves(stream: rr.RecordingStream, recording: Recording, stamps: np.ndarray) -> None:
    """One lane per valve: when its seat opens and closes."""
    for valve in _names(recording, "valve"):
        is_open = recording[f"valve/{valve}/opening"] > 0.5
        changes = np.flatnonzero(np.r_[True, is_open[1:] != is_open[:-1]])
        entity = f"valves/{valve}"
        colour = _colour(f"{valve.rsplit('_', 1)[0]}_1")
        stream.log(
            entity,
            rr.StateConfiguration(
                values=["open", "shut"], labels=["open", "shut"], colors=[colour, [55, 58, 64]]
            ),
            static=True,
        )
        states = ["open" if is_open[k] else "shut" for k in changes]
        _send(stream, entity, stamps[changes], rr.StateChange.columns(state=states))


def _log_text(stream: rr.RecordingStream, recording: Recording) -> None:
    lines = [f"# {recording.scenario['name']}", "", str(recording.scenario.get("description", ""))]
    lines += ["", f"Status: **{recording.status}**", "", "| metric | value | unit |", "|---|---:|---|"]
    lines += [f"| {n} | {m.value:.4g} | {m.unit} |" for n, m in recording.metrics.items()]
    if recording.warnings:
        lines += ["", "## Warnings", *(f"- {warning}" for warning in recording.warnings)]
    lines += ["", "## Versions", *(f"- {n} {v}" for n, v in recording.versions.items())]
    stream.log("summary", rr.TextDocument("\n".join(lines), media_type=rr.MediaType.MARKDOWN), static=True)


def _names(recording: Recording, kind: str) -> list[str]:
    return list(dict.fromkeys(c.split("/")[1] for c in recording.columns if c.startswith(f"{kind}/")))


def _colour(name: str) -> list[int]:
    role, number = name.rsplit("_", 1)
    palette = PLANTARFLEXOR_COLOURS if role.startswith("plantar") else DORSIFLEXOR_COLOURS
    return palette[(int(number) - 1) % len(palette)]


def _blueprint() -> rrb.Blueprint:
    legend = rrb.PlotLegend(corner="RightTop")

    def plot(origin: str, name: str) -> rrb.TimeSeriesView:
        link = rrb.TimeAxis(link="LinkToGlobal")
        return rrb.TimeSeriesView(origin=origin, name=name, axis_x=link, plot_legend=legend)

    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                origin="/world",
                name="leg and orthosis",
                line_grid=False,
                background=[28, 30, 34],
                eye_controls=rrb.EyeControls3D(
                    kind="Orbital",
                    position=(0.50, -0.78, 0.58),
                    look_target=(0.03, 0.0, 0.44),
                    eye_up=(0, 0, 1),
                ),
            ),
            rrb.Vertical(
                plot("/ankle/angle", "ankle angle [deg], dorsiflexion +"),
                plot("/ankle/moment", "ankle moment [N·m], dorsiflexion +"),
                plot("/pressure", "gauge pressure [bar]"),
                rrb.StateTimelineView(origin="/valves", name="valves"),
                rrb.Tabs(
                    plot("/force", "muscle force [N]"),
                    plot("/contraction", "contraction [%]"),
                    rrb.TextDocumentView(origin="/summary", name="summary"),
                    active_tab=0,
                ),
                row_shares=[3, 3, 3, 2.6, 3],
            ),
            column_shares=[3, 4],
        ),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )

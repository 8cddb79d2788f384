"""A response → Rerun: its cases beside one another, each over its own moving floor, and their curves."""

import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from afo_sim.show.moving_parts import Mountings
from afo_sim.show.rerun import colours, scene
from afo_sim.show.rerun.recording_file import APPLICATION, saving
from afo_sim.show.rerun.run_rows import TIMELINE, Columns, send
from afo_sim.show.walker_poses import coordinates, poses
from afo_sim.walker import Case, Response, verdict

_APART, _MARKS = 1.5, 0.5  # between walkers, between marks on the floor [m]
_EVERY = 2  # rows of a walk, of 10 ms
_LIMB, _OWN = [160, 165, 175], [84, 106, 255]
_RADII = {"trunk": 0.09, "right": 0.045, "left": 0.045, "muscle": 0.006}  # [m]
_PLOTS: dict[str, tuple[str, str, float]] = {
    "ankle": ("ankle of the device's leg [°]", "right/ankle", 180.0 / np.pi),
    "knee": ("knee of the device's leg [°], flexion +", "right/knee", -180.0 / np.pi),
    "clearance": ("lowest point of that sole [mm]", "right/clearance", 1e3),
    "load": ("vertical force on that foot [N]", "right/load", 1.0),
    "torque": ("torque of the device [N·m]", "device/torque", 1.0),
}


def write_response(response: Response, path: pathlib.Path) -> None:
    """Write a response, with its layout, as a Rerun file."""
    rr.set_strict_mode(True)
    name = f"responding walk: {response.scenario.name}"
    stream = rr.RecordingStream(APPLICATION, recording_id=f"{APPLICATION} {name}")
    stream.set_log_time_enabled(False)
    with saving(stream, path, _layout(response)):
        stream.send_recording_name(name)
        scene.log_axes(stream)
        for place, case in enumerate(response.cases.values()):
            _log_walker(stream, case, place)
            _log_curves(stream, case, place)
        text = rr.TextDocument("\n\n".join(_words(response)), media_type=rr.MediaType.MARKDOWN)
        stream.log("summary", text, static=True)


def _log_walker(stream: rr.RecordingStream, case: Case, place: int) -> None:
    """Shank, foot and device as the model has them, the other limbs as tubes; the walker stays in its place."""
    model, root = case.walked.body.model, f"world/{case.name.replace(' ', '_')}"
    block: Columns = {name: values[::_EVERY] for name, values in coordinates(case).items()}
    gone = block["qpos/forward"]
    stage = scene.Stage(model, {}, f"{root}/walker", 1.0, "force", Mountings(model, {}, ()))
    stream.log(root, rr.Transform3D(translation=[_APART * place, 0.0, 0.0]), static=True)
    heading: dict[str, Any] = {"labels": [case.name], "show_labels": True, "radii": [0.0001]}
    heading["colors"] = [colours.of_run(place)]
    stream.log(f"{root}/name", rr.Points3D([[0.0, 0.0, 1.95]], **heading), static=True)
    scene.log_shapes(stream, stage)
    scene.log_poses(stream, stage, block)
    back = np.column_stack([-gone, 0.0 * gone, 0.0 * gone])
    send(stream, stage.root, block, rr.Transform3D.columns(translation=back.astype(np.float32)))
    seen = poses(case, range(0, len(case.walked["time"]), _EVERY))
    for part, points in (("trunk", seen.trunk), *((side, leg[:, :3]) for side, leg in seen.legs.items())):
        _log_strips(stream, f"{stage.root}/{part}", block, [points], _LIMB, _RADII[part])
    if seen.muscles:
        _log_strips(stream, f"{stage.root}/device", block, [*seen.muscles.values()], _OWN, _RADII["muscle"])
    places = np.arange(-1.0, 1.01, _MARKS)
    marks = [[[x, -0.3, 0.0], [x, 0.3, 0.0]] for x in places]
    stream.log(f"{root}/floor", rr.LineStrips3D(marks, radii=[0.003], colors=[[92, 97, 105]]), static=True)
    moved = np.column_stack([-(gone % _MARKS), 0.0 * gone, 0.0 * gone])
    send(stream, f"{root}/floor", block, rr.Transform3D.columns(translation=moved.astype(np.float32)))


def _log_strips(
    stream: rr.RecordingStream,
    entity: str,
    block: Columns,
    lines: list[np.ndarray],
    colour: list[int],
    radius: float,
) -> None:
    """Lines (n, places, 3) as tubes."""
    stream.log(entity, rr.LineStrips3D.from_fields(colors=[colour], radii=[radius]), static=True)
    strips = [line[k].astype(np.float32) for k in range(len(block["time"])) for line in lines]
    counts = np.full(len(block["time"]), len(lines))
    send(stream, entity, block, rr.LineStrips3D.columns(strips=strips).partition(counts))


def _log_curves(stream: rr.RecordingStream, case: Case, place: int) -> None:
    for plot, (_, column, factor) in _PLOTS.items():
        entity = f"{plot}/{case.name.replace(' ', '_')}"
        style = rr.SeriesLines(names=[case.name], colors=[colours.of_run(place)], widths=[1.6])
        stream.log(entity, style, static=True)
        scalars = rr.Scalars.columns(scalars=factor * case.walked[column])
        send(stream, entity, {"time": case.walked["time"]}, scalars)


def _words(response: Response) -> Iterator[str]:
    yield f"# {response.scenario.name}"
    for reply in verdict(response):
        yield f"**{reply.question}** {reply.text}"
        yield from (f"*{each}*" for each in reply.assumptions)


def _layout(response: Response) -> rrb.Blueprint:
    cases = list(response.cases)
    told = colours.in_words((name, colours.of_run(k)) for k, name in enumerate(cases))
    middle = 0.5 * _APART * (len(cases) - 1)
    eye = (middle, -max(0.75 * _APART * len(cases), 2.8), 1.0)
    view = rrb.Spatial3DView(
        origin="/world",
        name="each walker stays in its place; marks on the floor 0.5 m apart",
        line_grid=False,
        background=[28, 30, 34],
        eye_controls=rrb.EyeControls3D(
            kind="Orbital", position=eye, look_target=(middle, 0.0, 0.85), eye_up=(0, 0, 1)
        ),
    )
    legend, link = rrb.PlotLegend(visible=False), rrb.TimeAxis(link="LinkToGlobal")
    titles = {plot: title for plot, (title, *_) in _PLOTS.items()}
    titles["ankle"] += f": {told}"
    plots: list[Any] = [
        rrb.TimeSeriesView(origin=f"/{plot}", name=title, axis_x=link, plot_legend=legend)
        for plot, title in titles.items()
    ]
    text = rrb.TextDocumentView(origin="/summary", name="in words")
    left = rrb.Vertical(view, text, row_shares=[3, 2])
    return rrb.Blueprint(
        rrb.Horizontal(left, rrb.Vertical(*plots), column_shares=[4, 3]),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="playing"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )

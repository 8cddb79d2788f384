"""A response → Rerun: its cases side by side, each over its own moving floor, and their curves."""

import pathlib

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from afo_sim.show.moving_parts import Mountings
from afo_sim.show.rerun import colours, scene
from afo_sim.show.rerun.curves import log_line
from afo_sim.show.rerun.layout import closed, space, time_plot
from afo_sim.show.rerun.recording_file import recording
from afo_sim.show.rerun.run_rows import send
from afo_sim.show.rerun.texts import document
from afo_sim.show.walker_film import coordinates, poses
from afo_sim.walker import Case, Response, in_words, verdict

_APART, _MARKS = 1.5, 0.5  # between walkers, between marks on the floor [m]
_EVERY = 2  # rows of a walk, of 10 ms
_LIMBS = {"trunk": 0.09, "left": 0.045, "right": 0.045}  # radii [m]
_PLOTS = {
    "ankle of the device's leg [°]": ("right/ankle", 180.0 / np.pi),
    "knee of the device's leg [°], flexion +": ("right/knee", -180.0 / np.pi),
    "lowest point of that sole [mm]": ("right/clearance", 1e3),
    "vertical force on that foot [N]": ("right/load", 1.0),
    "torque of the device [N·m]": ("device/torque", 1.0),
}


def write_response(response: Response, path: pathlib.Path) -> None:
    """Write a response, with its layout, as a Rerun file."""
    name = f"responding walk: {response.scenario.name}"
    count = len(response.cases)
    middle, away = 0.5 * _APART * (count - 1), max(0.75 * _APART * count, 2.8)
    title = f"each walker stays in its place; marks on the floor {_MARKS} m apart"
    view = space("/world", title, (middle, -away, 1.0), (middle, 0.0, 0.85))
    plots = (time_plot(f"/plot_{k}", title, legend=False) for k, title in enumerate(_PLOTS))
    left = rrb.Vertical(view, rrb.TextDocumentView(origin="/summary", name="in words"), row_shares=[3, 2])
    body = rrb.Horizontal(left, rrb.Vertical(*plots), column_shares=[4, 3])
    with recording(path, name, closed(body, play_state="playing")) as stream:
        stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for place, case in enumerate(response.cases.values()):
            _log_walker(stream, case, place)
            for k, (column, factor) in enumerate(_PLOTS.values()):
                entity = f"plot_{k}/{case.name.replace(' ', '_')}"
                rows, curve = {"time": case.walked["time"]}, factor * case.walked[column]
                log_line(stream, entity, rows, curve, case.name, colours.of_run(place))
        words = [f"**{r.question}** {r.text} {' '.join(r.assumptions)}" for r in verdict(response)]
        document(stream, "summary", "\n\n".join([*in_words(response), *words]))


def _log_walker(stream: rr.RecordingStream, case: Case, place: int) -> None:
    """Shanks, feet and device as the model has them, other limbs as tubes; the walker stays in its place."""
    model, root = case.walked.body.model, f"world/{case.name.replace(' ', '_')}"
    block = {name: values[::_EVERY] for name, values in coordinates(case).items()}
    stage = scene.Stage(model, {}, f"{root}/walker", 1.0, "force", Mountings(model, {}, ()))
    look = {"radii": [1e-4], "colors": [colours.of_run(place)], "show_labels": True}
    name = rr.Points3D([[0.0, 0.0, 1.95]], labels=[case.name], **look)
    marks = [[[x, -0.3, 0.0], [x, 0.3, 0.0]] for x in np.arange(-1.0, 1.01, _MARKS)]
    stream.log(root, rr.Transform3D(translation=[_APART * place, 0.0, 0.0]), static=True)
    stream.log(f"{root}/name", name, static=True)
    stream.log(f"{root}/floor", rr.LineStrips3D(marks, radii=[0.003], colors=[[92, 97, 105]]), static=True)
    scene.log_shapes(stream, stage)
    scene.log_poses(stream, stage, block)
    forward = block["qpos/forward"]
    for entity, gone in ((stage.root, forward), (f"{root}/floor", forward % _MARKS)):
        back = np.column_stack([-gone, 0.0 * gone, 0.0 * gone]).astype(np.float32)
        send(stream, entity, block, rr.Transform3D.columns(translation=back))
    for part, line in poses(case, range(0, len(case.walked["time"]), _EVERY)).items():
        shade = [160, 165, 175] if part in _LIMBS else colours.BLUE
        tube = rr.LineStrips3D.from_fields(radii=[_LIMBS.get(part, 0.006)], colors=[shade])
        stream.log(f"{stage.root}/{part}", tube, static=True)
        strips = line[:, : 2 if part in ("left", "right") else None].astype(np.float32)
        send(stream, f"{stage.root}/{part}", block, rr.LineStrips3D.columns(strips=list(strips)))

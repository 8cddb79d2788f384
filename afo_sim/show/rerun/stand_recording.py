"""Tests of the stand → Rerun: the muscles side by side, their curves, and everything over time."""

import pathlib
from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from afo_sim.common import Foreign
from afo_sim.lab import AXES, Trial, set_point_text
from afo_sim.show.rerun.curves import log_line
from afo_sim.show.rerun.layout import closed, space, time_plot
from afo_sim.show.rerun.muscle_shapes import PULLING, SLACK, tube_radius
from afo_sim.show.rerun.recording_file import recording
from afo_sim.show.rerun.run_rows import send
from afo_sim.show.rerun.texts import document
from afo_sim.show.stand_figure import SHOWN, colour

_SPACING = 0.09  # between muscles [m]
_ROWS = 1500  # of a curve in the file, about
_CURVE_SIZE = (160.0, 100.0)  # of the plane that curves are drawn in


def write_stand(trials: Sequence[Trial], path: pathlib.Path) -> None:
    """Write tests of one kind, with their layout, as a Rerun file."""
    name = f"stand: {trials[0].plan.kind}"
    with recording(path, name, _layout(trials)) as stream:
        stream.log("stand", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        every = [(trial, k) for trial in trials for k in range(len(trial.curves))]
        for place, (trial, k) in enumerate(every):
            point = set_point_text(trial, k)
            entity = f"{trial.name}/{point}".replace(" · ", "_").replace(" ", "_")
            label = point if len(trials) == 1 else f"{trial.name} {point}"
            _log_curve(stream, trial, k, entity, label, place * _SPACING)
        lines = [f"# {name}", "", *(f"- {trial.name}" for trial in trials)]
        lines += [f"- {warning}" for trial in trials for warning in trial.warnings]
        document(stream, "summary", "\n".join(lines))


def _layout(trials: Sequence[Trial]) -> rrb.Blueprint:
    names = ("pressure", "contraction", "force")
    plots = [time_plot(f"/{name}", SHOWN[name][0], legend=name == "pressure") for name in names]
    count = sum(len(trial.curves) for trial in trials)
    height = max(trial.plan.muscle.total_length for trial in trials)
    middle = 0.5 * (count - 1) * _SPACING
    eye = (1.2 * max(height, count * _SPACING) + 0.3, middle, -0.3 * height)
    scene = space("/stand", "the stand", eye, (0.0, middle, -0.6 * height))
    right: list[Foreign] = list(plots)
    if trials[0].plan.kind in AXES:
        abscissa, _, ordinate, _ = AXES[trials[0].plan.kind]
        title = f"{SHOWN[ordinate][0]} over {SHOWN[abscissa][0]}"
        right.insert(0, rrb.Spatial2DView(origin="/characteristic", name=title))
    beside = rrb.Vertical(*right, row_shares=[2.0, 1.0, 1.0, 1.0][-len(right) :])
    return closed(rrb.Horizontal(scene, beside, column_shares=[3, 4]), play_state="paused")


def _log_curve(stream: rr.RecordingStream, trial: Trial, k: int, entity: str, label: str, y: float) -> None:
    """One curve: its muscle in space, its columns over time, and its place on the characteristic."""
    every = -(-len(trial.curves[k]["time"]) // _ROWS)
    columns = {name: values[::every] for name, values in trial.curves[k].items()}
    shade = [round(255 * (0.25 + 0.75 * part)) for part in colour(trial, k)[:3]]  # for a dark ground
    for name in ("pressure", "contraction", "force"):
        log_line(stream, f"{name}/{entity}", columns, SHOWN[name][1] * columns[name], label, shade)
    muscle = trial.plan.muscle  # a tube that hangs from the frame, and the carriage below
    frame = rr.Boxes3D(
        half_sizes=[[0.03, 0.03, 0.006]], centers=[[0.0, y, 0.006]], colors=[[90, 95, 105]], fill_mode="solid"
    )
    stream.log(f"stand/{entity}/frame", frame, static=True)
    stream.log(f"stand/{entity}/muscle", rr.Capsules3D.from_fields(fill_mode="solid"), static=True)
    length = columns["length"] + muscle.end_length
    radius = tube_radius(columns["contraction"], muscle)
    strongest = max(float(loop["force"].max()) for loop in trial.curves)
    share = np.clip(columns["force"] / max(strongest, 1.0), 0.0, 1.0)[:, None]
    tube = rr.Capsules3D.columns(
        lengths=(length - 2.0 * radius).clip(0.001).astype(np.float32),
        radii=radius.astype(np.float32),
        translations=np.column_stack([0.0 * length, y + 0.0 * length, radius - length]).astype(np.float32),
        colors=(SLACK + share * (PULLING - SLACK)).round().astype(np.uint8),
    )
    send(stream, f"stand/{entity}/muscle", columns, tube)
    carriage = rr.Boxes3D(half_sizes=[[0.025, 0.025, 0.012]], colors=[shade], fill_mode="solid")
    stream.log(f"stand/{entity}/carriage", carriage, static=True)
    below = np.column_stack([0.0 * length, y + 0.0 * length, -length - 0.012]).astype(np.float32)
    send(stream, f"stand/{entity}/carriage", columns, rr.Transform3D.columns(translation=below))
    if trial.plan.kind not in AXES:
        return
    # the curve in a plane, all curves on one scale, and a dot that runs along it
    abscissa, _, ordinate, _ = AXES[trial.plan.kind]
    points = []
    for name, size in zip((abscissa, ordinate), _CURVE_SIZE, strict=True):
        ends = [f(curve[name]) for curve in trial.curves for f in (np.min, np.max)]
        points.append(size * (columns[name] - min(ends)) / max(max(ends) - min(ends), 1e-12))
    plane = np.column_stack([points[0], _CURVE_SIZE[1] - points[1]]).astype(np.float32)
    line = rr.LineStrips2D([plane], colors=[shade], radii=[0.4])
    stream.log(f"characteristic/{entity}/curve", line, static=True)
    dot = rr.Points2D.from_fields(colors=[[255, 255, 255]], radii=[1.4])
    stream.log(f"characteristic/{entity}/now", dot, static=True)
    send(stream, f"characteristic/{entity}/now", columns, rr.Points2D.columns(positions=plane))

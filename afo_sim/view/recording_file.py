"""The Rerun file of one run, or of several on one timeline."""

import pathlib
import re

import rerun as rr
import rerun.blueprint as rrb

from afo_sim.recording import Recording
from afo_sim.view import scene, signals
from afo_sim.view.layout import blueprint
from afo_sim.view.source import Source, from_folder, from_recording, require_rows

APPLICATION = "afo_sim"
POSE_RATE = 100.0  # poses a second unless told otherwise [Hz]; signals keep the run's own rate
GHOST = 0.55  # opacity of every run after the first


def write_rrd(
    run: Recording | pathlib.Path,
    path: pathlib.Path,
    *,
    rate: float | None = None,
    colour_by: str = "force",
) -> None:
    """Write a run, with its layout, as a Rerun file.

    Parameters
    ----------
    run : a finished recording, or the folder of one (read in blocks, never whole)
    path : file to write
    rate : samples a second [Hz], of signals and poses; the run's own and 100 Hz by default
    colour_by : what colours the muscles, "force" or "pressure"
    """
    source = from_recording(run) if isinstance(run, Recording) else from_folder(run)
    require_rows(source)
    stream = _stream(path, source.name, layout_of(source))
    scene.log_floor(stream)
    _write_run(stream, source, scene.stage(source, colour_by=colour_by), signals.curves(source), rate, "")
    signals.log_range(stream, source, (source.n_row - 1) / source.rate)
    signals.log_texts(stream, [(source.name, source)])
    stream.flush()
    stream.disconnect()


def write_comparison(folders: list[pathlib.Path], path: pathlib.Path, *, rate: float | None = None) -> None:
    """Write several runs side by side on one timeline: the first solid, the others as ghosts.

    Parameters
    ----------
    folders : of runs; their names label the curves
    path : file to write
    rate : as in `write_rrd` [Hz]
    """
    sources = [from_folder(folder) for folder in folders]
    labels = _labels(folders)
    for source in sources:
        require_rows(source)
    lanes = sum(len(source.named("valve")) for source in sources)
    layout = layout_of(sources[0], valves=min(lanes, 4), compared=True)
    stream = _stream(path, " · ".join(labels), layout)
    scene.log_floor(stream)
    for number, (label, source) in enumerate(zip(labels, sources, strict=True)):
        view = scene.stage(source, f"world/runs/{label}", 1.0 if number == 0 else GHOST)
        lines = signals.compared_curves(source, label, number)
        _write_run(stream, source, view, lines, rate, f"{label}/")
    longest = max(sources, key=lambda source: source.n_row / source.rate)
    signals.log_range(stream, sources[0], (longest.n_row - 1) / longest.rate)
    signals.log_texts(stream, list(zip(labels, sources, strict=True)))
    stream.flush()
    stream.disconnect()


def layout_of(source: Source, *, valves: int | None = None, compared: bool = False) -> rrb.Blueprint:
    """The layout in a run's own words; its valves' number of lanes unless told otherwise."""
    leg = source.scenario.leg
    return blueprint(
        len(source.named("valve")) if valves is None else valves,
        source.cycle,
        joint=leg.ankle,
        positive=leg.directions[0],
        compared=compared,
    )


def _stream(path: pathlib.Path, name: str, layout: object) -> rr.RecordingStream:
    rr.set_strict_mode(True)  # otherwise a wrong shape is dropped with a warning
    stream = rr.RecordingStream(APPLICATION, recording_id=f"{APPLICATION} {name}")
    stream.set_log_time_enabled(False)
    stream.save(path, default_blueprint=layout)
    stream.send_recording_name(name)
    return stream


def _write_run(
    stream: rr.RecordingStream,
    source: Source,
    view: scene.Stage,
    lines: list[signals.Curve],
    rate: float | None,
    prefix: str,
) -> None:
    """Everything of one run, block by block."""
    scene.log_shapes(stream, view)
    signals.log_styles(stream, lines)
    finder = signals.EventFinder(source)
    switched = [f"valve/{valve}/opening" for valve in finder.valves]
    columns = ["time", "ankle/angle", "ankle/moment/orthosis", *switched, *(c.column for c in lines)]
    every = source.every(rate)
    for block in source.read(list(dict.fromkeys(columns)), 1):
        finder.see(block)
        if every == 1:
            signals.log_curves(stream, lines, block)
            stream.flush()
    if every > 1:
        for block in source.read(list(dict.fromkeys(["time", *(c.column for c in lines)])), every):
            signals.log_curves(stream, lines, block)
            stream.flush()
    for block in source.read(view.columns, source.every(rate or POSE_RATE)):
        scene.log_poses(stream, view, block)
        stream.flush()
    signals.log_events(stream, finder, source, prefix)


def _labels(folders: list[pathlib.Path]) -> list[str]:
    """Short, distinct names: the folders' own, numbered where two are alike."""
    names = [re.sub(r"[^\w.-]", "_", folder.resolve().name) for folder in folders]
    return [n if names.count(n) == 1 else f"{n}_{k + 1}" for k, n in enumerate(names)]

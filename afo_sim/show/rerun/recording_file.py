"""The Rerun file of one run, or of several on one timeline."""

import errno
import pathlib
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import rerun as rr

import afo_sim.show.rerun.colours as colours
import afo_sim.show.rerun.curves as curves
import afo_sim.show.rerun.events as events
import afo_sim.show.rerun.scene as scene
import afo_sim.show.rerun.texts as texts
import afo_sim.show.rerun.walk_scene as walk_scene
from afo_sim.common import Foreign
from afo_sim.show.moving_parts import Carriage
from afo_sim.show.rerun.layout import Contents, blueprint
from afo_sim.show.rerun.run_rows import GAIT, Columns, Source, from_folder, from_recording, require_rows
from afo_sim.simulation import Recording

_END = b"RRF2FOOT"  # stands in the last bytes of a complete file
_SCARCE = 1 << 20  # free bytes below which a disk counts as full
APPLICATION = "afo_sim"
POSE_RATE = 100.0  # poses a second by default [Hz]; signals keep the run's own rate
_GHOST = 0.55  # opacity of every run after the first


@contextmanager
def recording(path: pathlib.Path, name: str, blueprint: Foreign) -> Iterator[rr.RecordingStream]:
    """A stream of a name; what is logged in the block is written to a file."""
    rr.set_strict_mode(True)  # otherwise a wrong shape is dropped with a warning
    rr.bindings.flush_and_cleanup_orphaned_recordings()  # else memory and threads of the files before stay
    stream = rr.RecordingStream(APPLICATION, recording_id=f"{APPLICATION} {name}")
    stream.set_log_time_enabled(False)
    log, layouts = blueprint._log_to_stream, list[rr.RecordingStream]()  # the same holds of a layout's own

    def logged(layout: rr.RecordingStream) -> None:
        layouts.append(layout)
        log(layout)

    blueprint._log_to_stream = logged
    try:
        stream.save(path, default_blueprint=blueprint)
        layouts.pop().disconnect()
        stream.send_recording_name(name)
        yield stream
        stream.flush()
        stream.disconnect()
    except RuntimeError as error:
        if "writer thread" not in str(error):
            raise
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - 64, 0))
        complete = _END in file.read()
    if not complete:
        code = errno.ENOSPC if shutil.disk_usage(path.parent).free < _SCARCE else errno.EIO
        raise OSError(code, "Rerun could not write it to its end", str(path))


@dataclass(frozen=True)
class RunScene:
    """One run with its view, lines and walker; the label is "" where it is the only one."""

    source: Source
    view: scene.Stage
    lines: list[curves.Curve]
    walker: walk_scene.Walker | None
    label: str = ""


def run_scene(source: Source, carriage: Callable[[Source], Carriage], colour_by: str = "force") -> RunScene:
    """A run that is shown alone; `carriage` gives the one that keeps up with it where it walks."""
    view = scene.stage(source, colour_by=colour_by)
    walker = walk_scene.Walker(view, source, carriage(source)) if source.walks else None
    return RunScene(source, view, curves.curves(source), walker)


def write_rrd(
    run: Recording | pathlib.Path,
    path: pathlib.Path,
    *,
    rate: float | str | None = None,
    colour_by: str = "force",
) -> None:
    """Write a run, with its layout, as a Rerun file."""
    source = from_recording(run) if isinstance(run, Recording) else from_folder(run)
    require_rows(source)
    _write(path, source.name, [run_scene(source, walk_scene.carriage, colour_by)], rate)


def write_comparison(
    folders: list[pathlib.Path], path: pathlib.Path, *, rate: float | str | None = None
) -> None:
    """Write several runs side by side on one timeline: the first solid, the others as ghosts."""
    sources = [from_folder(folder) for folder in folders]
    for source in sources:
        require_rows(source)
    root = f"{walk_scene.CARRIAGE}/runs" if any(source.walks for source in sources) else "world/runs"
    shown: list[RunScene] = []
    names = [re.sub(r"[^\w.-]", "_", folder.resolve().name) for folder in folders]
    labels = [n if names.count(n) == 1 else f"{n}_{k + 1}" for k, n in enumerate(names)]
    for number, (label, source) in enumerate(zip(labels, sources, strict=True)):
        view = scene.stage(source, f"{root}/{label}", 1.0 if number == 0 else _GHOST)
        leader = next((other.walker for other in shown if other.walker), None)
        walker, first = None, source.walks and leader is None
        if source.walks:
            colour = colours.of_run(number)
            walker = walk_scene.Walker(view, source, walk_scene.carriage(source), colour, first)
        lines = curves.compared_curves(source, label, number, recorded=first)
        shown.append(RunScene(source, view, lines, walker, label))
    _write(path, " · ".join(run.label for run in shown), shown, rate)


def contents(shown: list[RunScene]) -> Contents:
    """The contents of some runs, for the layout."""
    walkers = [run.walker for run in shown if run.walker is not None]
    lanes = sum(len(run.source.named("valve")) for run in shown)
    leg = shown[0].source.scenario.leg
    plots = curves.plots_of([line for run in shown for line in run.lines])
    told = {plot: [(line.name, line.colour) for line in lines] for plot, lines in plots.items()}
    return Contents(
        valves=lanes,
        loop=shown[0].source.cycle,
        muscles=any(run.source.named("muscle") for run in shown),
        mountings=any(run.source.named("cuff") for run in shown),
        compared=len(shown) > 1,
        carriage=f"/{walk_scene.CARRIAGE}" if walkers else "",
        trails=tuple(trail for walker in walkers for trail in walker.trails),
        stride=walkers[0].way.stride_time if walkers else 1.0,
        lanes=2 * len(walkers),
        joint=leg.ankle,
        positive=leg.directions[0],
        # of compared runs, `runs` tells names and colours once for all
        plots={plot: "" if len(shown) > 1 else colours.in_words(lines) for plot, lines in told.items()},
        runs=colours.in_words((run.label, colours.of_run(k)) for k, run in enumerate(shown) if run.label),
        answer=bool(texts.answer([(run.label or run.source.name, run.source) for run in shown])),
    )


def _write(path: pathlib.Path, name: str, shown: list[RunScene], rate: float | str | None) -> None:
    """Everything of some runs."""
    with recording(path, name, blueprint(contents(shown))) as stream:
        log_still(stream, shown)
        for run in shown:
            _write_run(stream, run, rate)
        longest = max((run.source for run in shown), key=lambda source: source.n_row / source.rate)
        ends = {"time": np.array([0.0, (longest.n_row - 1) / longest.rate])}
        if longest.walks:
            blocks = list(longest.read(list(GAIT), 1))
            ends |= {name: np.array([blocks[0][name][0], blocks[-1][name][-1]]) for name in GAIT}
        curves.log_limits(stream, [run.source for run in shown], ends)
        texts.log_texts(stream, [(run.label or run.source.name, run.source) for run in shown])


def log_still(stream: rr.RecordingStream, shown: list[RunScene]) -> None:
    """Log once all that does not change over some runs."""
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    if not any(run.walker for run in shown):
        scene.log_floor(stream, (0.45, 0.3, 0.002), (0.05, 0.0, 0.0))
    for run in shown:
        scene.log_shapes(stream, run.view)
        curves.log_styles(stream, run.lines)
        if run.walker is not None:
            walk_scene.log_walker_styles(stream, run.walker)


def _write_run(stream: rr.RecordingStream, run: RunScene, rate: float | str | None) -> None:
    """Log all of one run that changes, block by block."""
    source, every = run.source, run.source.every(rate)
    finder = events.EventFinder(source)
    plotted = curves.columns_of(source, run.lines)
    for block in source.read(list(dict.fromkeys([*finder.columns, *plotted])), 1):
        finder.see(block)
        if every == 1:
            curves.log_curves(stream, run.lines, block)
            stream.flush()
    if every > 1:
        for block in source.read(plotted, every):
            curves.log_curves(stream, run.lines, block)
            stream.flush()
    for block in source.read(run.view.columns, source.every(rate or POSE_RATE)):
        log_poses(stream, run, block)
        stream.flush()
    events.log_events(stream, finder, source, f"{run.label}/" if run.label else "")


def log_poses(stream: rr.RecordingStream, run: RunScene, block: Columns) -> None:
    """Log the poses in space at a block of rows."""
    scene.log_poses(stream, run.view, block)
    if run.walker is not None:
        run.walker.log(stream, block)

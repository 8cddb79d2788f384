"""Watching a run while it is computed: its rows stream into a viewer on this machine."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rerun as rr

import afo_sim.show.rerun.curves as curves
import afo_sim.show.rerun.scene as scene
import afo_sim.show.rerun.walk_scene as walk_scene
from afo_sim.show.rerun.layout import blueprint
from afo_sim.show.rerun.recording_file import APPLICATION, POSE_RATE, RunScene, contents, log_poses, log_still
from afo_sim.show.rerun.source import Source, from_recording
from afo_sim.show.rerun.viewer import require_display, viewer_process
from afo_sim.simulation.recording import Recording

Watch = Callable[[Recording], None]


@contextmanager
def live_viewer(*, headless: bool = False) -> Iterator[Watch]:
    """Open a viewer, and yield what takes each new stretch of a run (as a Recording of its rows).

    The window stays until it is closed; the viewer listens on this machine only.
    """
    if not headless:
        require_display()
    options = ["--headless"] if headless else ["--hide-welcome-screen"]
    rr.set_strict_mode(True)
    with viewer_process(options, wait_for_close=not headless) as url:
        stream = rr.RecordingStream(APPLICATION)
        stream.set_log_time_enabled(False)
        try:
            yield _stream_to(stream, url)
        finally:
            stream.flush()
            stream.disconnect()


def _stream_to(stream: rr.RecordingStream, url: str) -> Watch:
    started: list[RunScene] = []

    def watch(stretch: Recording) -> None:
        source = from_recording(stretch)
        if not started:
            started.append(_shown(source))
            stream.connect_grpc(url, default_blueprint=blueprint(contents(started)))
            stream.send_recording_name(source.name)
            log_still(stream, started)
        run = started[0]
        for block in source.read(curves.columns_of(source, run.lines), 1):
            curves.log_curves(stream, run.lines, block)
        for block in source.read(run.view.columns, source.every(POSE_RATE)):
            log_poses(stream, run, block)
        stream.flush()

    return watch


def _shown(source: Source) -> RunScene:
    """The view of a run that has only begun."""
    view = scene.stage(source)
    walker = None
    if source.walks:
        walker = walk_scene.Walker(view, source, walk_scene.expected_carriage(source))
    return RunScene(source, view, curves.curves(source), walker)

"""Watching a run while it is computed: its rows stream into a viewer on this machine."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rerun as rr

from afo_sim.recording import Recording
from afo_sim.view import scene, signals
from afo_sim.view.recording_file import APPLICATION, POSE_RATE, layout_of
from afo_sim.view.source import from_recording
from afo_sim.view.viewer import require_display, viewer_process

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
    started: list[tuple[scene.Stage, list[signals.Curve]]] = []

    def watch(stretch: Recording) -> None:
        source = from_recording(stretch)
        if not started:
            stream.connect_grpc(url, default_blueprint=layout_of(source))
            stream.send_recording_name(source.name)
            started.append((scene.stage(source), signals.curves(source)))
            scene.log_floor(stream)
            scene.log_shapes(stream, started[0][0])
            signals.log_styles(stream, started[0][1])
        view, lines = started[0]
        names = list(dict.fromkeys(["time", *(line.column for line in lines)]))
        for block in source.read(names, 1):
            signals.log_curves(stream, lines, block)
        for block in source.read(view.columns, source.every(POSE_RATE)):
            scene.log_poses(stream, view, block)
        stream.flush()

    return watch

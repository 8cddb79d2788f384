"""Watching a run while it is computed: its rows stream into a viewer on this machine."""

import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import IO

import numpy as np
import rerun as rr

import afo_sim.show.rerun.curves as curves
import afo_sim.show.rerun.recording_file as recording_file
import afo_sim.show.rerun.walk_scene as walk_scene
from afo_sim.common import InputError, child_environment, write_bytes
from afo_sim.show.rerun.layout import blueprint
from afo_sim.show.rerun.run_rows import TIMELINE, from_recording
from afo_sim.simulation import Recording

_LOOPBACK = "127.0.0.1"
_START_LIMIT = 60.0  # how long a viewer may take to start or load [s]


def open_recordings(paths: Sequence[pathlib.Path]) -> None:
    """Show Rerun files in a window, until it is closed."""
    require_display(paths[0])
    subprocess.run([str(_binary()), *map(str, paths), "--bind", _LOOPBACK], check=False, env=_environment())


def require_display(file: pathlib.Path | None = None) -> None:
    """Refuse to open a window where there is no screen."""
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if sys.platform.startswith("linux") and not display:
        problem = "there is no display here to open the viewer on; make a picture with `screenshot`, or copy "
        problem += "the file to a machine with a display and open it there with `rerun FILE`"
        raise InputError(problem, file=file)


def screenshot(path: pathlib.Path, picture: pathlib.Path, at: float | None = None) -> None:
    """Write a PNG of a Rerun file, laid out as on a screen, without a display."""
    from rerun.experimental import ViewerClient

    with viewer_process(["--headless", "--window-size", "1600x900", "--hide-welcome-screen"]) as url:
        client = ViewerClient(url)
        client.open(str(path))
        _wait(lambda: not client.get_state().loading)
        moment = np.timedelta64(round((at or 0.0) * 1e9), "ns")
        client.set_time(TIMELINE, duration=moment, play_state="paused")
        time.sleep(1.0)  # the viewer tells when it has loaded, not when it has drawn
        write_bytes(picture, client.take_screenshot())


@contextmanager
def viewer_process(options: Sequence[str], *, wait_for_close: bool = False) -> Iterator[str]:
    """A viewer for the duration of a block (or until closed); yields the address it listens at."""
    with socket.socket() as probe:
        probe.bind((_LOOPBACK, 0))
        port = int(probe.getsockname()[1])
    command = [str(_binary()), "--bind", _LOOPBACK, "--port", str(port), *options]
    with tempfile.TemporaryFile("w+") as complaint:
        process = subprocess.Popen(command, env=_environment(), stdout=subprocess.DEVNULL, stderr=complaint)
        try:
            _wait(lambda: process.poll() is not None or _listens(port))
            time.sleep(0.3)  # it listens before it looks for a driver
            if process.poll() is not None:
                raise _no_viewer(complaint)
            try:
                yield f"rerun+http://{_LOOPBACK}:{port}/proxy"
            except ConnectionError:  # it may end later than that, while it is asked for a picture
                with suppress(subprocess.TimeoutExpired):
                    process.wait(3.0)
                if process.poll() is not None:
                    raise _no_viewer(complaint) from None
                raise
            if wait_for_close:
                process.wait()
        finally:
            process.terminate()
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _no_viewer(complaint: IO[str]) -> InputError:
    complaint.seek(0)
    lines = [line for line in complaint.read().splitlines() if line.strip()]
    told = f" ({lines[-1].strip()[:120]})" if lines else ""
    problem = f"the Rerun viewer does not start here{told}; without a display it needs a Vulkan driver in "
    return InputError(f"{problem}software: on Debian or Ubuntu install the package mesa-vulkan-drivers")


def _environment() -> dict[str, str]:
    return {"XDG_RUNTIME_DIR": str(pathlib.Path.home())} | child_environment({"RUST_LOG": "error"})


def _binary() -> pathlib.Path:
    import rerun_cli

    name = "rerun.exe" if sys.platform == "win32" else "rerun"
    return pathlib.Path(rerun_cli.__file__).with_name(name)


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(0.2)
        return probe.connect_ex((_LOOPBACK, port)) == 0


def _wait(done: Callable[[], object]) -> None:
    """Poll until `done()` is true."""
    limit = time.monotonic() + _START_LIMIT
    while not done():
        if time.monotonic() > limit:
            raise InputError(f"the Rerun viewer did not answer within {_START_LIMIT:g} s")
        time.sleep(0.05)


@contextmanager
def live_viewer(*, headless: bool = False) -> Iterator[Callable[[Recording], None]]:
    """Open a viewer, and yield what takes each new stretch of a run (as a Recording of its rows)."""
    if not headless:
        require_display()
    options = ["--headless"] if headless else ["--hide-welcome-screen"]
    rr.set_strict_mode(True)
    with viewer_process(options, wait_for_close=not headless) as url:
        stream = rr.RecordingStream(recording_file.APPLICATION)
        stream.set_log_time_enabled(False)
        started: list[recording_file.RunScene] = []

        def watch(stretch: Recording) -> None:
            source = from_recording(stretch)
            if not started:
                started.append(recording_file.run_scene(source, walk_scene.expected_carriage))
                stream.connect_grpc(url, default_blueprint=blueprint(recording_file.contents(started)))
                stream.send_recording_name(source.name)
                recording_file.log_still(stream, started)
            run = started[0]
            for block in source.read(curves.columns_of(source, run.lines), 1):
                curves.log_curves(stream, run.lines, block)
            for block in source.read(run.view.columns, source.every(recording_file.POSE_RATE)):
                recording_file.log_poses(stream, run, block)
            stream.flush()

        try:
            yield watch
        finally:
            stream.flush()
            stream.disconnect()

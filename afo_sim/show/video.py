"""Recording → MP4: the run replayed in MuJoCo, in real time, encoded by ffmpeg."""

import pathlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import IO

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.writing import replacing
from afo_sim.show.video_painter import Painter
from afo_sim.simulation.recording import Recording

Progress = Callable[[int, int], None]


def write_video(
    recording: Recording,
    path: pathlib.Path,
    *,
    rate: float = 30.0,
    width: int = 1280,
    height: int = 720,
    progress: Progress | None = None,
) -> None:
    """Replay a run as an MP4 video, in real time.

    Parameters
    ----------
    recording : a finished recording
    path : file to write, whole or not at all
    rate : frames per second [1/s]
    width, height : of the picture, even numbers [pixel]
    progress : called with (frames done, frames in all)

    Raises
    ------
    InputError
        The recording has no rows, a number is out of range, ffmpeg is missing or refuses, or there
        is no OpenGL to draw with.
    """
    rows = _rows(recording, rate)
    for field, pixels in (("width", width), ("height", height)):
        if pixels < 2 or pixels % 2:
            raise InputError("is not a valid size of a picture", field=field, value=pixels, allowed="even, at least 2")
    program = _ffmpeg()
    with (
        Painter(recording, width, height) as painter,
        replacing(path) as temporary,
        _encoder(program, temporary, rate, width, height) as frames,
    ):
        for done, row in enumerate(rows, start=1):
            frames.write(painter.picture(int(row)).tobytes())
            if progress is not None:
                progress(done, len(rows))


def _rows(recording: Recording, rate: float) -> np.ndarray:
    """Row of the recording in each frame."""
    time = recording["time"]
    if not len(time):
        raise InputError(f"there is nothing to draw: the recording has no rows ({recording.status})")
    if not 0.0 < rate <= 1000.0:
        raise InputError("is not a valid frame rate", field="rate", value=rate, allowed="above 0 to 1000")
    count = int((time[-1] - time[0]) * rate + 1e-6) + 1
    return np.minimum(np.searchsorted(time, time[0] + np.arange(count) / rate - 1e-9), len(time) - 1)


def _ffmpeg() -> str:
    program = shutil.which("ffmpeg")
    if program is None:
        raise InputError(
            "videos are encoded by the program ffmpeg, which is not installed; install the package "
            "ffmpeg (Debian, Ubuntu: apt install ffmpeg; macOS: brew install ffmpeg)"
        )
    return program


@contextmanager
def _encoder(program: str, path: pathlib.Path, rate: float, width: int, height: int) -> Iterator[IO[bytes]]:
    """A stream that takes raw RGB frames, of which ffmpeg makes an MP4."""
    command = [program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{width}x{height}", "-r", repr(rate), "-i", "-"]
    command += ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "18", "-movflags", "+faststart"]
    command += ["-f", "mp4", f"file:{path}"]
    with (
        tempfile.TemporaryFile() as log,
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=log) as process,
    ):
        assert process.stdin is not None
        try:
            yield process.stdin
        except BrokenPipeError:
            pass  # ffmpeg ended early; its exit code and message say why
        except BaseException:
            process.kill()
            raise
        finally:
            with suppress(BrokenPipeError):
                process.stdin.close()
        if process.wait() != 0:
            log.seek(0)
            raise InputError(f"ffmpeg failed: {log.read().decode(errors='replace').strip()[-500:]}")

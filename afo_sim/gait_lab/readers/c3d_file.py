"""A C3D file as ezc3d reads it, in a process of its own.

ezc3d is C++: on a damaged file it may end the process that it runs in, or never come back (of 700 files
with one to four changed bytes, 6 and 3). There it harms nobody.
"""

import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from afo_sim.common import InputError, child_environment, optional, plausible, trusted_places
from afo_sim.gait_lab.readers.c3d_child import ANSWER, ANSWER_A_BYTE, ARRAYS

_BLOCK = 512  # bytes; C3D counts in them
_LARGEST = 2**28  # bytes of a file
PATIENCE = 20.0  # that a file is given [s]
SECONDS_A_BYTE = 1e-6  # that a large one is given more
_BROKEN = "it is damaged (ezc3d broke off)"
CHILD = pathlib.Path(__file__).with_name("c3d_child.py")


@dataclass(frozen=True, eq=False)
class C3dFile:
    """Numbers and texts of a C3D file, with the file's own units."""

    file: pathlib.Path
    parameters: Mapping[str, Mapping[str, Any]]  # group: name: value
    points: np.ndarray  # (frames, points, 3)
    residuals: np.ndarray  # negative where not seen (frames, points)
    analogs: np.ndarray  # scaled (channels, samples)
    frame_rate: float  # of the header [Hz]
    first_frame: int  # from 0
    frames: int

    def numbers(self, group: str, name: str) -> np.ndarray:
        """A parameter's numbers in the file's order, NaN where infinite; none if it is not there."""
        try:
            found = np.asarray(self.value(group, name), dtype=float).ravel(order="F")
        except (TypeError, ValueError):
            return np.empty(0)
        finite = np.where(np.isinf(found), np.nan, found)
        return plausible(finite, file=self.file, field=f"{group}:{name}", missing=True)

    def value(self, group: str, name: str) -> Any:
        """A parameter as it is in the file; an empty list if it is not there."""
        return self.parameters.get(group, {}).get(name, [])

    def texts(self, group: str, name: str) -> list[str]:
        """A list of texts, which goes on in NAME2, NAME3, … after 255 entries."""
        found, number = [str(text) for text in np.atleast_1d(self.value(group, name))], 2
        while f"{name}{number}" in self.parameters.get(group, {}):
            found += [str(text) for text in np.atleast_1d(self.value(group, f"{name}{number}"))]
            number += 1
        return [text.strip("\0 ") for text in found]


def read_c3d_file(path: pathlib.Path) -> C3dFile:
    """Read a C3D file."""
    optional("ezc3d")  # the process below needs it
    size = _refuse_damaged(path)
    found = _answer(path, size)
    points, residuals = found["points"], found["residuals"]
    frames, count = points.shape[:2]
    whole = residuals.size == count * frames
    return C3dFile(
        file=path,
        parameters=found["parameters"],
        points=points,
        residuals=residuals.reshape(count, frames).T if whole else np.zeros((frames, count)),
        analogs=found["analogs"],
        frame_rate=found["frame_rate"],
        first_frame=found["first_frame"],
        frames=frames or max(found["last_frame"] - found["first_frame"] + 1, 0),
    )


def _answer(path: pathlib.Path, size: int) -> dict[str, Any]:
    """What the child says of a file of so many bytes; it runs no code of the folder that it is started in."""
    command = [sys.executable, "-I", str(CHILD), str(path.absolute()), *trusted_places()]
    patience, most = PATIENCE + SECONDS_A_BYTE * size, ANSWER + ANSWER_A_BYTE * size
    given = child_environment({"OPENBLAS_NUM_THREADS": "1"})  # each further thread asks for memory
    with tempfile.TemporaryFile() as said:
        try:
            done = subprocess.run(
                command, stdout=said, stderr=subprocess.DEVNULL, timeout=patience, env=given, check=False
            )
        except subprocess.TimeoutExpired:
            why = f"it is damaged (ezc3d did not come to an end in {patience:.0f} s)"
            raise _refused(path, why) from None
        if done.returncode or os.fstat(said.fileno()).st_size > most:
            raise _refused(path, _BROKEN)
        said.seek(0)
        try:
            found: dict[str, Any] = json.loads(said.readline())
            for name in ARRAYS if "refused" not in found else ():
                numbers = np.frombuffer(said.read(8 * math.prod(found[name])), "<f8")
                found[name] = numbers.reshape(found[name])
        except (KeyError, RecursionError, TypeError, ValueError):
            raise _refused(path, _BROKEN) from None
    if "refused" in found:
        raise _refused(path, found["refused"])
    return found


def _refused(path: pathlib.Path, why: str) -> InputError:
    return InputError(f"ezc3d cannot read it: {why}", file=path)


def _refuse_damaged(path: pathlib.Path) -> int:
    """Refuse what is no C3D file or ends too early; how many bytes it has."""
    try:
        with path.open("rb") as stream:
            head = stream.read(_BLOCK)
            stream.seek(_BLOCK * ((head[0] if head else 1) - 1))
            section = stream.read(4)
            size = stream.seek(0, 2)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file=path) from None
    except ValueError:  # a place before the file's beginning
        raise InputError("is not a whole C3D file", file=path) from None
    if size > _LARGEST:
        raise InputError("is too large", file=path, allowed=f"up to {_LARGEST >> 20} MiB")
    if len(head) < _BLOCK or head[1] != 0x50:
        raise InputError("is not a whole C3D file", file=path)
    if len(section) < 4:
        raise InputError(f"is cut short: it ends after {size} bytes, before its parameters", file=path)
    order = ">" if section[3] == 86 else "<"  # 86: MIPS; 84: Intel; 85: DEC, whose whole numbers are Intel's
    points, analogs, first, last = struct.unpack(order + "4H", head[2:10])
    (start,) = struct.unpack(order + "H", head[16:18])
    # numbers are floating where the header's scale is negative; its sign's place is the processor's
    floating = head[12 + {85: 1, 86: 0}.get(section[3], 3)] & 0x80
    frames = max(last - first + 1, 0) if last < 65535 else 0  # 65535 stands for more than fits
    needed = _BLOCK * (start - 1) + (4 if floating else 2) * (4 * points + analogs) * frames
    if start < 2 or needed > size:
        raise InputError(f"is cut short or damaged: it has {size} bytes of {needed}", file=path)
    return size

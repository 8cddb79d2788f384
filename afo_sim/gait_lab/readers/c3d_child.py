"""Reads one C3D file and writes it to the standard output; `c3d_file` runs this as a process.

It is run as a file, and imports nothing of this package: what it needs is Python's own, and ezc3d.
"""

import json
import os
import pathlib
import sys
from contextlib import suppress
from typing import Any

ARRAYS = ("points", "residuals", "analogs")
ROOM, ROOM_A_BYTE = 2**30, 64  # memory for Python with its libraries, and for each byte of the file [bytes]
ANSWER, ANSWER_A_BYTE = 2**20, 16  # an answer's size, and more for each byte of the file [bytes]


def _contents(path: str) -> dict[str, Any]:
    """All that is read of a C3D file, in plain arrays and texts."""
    import ezc3d

    file = ezc3d.c3d(path, ignore_bad_formatting=True)
    header, data = file["header"]["points"], file["data"]
    return {
        "parameters": {
            group: {name: part["value"] for name, part in parts.items() if "value" in part}
            for group, parts in file["parameters"].items()
        },
        "points": data["points"][:3].transpose(2, 1, 0),
        "residuals": data["meta_points"]["residuals"],
        "analogs": data["analogs"][0],
        "frame_rate": float(header["frame_rate"]),
        "first_frame": int(header["first_frame"]),
        "last_frame": int(header["last_frame"]),
    }


def _limit(size: int) -> None:
    """A header that asks for more than its file of so many bytes can hold ends this process, and no other."""
    with suppress(ImportError, OSError, ValueError):  # a system without such limits
        import resource

        for kind, most in (
            (resource.RLIMIT_FSIZE, ANSWER + ANSWER_A_BYTE * size),
            (resource.RLIMIT_AS, ROOM + ROOM_A_BYTE * size),
        ):
            resource.setrlimit(kind, (most, most))


def main() -> None:
    """Write ezc3d's complaint if it refuses the file, else the file's contents."""
    path, *places = sys.argv[1:]
    sys.path += places
    answer = os.dup(1)
    os.dup2(2, 1)  # what ezc3d itself may print is no part of the answer
    _limit(pathlib.Path(path).stat().st_size)
    arrays: list[Any] = []
    try:
        found = _contents(path)
        arrays = [found[name].astype("<f8") for name in ARRAYS]
        found |= {name: array.shape for name, array in zip(ARRAYS, arrays, strict=True)}
    except Exception as error:  # ezc3d passes on what its C++ threw
        found = {"refused": " ".join(str(error).split()) or type(error).__name__}
    with os.fdopen(answer, "wb") as stream:
        stream.write(json.dumps(found, default=lambda value: value.tolist()).encode() + b"\n")
        for array in arrays:
            stream.write(array.tobytes())


if __name__ == "__main__":
    main()

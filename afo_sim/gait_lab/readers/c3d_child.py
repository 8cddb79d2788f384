"""Reads one C3D file and writes what is in it to the standard output; `c3d_file` runs this as a process."""

import os
import pickle
import sys
from typing import Any


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
        "points": data["points"][:3].transpose(2, 1, 0).copy(),
        "residuals": data["meta_points"]["residuals"],
        "analogs": data["analogs"][0],
        "frame_rate": float(header["frame_rate"]),
        "first_frame": int(header["first_frame"]),
        "last_frame": int(header["last_frame"]),
    }


def main() -> None:
    """Write a pickled text if ezc3d refuses the file, else its contents."""
    answer = os.dup(1)
    os.dup2(2, 1)  # what ezc3d itself may print is no part of the answer
    found: dict[str, Any] | str
    try:
        found = _contents(sys.argv[1])
    except Exception as error:  # ezc3d passes on what its C++ threw
        found = " ".join(str(error).split()) or type(error).__name__
    with os.fdopen(answer, "wb") as stream:
        pickle.dump(found, stream)


if __name__ == "__main__":
    main()

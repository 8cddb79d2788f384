"""C3D files through ezc3d, which is installed only on request."""

import pathlib
from typing import Any

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.common.units import parse_quantity
from afo_sim.gait.readers.markers import Markers
from afo_sim.gait.readers.plates import Plate, plate


def read_c3d(path: pathlib.Path) -> tuple[Markers, list[Plate]]:
    """Read markers and force plates from a C3D file.

    Parameters
    ----------
    path : with POINT data, and FORCE_PLATFORM if it has plates; the unit is the file's own

    Returns
    -------
    (markers, plates named "1", "2", … in the file's order), both in the laboratory's axes; a force is the
    file's own, by C3D's convention the foot's on the plate, which `ground_force` finds out and turns round

    Raises
    ------
    InputError
        ezc3d is not installed, or cannot read the file.
    """
    try:
        import ezc3d
    except ImportError:
        raise InputError(
            "reading C3D needs the library ezc3d", file=path, allowed="after: pip install 'afo-sim[c3d]'"
        ) from None
    if not path.is_file():
        raise InputError("there is no such file", file=path)
    try:
        file = ezc3d.c3d(str(path), extract_forceplat_data=True)
    except Exception as error:  # ezc3d passes on what its C++ threw
        raise InputError(f"ezc3d cannot read it: {' '.join(str(error).split())}", file=path) from None
    point = file["parameters"]["POINT"]
    points = np.moveaxis(file["data"]["points"][:3], 0, -1)  # (marker, frame, 3)
    points = points * _unit(path, point.get("UNITS", {}).get("value", ["mm"]))
    rate = float(file["header"]["points"]["frame_rate"])
    first = int(file["header"]["points"]["first_frame"])
    names = [
        name for group in ("LABELS", "LABELS2", "LABELS3") for name in point.get(group, {}).get("value", [])
    ]
    time = (first + np.arange(points.shape[1])) / rate
    markers = Markers(path, time, dict(zip(names, points, strict=False)))
    analog = float(file["header"]["analogs"]["frame_rate"])
    return markers, [
        _plate(path, str(k), platform, analog, float(time[0]))
        for k, platform in enumerate(file["data"]["platform"], start=1)
    ]


def _plate(path: pathlib.Path, name: str, platform: Any, rate: float, start: float) -> Plate:
    force = np.array(platform["force"]).T
    place = np.array(platform["center_of_pressure"]).T * _unit(path, [platform["unit_position"]])
    return plate(path, name, start + np.arange(len(force)) / rate, force, place)


def _unit(path: pathlib.Path, names: list[str]) -> float:
    """Metres in the file's unit of length."""
    name = names[0].strip() if names else "mm"
    try:
        return parse_quantity(f"1 {name or 'mm'}", "m")
    except ValueError:
        raise InputError(
            "is no length", file=path, field="POINT:UNITS", value=name, allowed="mm, m"
        ) from None

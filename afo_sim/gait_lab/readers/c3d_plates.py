"""Force plates of a C3D file: channels → force and centre of pressure in the laboratory.

C3D's own types (c3d.org, FORCE_PLATFORM): 1 has forces, centre of pressure and free moment; 2 forces and
moments; 3 the eight channels of four sensors; 4 is 2 before its calibration matrix. ezc3d computes them
too, but refuses the whole file where one plate lacks a channel, turns a type 3 with a positive depth over,
and leaves the plate's constant in the centre of pressure.
"""

import pathlib

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.c3d_file import C3dFile
from afo_sim.gait_lab.readers.length_unit import UNITS
from afo_sim.gait_lab.readers.plate_baseline import constant, place_of
from afo_sim.gait_lab.readers.plate_loads import DeclaredPlate, NoPlateError, Z, plate_loads
from afo_sim.gait_lab.readers.plates import PRESSED, Plate, plate

CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}  # by type
EDGES = (0.2, 6.0)  # of a plate or a treadmill's belt [m]; assumed
BESIDE = 0.02  # distance from the plate at which a centre of pressure is off it [m]; assumed


def plates_of_c3d(
    path: pathlib.Path, file: C3dFile, time: np.ndarray, metre: float
) -> tuple[list[Plate], list[str]]:
    """All plates that can be read, and warnings for those that cannot.

    Units: time [s] (n,).
    """
    used = file.numbers("FORCE_PLATFORM", "USED")
    plates, warnings = [], []
    for k in range(min(int(used[0]), 64) if len(used) and np.isfinite(used[0]) else 0):
        name = str(k + 1)
        try:
            plates.append(_plate(path, name, _declared(file, k), time, metre))
        except NoPlateError as error:
            warnings.append(f"plate {name} was left out: {error}")
        except InputError as error:  # a load without a number
            warnings.append(f"plate {name} was left out: {error.problem}")
    return plates, warnings


def _declared(file: C3dFile, k: int) -> DeclaredPlate:
    kinds, corners, origins = (file.numbers("FORCE_PLATFORM", n) for n in ("TYPE", "CORNERS", "ORIGIN"))
    kind = int(kinds[k]) if k < len(kinds) else 0
    if kind not in CHANNELS:
        raise NoPlateError(f"its type is {kind}, and types 1 to 4 are read")
    if len(corners) < 12 * (k + 1):
        raise NoPlateError("its corners are not in the file")
    channel = file.numbers("FORCE_PLATFORM", "CHANNEL")
    shape = np.shape(file.value("FORCE_PLATFORM", "CHANNEL"))
    rows = shape[0] if len(shape) > 1 else len(channel)
    places = channel[rows * k : rows * (k + 1)][: CHANNELS[kind]]
    if len(places) < CHANNELS[kind] or not np.all((places >= 1) & (places <= len(file.analogs))):
        shown = ", ".join(f"{place:g}" for place in places) or "none"
        raise NoPlateError(f"the file has {len(file.analogs)} analog channels, not all of its own ({shown})")
    index = places.astype(int) - 1
    units = file.texts("ANALOG", "UNITS")
    return DeclaredPlate(
        kind=kind,
        corners=corners[12 * k : 12 * k + 12].reshape(4, 3),
        origin=origins[3 * k : 3 * k + 3] if len(origins) >= 3 * k + 3 else np.zeros(3),
        channels=file.analogs[index].T,
        calibration=_calibration(file, k) if kind == 4 else None,
        moment_unit=units[index[3]] if kind == 2 and index[3] < len(units) else "",
    )


def _calibration(file: C3dFile, k: int) -> np.ndarray | None:
    matrix = file.numbers("FORCE_PLATFORM", "CAL_MATRIX")[36 * k : 36 * k + 36]
    if len(matrix) < 36 or not np.any(matrix):
        return None
    return np.asarray(matrix.reshape(6, 6, order="F"))


def _plate(path: pathlib.Path, name: str, declared: DeclaredPlate, time: np.ndarray, metre: float) -> Plate:
    remarks: list[str] = []
    warnings: list[str] = []
    corners = declared.corners * _edge_unit(declared.corners, metre, warnings)
    centre, turn = _frame(corners)
    half = np.abs((corners - centre) @ turn).max(axis=0)
    force, moment = plate_loads(declared, metre, half, remarks, warnings)
    if moment is None:  # type 1 has the centre of pressure itself
        rest = constant(time, force[:, 2], force)
        spot = np.column_stack([declared.channels[:, 3:5] * metre, np.zeros(len(force))])
        force = force - rest
    else:
        rest = constant(time, force[:, 2], np.column_stack([force, moment]))
        force, moment = force - rest[:3], moment - rest[3:]
        spot = place_of(force, moment, Z, 0.0)
    if np.any(rest):
        remarks.append(f"read {np.linalg.norm(rest[:3]):.1f} N without load, which was taken off")
    _doubt_place(spot, force[:, 2], half, warnings)
    found = plate(path, name, time, force @ turn.T, centre + spot @ turn.T)
    return Plate(
        name,
        time,
        found.force,
        found.place,
        corners,
        tuple(f"plate {name}: {remark}" for remark in remarks),
        tuple(f"plate {name}: {warning}" for warning in warnings),
    )


def _edge_unit(corners: np.ndarray, metre: float, warnings: list[str]) -> float:
    """Metres in the corners' unit: the file's, unless no plate is of that size."""
    edge = float(np.linalg.norm(np.diff(corners, axis=0), axis=1).max())
    if not np.isfinite(edge) or edge == 0.0:
        raise NoPlateError("its corners are all the same point")
    fits = [(unit, factor) for unit, factor in UNITS.items() if EDGES[0] <= edge * factor <= EDGES[1]]
    if EDGES[0] <= edge * metre <= EDGES[1] or len(fits) != 1:
        return metre
    unit, factor = fits[0]
    warnings.append(f"its edges are {edge * metre:.3g} m long as stated; its corners were read as {unit}")
    return factor


def _frame(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The surface's centre (3,), and the plate's axes as columns in the laboratory (3, 3).

    Corners stand at +x +y, −x +y, −x −y, +x −y of the plate.
    """
    first, second, third, fourth = corners
    x = first + fourth - second - third
    z = np.cross(x, first + second - third - fourth)
    lengths = np.linalg.norm(x), np.linalg.norm(z)
    if min(lengths) < 1e-6 or not np.isfinite(corners).all():
        raise NoPlateError("its corners are no rectangle")
    x, z = x / lengths[0], z / lengths[1]
    return corners.mean(axis=0), np.column_stack([x, np.cross(z, x), z])


def _doubt_place(spot: np.ndarray, load: np.ndarray, half: np.ndarray, warnings: list[str]) -> None:
    pressed = np.abs(load) > PRESSED
    if not pressed.any():
        return
    off = (np.abs(spot[pressed, :2]) - half[:2]).max(axis=1)
    share = float((off > BESIDE).mean())
    if share > 0.1:
        warnings.append(
            f"its centre of pressure lies off the plate in {100.0 * share:.0f} % of its loaded samples, "
            f"by up to {1e3 * float(np.nanmax(off)):.0f} mm: its origin, corners or moments are doubtful"
        )

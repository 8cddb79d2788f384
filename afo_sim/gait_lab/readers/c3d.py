"""C3D files: markers and force plates."""

import math
import pathlib
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.common import InputError, Notice, plausible
from afo_sim.gait_lab.noted import note
from afo_sim.gait_lab.readers.c3d_file import C3dFile, read_c3d_file
from afo_sim.gait_lab.readers.markers import Markers, lost_as_nan, marker_set
from afo_sim.gait_lab.readers.plates import PRESSED, Plate, constant, offset_note, place_of, plate
from afo_sim.gait_lab.readers.signals import stretches
from afo_sim.gait_lab.readers.stated import read_stated
from afo_sim.gait_lab.readers.unit_checks import length_name, metres_of, unit_within

# Results of a model that Vicon stores as points; each of these parameters lists their names.
_RESULTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "REACTIONS", "SCALARS")

_CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}  # by type
_EDGES = (0.2, 6.0)  # of a plate or a treadmill's belt [m]; assumed
_ALIKE = 0.02  # difference of the two ends of a range that an overflow leaves (assumed) [-]
_BESIDE = 0.02  # distance from the plate at which a centre of pressure is off it [m]; assumed
_DEPTH = (0.002, 0.3)  # of a plate's origin below its surface [m]; assumed
_CLEAR = 0.25  # share of it below which all other steps, and of its rest that may be elsewhere [-]; assumed
_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class _DeclaredPlate:
    """A plate as the file declares it; the unit of length is the file's."""

    kind: int
    corners: np.ndarray  # (4, 3)
    origin: np.ndarray  # (3,)
    channels: np.ndarray  # (n, 6 or 8)
    calibration: np.ndarray | None  # (6, 6), of type 4
    moment_unit: str
    notices: list[Notice]


@np.errstate(invalid="ignore")  # a damaged number may be a NaN that signals
def read_c3d(path: pathlib.Path) -> tuple[Markers, list[Plate]]:
    """Read markers and force plates from a C3D file."""
    file = read_c3d_file(path)
    frames, samples, _ = file.words.shape
    rate, begin, count = file.layout.frame_rate, max(file.layout.first_frame - 1, 0), file.points.shape[1]
    names = (file.texts("POINT", "LABELS") + [""] * count)[:count]
    points = lost_as_nan(file.points)
    results = {name for kind in _RESULTS for name in file.texts("POINT", kind) if name}
    kept = [k for k, name in enumerate(names) if name not in results]
    time = (begin + np.arange(frames)) / rate
    stated, said = read_stated(file, time, names, points)
    names, points = [names[k] for k in kept], points[:, kept]
    stated_unit = length_name((file.texts("POINT", "UNITS") or [""])[0]) or "mm"  # C3D's own habit
    metre, unit = metres_of(path, "POINT:UNITS", stated_unit, points)
    analog_time = begin / rate + np.arange(frames * samples) / (rate * max(samples, 1))
    plates, left_out = _plates_of_c3d(path, file, analog_time, metre)
    notices = [*file.notices, *said, *unit, *left_out]
    if len(kept) < count:
        text = "{count} of its points are a model's results, no markers"
        notices.insert(0, note("points-are-results", text, count=count - len(kept)))
    return replace(marker_set(path, time, names, points * metre, notices), stated=stated), plates


def _plates_of_c3d(
    path: pathlib.Path, file: C3dFile, time: np.ndarray, metre: float
) -> tuple[list[Plate], list[Notice]]:
    """All plates that can be read, and warnings for those that cannot."""
    used = file.numbers("FORCE_PLATFORM", "USED")
    plates, left_out = [], []
    count = min(int(used[0]), 64) if len(used) and np.isfinite(used[0]) else 0
    if count < 1 and file.layout.channels:
        text = "none of its {channels} analog channels belongs to a plate (FORCE_PLATFORM:USED)"
        left_out.append(note("plate-left-out", text, channels=file.layout.channels))
    for k in range(count):
        name = str(k + 1)
        try:
            plates.append(_plate(path, name, _declared(file, k), time, metre))
        except InputError as error:
            text = "plate {subject} was left out: {why}"
            what = "a number of its channels" if error.field == "ANALOG" else error.field
            why = f"{what} {error.problem}" if error.problem.startswith("is not") else error.problem
            left_out.append(Notice("plate-left-out", text, subject=name, why=why))
    return plates, left_out


def _declared(file: C3dFile, k: int) -> _DeclaredPlate:
    kinds, corners, origins = (file.numbers("FORCE_PLATFORM", n) for n in ("TYPE", "CORNERS", "ORIGIN"))
    kind = int(np.nan_to_num(kinds[k])) if k < len(kinds) else 0
    if kind not in _CHANNELS:
        raise InputError(f"its type is {kind or 'not stated'}, and types 1 to 4 are read")
    if len(corners) < 12 * (k + 1):
        raise InputError("its corners are not in the file")
    channel = file.numbers("FORCE_PLATFORM", "CHANNEL")
    there = file.layout.channels
    rows = math.prod(file.groups["FORCE_PLATFORM"]["CHANNEL"].shape[:1]) if len(channel) else 0
    places = channel[rows * k : rows * (k + 1)][: _CHANNELS[kind]]
    if len(places) < _CHANNELS[kind] or not np.all((places >= 1) & (places <= there)):
        shown = ", ".join(f"{place:g}" for place in places) or "none"
        raise InputError(f"the file has {there} analog channels, not all of its own ({shown})")
    index = places.astype(int) - 1
    units = file.texts("ANALOG", "UNITS")
    matrix = file.numbers("FORCE_PLATFORM", "CAL_MATRIX")[36 * k :][:36] if kind == 4 else np.empty(0)
    calibrated = len(matrix) == 36 and np.any(matrix)
    channels, gains = file.analogs(index)
    channels = plausible(channels, field="ANALOG", missing=True)
    names = [*file.texts("ANALOG", "LABELS"), *[""] * there]
    named = [names[k] or str(k + 1) for k in index]
    overflowed = _mend_overflow(str(k + 1), named, channels, 2.0**16 * gains)
    return _DeclaredPlate(
        kind=kind,
        corners=corners[12 * k : 12 * k + 12].reshape(4, 3),
        origin=origins[3 * k : 3 * k + 3] if len(origins) >= 3 * k + 3 else np.zeros(3),
        channels=channels,
        calibration=matrix.reshape(6, 6, order="F") if calibrated else None,
        moment_unit=units[index[3]] if kind == 2 and index[3] < len(units) else "",
        notices=overflowed,
    )


def _mend_overflow(plate: str, names: list[str], channels: np.ndarray, turns: np.ndarray) -> list[Notice]:
    """Put channels that overflowed 16 bits together again, in place, where it is clear how they ran."""
    found = []
    for name, column, turn in zip(names, channels.T, np.abs(turns).tolist(), strict=True):
        jumps = int((np.abs(np.diff(column)) > 0.5 * turn).sum())
        if not jumps or not (1.0 - _CLEAR) * turn <= np.ptp(column) <= turn:
            found += _turned_over(plate, name, column)
            continue
        whole = np.unwrap(column, period=turn)
        level = np.floor(100.0 * (column - column.min()) / turn).astype(int)
        # at the commonest value, the unloaded plate's, it must be in one and the same turn
        rest = np.round((whole - column) / turn)[level == np.bincount(level).argmax()]
        clear = np.abs(np.diff(whole)).max() < _CLEAR * turn and np.mean(rest != np.median(rest)) < _CLEAR
        turned = stretches(np.round((whole - column) / turn) != np.median(rest))
        clear &= min((end - start for start, end in turned), default=2) > 1  # a sample alone is a dropout
        code, done = "plate-overflow", "its forces are doubtful"
        if clear:
            code, done = "plate-overflow-mended", "it was put together again"
            column[:] = whole - np.median(rest) * turn
        text = "plate {subject}: channel {channel} jumps {count} times by {turn:g}, as by an overflow: {done}"
        found.append(Notice(code, text, subject=plate, channel=name, count=jumps, turn=turn, done=done))
    return found


def _turned_over(plate: str, channel: str, column: np.ndarray) -> list[Notice]:
    """A warning where a channel goes from end to end of its range in a sample, ends alike but for sign."""
    # so does one that overflowed before somebody scaled it: it stays, since by how much is not known
    low, high = float(column.min()), float(column.max())
    over = int((np.abs(np.diff(column)) > (1.0 - _CLEAR) * (high - low)).sum())
    if not over or abs(high + low) > _ALIKE * (high - low):
        return []
    text = "plate {subject}: channel {channel} goes {count} times from {low:.4g} to {high:.4g} or back in a "
    text += "sample, as by an overflow: its forces are doubtful"
    return [Notice("plate-overflow", text, subject=plate, channel=channel, count=over, low=low, high=high)]


def _plate(path: pathlib.Path, name: str, declared: _DeclaredPlate, time: np.ndarray, metre: float) -> Plate:
    notices = declared.notices
    corners = declared.corners * _edge_unit(name, declared.corners, metre, notices)
    centre, turn = _frame(corners)
    half = np.abs((corners - centre) @ turn).max(axis=0)
    force, moment = _plate_loads(name, declared, metre, half, notices)
    if moment is None:  # type 1 has the centre of pressure itself
        rest = constant(time, force[:, 2], force)
        spot = np.column_stack([declared.channels[:, 3:5] * metre, np.zeros(len(force))])
        force = force - rest
    else:
        rest = constant(time, force[:, 2], np.column_stack([force, moment]))
        force, moment = force - rest[:3], moment - rest[3:]
        spot = place_of(force, moment, _Z, 0.0)
    if np.any(rest):
        notices.append(offset_note(name, rest[:3]))
    notices += _pressure_off_plate(name, spot, force[:, 2], half)
    found = plate(path, name, time, force @ turn.T, centre + spot @ turn.T)
    return Plate(name, time, found.force, found.place, corners, tuple(notices))


def _edge_unit(name: str, corners: np.ndarray, metre: float, notices: list[Notice]) -> float:
    """Metres in the corners' unit: the file's, unless no plate is of that size."""
    edge = float(np.linalg.norm(np.diff(corners, axis=0), axis=1).max())
    if not np.isfinite(edge) or edge == 0.0:
        raise InputError("its corners are all the same point")
    unit, factor = unit_within(edge, _EDGES)
    if not unit or _EDGES[0] <= edge * metre <= _EDGES[1]:
        return metre
    text = "plate {subject}: its edges are {edge:.3g} m long as stated; its corners were read as {unit}"
    notices.append(Notice("plate-corner-unit", text, subject=name, edge=edge * metre, unit=unit))
    return factor


def _frame(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The surface's centre (3,), and the plate's axes as columns in the laboratory (3, 3)."""
    first, second, third, fourth = corners
    x = first + fourth - second - third
    z = np.cross(x, first + second - third - fourth)
    lengths = np.linalg.norm(x), np.linalg.norm(z)
    if min(lengths) < 1e-6 or not np.isfinite(corners).all():
        raise InputError("its corners do not form a rectangle")
    x, z = x / lengths[0], z / lengths[1]
    return corners.mean(axis=0), np.column_stack([x, np.cross(z, x), z])


def _pressure_off_plate(name: str, spot: np.ndarray, load: np.ndarray, half: np.ndarray) -> list[Notice]:
    """A warning where the centre of pressure lies beside the plate too often."""
    pressed = np.abs(load) > PRESSED
    if not pressed.any():
        return []
    off = (np.abs(spot[pressed, :2]) - half[:2]).max(axis=1)
    share = float((off > _BESIDE).mean())
    if share <= 0.1:
        return []
    text = "plate {subject}: its centre of pressure lies off the plate in {percent:.0f} % of its loaded "
    text += "samples, by up to {off_mm:.0f} mm: its origin, corners or moments are doubtful"
    most = 1e3 * float(np.nanmax(off))
    return [Notice("plate-pressure-off", text, subject=name, percent=100.0 * share, off_mm=most)]


def _plate_loads(
    name: str, declared: _DeclaredPlate, metre: float, half: np.ndarray, notices: list[Notice]
) -> tuple[np.ndarray, np.ndarray | None]:
    """Force [N] and moment about the surface's centre [N·m] in the plate's axes, (n, 3) each."""
    channels = declared.channels
    if declared.kind == 1:
        return channels[:, :3], None
    origin = _origin(name, declared, metre, notices)
    if declared.kind == 3:  # four sensors at (±a, ±b), the first in the first quadrant
        a, b, depth = origin
        x12, x34, y14, y23, z1, z2, z3, z4 = channels.T
        force = np.column_stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4])
        about_x, about_y = b * (z1 + z2 - z3 - z4), a * (z2 + z3 - z1 - z4)
        moment = np.column_stack([about_x, about_y, b * (x34 - x12) + a * (y14 - y23)])
        return force, moment + np.cross(force, [0.0, 0.0, depth])
    if declared.kind == 4:
        if declared.calibration is None:
            text = "plate {subject}: has no calibration matrix; its channels were taken as N and moments"
            notices.append(Notice("plate-not-calibrated", text, subject=name))
        else:
            channels = channels @ declared.calibration.T
    force = channels[:, :3]
    scale, unit = _moment_scale(name, declared, metre, force, channels[:, 3:6], origin, half)
    notices += unit
    return force, scale * channels[:, 3:6] + np.cross(force, origin)


def _origin(name: str, declared: _DeclaredPlate, metre: float, notices: list[Notice]) -> np.ndarray:
    """From the sensors' origin to the surface's centre, in the plate's axes [m]; of type 3 half distances."""
    origin = np.where(np.isfinite(declared.origin), declared.origin, 0.0)
    depth = abs(origin[2]) * metre
    unit = metre
    tiny = depth * 1e3 < _DEPTH[0]  # which may be no depth but a mark
    if not tiny and not _DEPTH[0] <= depth <= _DEPTH[1]:
        read_as, factor = unit_within(abs(origin[2]), _DEPTH)
        unit = factor if read_as else metre
        text = "plate {subject}: its origin lies {depth:.3g} m deep"
        text += " as stated; it was read as {unit}" if read_as else ""
        notices.append(Notice("plate-origin-unit", text, subject=name, depth=depth, unit=read_as))
    if declared.kind == 3:
        if not np.all(origin[:2]):
            raise InputError("the distances of its sensors (ORIGIN) are 0")
        return np.array([abs(origin[0]), abs(origin[1]), -abs(origin[2])]) * unit
    if origin[2] > 0.0:
        up = "its ORIGIN points up from the sensors' side; the opposite was taken, as C3D has it"
        notices.append(note("plate-origin-turned", f"plate {{subject}}: {up}", subject=name))
        origin = -origin
    return np.asarray(origin * unit)


def _moment_scale(
    plate_name: str, declared: _DeclaredPlate, metre: float, force: np.ndarray, moment: np.ndarray,
    origin: np.ndarray, half: np.ndarray,
) -> tuple[float, list[Notice]]:  # fmt: skip
    """N·m in the moments' unit: the channel's, or N times the file's length, unless the pressure says no."""
    stated = metre
    name = declared.moment_unit.strip().lower().replace(" ", "")
    for words, factor in ((("nmm", "n*mm", "n.mm", "n-mm"), 1e-3), (("nm", "n*m", "n.m", "n-m"), 1.0)):
        stated = factor if name in words else stated
    pressed = np.abs(force[:, 2]) > PRESSED
    if not pressed.any():
        return stated, []

    def reach(about: np.ndarray) -> float:
        """How far from the middle these moments put the pressure; 1 is the plate's edge."""
        spot = place_of(force[pressed], about, _Z, 0.0)[:, :2] / np.maximum(half[:2], 1e-3)
        return float(np.nanquantile(np.abs(spot).max(axis=1), 0.9))

    def is_on(scale: float) -> bool:
        # a foot that crosses a plate does not stay within a hundredth of it
        about = scale * moment[pressed]
        return reach(about) >= 0.01 and reach(about + np.cross(force[pressed], origin)) <= 1.5

    others = [scale for scale in (1.0, 1e-3) if scale != stated and is_on(scale)]
    if is_on(stated) or len(others) != 1:
        return stated, []
    unit = {1.0: "N·m", 1e-3: "N·mm"}[others[0]]
    text = "plate {subject}: its centre of pressure reaches {times:.3g} times as far as its edge with "
    text += "moments in the stated unit; they were read as {unit}"
    times = reach(stated * moment[pressed])
    return others[0], [Notice("plate-moment-unit", text, subject=plate_name, times=times, unit=unit)]

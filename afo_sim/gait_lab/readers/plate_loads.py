"""A force plate's channels → its force and moment about the middle of its surface, by C3D's types 1 to 4."""

from dataclasses import dataclass

import numpy as np

from afo_sim.gait_lab.readers.length_unit import UNITS
from afo_sim.gait_lab.readers.plate_baseline import place_of
from afo_sim.gait_lab.readers.plates import PRESSED

DEPTH = (0.002, 0.3)  # of a plate's origin below its surface [m]; assumed
Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class DeclaredPlate:
    """A plate as the file declares it; the unit of length is the file's."""

    kind: int
    corners: np.ndarray  # (4, 3)
    origin: np.ndarray  # (3,)
    channels: np.ndarray  # (n, 6 or 8)
    calibration: np.ndarray | None  # (6, 6), of type 4
    moment_unit: str


class NoPlateError(Exception):
    """Why a plate cannot be read."""


def plate_loads(
    declared: DeclaredPlate, metre: float, half: np.ndarray, remarks: list[str], warnings: list[str]
) -> tuple[np.ndarray, np.ndarray | None]:
    """Force [N] and moment about the surface's centre [N·m] in the plate's axes, (n, 3) each."""
    channels = declared.channels
    if declared.kind == 1:
        return channels[:, :3], None
    origin = _origin(declared, metre, remarks, warnings)
    if declared.kind == 3:
        return _kistler(channels, origin)
    if declared.kind == 4:
        if declared.calibration is None:
            warnings.append("has no calibration matrix; its channels were taken as N and moments")
        else:
            channels = channels @ declared.calibration.T
    force = channels[:, :3]
    scale, told = _moment_scale(declared, metre, force, channels[:, 3:6], origin, half)
    warnings += told
    return force, scale * channels[:, 3:6] + np.cross(force, origin)


def _origin(declared: DeclaredPlate, metre: float, remarks: list[str], warnings: list[str]) -> np.ndarray:
    """From the sensors' origin to the surface's centre, in the plate's axes [m]; of type 3 half distances.

    The plate's z points down, so its third number is negative; where it is not, the opposite vector is
    meant (as Visual3D and ezc3d read it).
    """
    origin = np.where(np.isfinite(declared.origin), declared.origin, 0.0)
    depth = abs(origin[2]) * metre
    unit = metre
    if depth and not DEPTH[0] <= depth <= DEPTH[1]:
        fits = [(n, f) for n, f in UNITS.items() if DEPTH[0] <= abs(origin[2]) * f <= DEPTH[1]]
        if depth > DEPTH[1] or depth * 1e3 >= DEPTH[0]:  # a tiny number may be no depth but a mark
            if len(fits) == 1:
                unit = fits[0][1]
                warnings.append(f"its origin lies {depth:.3g} m deep as stated; it was read as {fits[0][0]}")
            else:
                warnings.append(f"its origin lies {depth:.3g} m deep")
    if declared.kind == 3:
        if not np.all(origin[:2]):
            raise NoPlateError("the distances of its sensors (ORIGIN) are 0")
        return np.array([abs(origin[0]), abs(origin[1]), -abs(origin[2])]) * unit
    if origin[2] > 0.0:
        remarks.append("its ORIGIN points up from the sensors' side; the opposite was taken, as C3D has it")
        origin = -origin
    return np.asarray(origin * unit)


def _kistler(channels: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Four sensors at (±a, ±b), the first in the first quadrant: Fx12 Fx34 Fy14 Fy23 Fz1 … Fz4 (type 3)."""
    a, b, depth = origin
    x12, x34, y14, y23, z1, z2, z3, z4 = channels.T
    force = np.column_stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4])
    moment = np.column_stack(
        [b * (z1 + z2 - z3 - z4), a * (z2 + z3 - z1 - z4), b * (x34 - x12) + a * (y14 - y23)]
    )
    return force, moment + np.cross(force, [0.0, 0.0, depth])


def _moment_scale(
    declared: DeclaredPlate,
    metre: float,
    force: np.ndarray,
    moment: np.ndarray,
    origin: np.ndarray,
    half: np.ndarray,
) -> tuple[float, list[str]]:
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
        spot = place_of(force[pressed], about, Z, 0.0)[:, :2] / np.maximum(half[:2], 1e-3)
        return float(np.nanquantile(np.abs(spot).max(axis=1), 0.9))

    def is_on(scale: float) -> bool:
        # a foot that crosses a plate does not stay within a hundredth of it
        about = scale * moment[pressed]
        return reach(about) >= 0.01 and reach(about + np.cross(force[pressed], origin)) <= 1.5

    others = [scale for scale in (1.0, 1e-3) if scale != stated and is_on(scale)]
    if is_on(stated) or len(others) != 1:
        return stated, []
    unit = {1.0: "N·m", 1e-3: "N·mm"}[others[0]]
    seen = f"its centre of pressure reaches {reach(stated * moment[pressed]):.3g} times as far as its edge"
    return others[0], [f"{seen} with moments in the stated unit; they were read as {unit}"]

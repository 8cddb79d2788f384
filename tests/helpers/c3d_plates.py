"""C3D files of a walker's markers and force plates of all types, written from a known force."""

import pathlib

import numpy as np
from c3d_bytes import C3dBytes

RATE, RATIO, FRAMES = 100.0, 10, 200
TIME = np.arange(FRAMES * RATIO) / (RATE * RATIO)
HALF = np.array([0.3, 0.2])  # of the plate, along its x and y [m]
CENTRE = np.array([0.5, 1.2, 0.01])
ORIGIN = np.array([0.001, -0.002, -0.04])  # from the sensors to the surface's middle, in the plate's axes
SENSORS = (0.25, 0.15)  # half distances of a type 3's [m]
SHARE = np.clip((TIME - 0.5) / 0.7, 0.0, 1.0)
STANCE = (TIME > 0.5) & (TIME < 1.2)


def turned(degrees: float) -> np.ndarray:
    """Axes of a plate in a floor, as columns: z down, x turned from the laboratory's."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x = np.array([c, s, 0.0])
    z = np.array([0.0, 0.0, -1.0])
    return np.column_stack([x, np.cross(z, x), z])


def pressed() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The foot's force on the plate [N], where [m], and the free moment [N·m], in the laboratory."""
    size = np.where(STANCE, 800.0 * np.sin(np.pi * SHARE), 0.0)
    force = np.column_stack([-0.15 * size * np.cos(np.pi * SHARE), 0.04 * size, -size])
    place = CENTRE + np.column_stack([0.1 * SHARE - 0.05, 0.24 * SHARE - 0.12, 0.0 * SHARE])
    return force, place, np.where(STANCE, 3.0, 0.0)


def channels(kind: int, turn: np.ndarray, origin: np.ndarray, unit: float) -> np.ndarray:
    """What the plate's amplifiers give (n, 6 or 8); moments in N times the unit of length."""
    force, place, free = pressed()
    own, arm = force @ turn, (place - CENTRE) @ turn
    twist = np.column_stack([0.0 * free, 0.0 * free, -free])
    if kind == 1:
        return np.column_stack([own, arm[:, :2] / unit, -free / unit])
    moment = np.cross(arm + origin, own) + twist  # about the sensors' origin
    if kind == 2:
        return np.column_stack([own, moment / unit])
    if kind == 4:
        return np.linalg.solve(matrix(), np.column_stack([own, moment / unit]).T).T
    # four sensors at (±a, ±b) below the middle, solved from force and moment, what is free shared evenly
    a, b = SENSORS
    moment = np.cross(arm + np.array([0.0, 0.0, origin[2]]), own) + twist
    rows = np.array([[1, 1, 1, 1], [b, b, -b, -b], [-a, a, a, -a], [1, -1, 1, -1]], dtype=float)
    upright = np.linalg.solve(rows, np.column_stack([own[:, 2], moment[:, :2], 0.0 * free]).T)
    along = np.array([[1, 1, 0, 0], [0, 0, 1, 1], [-b, b, a, -a], [a, -a, b, -b]], dtype=float)
    level = np.linalg.solve(along, np.column_stack([own[:, :2], moment[:, 2], 0.0 * free]).T)
    return np.vstack([level, upright]).T


def matrix() -> np.ndarray:
    """A calibration with crosstalk, unlike its transpose."""
    return np.diag([2.0, 2.5, 4.0, 900.0, 600.0, 400.0]) + np.triu(np.full((6, 6), 0.03), 1)


def write(
    path: pathlib.Path,
    signals: list[np.ndarray],
    kinds: list[int],
    turns: list[np.ndarray],
    *,
    unit: str = "mm",
    metre: float | None = None,
    origin: np.ndarray | None = None,
    moments: str = "",
    first: int = 0,
    labels: list[str] | None = None,
    points: np.ndarray | None = None,
    change=lambda file: None,
) -> pathlib.Path:
    """A file with a walker's markers and plates side by side in the analog channels."""
    metre = metre or {"mm": 1e-3, "cm": 1e-2, "m": 1.0}[unit]
    names = labels if labels is not None else ["C7", "RASI", "LASI", "RANK", "RHEE"]
    file = C3dBytes(RATE, (walker(len(names)) if points is None else points) / metre, first=first + 1)
    file.analogs = np.hstack([*signals, np.zeros((len(TIME), 0))])
    count = file.analogs.shape[1]
    file.parameters = {"POINT": {"LABELS": names, "UNITS": [unit]}}
    units = [u for s in signals for u in (["N"] * 3 + [moments] * 3 + ["N"] * 8)[: s.shape[1]]]
    file.add_parameter("ANALOG", "UNITS", units if moments else [""] * count)
    if signals:
        corner = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * HALF
        corners = [CENTRE + corner @ turn[:, :2].T for turn in turns]
        origins = [
            (ORIGIN if kind != 3 else np.array([*SENSORS, ORIGIN[2]])) if origin is None else origin
            for kind in kinds
        ]
        file.add_parameter("FORCE_PLATFORM", "CORNERS", np.stack([c.T for c in corners], axis=2) / metre)
        file.add_parameter("FORCE_PLATFORM", "ORIGIN", np.column_stack(origins) / metre)
        file.add_parameter("FORCE_PLATFORM", "CAL_MATRIX", np.stack([matrix()] * len(kinds), axis=2))
        place = np.full((max(signal.shape[1] for signal in signals), len(signals)), 0)
        start = 1
        for k, signal in enumerate(signals):
            place[: signal.shape[1], k] = np.arange(start, start + signal.shape[1])
            start += signal.shape[1]
        for name, numbers in {"USED": [len(kinds)], "TYPE": kinds, "ZERO": [1, 0], "CHANNEL": place}.items():
            file.add_parameter("FORCE_PLATFORM", name, np.array(numbers))
    change(file)
    return file.write(path)


def walker(count: int) -> np.ndarray:
    """Markers from neck to heel at 1.2 m/s [m] (frames, count, 3)."""
    time = np.arange(FRAMES) / RATE
    found = np.full((FRAMES, count, 3), 0.1)
    found[:, :, 1] = 1.2 * time[:, None] + 0.01
    found[:, :, 2] = np.linspace(1.45, 0.05, count)
    return found

"""C3D files with force plates of type 1 to 4, as the format's user guide (c3d.org) defines their channels."""

import pathlib
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from c3d_bytes import C3dBytes
from gait_lab.laboratory import Recorded
from gait_lab.trial_files import METRE

DEPTH = 0.040  # of the plate's own origin below its surface [m]
SENSOR = (0.12, 0.20)  # of a type-3 plate's sensors from its middle [m]


def write_c3d(
    path: pathlib.Path,
    time: np.ndarray,
    points: Mapping[str, np.ndarray],
    plates: Sequence[Recorded],
    kind: int = 2,
    unit: str = "mm",
    first_frame: int = 1,
    change: Callable[[C3dBytes], None] = lambda _: None,
) -> pathlib.Path:
    """Markers, and plates that hold the foot's force on them in their own axes, z into the floor."""
    rate = 1.0 / (time[1] - time[0])
    places = METRE[unit] * np.stack([*points.values()], axis=1) if points else np.zeros((len(time), 0, 3))
    file = C3dBytes(float(rate), places, first=first_frame)
    file.parameters = {"POINT": {"LABELS": list(points), "UNITS": [unit]}}
    if plates:
        length = METRE[unit]
        made = [_channels(plate, kind, length) for plate in plates]
        count = len(made[0][0])
        file.add_parameter("ANALOG", "LABELS", [f"C{j}P{k}" for k in range(len(made)) for j in range(count)])
        file.analogs = np.vstack([channels for channels, *_ in made]).T
        corners = np.stack([length * plate.corners.T for plate in plates], axis=-1)
        file.add_parameter("FORCE_PLATFORM", "CORNERS", corners)
        file.add_parameter("FORCE_PLATFORM", "ORIGIN", np.stack([origin for _, origin, _ in made], axis=-1))
        if kind == 4:
            matrices = np.stack([matrix for *_, matrix in made], axis=-1)
            file.add_parameter("FORCE_PLATFORM", "CAL_MATRIX", matrices)
        channel = np.arange(1, count * len(made) + 1).reshape(len(made), count).T
        whole = {"USED": [len(made)], "TYPE": [kind] * len(made), "ZERO": [1, 0], "CHANNEL": channel}
        for name, numbers in whole.items():
            file.add_parameter("FORCE_PLATFORM", name, np.array(numbers))
    change(file)
    return file.write(path)


def plate_axes(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle (3,), and columns x, y, z (3, 3): x from corner 2 to 1, y from 4 to 1, z into the floor."""
    x = corners[0] - corners[1]
    y = corners[0] - corners[3]
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    return corners.mean(axis=0), np.column_stack([x, y, np.cross(x, y)])


def _channels(plate: Recorded, kind: int, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    middle, axes = plate_axes(plate.corners)
    assert np.allclose(axes.T @ axes, np.eye(3))
    push = -plate.force @ axes  # of the foot on the plate
    arm = (plate.place - middle) @ axes
    arm[np.linalg.norm(push, axis=1) < 1.0] = 0.0
    below = np.array([0.0, 0.0, DEPTH])
    none = np.zeros((6, 6))
    if kind == 1:
        # Without a free moment about the centre of pressure.
        channels = np.column_stack([push, length * arm[:, :2], 0.0 * push[:, 2]])
        return channels.T, np.zeros(3), none
    moment = length * np.cross(arm - below, push)  # about the plate's own origin
    if kind in (2, 4):
        six = np.hstack([push, moment])
        origin = -length * below  # the surface's middle, from the plate's own origin
        if kind == 2:
            return six.T, origin, none
        rng = np.random.default_rng(3)
        matrix = np.diag([500.0, 500.0, 1000.0, 2e5, 2e5, 1e5]) @ (
            np.eye(6) + 0.02 * rng.standard_normal((6, 6))
        )
        return np.linalg.solve(matrix, six.T), origin, matrix
    a, b = (length * s for s in SENSOR)
    # x12, x34, y14, y23, z1, z2, z3, z4 → Fx, Fy, Fz, Mx, My, Mz; sensors in the quadrants 1 to 4.
    sums = np.array(
        [
            [1, 1, 0, 0, 0, 0, 0, 0],
            [0, 0, 1, 1, 0, 0, 0, 0],
            [0, 0, 0, 0, 1, 1, 1, 1],
            [0, 0, 0, 0, b, b, -b, -b],
            [0, 0, 0, 0, -a, a, a, -a],
            [-b, b, a, -a, 0, 0, 0, 0],
        ],
        dtype=float,
    )
    eight = np.linalg.pinv(sums) @ np.hstack([push, moment]).T
    return eight, np.array([a, b, -length * DEPTH]), none

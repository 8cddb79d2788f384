"""Points of a responding walker over its walk, for film and viewer."""

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np

from afo_sim.model import ANKLE, POINTS, SOLE
from afo_sim.show.moving_parts import joint_columns, padded
from afo_sim.show.walking_figure import HEAD, TRUNK
from afo_sim.walker import SIDES, Case

JOINTS = ("hip", "knee", ANKLE)
_NAMES = {"right": SIDES[0], "left": SIDES[1]}  # what the model's names of a leg begin with


@dataclass(frozen=True)
class Poses:
    """A walker at some rows, x forward, y left, z up [m].

    trunk : hip, neck and middle of the head (n, 3, 3)
    legs : hip, knee, ankle, heel, ball, pulp, tip of "right" and "left" (n, 7, 3)
    muscles : of the device, from origin to insertion, each (n, places, 3)
    """

    trunk: np.ndarray
    legs: dict[str, np.ndarray]
    muscles: dict[str, np.ndarray]


def coordinates(case: Case) -> dict[str, np.ndarray]:
    """The columns of a walk by the names of the model's coordinates, qpos/… and time."""
    found = {"time": case.walked["time"]}
    for column in joint_columns(case.walked.body.model):
        name = column.removeprefix("qpos/")
        side = "left" if name.startswith(_NAMES["left"]) else "right"
        root = f"trunk/{name}"
        own = f"{side}/{name.removeprefix(_NAMES['left'])}"
        found[column] = case.walked[root if root in case.walked.columns else own]
    return found


def poses(case: Case, rows: Iterable[int]) -> Poses:
    """A walker at rows of its walk."""
    body, kept = case.walked.body, coordinates(case)
    model, names = body.model, [f"qpos/{body.model.joint(j).name}" for j in range(body.model.njnt)]
    data = mujoco.MjData(model)
    device = [model.tendon(name).id for name in (body.ids.muscles if body.ids else ())]
    hips = [model.joint(f"{_NAMES[side]}hip").id for side in _NAMES]
    height = 1.75 * body.size.taller
    trunk, legs, paths = [], {side: [] for side in _NAMES}, [[] for _ in device]  # type: ignore[var-annotated]
    for row in rows:
        data.qpos[model.jnt_qposadr] = [kept[name][row] for name in names]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        hip, up = data.xanchor[hips].mean(axis=0), data.xmat[model.body("trunk").id].reshape(3, 3)[:, 2]
        trunk.append([hip, hip + TRUNK * height * up, hip + (TRUNK + HEAD) * height * up])
        for side, prefix in _NAMES.items():
            joints = [data.xanchor[model.joint(f"{prefix}{name}").id] for name in JOINTS]
            sole = [data.site(f"{prefix}{SOLE}{point}").xpos for point in POINTS]
            legs[side].append(np.array([*joints, *sole]))
        points = data.wrap_xpos.reshape(-1, 3)
        for path, tendon in zip(paths, device, strict=True):
            first, count = data.ten_wrapadr[tendon], data.ten_wrapnum[tendon]
            path.append(points[first : first + count].copy())
    muscles = {
        model.tendon(tendon).name: padded(path) for tendon, path in zip(device, paths, strict=True) if path
    }
    return Poses(np.array(trunk), {side: np.array(points) for side, points in legs.items()}, muscles)

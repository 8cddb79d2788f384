"""Lines of a responding walker over its walk, for film and viewer."""

from collections.abc import Iterable

import mujoco
import numpy as np

from afo_sim.model import ANKLE, POINTS, SOLE
from afo_sim.show.moving_parts import Mountings, joint_columns, padded
from afo_sim.show.walking_figure import HEAD, TRUNK
from afo_sim.walker import ROOT, SIDES, Case

_SIDES = dict(zip(("left", "right"), reversed(SIDES), strict=True))  # what the model's names begin with


def coordinates(case: Case) -> dict[str, np.ndarray]:
    """The columns of a walk by the names of the model's coordinates, qpos/… and time."""
    found, kept = {"time": case.walked["time"]}, case.walked.columns
    for column in joint_columns(case.walked.body.model):
        name = column.removeprefix("qpos/")
        own = name.replace("left_", "left/") if name.startswith("left_") else f"right/{name}"
        found[column] = kept[f"trunk/{name}" if name in ROOT else own]
    return found


def poses(case: Case, rows: Iterable[int]) -> dict[str, np.ndarray]:
    """A walker's lines at some rows, each (n, places, 3), x forward, y left, z up [m]."""
    body, kept = case.walked.body, coordinates(case)
    model = body.model
    data, moved, trunk = mujoco.MjData(model), Mountings(model, {}, ()), model.body("trunk").id
    up = 1.75 * body.size.taller * np.array([[0.0], [TRUNK], [TRUNK + HEAD]])
    found: dict[str, list[np.ndarray]] = {}
    for row in rows:
        moved.pose(data, lambda name, row=row: float(kept[name][row]))  # type: ignore[misc]
        legs = {}
        for side, prefix in _SIDES.items():
            joints = [data.xanchor[model.joint(f"{prefix}{name}").id] for name in ("hip", "knee", ANKLE)]
            sole = [data.site(f"{prefix}{SOLE}{point}").xpos for point in POINTS]
            legs[side] = np.array([*joints, *sole, joints[-1]])
        hip = 0.5 * (legs["left"][0] + legs["right"][0])
        now = {"left": legs["left"], "trunk": hip + up * data.xmat[trunk][2::3], "right": legs["right"]}
        points = data.wrap_xpos.reshape(-1, 3)
        for name in body.ids.muscles if body.ids else ():
            tendon = model.tendon(name).id
            first = data.ten_wrapadr[tendon]
            now[name] = points[first : first + data.ten_wrapnum[tendon]].copy()
        for name, line in now.items():
            found.setdefault(name, []).append(line)
    return {name: padded(lines) for name, lines in found.items()}

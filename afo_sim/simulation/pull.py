"""Pull of the muscles on the segments that carry them: on the shank's cuff and on the foot's plate."""

from collections.abc import Mapping

import numpy as np

from afo_sim.description.orthosis import Orthosis, Segment
from afo_sim.model.mounting import muscle_names
from afo_sim.model.tendons import side

LEFT = 1  # place in forward, left, up


def pull_on(orthosis: Orthosis, columns: Mapping[str, np.ndarray], segment: Segment) -> np.ndarray:
    """Force of all muscles between two anchors on one segment, in its own axes.

    A muscle's tension F acts on the shank along its path, F (f − s)/|f − s|. There s is its end on the shank,
    and f its end on the foot, turned by the ankle's angle. On the foot acts the same force the other way.
    Cuff and plate have no mass here: what the muscles do to them, they do to the skin.

    Parameters
    ----------
    orthosis : with its anchors
    columns : with ankle/angle [rad] and muscle/*/force [N] (n,)
    segment : "shank" or "foot"

    Returns
    -------
    Force forward, left and up [N] (n, 3); zero where all muscles run over pulleys.
    """
    angle = columns["ankle/angle"]
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = sine if segment == "shank" else -sine  # of the other segment in this one's axes: the foot, toe up
    total = np.zeros((3, len(angle)))
    for name, group in muscle_names(orthosis).items():
        if group.origin is None or group.insertion is None:
            continue
        ends: dict[Segment, np.ndarray] = {}
        for anchor in (group.origin, group.insertion):
            ends[anchor.segment] = np.array(anchor.from_ankle)
            ends[anchor.segment][LEFT] += side(name, group) * anchor.spacing
        x, y, z = ends["foot" if segment == "shank" else "shank"]
        forward, left, up = ends[segment]
        path = x * cosine - z * turn - forward, y - left, x * turn + z * cosine - up
        over_length = columns[f"muscle/{name}/force"] / np.sqrt(path[0] ** 2 + path[1] ** 2 + path[2] ** 2)
        for axis, along in enumerate(path):
            total[axis] += along * over_length
    return total.T

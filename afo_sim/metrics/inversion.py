"""Moments of an orthosis that turn the foot to its sides."""

from typing import Protocol

import numpy as np

from afo_sim.metrics import peak
from afo_sim.metrics.metric import TORQUE, Found, tells
from afo_sim.metrics.strides import Stride

COLUMN = "ankle/moment/inversion"
MEANING = "of the muscles on the foot, about the forward axis through the ankle"


class Rows(Protocol):
    """Columns of a recording, or of a stride of it, by name; KeyError of what there is not."""

    def __getitem__(self, column: str, /) -> np.ndarray: ...


@tells(
    TORQUE,
    *peak.rows("peak_inversion_moment", "Inversion moment", MEANING),
    *peak.rows("peak_eversion_moment", "Eversion moment", MEANING),
)
def inversion(stride: Stride) -> Found:
    """Greatest moments to the inside and to the outside in a stride, positive numbers."""
    return inversion_peaks(stride, stride.timestep)


def inversion_peaks(rows: Rows, timestep: float) -> Found:
    """Greatest moments to the inside and to the outside, positive numbers; none without such a column.

    Units: timestep [s].
    """
    try:
        moment = rows[COLUMN]
    except KeyError:
        return
    yield from peak.told("peak_inversion_moment", moment, timestep)
    yield from peak.told("peak_eversion_moment", 0.0 - moment, timestep)

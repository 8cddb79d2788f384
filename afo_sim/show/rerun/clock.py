"""Timelines: every row is logged in seconds and, in walking, in strides."""

from typing import Any

import numpy as np
import rerun as rr

from afo_sim.show.rerun.source import Columns

TIMELINE = "sim_time"
STRIDES = "strides"  # 1 s on it is one stride: runs of different cadence line up, stride for stride
GAIT = ("gait/stride", "gait/phase")
ANGLE = "ankle_angle_deg"  # timeline of a design: whole degrees
SWEPT = "ankle/swept"  # its column


def stamps(time: np.ndarray) -> np.ndarray:
    """Times [s] on a timeline's grid of nanoseconds."""
    return np.round(time * 1e9).astype(np.int64).astype("timedelta64[ns]")


def strides(rows: Columns) -> np.ndarray:
    """Strides since the first heel strike of rows of walking [-] (n,)."""
    return rows["gait/stride"] + rows["gait/phase"]


def send(stream: rr.RecordingStream, entity: str, rows: Columns, columns: Any) -> None:
    """Log columns at the times of some rows.

    Units: rows [s] (n,).
    """
    times = [rr.TimeColumn(TIMELINE, duration=stamps(rows["time"]))]
    if GAIT[0] in rows:
        times.append(rr.TimeColumn(STRIDES, duration=stamps(strides(rows))))
    if SWEPT in rows:
        times.append(rr.TimeColumn(ANGLE, sequence=np.round(rows[SWEPT]).astype(np.int64)))
    stream.send_columns(entity, times, columns)

"""A recording of walking that is written down, not simulated: every number about it is known."""

import numpy as np

MASS, STRIDE, STEP = 80.0, 1.25, 1e-3
TOE_OFF = 0.6
AMPLITUDE = np.radians(12.0)
OMEGA = 2.0 * np.pi / STRIDE
SHANK = np.radians(-15.0)


def walk_columns(strides: float = 4.2, step: float = STEP, start: float = 0.0) -> dict[str, np.ndarray]:
    """An ankle that swings as a sine, 600 N on the ground until 60 % of each stride; no orthosis.

    The recorded ankle is 3 degrees below, its moment in step with its velocity. The toe dips twice in swing,
    to 10 mm; the ball rises evenly by 40 mm.
    """
    time = np.arange(round(strides * STRIDE / step)) * step
    way = start + time / STRIDE
    phase = way % 1.0
    swing = np.clip((phase - TOE_OFF) / (1.0 - TOE_OFF), 0.0, 1.0)
    turn = 2.0 * np.pi * way
    velocity = AMPLITUDE * OMEGA * np.cos(turn)
    toe = 0.02 + 0.01 * np.cos(4.0 * np.pi * swing)
    return {
        "time": time,
        "gait/phase": phase,
        "gait/stride": np.floor(way),
        "ankle/angle": AMPLITUDE * np.sin(turn),
        "ankle/velocity": velocity,
        "ankle/moment/orthosis": np.zeros_like(time),
        "ankle/moment/passive": np.zeros_like(time),
        "ankle/moment/biological": 20.0 * velocity,
        "shank/angle": np.full_like(time, SHANK),
        "ground/force/z": np.where(phase < TOE_OFF, 600.0, 0.0),
        "toe/height": toe,
        "gait/toe_height": toe + 0.004,
        "ball/height": 0.04 * swing,
        "gait/ball_height": 0.04 * swing,
        "gait/ankle_angle": AMPLITUDE * np.sin(turn) - np.radians(3.0),
        "gait/ankle_moment": 20.0 * velocity,
        "gait/needed_moment": np.where(phase < TOE_OFF, 0.0, 4.0),
    }


def with_orthosis(columns: dict[str, np.ndarray], torque: np.ndarray) -> dict[str, np.ndarray]:
    """The same with one chamber: 2 g/s through its inlet in swing, 3 bar then and 0.5 bar in stance."""
    swing = columns["gait/phase"] >= TOE_OFF
    blank = np.zeros_like(torque)
    return columns | {
        "ankle/moment/orthosis": torque,
        "muscle/front_1/force": blank,
        "chamber/front/mass": blank,
        "chamber/front/pressure": np.where(swing, 3e5, 0.5e5),
        "valve/front_inlet/mass_flow": np.where(swing, 2e-3, -1e-3),
        "valve/front_inlet/opening": np.where(swing, 1.0, 0.0),
        "valve/front_outlet/opening": np.where(swing, 0.0, 1.0),
        "supply/pressure": np.full_like(torque, 4e5),
    }

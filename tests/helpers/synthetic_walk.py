"""A recording of walking that is written down, not simulated: every number about it is known."""

import numpy as np

MASS, STRIDE, STEP = 80.0, 1.25, 1e-3
TOE_OFF = 0.6
AMPLITUDE = np.radians(12.0)
OMEGA = 2.0 * np.pi / STRIDE
SHANK = np.radians(-15.0)  # at heel strike
UPRIGHT = 0.9  # phase at which the shank leans back past the vertical
STRIDE_LENGTH = 1.25  # [m]


def walk_columns(strides: float = 4.2, step: float = STEP, start: float = 0.0) -> dict[str, np.ndarray]:
    """An ankle that swings as a sine, 600 N on the ground until 60 % of each stride; no orthosis.

    The recorded ankle is 3 degrees below, its moment in step with its velocity. The toe dips twice in swing,
    at 70 and 90 % of the stride, to 10 mm; it is the lowest point of the outsole. The ball rises evenly by
    40 mm. The foot stands in stance and is fast from 67.5 to 92.5 %, fastest at 80 %. The shank leans
    forward by 60 degrees in stance and back in swing.
    """
    time = np.arange(round(strides * STRIDE / step)) * step
    way = start + time / STRIDE
    phase = way % 1.0
    swing = np.clip((phase - TOE_OFF) / (1.0 - TOE_OFF), 0.0, 1.0)
    turn = 2.0 * np.pi * way
    velocity = AMPLITUDE * OMEGA * np.cos(turn)
    toe = 0.02 + 0.01 * np.cos(4.0 * np.pi * swing)
    moved = np.floor(way) + swing - np.sin(2.0 * np.pi * swing) / (2.0 * np.pi)
    return {
        "time": time,
        "gait/phase": phase,
        "gait/stride": np.floor(way),
        "ankle/angle": AMPLITUDE * np.sin(turn),
        "ankle/velocity": velocity,
        "ankle/moment/orthosis": np.zeros_like(time),
        "ankle/moment/passive": np.zeros_like(time),
        "ankle/moment/biological": 20.0 * velocity,
        "shank/angle": np.interp(phase, [0.0, TOE_OFF, 1.0], SHANK + np.radians([0.0, 60.0, 0.0])),
        "ground/force/z": np.where(phase < TOE_OFF, 600.0, 0.0),
        "toe/height": toe,
        "gait/toe_height": toe + 0.004,
        "sole/height": toe,
        "gait/sole_height": toe + 0.004,
        "ankle/position/x": STRIDE_LENGTH * moved,
        "ball/height": 0.04 * swing,
        "gait/ball_height": 0.04 * swing,
        "gait/ankle_angle": AMPLITUDE * np.sin(turn) - np.radians(3.0),
        "gait/ankle_moment": 20.0 * velocity,
        "gait/needed_moment": np.where(
            phase < TOE_OFF - 1.5 * STEP / STRIDE, 0.0, 4.0
        ),  # from the row before
        "gait/passive_moment": np.where(phase < TOE_OFF - 1.5 * STEP / STRIDE, 0.0, -2.5),
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
        "valve/front_inlet/coil": np.where(swing, 1.0, 0.0),
        "valve/front_inlet/opening": np.where(swing, 1.0, 0.0),
        "valve/front_outlet/opening": np.where(swing, 0.0, 1.0),
        "supply/pressure": np.full_like(torque, 4e5),
        "supply/exergy_flow": np.where(swing, 2e-3 * 135.6e3, 0.0),
        "exhaust/exergy_flow": np.where(swing, 0.0, 100.0),
    }

"""physics → MuJoCo's actuator callbacks: parameter slots, compiled functions, and their installation."""

from afo_sim.native.install import KernelFailure, Mode, assert_live, assert_rows, installed
from afo_sim.native.slots import (
    FLOWS_PER_CHAMBER,
    MUSCLE_CHAMBER,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_SERIES_LENGTH,
    N_USER,
    chamber_row,
    friction_row,
    motor_row,
    muscle_row,
    pad_row,
    passive_row,
    spastic_row,
    valve_row,
)

__all__ = [
    "FLOWS_PER_CHAMBER",
    "MUSCLE_CHAMBER",
    "MUSCLE_NOMINAL_LENGTH",
    "MUSCLE_SERIES_LENGTH",
    "N_USER",
    "KernelFailure",
    "Mode",
    "assert_live",
    "assert_rows",
    "chamber_row",
    "friction_row",
    "installed",
    "motor_row",
    "muscle_row",
    "pad_row",
    "passive_row",
    "spastic_row",
    "valve_row",
]

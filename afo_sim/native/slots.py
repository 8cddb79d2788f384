"""Slots of the parameters in `actuator_user`, and the rows that hold them.

An actuator's row begins with a mark and a kind. Nothing outside this package writes a row; the slots are
read by name.
"""

from collections.abc import Sequence

import numpy as np

from afo_sim.physics.friction.law import MAX_FRICTION_COEFFICIENTS
from afo_sim.physics.hill import DAMPER_COEFFICIENTS
from afo_sim.physics.law import MAX_COEFFICIENTS, Braid
from afo_sim.physics.laws import LAWS

MARK = 2826.0  # tells this project's actuators from anybody else's

KIND_MUSCLE, KIND_CHAMBER, KIND_VALVE, KIND_PASSIVE, KIND_FRICTION = 1.0, 2.0, 3.0, 4.0, 5.0
KIND_MOTOR, KIND_SPASTIC, KIND_PAD = 6.0, 7.0, 8.0


# Places of the parameters within their actuator's row (after the mark and the kind)
(
    MUSCLE_LAW,
    MUSCLE_CHAMBER,
    MUSCLE_NEXT,
    MUSCLE_SERIES_LENGTH,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_NOMINAL_RADIUS,
    MUSCLE_B,
    MUSCLE_DAMPING,
    MUSCLE_BRAID_STIFFNESS,
    MUSCLE_DEAD_VOLUME,
    MUSCLE_IMPLICIT_COUNT,
    MUSCLE_LOWEST_PRESSURE,
    MUSCLE_FRICTION,
    MUSCLE_FRICTION_STATES,
) = range(2, 16)
MUSCLE_FRICTION_COEFFICIENTS = MUSCLE_FRICTION_STATES + 1
MUSCLE_DAMPER = MUSCLE_FRICTION_COEFFICIENTS + MAX_FRICTION_COEFFICIENTS
MUSCLE_COEFFICIENTS = MUSCLE_DAMPER + DAMPER_COEFFICIENTS
(
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_INLET,
    CHAMBER_OUTLET,
    CHAMBER_TUBE_VOLUME,
    CHAMBER_WALL_CONDUCTANCE,
    CHAMBER_USERDATA,
) = range(2, 8)
VALVE_CONDUCTANCE, VALVE_CRITICAL_RATIO, VALVE_OPENING_DELAY, VALVE_CLOSING_DELAY = range(2, 6)
PASSIVE_SCALE, PASSIVE_OFFSET, PASSIVE_LOAD = range(2, 5)
FRICTION_MUSCLE = 2
SPASTIC_GAIN = 2
PAD_STIFFNESS, PAD_DAMPING, PAD_FLOOR = range(2, 5)
N_USER = MUSCLE_COEFFICIENTS + MAX_COEFFICIENTS  # slots per actuator


def muscle_row(
    *,
    law: str,
    coefficients: Sequence[float],
    lowest_pressure: float,
    braid: Braid,
    series_length: float,
    damping: float,
    braid_stiffness: float,
    dead_volume: float,
    chamber: int,
    next_muscle: int,
    implicit_count: int = 1,
    damper: Sequence[float] = (),
    friction: int = 0,
    friction_coefficients: Sequence[float] = (),
    friction_states: int = -1,
) -> np.ndarray:
    """`actuator_user` of a muscle.

    Parameters
    ----------
    law, coefficients : name of a force law, and its kernel's coefficients
    lowest_pressure : gauge, of the law's range [Pa]
    braid : geometry
    series_length : all of the tendon that does not contract [m]
    damping : Hill damping over absolute pressure, R in F_d = R p κ̇ [N·s/Pa]
    braid_stiffness : [N] per unit of stretch
    dead_volume : [m³]
    chamber, next_muscle : actuator ids; −1 for no next muscle of the chamber
    implicit_count : parallel muscles whose damping this one's gain carries: all for a group's first, else 0
    damper : coefficients of a three-element damper
    friction, friction_coefficients : native id of a friction, 0 for none, and its kernel's coefficients
    friction_states : actuator id of the states of friction; −1 for none

    Returns
    -------
    (N_USER,)
    """
    row = _row(
        KIND_MUSCLE,
        LAWS[law].native_id,
        chamber,
        next_muscle,
        series_length,
        braid.nominal_length,
        braid.nominal_radius,
        braid.b,
        damping,
        braid_stiffness,
        dead_volume,
        implicit_count,
        lowest_pressure,
        friction,
        friction_states,
    )
    first = MUSCLE_FRICTION_COEFFICIENTS
    row[first : first + len(friction_coefficients)] = friction_coefficients
    row[MUSCLE_DAMPER : MUSCLE_DAMPER + len(damper)] = damper
    row[MUSCLE_COEFFICIENTS : MUSCLE_COEFFICIENTS + len(coefficients)] = coefficients
    return row


def chamber_row(
    *,
    first_muscle: int,
    inlet: int,
    outlet: int,
    tube_volume: float,
    wall_conductance: float,
    userdata: int,
) -> np.ndarray:
    """`actuator_user` of a chamber.

    Parameters
    ----------
    first_muscle, inlet, outlet : actuator ids
    tube_volume : [m³]
    wall_conductance : heat to the wall [W/K]
    userdata : first place of its flows in `userdata`
    """
    return _row(KIND_CHAMBER, first_muscle, inlet, outlet, tube_volume, wall_conductance, userdata)


def valve_row(
    *, conductance: float, critical_ratio: float, opening_delay: float, closing_delay: float
) -> np.ndarray:
    """`actuator_user` of a solenoid valve: C [m³/(s·Pa)], b [-], dead times [s]."""
    return _row(KIND_VALVE, conductance, critical_ratio, opening_delay, closing_delay)


def passive_row(*, scale: float, offset: float, load: float = 0.0) -> np.ndarray:
    """`actuator_user` of the passive ankle: scale [-], offset [rad], load against positive angles [N·m]."""
    return _row(KIND_PASSIVE, scale, offset, load)


def friction_row(*, muscle: int) -> np.ndarray:
    """`actuator_user` of what holds the states of a muscle's friction."""
    return _row(KIND_FRICTION, muscle)


def motor_row() -> np.ndarray:
    """`actuator_user` of MuJoCo's own motor, which needs no callback."""
    return _row(KIND_MOTOR)


def spastic_row(*, gain: float) -> np.ndarray:
    """`actuator_user` of the plantarflexors' stretch reflex; gain [N·m·s/rad]."""
    return _row(KIND_SPASTIC, gain)


def pad_row(*, stiffness: float, damping: float, floor: int) -> np.ndarray:
    """`actuator_user` of a pad under the sole.

    Parameters
    ----------
    stiffness, damping : [N/m], [s/m]
    floor : id of the actuator whose input is the floor's height [m]
    """
    return _row(KIND_PAD, stiffness, damping, floor)


def _row(kind: float, *values: float) -> np.ndarray:
    row = np.zeros(N_USER)
    row[: 2 + len(values)] = MARK, kind, *values
    return row

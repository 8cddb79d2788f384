"""Slots of the parameters in `actuator_user`, and the rows that hold them.

An actuator's row begins with a mark and a kind. Nothing outside this package writes a row; the slots are
read by name.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from afo_sim.common.units import GAS_CONSTANT, HEAT_CAPACITY_RATIO
from afo_sim.physics.friction.law import MAX_FRICTION_COEFFICIENTS
from afo_sim.physics.law import MAX_COEFFICIENTS, Braid
from afo_sim.physics.laws import LAWS
from afo_sim.physics.static_force import DAMPER_COEFFICIENTS

RIGID = 1e6  # stiffness of a cable that is called rigid [N/m]: 0.5 mm at 500 N
MARK = 2831.0  # tells this project's actuators from anybody else's; another number where the slots move

KIND_MUSCLE, KIND_CHAMBER, KIND_VALVE, KIND_PASSIVE, KIND_FRICTION = 1.0, 2.0, 3.0, 4.0, 5.0
KIND_MOTOR, KIND_SPASTIC, KIND_PAD, KIND_NETWORK, KIND_DRIVE = 6.0, 7.0, 8.0, 9.0, 10.0
KIND_VOLUME, KIND_STORE, KIND_RESTRICTION = 11.0, 12.0, 13.0
BANG_BANG, PWM, REGULATOR = 1.0, 2.0, 3.0  # kinds of a drive
MAX_ANCHORS = 4  # anchors that the muscles of a network pull on, in series


# Places of the parameters within their actuator's row (after the mark and the kind)
(
    MUSCLE_LEADER,
    MUSCLE_COUNT,
    MUSCLE_CHAMBER,
    MUSCLE_NEXT,
    MUSCLE_STATE,
    MUSCLE_USERDATA,
    MUSCLE_LAW,
    MUSCLE_SERIES_LENGTH,
    MUSCLE_CABLE_STIFFNESS,
    MUSCLE_INVERSE_MASS,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_NOMINAL_RADIUS,
    MUSCLE_B,
    MUSCLE_BRAIDS,
    MUSCLE_LOCK,
    MUSCLE_DAMPING,
    MUSCLE_BRAID_STIFFNESS,
    MUSCLE_RETURN_STIFFNESS,
    MUSCLE_DEAD_VOLUME,
    MUSCLE_LOWEST_PRESSURE,
    MUSCLE_FRICTION,
    MUSCLE_FRICTION_STATES,
    MUSCLE_WRAP_FRICTION,
) = range(2, 25)
MUSCLE_FRICTION_COEFFICIENTS = MUSCLE_WRAP_FRICTION + 1
MUSCLE_DAMPER = MUSCLE_FRICTION_COEFFICIENTS + MAX_FRICTION_COEFFICIENTS
MUSCLE_COEFFICIENTS = MUSCLE_DAMPER + DAMPER_COEFFICIENTS
(
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_NEXT,
    CHAMBER_INLET,
    CHAMBER_OUTLET,
    CHAMBER_TUBE_VOLUME,
    CHAMBER_WALL_CONDUCTANCE,
    CHAMBER_USERDATA,
    AIR_NEXT,
    AIR_NUMBER,
    AIR_FIRST_EDGE,
    AIR_UPSTREAM,
    AIR_LEADS,
    AIR_GAS,
    AIR_HEAT_CAPACITY_RATIO,
    AIR_FIRST_NODE,
    AIR_STEEPNESS,
) = range(2, 18)
# of a volume, beside the slots of a chamber for what both have; of a store
VOLUME_START, VOLUME_START_AS = CHAMBER_FIRST_MUSCLE, CHAMBER_NEXT
VOLUME_POWER, VOLUME_POWER_RATE = CHAMBER_INLET, CHAMBER_OUTLET  # V^−γ and V^(γ − 1)
STORE_CONTENT, STORE_SHELL = CHAMBER_FIRST_MUSCLE, CHAMBER_NEXT
STORE_GAS = AIR_STEEPNESS + 1  # R, c_v, b0, b1, c0, c1, whether it liquefies
NETWORK_FIRST_CHAMBER, NETWORK_STATE, NETWORK_USERDATA, NETWORK_ANCHORS, NETWORK_FIRST_ANCHOR = range(2, 7)
# places within an anchor's own block of slots
ANCHOR_STIFFNESS, ANCHOR_FORCE, ANCHOR_LENGTH, ANCHOR_DAMPING = range(4)
ANCHOR_SLOTS = 4
(
    VALVE_CONDUCTANCE,
    VALVE_CRITICAL_RATIO,
    VALVE_OPENING_DELAY,
    VALVE_CLOSING_DELAY,
    VALVE_BANDWIDTH,
    VALVE_COIL,
    VALVE_DEAD_BAND,
    EDGE_ROW_ORIGIN,
    EDGE_ROW_END,
    EDGE_ROW_NEXT,
    EDGE_ROW_PLACE,
    EDGE_ROW_LAW,
    EDGE_ROW_FOLLOWS,
    EDGE_ROW_STEEPNESS,
    EDGE_ROW_1,
    EDGE_ROW_2,
    EDGE_ROW_3,
    EDGE_ROW_4,
    EDGE_ROW_TANK,
) = range(2, 21)
(
    DRIVE_KIND,
    DRIVE_CHAMBER,
    DRIVE_USERDATA,
    DRIVE_DEAD_BAND,
    DRIVE_RELEASE,
    DRIVE_PERIOD,
    DRIVE_LEAST_ON,
    DRIVE_LEAST_OFF,
    DRIVE_FULL_AT,
    DRIVE_INTEGRAL_RATE,
    DRIVE_DERIVATIVE_TIME,
    DRIVE_FILTER_TIME,
) = range(2, 14)
PASSIVE_SCALE, PASSIVE_OFFSET, PASSIVE_LOAD, PASSIVE_DAMPING = range(2, 6)
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
    damping: float,
    braid_stiffness: float,
    dead_volume: float,
    series_length: float,
    leader: int,
    chamber: int,
    next_muscle: int = -1,
    count: int = 1,
    state: int = 0,
    userdata: int = 0,
    return_stiffness: float = 0.0,
    cable_stiffness: float = RIGID,
    damper: Sequence[float] = (),
    friction: int = 0,
    friction_coefficients: Sequence[float] = (),
    friction_states: int = -1,
    wrap_friction: float = 0.0,
) -> np.ndarray:
    """`actuator_user` of a muscle, but for MUSCLE_INVERSE_MASS, which the compiled model tells.

    Units: lowest_pressure [Pa], damping [N·s/Pa], braid_stiffness [N], dead_volume [m³], series_length [m],
    return_stiffness [N], cable_stiffness [N/m], wrap_friction [-].
    """
    row = _row(
        KIND_MUSCLE,
        leader,
        count,
        chamber,
        next_muscle,
        state,
        userdata,
        LAWS[law].native_id,
        series_length,
        cable_stiffness,
        0.0,
        braid.nominal_length,
        braid.nominal_radius,
        braid.b,
        float(LAWS[law].braids),
        braid.lock,
        damping,
        braid_stiffness,
        return_stiffness,
        dead_volume,
        lowest_pressure,
        friction,
        friction_states,
        wrap_friction,
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
    next_chamber: int = -1,
    air: "AirSlots | None" = None,
) -> np.ndarray:
    """`actuator_user` of a chamber.

    Units: tube_volume [m³], wall_conductance [W/K].
    """
    return _row(
        KIND_CHAMBER,
        first_muscle,
        next_chamber,
        inlet,
        outlet,
        tube_volume,
        wall_conductance,
        userdata,
        *(air or AirSlots()),
    )


class AirSlots(NamedTuple):
    """Slots of a node of the air.

    following : actuator id of the next node; −1 for none
    number : its number in the network
    first_edge : actuator id of the first valve or restriction; of the node that leads, else −1
    upstream : number of the node that the supply draws from; 0 for none
    leads : 1 of the node that leads, which is the last one in the order of the actuators; else 0
    gas_constant : R [J/(kg·K)]
    heat_capacity_ratio : γ [-]
    first_node : actuator id of the first chamber
    steepness : largest slope of the flows at the node by its pressure, all open [kg/(s·Pa)]; that of a flow
        between two volumes counts twice
    """

    following: int = -1
    number: int = 2
    first_edge: int = -1
    upstream: int = 0
    leads: float = 0.0
    gas_constant: float = GAS_CONSTANT
    heat_capacity_ratio: float = HEAT_CAPACITY_RATIO
    first_node: int = 0
    steepness: float = math.inf


def volume_row(
    *, volume: float, wall_conductance: float, userdata: int, start: float, start_as: int, air: AirSlots
) -> np.ndarray:
    """`actuator_user` of a rigid volume.

    Units: volume, wall_conductance [m³], start, start_as [Pa].
    """
    gamma = air.heat_capacity_ratio
    powers = (volume**-gamma, volume ** (gamma - 1.0))
    return _row(KIND_VOLUME, start, start_as, *powers, volume, wall_conductance, userdata, *air)


def network_row(
    *, first_chamber: int, state: int, userdata: int, anchors: Sequence[Sequence[float]] = ()
) -> np.ndarray:
    """`actuator_user` of a network: chambers and anchors that are solved together.

    Units: anchors [N/m].
    """
    if len(anchors) > MAX_ANCHORS:
        raise ValueError(f"a network has {len(anchors)} anchors; there is room for {MAX_ANCHORS}")
    flat = [number for anchor in anchors for number in anchor]
    return _row(KIND_NETWORK, first_chamber, state, userdata, len(anchors), *flat)


def store_row(
    *,
    volume: float,
    content: float,
    shell: float,
    wall_conductance: float,
    gas: Sequence[float],
    userdata: int,
    air: AirSlots,
) -> np.ndarray:
    """`actuator_user` of a finite source, whose states are mass [kg] and temperature [K].

    Units: volume, content [m³], shell, wall_conductance [J/K].
    """
    none = (0.0,) * (CHAMBER_TUBE_VOLUME - CHAMBER_INLET)
    return _row(KIND_STORE, content, shell, *none, volume, wall_conductance, userdata, *air, *gas)


def valve_row(
    *,
    conductance: float,
    critical_ratio: float,
    opening_delay: float,
    closing_delay: float,
    bandwidth: float = 0.0,
    coil: int = -1,
    dead_band: float = 0.0,
    edge: "EdgeSlots | None" = None,
) -> np.ndarray:
    """`actuator_user` of a valve: C [m³/(s·Pa)], b [-], dead times [s].

    Units: bandwidth [Hz], dead_band [-].
    """
    return _row(
        KIND_VALVE,
        conductance,
        critical_ratio,
        opening_delay,
        closing_delay,
        bandwidth,
        coil + 1.0,
        dead_band,
        *(edge or EdgeSlots()),
    )


class EdgeSlots(NamedTuple):
    """Slots of a valve or restriction between two nodes of the air.

    origin, end : numbers of the nodes
    following : actuator id of the next one; −1 for none
    place : of its flow in `userdata`
    law : of its flow
    follows : actuator id of the valve whose other way it is, and one more; 0 for none
    steepness : largest slope of the flow by a pressure difference [kg/(s·Pa)]
    first, second, third, fourth : parameters of the law
    tank : actuator id of a compressor's tank
    """

    origin: int = 0
    end: int = 0
    following: int = -1
    place: int = 0
    law: int = 0
    follows: int = 0
    steepness: float = 0.0
    first: float = 0.0
    second: float = 0.0
    third: float = 0.0
    fourth: float = 0.0
    tank: int = -1


def restriction_row(*, conductance: float, critical_ratio: float, edge: EdgeSlots) -> np.ndarray:
    """`actuator_user` of a restriction without a coil: C [m³/(s·Pa)], b [-]."""
    none = (0.0,) * (EDGE_ROW_ORIGIN - VALVE_OPENING_DELAY)
    return _row(KIND_RESTRICTION, conductance, critical_ratio, *none, *edge)


def drive_row(
    *,
    kind: float,
    chamber: int,
    userdata: int,
    dead_band: float,
    release: float,
    period: float,
    least_on: float,
    least_off: float,
    full_at: float,
    integral_rate: float,
    derivative_time: float,
    filter_time: float,
) -> np.ndarray:
    """`actuator_user` of a pressure drive.

    Units: others [Pa].
    """
    return _row(
        KIND_DRIVE,
        kind,
        chamber,
        userdata,
        dead_band,
        release,
        period,
        least_on,
        least_off,
        full_at,
        integral_rate,
        derivative_time,
        filter_time,
    )


def passive_row(*, scale: float, offset: float, load: float = 0.0, damping: float = 0.0) -> np.ndarray:
    """`actuator_user` of the passive ankle.

    Units: scale, offset [-], load [N·m], damping [N·m·s/rad].
    """
    return _row(KIND_PASSIVE, scale, offset, load, damping)


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

    Units: stiffness, damping [N/m], floor [m].
    """
    return _row(KIND_PAD, stiffness, damping, floor)


def _row(kind: float, *values: float) -> np.ndarray:
    row = np.zeros(N_USER)
    row[: 2 + len(values)] = MARK, kind, *values
    return row

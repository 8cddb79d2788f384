"""Where the callbacks' numbers stand: rows of `actuator_user`, states in `act`, results in `userdata`.

    row        an actuator's parameters, behind the layout's number and a kind; `ROWS` has a kind's tables
    act        states, from the actuator's own address on
    userdata   results of the step, from a place on that the row holds

A table names its numbers in their order, and its places follow from that: `MUSCLE_ROW.damping` is a place in
a row. To compiled code they are constants. Nothing outside this package writes a row or knows a place.

    actuator   act                                              userdata
    network    of each leader: contraction, carried force,      of each anchor: force, displacement
               last move; of each anchor: displacement,
               last move
    chamber    air mass, σ = p V^γ, last volume, last pressure  flow, opening of each valve, volume, pressure
    muscle     –                                                of each leader: contraction, tension, rate, …
    drive      reading, integral, pulse, switches               coils of inlet and outlet
    valve      armature, opening, coil, seat                    –
    line       flow                                             mean flow, flow at the step's end
    friction   states of the muscle's friction                  –
    leg muscle excitation, activation, fibre's length,          excitation, tension
               velocity, force, energy
    reflex     phase of the gait, foot strikes                  what its nerves carry, step by step
    grip       where the sole holds the floor, its gain's input –
    pad, reflex of stretch   its gain's input                   –

A "last" state, and all states of a network, belong to the posture one step back. What belongs to the present
posture is solved anew in each step and stands in `userdata`.
"""

from enum import IntEnum
from itertools import accumulate
from typing import Any, NamedTuple

from afo_sim.native.walker_slots import (
    GripAct,
    GripRow,
    LegMuscleAct,
    LegMuscleData,
    LegMuscleRow,
    ReflexAct,
    ReflexRow,
)
from afo_sim.physics import (
    DAMPER_COEFFICIENTS,
    GAINS,
    LAW_VOLUME,
    MAX_COEFFICIENTS,
    MAX_FRICTION_COEFFICIENTS,
    register_jitable,
)

RIGID = 1e6  # stiffness of a cable that is called rigid [N/m]: 0.5 mm at 500 N
LAYOUT, KIND, FIRST = 0, 1, 2  # places in every row: the number of its layout, its kind, the first of its own
THIS_LAYOUT = 2840  # tells this project's rows from anybody else's; another number where the places move
MAX_ANCHORS = 4  # anchors that the muscles of a network pull on, in series
LAW_PARAMETERS = 4  # of a flow law


class Kind(IntEnum):
    """Of an actuator."""

    MUSCLE, CHAMBER, VALVE, PASSIVE, FRICTION, MOTOR = 1, 2, 3, 4, 5, 6
    SPASTIC, PAD, NETWORK, DRIVE, VOLUME, STORE = 7, 8, 9, 10, 11, 12
    RESTRICTION, LEG_MUSCLE, REFLEX, GRIP = 13, 14, 15, 16


class DriveKind(IntEnum):
    """Of a pressure drive."""

    BANG_BANG, PWM, REGULATOR = 1, 2, 3


@register_jitable
def kind_of(u: Any, j: int) -> int:
    """Kind of the actuator whose row starts at j; 0 where it is none of this project's."""
    kind = u[j + KIND]
    ours = u[j + LAYOUT] == THIS_LAYOUT and 1 <= kind <= KINDS  # which no NaN is: of that `int` is undefined
    return int(kind) if ours and kind == int(kind) else 0


def places(table: Any, first: int = 0, **widths: int) -> Any:
    """The place of each number of a table from `first` on; a field is one number, or as many as its width."""
    return table(*list(accumulate((widths.get(name, 1) for name in table._fields), initial=first))[:-1])


class MuscleRow(NamedTuple):
    """Of a muscle."""

    leader: int  # actuator id of the first of the alike muscles, which has the states of all
    parallel: int  # how many alike muscles there are
    chamber: int  # actuator id
    next: int  # actuator id of its chamber's next muscle; −1 for none
    state: int  # of the leader, in `act`
    userdata: int  # of the leader
    law: int
    series_length: int  # [m]
    cable_stiffness: int  # [N/m]
    inverse_mass: int  # J M⁻¹ Jᵀ of its path [1/kg], which the compiled model gives
    nominal_length: int  # [m]
    nominal_radius: int  # [m]
    b: int
    braids: int
    lock: int
    damping: int  # [N·s/Pa]
    braid_stiffness: int  # [N]
    return_stiffness: int  # [N]
    dead_volume: int  # [m³]
    lowest_pressure: int  # [Pa]
    friction: int
    friction_states: int  # actuator id of what holds them; −1 for none
    wrap_friction: int  # [-]
    friction_coefficients: int
    damper: int
    returning: int  # [N]
    law_volume: int
    contraction_scale: int  # [-]
    rubber: int  # [N]
    rubber_bore: int  # [-]
    rubber_turn: int  # [-]
    rubber_volume: int  # [m³]
    coefficients: int


class ChamberRow(NamedTuple):
    """Of a chamber: actuator ids of its first muscle, of the network's next chamber, of its valves."""

    first_muscle: int
    next: int
    inlet: int
    outlet: int


class VolumeRow(NamedTuple):
    """Of a rigid volume: its first gauge pressure [Pa], or the chamber whose it is; V^−γ."""

    start: int
    start_as: int
    power: int


class StoreRow(NamedTuple):
    """Of a finite source, whose states are mass [kg] and temperature [K]: full content [kg], shell [J/K]."""

    content: int
    shell: int


class AirRow(NamedTuple):
    """Of every node of the air, behind its own four numbers."""

    volume: int  # of a chamber without its muscles [m³]
    wall_conductance: int  # [W/K]
    userdata: int
    following: int  # actuator id of the next node; −1 for none
    number: int  # in the network
    first_edge: int  # actuator id of the first valve or restriction; of the node that leads, else −1
    upstream: int  # number of the node that the supply draws from; 0 for none
    leads: int  # 1 of the node that leads, which is the last one in the order of the actuators; else 0
    gas_constant: int  # [J/(kg·K)]
    heat_capacity_ratio: int
    first_node: int  # actuator id of the first chamber
    steepness: int  # steepest slope of its flows, all open [kg/(s·Pa)]; twice between volumes; ∞ of lines
    wall_conductance_by_flow: int  # by the flow into it [J/(kg·K)]
    real_gas: int  # of a store: R, c_v, b0, b1, c0, c1, whether it liquefies


class NetworkRow(NamedTuple):
    """Of chambers and anchors that are solved together; each anchor has a block of its own."""

    first_chamber: int
    state: int
    userdata: int
    anchors: int
    first_anchor: int


class AnchorBlock(NamedTuple):
    """Of an anchor, in its network's row: [N/m], or a [N] and x0 [m] of a stiffening; [N·s/m]."""

    stiffness: int
    force: int
    length: int
    damping: int


class ValveRow(NamedTuple):
    """Of a valve."""

    conductance: int  # C [m³/(s·Pa)]
    critical_ratio: int  # b [-]
    opening_delay: int  # [s]
    closing_delay: int  # [s]
    bandwidth: int  # [Hz]
    coil: int  # one more than its coil's place, or 0
    dead_band: int  # [-]
    opening_ramp: int  # [s]
    closing_ramp: int  # [s]
    threshold: int  # [-]
    hold_decay: int  # [s]
    hold_pressure: int  # [Pa]
    before: int  # actuator id of the node that it lets air out of; −1 for none


class EdgeRow(NamedTuple):
    """Of every valve or restriction between two nodes of the air, behind a valve's own numbers."""

    origin: int  # number of the node
    end: int  # number of the node
    following: int  # actuator id of the next one; −1 for none
    place: int  # of its flow in `userdata`
    law: int  # of its flow
    follows: int  # actuator id of the valve whose other way it is, and one more; 0 for none
    steepness: int  # largest slope of the flow by a pressure difference [kg/(s·Pa)]
    parameters: int  # of the law
    tank: int  # actuator id of a compressor's tank


class DriveRow(NamedTuple):
    """Of a pressure drive: its kind, its chamber's actuator id, its place in `userdata`; [Pa], [s], [1/s]."""

    kind: int
    chamber: int
    userdata: int
    dead_band: int
    release: int
    period: int
    least_on: int
    least_off: int
    full_at: int
    integral_rate: int
    derivative_time: int
    filter_time: int


class PassiveRow(NamedTuple):
    """Of the passive ankle: [-], [-], [N·m], [N·m·s/rad]."""

    scale: int
    offset: int
    load: int
    damping: int


class FrictionRow(NamedTuple):
    """Of what holds the states of a muscle's friction: the muscle's actuator id."""

    muscle: int


class SpasticRow(NamedTuple):
    """Of the plantarflexors' stretch reflex [N·m·s/rad]; of a motor what it brakes beside its input."""

    gain: int


class PadRow(NamedTuple):
    """Of a pad under the sole: [N/m], [N·s/m]; its input is the floor's height [m]."""

    stiffness: int
    damping: int


MUSCLE_ROW: MuscleRow = places(
    MuscleRow,
    FIRST,
    friction_coefficients=MAX_FRICTION_COEFFICIENTS,
    damper=DAMPER_COEFFICIENTS,
    law_volume=LAW_VOLUME,
)
CHAMBER_ROW: ChamberRow = places(ChamberRow, FIRST)
VOLUME_ROW: VolumeRow = places(VolumeRow, FIRST)
STORE_ROW: StoreRow = places(StoreRow, FIRST)
AIR_ROW: AirRow = places(AirRow, FIRST + len(CHAMBER_ROW))
NETWORK_ROW: NetworkRow = places(NetworkRow, FIRST)
ANCHOR: AnchorBlock = places(AnchorBlock)
VALVE_ROW: ValveRow = places(ValveRow, FIRST)
EDGE_ROW: EdgeRow = places(EdgeRow, FIRST + len(VALVE_ROW), parameters=LAW_PARAMETERS)
DRIVE_ROW: DriveRow = places(DriveRow, FIRST)
PASSIVE_ROW: PassiveRow = places(PassiveRow, FIRST)
FRICTION_ROW: FrictionRow = places(FrictionRow, FIRST)
SPASTIC_ROW: SpasticRow = places(SpasticRow, FIRST)
PAD_ROW: PadRow = places(PadRow, FIRST)
LEG_MUSCLE_ROW: LegMuscleRow = places(LegMuscleRow, FIRST)
REFLEX_ROW: ReflexRow = places(ReflexRow, FIRST, gains=len(GAINS))
GRIP_ROW: GripRow = places(GripRow, FIRST)
KINDS = len(Kind)
N_USER = MUSCLE_ROW.coefficients + MAX_COEFFICIENTS  # numbers of a row
ROWS: dict[Kind, tuple[Any, ...]] = {
    Kind.MUSCLE: (MUSCLE_ROW,), Kind.CHAMBER: (CHAMBER_ROW, AIR_ROW), Kind.VOLUME: (VOLUME_ROW, AIR_ROW),
    Kind.STORE: (STORE_ROW, AIR_ROW), Kind.NETWORK: (NETWORK_ROW,), Kind.VALVE: (VALVE_ROW, EDGE_ROW),
    Kind.RESTRICTION: (VALVE_ROW, EDGE_ROW), Kind.DRIVE: (DRIVE_ROW,), Kind.PASSIVE: (PASSIVE_ROW,),
    Kind.FRICTION: (FRICTION_ROW,), Kind.SPASTIC: (SPASTIC_ROW,), Kind.PAD: (PAD_ROW,),
    Kind.MOTOR: (SPASTIC_ROW,), Kind.LEG_MUSCLE: (LEG_MUSCLE_ROW,), Kind.REFLEX: (REFLEX_ROW,),
    Kind.GRIP: (GRIP_ROW,),
}  # fmt: skip
# what other rooms read of a muscle
MUSCLE_CHAMBER, MUSCLE_NOMINAL_LENGTH = MUSCLE_ROW.chamber, MUSCLE_ROW.nominal_length
MUSCLE_SERIES_LENGTH = MUSCLE_ROW.series_length


class ChamberAct(NamedTuple):
    """States of a chamber; of a volume the first two."""

    mass: int
    sigma: int
    last_volume: int
    last_pressure: int


class StoreAct(NamedTuple):
    """States of a finite source."""

    mass: int
    temperature: int


class ValveAct(NamedTuple):
    """States of a valve."""

    armature: int
    opening: int  # how far it is open
    coil: int  # whether it was on at last
    seat: int  # whether the armature has come to the open seat, which the opening follows


class RestrictionAct(NamedTuple):
    """States of a compressor, or of a line with inertia."""

    state: int  # whether it runs; flow [kg/s]
    unused: int  # MuJoCo asks for two


class LeaderAct(NamedTuple):
    """States of a muscle, in those of its network; `carried` is the static force beyond its tension [N]."""

    contraction: int
    carried: int
    last_move: int


class AnchorAct(NamedTuple):
    """States of an anchor, in those of its network."""

    displacement: int
    last_move: int


class DriveAct(NamedTuple):
    """States of a drive."""

    reading: int
    integral: int
    given: int  # the side of two-point switching, or the signed width of the present pulse [s]
    clock: int  # time since that began [s]
    stage: int  # 0 before the first step, 1 off, 2 on
    inlet_last: int
    outlet_last: int
    inlet_switches: int
    outlet_switches: int


class ChamberData(NamedTuple):
    """Results of a chamber, and −dp/dV; of a valve's, as of a restriction, its opening is behind its flow."""

    inlet_flow: int
    inlet_opening: int
    outlet_flow: int
    outlet_opening: int
    volume: int
    pressure: int
    by_volume: int


class LeaderData(NamedTuple):
    """Results of a muscle, what its network's solution works with, and where its law was asked last."""

    contraction: int
    tension: int
    rate: int
    cable_slope: int
    volume_slope: int
    step: int
    by_pressure: int
    by_pull: int
    coefficient: int
    change: int
    asked: int
    static: int
    static_by: int
    static_by_pressure: int


class AnchorData(NamedTuple):
    """Results of an anchor."""

    pull: int
    displacement: int


class DriveData(NamedTuple):
    """Results of a drive: coils of its valves."""

    inlet_coil: int
    outlet_coil: int


class VolumeData(NamedTuple):
    """Results of a volume or store."""

    pressure: int


CHAMBER_ACT: ChamberAct = places(ChamberAct)
STORE_ACT: StoreAct = places(StoreAct)
VALVE_ACT: ValveAct = places(ValveAct)
RESTRICTION_ACT: RestrictionAct = places(RestrictionAct)
LEADER_ACT: LeaderAct = places(LeaderAct)
ANCHOR_ACT: AnchorAct = places(AnchorAct)
DRIVE_ACT: DriveAct = places(DriveAct)
LEG_MUSCLE_ACT: LegMuscleAct = places(LegMuscleAct)
REFLEX_ACT: ReflexAct = places(ReflexAct)
GRIP_ACT: GripAct = places(GripAct)
LEG_MUSCLE_DATA: LegMuscleData = places(LegMuscleData)
CHAMBER_DATA: ChamberData = places(ChamberData)
LEADER_DATA: LeaderData = places(LeaderData)
ANCHOR_DATA: AnchorData = places(AnchorData)
DRIVE_DATA: DriveData = places(DriveData)
VOLUME_DATA: VolumeData = places(VolumeData)
EDGE_DATA = 2  # results of a restriction: mean flow and opening over the step; of a line its flow at the end

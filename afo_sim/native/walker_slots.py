"""Numbers of a walker's own actuators, by name: of their rows, in `act`, in `userdata`."""

from typing import NamedTuple


class LegMuscleRow(NamedTuple):
    """Of a leg's own muscle: [-], [N], [m], [m], [-], [-], [1/s], [-], [-], [kg], [-], its `userdata`."""

    strength: int
    force: int
    optimal: int
    slack: int
    width: int
    strain: int
    fastest: int
    damping: int
    passive: int
    mass: int
    slow: int
    userdata: int


class ReflexRow(NamedTuple):
    """Of a leg's reflexes."""

    other: int  # actuator id of the other leg's
    muscle: int  # actuator id of the first; the others follow
    pad: int  # actuator id of the first; the others follow
    tissue: int  # actuator id of the passive ankle, whose input is the knee's angle
    extension: int  # of the toes, on whose hinge the actuator is, at most [N·m]
    foot: int  # body whose centre of mass is compared with the trunk's
    trunk: int  # body
    knee: int  # place in `qpos`
    knee_rate: int  # place in `qvel`
    pitch: int  # place in `qpos`
    pitch_rate: int  # place in `qvel`
    userdata: int  # of the nerves' memory
    slots: int  # how many steps it holds
    weight: int  # of the body [N]
    slope: int  # of the floor, up positive [rad]
    floor: int  # place in `userdata` of the heights of an uneven floor; 0 for a plane
    gains: int  # as `physics.reflexes` names them


class GripRow(NamedTuple):
    """Of the floor's hold on a point of the sole: actuator id of its pad; [N/m], [N·s/m], [-]."""

    pad: int
    stiffness: int
    damping: int
    friction: int


class LegMuscleAct(NamedTuple):
    """States of a leg's own muscle: [-], [-], [-], [1/s], [-], [J]."""

    excitation: int
    activation: int
    length: int
    velocity: int
    force: int
    energy: int


class ReflexAct(NamedTuple):
    """States of a leg's reflexes: the gait's phase, and how often the foot has come down."""

    phase: int
    strikes: int


class GripAct(NamedTuple):
    """States of the floor's hold: where it holds [m], and what its gain carries [N·s/m]."""

    anchor: int
    carried: int


class LegMuscleData(NamedTuple):
    """Results of a leg's own muscle: [-], [N]."""

    excitation: int
    tension: int

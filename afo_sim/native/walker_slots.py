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
    """Of a leg's reflexes.

    other : actuator id of the other leg's
    muscle, pad : actuator ids of its first muscle and its first pad; the others follow
    tissue : actuator id of the passive ankle, whose input is the knee's angle
    extension : of the toes, on whose hinge the actuator is, at most [N·m]
    foot, trunk : bodies whose centres of mass are compared
    knee, knee_rate, pitch, pitch_rate : places in `qpos` and `qvel`
    userdata, slots : of the nerves' memory, and how many steps it holds
    weight : of the body [N]
    gains : as `physics.reflexes` names them
    """

    other: int
    muscle: int
    pad: int
    tissue: int
    extension: int
    foot: int
    trunk: int
    knee: int
    knee_rate: int
    pitch: int
    pitch_rate: int
    userdata: int
    slots: int
    weight: int
    gains: int


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

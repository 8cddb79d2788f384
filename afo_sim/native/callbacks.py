"""Muscles, chambers, valves and the passive ankle as MuJoCo actuator callbacks.

Every actuator of this project carries its parameters in `actuator_user`, behind a mark and a kind;
its states are in `act`, its input in `ctrl`:

    kind     transmission   ctrl                    act
    muscle   tendon           none (see below)        –
    chamber  ankle, no force  supply pressure, gauge  air mass, volume, absolute pressure
    valve    ankle, no force  coil                    armature, opening
    passive  ankle            knee angle              –
    friction ankle, no force  –                       states of a muscle's friction
    spastic  ankle            –                       –
    pad      a sole point's z  none (see below)        –
    motor    joint            MuJoCo's own            –

Per chamber, `userdata` receives what MuJoCo has no field for: inlet flow, outlet flow [kg/s],
volume [m³] of the same step.

The callbacks are process-global in MuJoCo. They act only on marked actuators, are installed and
restored by `installed`, and never displace somebody else's. The same two functions run compiled
(function pointers, which `mujoco.batch` requires) or as plain Python.

Two numerical matters:

* The Hill damper is stiff, friction more so, and MuJoCo integrates user forces explicitly. The bias
  therefore leaves the damping coefficient in the muscle's own `ctrl`, where an affine gain of
  −1 × tendon velocity makes it the force's derivative for the integrator `implicitfast`; what that
  gain adds to the force (from a `ctrl` that the last step left) the bias takes away. The force is
  exactly the law's, and only its dependence on velocity is integrated implicitly. Parallel muscles
  are alike, so the first of a group carries the derivative of all. A pad under the sole does the same;
  the floor's height is the `ctrl` of a motor without force.
* Pressure integrated with the volume rate of the *old* velocity feeds energy into the joint. The
  chamber therefore keeps the volume that its pressure has been integrated to, and makes up the
  difference in the next step (midpoint rule): the sum of the volume changes is the volume, and a
  sealed chamber is nearly as good a spring as a metal one.
"""

from collections.abc import Callable
from typing import Any

from afo_sim.native.air import chamber_dyn, valve_dyn
from afo_sim.native.complaints import FINE, NO_NUMBER
from afo_sim.native.muscle import (
    bias_beside_gain,
    friction_dyn,
    muscle_derivative,
    muscle_force,
    sole_pad_force,
)
from afo_sim.native.slots import (
    KIND_CHAMBER,
    KIND_FRICTION,
    KIND_MUSCLE,
    KIND_PAD,
    KIND_PASSIVE,
    KIND_SPASTIC,
    KIND_VALVE,
    MARK,
    N_USER,
    PASSIVE_LOAD,
    PASSIVE_OFFSET,
    PASSIVE_SCALE,
    SPASTIC_GAIN,
)
from afo_sim.physics.passive_ankle import passive_moment, spastic_moment


def define(fail: Callable[[int, int], None]) -> tuple[Any, Any]:
    """The two callbacks (bias, dyn), over a `fail(complaint, actuator)` that does not return."""

    def bias(m: Any, d: Any, i: int) -> float:
        u, j = m.actuator_user, m.nuser_actuator * i
        if m.nuser_actuator < N_USER or u[j] != MARK:
            return 0.0
        kind = u[j + 1]
        if kind == KIND_MUSCLE:
            force, damping = muscle_force(m, d, i, j)
            if force != force:
                fail(NO_NUMBER, i)
            return bias_beside_gain(d, i, -force, muscle_derivative(m, j, damping))
        if kind == KIND_PASSIVE:
            scale, offset = u[j + PASSIVE_SCALE], u[j + PASSIVE_OFFSET]
            moment = passive_moment(d.actuator_length[i], d.ctrl[i], scale, offset)
            if moment != moment:
                fail(NO_NUMBER, i)
            return moment - u[j + PASSIVE_LOAD]
        if kind == KIND_SPASTIC:
            return spastic_moment(d.actuator_velocity[i], u[j + SPASTIC_GAIN])
        if kind == KIND_PAD:
            force, damping = sole_pad_force(m, d, i, j)
            if force != force:
                fail(NO_NUMBER, i)
            return bias_beside_gain(d, i, force, damping)
        return 0.0

    def dyn(m: Any, d: Any, i: int) -> float:
        j = m.nuser_actuator * i
        if m.nuser_actuator < N_USER or m.actuator_user[j] != MARK:
            return 0.0
        kind = m.actuator_user[j + 1]
        if kind == KIND_CHAMBER:
            complaint = chamber_dyn(m, d, i, j)
            if complaint != FINE:
                fail(complaint, i)
        elif kind == KIND_VALVE:
            valve_dyn(m, d, i, j)
        elif kind == KIND_FRICTION:
            return friction_dyn(m, d, i, j)
        return 0.0

    return bias, dyn

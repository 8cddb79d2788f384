"""Muscles, chambers, valves and the passive ankle as MuJoCo actuator callbacks.

Every actuator of this project carries its parameters in `actuator_user`, behind the number of their layout
and a kind; its states are in `act`, its input in `ctrl`:

    kind     transmission     ctrl                    act
    network  a joint, no force  1 for at rest           own lengths of muscles, displacements of anchors
    muscle   tendon             none (see below)        –
    chamber  a joint, no force  supply pressure, gauge  air mass, σ = p V^γ, last volume, last pressure
    drive    a joint, no force  target, gauge; or < 0   reading, integral, pulse, switches
    valve    a joint, no force  coil                    armature, opening, coil, seat
    line     a joint, no force  –                       flow
    passive  ankle              knee angle              –
    friction a joint, no force  –                       states of a muscle's friction
    spastic  ankle              –                       what its gain carries (see below)
    pad      a sole point's z   height of the floor     what its gain carries
    grip     a sole point's x   –                       where the floor holds it, what its gain carries
    reflex   toes               –                       phase of the gait, foot strikes
    leg muscle  tendon          –                       activation, fibre, energy
    motor    joint              MuJoCo's own            –

The callbacks are process-global in MuJoCo. They act only on actuators of this layout, refuse all others, are
installed and restored by `installed`, and never displace somebody else's. The same two functions run
compiled (function pointers, which `mujoco.batch` requires) or as plain Python.

MuJoCo calls every dyn, then every bias. A network stands before its muscles and chambers: its dyn solves them
(`network.py`) and writes what the others read into `userdata`. A drive stands before chambers and valves: it
reads the pressure of this step and writes the coils of this step.

Three numerical matters:

* A tension is a function of positions. MuJoCo's velocities stand half a step before them, so that the tension
  taken as it is makes a scheme of second order. It is stable because the actuator of a leader carries the
  derivative −α h dT/dx to the integrator `implicitfast`; α = ¼ is Newmark's average acceleration. An affine
  gain of −1 × tendon velocity carries it, with the coefficient in the muscle's own `ctrl`. The network's
  dyn sets that velocity to zero, so that the gain adds no force at all. Friction at a path's guides is
  carried by the same gain (`guides.py`): what the joint feels is then not the muscle's tension.
* Half of a joint's damping is MuJoCo's, which takes it at the end of a step, and half that of the passive
  ankle, the toes' reflex or the leg's support, which takes it at the start: the trapezoidal rule.
* A pad under the sole, a grip, and a reflex carry half their damping by such a gain, by the same rule, a pad
  and a grip their spring's too, as a tension's. The input of the gain is a state that the step takes early
  (`actearly`): the dyn gives its rate. What the gain adds to the force the bias takes away.
"""

from collections.abc import Callable
from typing import Any

from afo_sim.native import slots
from afo_sim.native.air_step import air_dyn, restriction_dyn
from afo_sim.native.driving import drive_dyn, valve_dyn
from afo_sim.native.error_codes import FINE, NO_NUMBER
from afo_sim.native.guides import behind_guides
from afo_sim.native.muscle import beside_gain, friction_dyn, sole_pad_force
from afo_sim.native.network import network_dyn
from afo_sim.native.refuse import tried
from afo_sim.native.walker import grip_bias, grip_dyn, leg_muscle_dyn, reflex_dyn, toe_moment
from afo_sim.physics import passive_moment, register_jitable, spastic_moment


@register_jitable
def force_of(m: Any, d: Any, i: int) -> tuple[int, float]:
    """Force of the actuator i beside its gain: (complaint, force)."""
    u, j = m.actuator_user, m.nuser_actuator * i
    kind, force = slots.kind_of(u, j), 0.0
    if kind == slots.Kind.MUSCLE:
        leader = m.nuser_actuator * int(u[j + slots.MUSCLE_ROW.leader])
        tension = d.userdata[int(u[leader + slots.MUSCLE_ROW.userdata]) + slots.LEADER_DATA.tension]
        if tension == tension and u[j + slots.MUSCLE_ROW.wrap_friction] > 0.0:
            tension, _ = behind_guides(m, d, i, j, tension)
        force = 0.0 - tension
    elif kind == slots.Kind.PASSIVE:
        scale, offset = u[j + slots.PASSIVE_ROW.scale], u[j + slots.PASSIVE_ROW.offset]
        force = passive_moment(d.actuator_length[i], d.ctrl[i], scale, offset)
        force -= u[j + slots.PASSIVE_ROW.load]
        force -= u[j + slots.PASSIVE_ROW.damping] * d.actuator_velocity[i]
    elif kind == slots.Kind.SPASTIC:
        moment = spastic_moment(d.actuator_velocity[i], u[j + slots.SPASTIC_ROW.gain])
        force = beside_gain(m, d, i, m.actuator_actadr[i], moment)
    elif kind == slots.Kind.PAD:
        force = beside_gain(m, d, i, m.actuator_actadr[i], sole_pad_force(m, d, i, j)[0])
    elif kind == slots.Kind.LEG_MUSCLE:
        force = 0.0 - d.userdata[int(u[j + slots.LEG_MUSCLE_ROW.userdata]) + slots.LEG_MUSCLE_DATA.tension]
    elif kind == slots.Kind.REFLEX:
        force = toe_moment(m, d, i, j)
    elif kind == slots.Kind.GRIP:
        force = grip_bias(m, d, i, j)
    elif kind == slots.Kind.MOTOR:
        force = 0.0 - u[j + slots.SPASTIC_ROW.gain] * d.actuator_velocity[i]
    return FINE if force == force else NO_NUMBER, force


@register_jitable
def rate_of(m: Any, d: Any, i: int) -> tuple[int, int, float]:
    """Rates of the actuator i: (complaint, actuator that it is of, rate of the only state of one)."""
    u, j = m.actuator_user, m.nuser_actuator * i
    kind, complaint, actuator, rate = slots.kind_of(u, j), FINE, i, 0.0
    if kind == slots.Kind.NETWORK:
        complaint, actuator = network_dyn(m, d, i, j)
    elif kind in (slots.Kind.CHAMBER, slots.Kind.VOLUME, slots.Kind.STORE):
        air_dyn(m, d, j)
    elif kind == slots.Kind.RESTRICTION:
        restriction_dyn(m, d, i, j)
    elif kind == slots.Kind.DRIVE:
        complaint = drive_dyn(m, d, i, j)
    elif kind == slots.Kind.VALVE:
        valve_dyn(m, d, i, j)
    elif kind == slots.Kind.FRICTION:
        rate = friction_dyn(m, d, i, j)
    elif kind == slots.Kind.REFLEX:
        reflex_dyn(m, d, i, j)
    elif kind == slots.Kind.LEG_MUSCLE:
        leg_muscle_dyn(m, d, i, j)
    elif kind == slots.Kind.GRIP:
        grip_dyn(m, d, i, j)
    elif kind == slots.Kind.PAD:
        rate = (sole_pad_force(m, d, i, j)[1] - d.act[m.actuator_actadr[i]]) / m.opt.timestep
    elif kind == slots.Kind.SPASTIC:
        gain = u[j + slots.SPASTIC_ROW.gain]
        damping = 0.5 * gain if spastic_moment(d.actuator_velocity[i], gain) < 0.0 else 0.0
        rate = (damping - d.act[m.actuator_actadr[i]]) / m.opt.timestep
    return complaint, actuator, rate


def define(fail: Callable[[int, int], None]) -> tuple[Any, Any]:
    """The two callbacks (bias, dyn), over a `fail(complaint, actuator)` that does not return."""

    def bias(m: Any, d: Any, i: int) -> float:
        complaint, force = force_of(m, d, i)
        if complaint != FINE and not tried(m, d):
            fail(complaint, i)
        return force if complaint == FINE else 0.0

    def dyn(m: Any, d: Any, i: int) -> float:
        complaint, actuator, rate = rate_of(m, d, i)
        if complaint != FINE and not tried(m, d):
            fail(complaint, actuator)
        return rate

    return bias, dyn

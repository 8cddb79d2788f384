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

from numba.extending import register_jitable

from afo_sim.common.units import AMBIENT_PRESSURE, AMBIENT_TEMPERATURE, GAS_CONSTANT
from afo_sim.native.slots import (
    CHAMBER_FIRST_MUSCLE,
    CHAMBER_INLET,
    CHAMBER_OUTLET,
    CHAMBER_TUBE_VOLUME,
    CHAMBER_USERDATA,
    CHAMBER_WALL_CONDUCTANCE,
    FRICTION_MUSCLE,
    KIND_CHAMBER,
    KIND_FRICTION,
    KIND_MUSCLE,
    KIND_PAD,
    KIND_PASSIVE,
    KIND_SPASTIC,
    KIND_VALVE,
    MARK,
    MUSCLE_B,
    MUSCLE_BRAID_STIFFNESS,
    MUSCLE_CHAMBER,
    MUSCLE_COEFFICIENTS,
    MUSCLE_DAMPER,
    MUSCLE_DAMPING,
    MUSCLE_DEAD_VOLUME,
    MUSCLE_FRICTION,
    MUSCLE_FRICTION_COEFFICIENTS,
    MUSCLE_FRICTION_STATES,
    MUSCLE_IMPLICIT_COUNT,
    MUSCLE_LAW,
    MUSCLE_LOWEST_PRESSURE,
    MUSCLE_NEXT,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_NOMINAL_RADIUS,
    MUSCLE_SERIES_LENGTH,
    N_USER,
    PAD_DAMPING,
    PAD_FLOOR,
    PAD_STIFFNESS,
    PASSIVE_LOAD,
    PASSIVE_OFFSET,
    PASSIVE_SCALE,
    SPASTIC_GAIN,
    VALVE_CLOSING_DELAY,
    VALVE_CONDUCTANCE,
    VALVE_CRITICAL_RATIO,
    VALVE_OPENING_DELAY,
)
from afo_sim.native.state import (
    ABSOLUTE_PRESSURE,
    AIR_MASS,
    ARMATURE,
    INLET_FLOW,
    INTEGRATED_VOLUME,
    OPENING,
    OUTLET_FLOW,
    VOLUME,
)
from afo_sim.physics.friction.dispatch import friction_force, friction_pressure, friction_rates, is_force
from afo_sim.physics.ground import pad_force
from afo_sim.physics.hill import hill_force, three_element_damping
from afo_sim.physics.passive_ankle import passive_moment, spastic_moment
from afo_sim.physics.pneumatics import muscle_volume, pressure_rate, valve_flow, valve_rates
from afo_sim.physics.static_force import muscle_static_force

PRESSURE_STEP = 500.0  # of the slope ∂F/∂p that friction is integrated with [Pa]

# What a callback can object to; the text that MuJoCo reports is "<complaint> <actuator id>".
COMPLAINTS = (
    "the force is not a number in actuator",
    "the absolute pressure is not positive in actuator",
    "the volume is not positive in actuator",
    "the air mass is not positive in actuator",
    "the supply's absolute pressure is not positive in actuator",
)


@register_jitable
def friction_address(m: Any, j: int) -> int:
    """Place in `act` of the first state of a muscle's friction; 0 where it has none, which nobody reads."""
    actuator = int(m.actuator_user[j + MUSCLE_FRICTION_STATES])
    return m.actuator_actadr[actuator] if actuator >= 0 else 0


@register_jitable
def muscle_force(m: Any, d: Any, i: int, j: int) -> tuple[float, float]:
    """Tension of the muscle actuator i whose row starts at j [N], and its damping −dF/dκ̇ [N·s]."""
    u = m.actuator_user
    length = u[j + MUSCLE_NOMINAL_LENGTH]
    contraction = 1.0 - (d.actuator_length[i] - u[j + MUSCLE_SERIES_LENGTH]) / length
    rate = -d.actuator_velocity[i] / length
    absolute = d.act[m.actuator_actadr[int(u[j + MUSCLE_CHAMBER])] + ABSOLUTE_PRESSURE]
    pressure = absolute - AMBIENT_PRESSURE
    law, lowest, c = u[j + MUSCLE_LAW], u[j + MUSCLE_LOWEST_PRESSURE], j + MUSCLE_COEFFICIENTS
    friction, slope, static_slope = 0.0, 0.0, 0.0
    model, f, step = u[j + MUSCLE_FRICTION], j + MUSCLE_FRICTION_COEFFICIENTS, m.opt.timestep
    if model == 0.0:
        static = muscle_static_force(law, contraction, pressure, lowest, u, c)
    elif is_force(model):
        static = muscle_static_force(law, contraction, pressure, lowest, u, c)
        a = friction_address(m, j)
        friction, slope = friction_force(model, contraction, rate, pressure, d.act, a, u, f, step)
    else:
        # the muscle pulls as if at p − q; friction cannot be more than what presses
        q, q_slope = friction_pressure(model, rate, d.act, friction_address(m, j), u, f, step)
        bound = 0.0 if pressure < 0.0 else pressure
        if q > bound:
            q, q_slope = bound, 0.0
        elif q < -bound:
            q, q_slope = -bound, 0.0
        felt = pressure - q
        static = muscle_static_force(law, contraction, felt, lowest, u, c)
        more = muscle_static_force(law, contraction, felt + PRESSURE_STEP, lowest, u, c)
        if more > static:
            static_slope = (more - static) / PRESSURE_STEP * q_slope
    k = j + MUSCLE_DAMPER
    damping = u[j + MUSCLE_DAMPING] * absolute + length * three_element_damping(
        pressure, rate, u[k], u[k + 1], u[k + 2], u[k + 3], u[k + 4], u[k + 5], u[k + 6]
    )
    braid = u[j + MUSCLE_BRAID_STIFFNESS]
    return hill_force(static, contraction, rate, damping, friction, slope, static_slope, braid)


def define(fail: Callable[[int, int], None]) -> tuple[Any, Any]:
    """The two callbacks, over a `fail(complaint, actuator)` that does not return."""

    @register_jitable
    def muscle_bias(m: Any, d: Any, i: int, j: int) -> float:
        u = m.actuator_user
        force, coefficient = muscle_force(m, d, i, j)
        if force != force:
            fail(0, i)
        if coefficient < 0.0:  # friction that falls with speed: implicit, it would divide by zero
            coefficient = 0.0
        ctrl = d.ctrl
        gained = d.actuator_velocity[i] * ctrl[i]  # the affine gain takes this off
        ctrl[i] = coefficient / u[j + MUSCLE_NOMINAL_LENGTH] * u[j + MUSCLE_IMPLICIT_COUNT]
        return gained - force

    @register_jitable
    def pad_bias(m: Any, d: Any, i: int, j: int) -> float:
        u, ctrl = m.actuator_user, d.ctrl
        floor, velocity = ctrl[int(u[j + PAD_FLOOR])], d.actuator_velocity[i]
        force, damping = pad_force(
            floor, d.actuator_length[i], velocity, u[j + PAD_STIFFNESS], u[j + PAD_DAMPING]
        )
        if force != force:
            fail(0, i)
        gained = velocity * ctrl[i]  # as a muscle's
        ctrl[i] = damping
        return gained + force

    @register_jitable
    def friction_dyn(m: Any, d: Any, i: int, j: int) -> float:
        u, act = m.actuator_user, d.act
        muscle = int(u[j + FRICTION_MUSCLE])
        q = m.nuser_actuator * muscle
        rate = -d.actuator_velocity[muscle] / u[q + MUSCLE_NOMINAL_LENGTH]
        c, a = q + MUSCLE_FRICTION_COEFFICIENTS, m.actuator_actadr[i]
        return friction_rates(u[q + MUSCLE_FRICTION], rate, act, a, u, c, m.opt.timestep, d.act_dot)

    @register_jitable
    def chamber_dyn(m: Any, d: Any, i: int, j: int) -> None:
        u, act, act_dot = m.actuator_user, d.act, d.act_dot
        lengths, velocities = d.actuator_length, d.actuator_velocity
        addresses, width = m.actuator_actadr, m.nuser_actuator
        adr = addresses[i]
        mass, integrated_volume = act[adr + AIR_MASS], act[adr + INTEGRATED_VOLUME]
        pressure = act[adr + ABSOLUTE_PRESSURE]
        if not pressure > 0.0:
            fail(1, i)
        if not mass > 0.0:
            fail(3, i)
        volume, volume_rate = u[j + CHAMBER_TUBE_VOLUME], 0.0
        k = int(u[j + CHAMBER_FIRST_MUSCLE])
        while k >= 0:
            q = width * k
            length = u[q + MUSCLE_NOMINAL_LENGTH]
            per_length = 1.0 / length
            contraction = 1.0 - (lengths[k] - u[q + MUSCLE_SERIES_LENGTH]) * per_length
            part, slope = muscle_volume(
                contraction, length, u[q + MUSCLE_NOMINAL_RADIUS], u[q + MUSCLE_B], u[q + MUSCLE_DEAD_VOLUME]
            )
            volume += part
            volume_rate -= slope * velocities[k] * per_length
            k = int(u[q + MUSCLE_NEXT])
        if not volume > 0.0:
            fail(2, i)
        step = m.opt.timestep
        # from the volume that the pressure belongs to, to the one at the end of this step
        volume_rate += (volume - integrated_volume) / step
        temperature = pressure * integrated_volume / (mass * GAS_CONSTANT)
        inlet, outlet = int(u[j + CHAMBER_INLET]), int(u[j + CHAMBER_OUTLET])
        q = width * inlet
        supply = d.ctrl[i] + AMBIENT_PRESSURE
        if not supply > 0.0:
            fail(4, i)
        inlet_flow = valve_flow(
            supply,
            AMBIENT_TEMPERATURE,
            pressure,
            temperature,
            act[addresses[inlet] + OPENING],
            u[q + VALVE_CONDUCTANCE],
            u[q + VALVE_CRITICAL_RATIO],
        )
        q = width * outlet
        outlet_flow = valve_flow(
            pressure,
            temperature,
            AMBIENT_PRESSURE,
            AMBIENT_TEMPERATURE,
            act[addresses[outlet] + OPENING],
            u[q + VALVE_CONDUCTANCE],
            u[q + VALVE_CRITICAL_RATIO],
        )
        flow_in, flow_out = 0.0, 0.0
        if inlet_flow < 0.0:
            flow_out -= inlet_flow
        else:
            flow_in += inlet_flow
        if outlet_flow < 0.0:
            flow_in -= outlet_flow
        else:
            flow_out += outlet_flow
        act_dot[adr + AIR_MASS] = flow_in - flow_out
        act_dot[adr + INTEGRATED_VOLUME] = volume_rate
        # midpoint rule: the explicit one loses pressure whichever way the volume moves
        wall = u[j + CHAMBER_WALL_CONDUCTANCE]
        half = 0.5 * step
        rate = pressure_rate(pressure, temperature, integrated_volume, volume_rate, flow_in, flow_out, wall)
        pressure += half * rate
        integrated_volume += half * volume_rate
        mass += half * (flow_in - flow_out)
        temperature = pressure * integrated_volume / (mass * GAS_CONSTANT)
        act_dot[adr + ABSOLUTE_PRESSURE] = pressure_rate(
            pressure, temperature, integrated_volume, volume_rate, flow_in, flow_out, wall
        )
        row = int(u[j + CHAMBER_USERDATA])
        userdata = d.userdata
        userdata[row + INLET_FLOW], userdata[row + OUTLET_FLOW] = inlet_flow, outlet_flow
        userdata[row + VOLUME] = volume

    @register_jitable
    def valve_dyn(m: Any, d: Any, i: int, j: int) -> None:
        u = m.actuator_user
        adr = m.actuator_actadr[i]
        d.act_dot[adr + ARMATURE], d.act_dot[adr + OPENING] = valve_rates(
            d.ctrl[i],
            d.act[adr + ARMATURE],
            d.act[adr + OPENING],
            u[j + VALVE_OPENING_DELAY],
            u[j + VALVE_CLOSING_DELAY],
            m.opt.timestep,
        )

    def bias(m: Any, d: Any, i: int) -> float:
        j = m.nuser_actuator * i
        if m.nuser_actuator < N_USER or m.actuator_user[j] != MARK:
            return 0.0
        u = m.actuator_user
        kind = u[j + 1]
        if kind == KIND_MUSCLE:
            return muscle_bias(m, d, i, j)
        if kind == KIND_PASSIVE:
            moment = passive_moment(
                d.actuator_length[i], d.ctrl[i], u[j + PASSIVE_SCALE], u[j + PASSIVE_OFFSET]
            )
            if moment != moment:
                fail(0, i)
            return moment - u[j + PASSIVE_LOAD]
        if kind == KIND_SPASTIC:
            return spastic_moment(d.actuator_velocity[i], u[j + SPASTIC_GAIN])
        if kind == KIND_PAD:
            return pad_bias(m, d, i, j)
        return 0.0

    def dyn(m: Any, d: Any, i: int) -> float:
        j = m.nuser_actuator * i
        if m.nuser_actuator < N_USER or m.actuator_user[j] != MARK:
            return 0.0
        kind = m.actuator_user[j + 1]
        if kind == KIND_CHAMBER:
            chamber_dyn(m, d, i, j)
        elif kind == KIND_VALVE:
            valve_dyn(m, d, i, j)
        elif kind == KIND_FRICTION:
            return friction_dyn(m, d, i, j)
        return 0.0

    return bias, dyn

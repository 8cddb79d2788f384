"""Muscle, its friction, and the pad under the sole: forces, and the derivative that their gain carries."""

from typing import Any

from numba.extending import register_jitable

from afo_sim.common.units import AMBIENT_PRESSURE
from afo_sim.native.slots import (
    FRICTION_MUSCLE,
    MUSCLE_BRAID_STIFFNESS,
    MUSCLE_CHAMBER,
    MUSCLE_COEFFICIENTS,
    MUSCLE_DAMPER,
    MUSCLE_DAMPING,
    MUSCLE_FRICTION,
    MUSCLE_FRICTION_COEFFICIENTS,
    MUSCLE_FRICTION_STATES,
    MUSCLE_IMPLICIT_COUNT,
    MUSCLE_LAW,
    MUSCLE_LOWEST_PRESSURE,
    MUSCLE_NOMINAL_LENGTH,
    MUSCLE_SERIES_LENGTH,
    PAD_DAMPING,
    PAD_FLOOR,
    PAD_STIFFNESS,
)
from afo_sim.native.state import ABSOLUTE_PRESSURE
from afo_sim.physics.friction.dispatch import friction_force, friction_pressure, friction_rates, is_force
from afo_sim.physics.ground import pad_force
from afo_sim.physics.hill import hill_force, three_element_damping
from afo_sim.physics.static_force import muscle_static_force

PRESSURE_STEP = 500.0  # of the slope ∂F/∂p that friction is integrated with [Pa]


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


@register_jitable
def muscle_derivative(m: Any, j: int, coefficient: float) -> float:
    """−dF/dv [N·s/m] that the gain of a muscle carries, from the damping −dF/dκ̇ [N·s]."""
    u = m.actuator_user
    if coefficient < 0.0:  # friction that falls with speed: implicit, it would divide by zero
        coefficient = 0.0
    return coefficient / u[j + MUSCLE_NOMINAL_LENGTH] * u[j + MUSCLE_IMPLICIT_COUNT]


@register_jitable
def bias_beside_gain(d: Any, i: int, force: float, derivative: float) -> float:
    """Bias that makes the actuator's whole force `force` [N], and the derivative left for its gain.

    MuJoCo adds −1 × velocity × ctrl, with the ctrl that the last step left: the bias takes it off.
    """
    ctrl = d.ctrl
    gained = d.actuator_velocity[i] * ctrl[i]
    ctrl[i] = derivative
    return gained + force


@register_jitable
def sole_pad_force(m: Any, d: Any, i: int, j: int) -> tuple[float, float]:
    """Upward force of the pad actuator i whose row starts at j [N], and its damping −dF/dv [N·s/m]."""
    u = m.actuator_user
    floor = d.ctrl[int(u[j + PAD_FLOOR])]
    return pad_force(
        floor, d.actuator_length[i], d.actuator_velocity[i], u[j + PAD_STIFFNESS], u[j + PAD_DAMPING]
    )


@register_jitable
def friction_dyn(m: Any, d: Any, i: int, j: int) -> float:
    """Write the rates of a friction's states but the first to `act_dot`, and return that of the first."""
    u, act = m.actuator_user, d.act
    muscle = int(u[j + FRICTION_MUSCLE])
    q = m.nuser_actuator * muscle
    rate = -d.actuator_velocity[muscle] / u[q + MUSCLE_NOMINAL_LENGTH]
    c, a = q + MUSCLE_FRICTION_COEFFICIENTS, m.actuator_actadr[i]
    return friction_rates(u[q + MUSCLE_FRICTION], rate, act, a, u, c, m.opt.timestep, d.act_dot)

"""One muscle at its own length: its balance of forces and the slopes; friction; the sole's pad."""

from typing import Any

from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.native.slots import FRICTION_ROW, LEADER_DATA, MUSCLE_ROW, PAD_ROW
from afo_sim.physics import (
    Slopes,
    cable_tension,
    friction_force,
    friction_pressure,
    friction_rates,
    is_force,
    pad_force,
    register_jitable,
    signed_force,
    three_element_damping,
)


@register_jitable
def law_slopes(u: Any, k: int, contraction: float, pressure: float) -> Slopes:
    """Signed static force of the muscle whose row starts at k, at gauge pressure, and its slopes."""
    return signed_force(
        u[k + MUSCLE_ROW.law],
        contraction,
        pressure,
        u[k + MUSCLE_ROW.lowest_pressure],
        u[k + MUSCLE_ROW.return_stiffness],
        u[k + MUSCLE_ROW.braid_stiffness],
        u[k + MUSCLE_ROW.nominal_radius],
        u[k + MUSCLE_ROW.b],
        u[k + MUSCLE_ROW.braids],
        u[k + MUSCLE_ROW.contraction_scale],
        u,
        k + MUSCLE_ROW.coefficients,
    )


@register_jitable
def cable(m: Any, d: Any, leader: int, contraction: float, shift: float) -> tuple[float, float]:
    """Tension [N] and slope [N/m] of a leader's cable, its anchors displaced by `shift` [m]."""
    u, k = m.actuator_user, m.nuser_actuator * leader
    own = u[k + MUSCLE_ROW.nominal_length] * (1.0 - contraction)
    stretch = d.actuator_length[leader] - u[k + MUSCLE_ROW.series_length] - own - shift
    return cable_tension(stretch, u[k + MUSCLE_ROW.cable_stiffness])


@register_jitable
def friction(
    m: Any, d: Any, k: int, contraction: float, rate: float, pressure: float, static: float
) -> tuple[float, float]:
    """Friction of the muscle whose row starts at k, positive while shortening [N], and its slope by κ̇
    [N·s]."""
    u, step = m.actuator_user, m.opt.timestep
    model, f = u[k + MUSCLE_ROW.friction], k + MUSCLE_ROW.friction_coefficients
    if model == 0.0:
        return 0.0, 0.0
    holder = int(u[k + MUSCLE_ROW.friction_states])
    a = m.actuator_actadr[holder] if holder >= 0 else 0
    if is_force(model):
        return friction_force(model, contraction, rate, pressure, d.act, a, u, f, step)
    q, q_slope = friction_pressure(model, rate, d.act, a, u, f, step)
    bound = 0.0 if pressure < 0.0 else pressure
    if q > bound:
        q, q_slope = bound, 0.0
    elif q < -bound:
        q, q_slope = -bound, 0.0
    felt, _, by_pressure = law_slopes(u, k, contraction, pressure - q)
    slope = by_pressure * q_slope
    return static - felt, slope if slope > 0.0 else 0.0


@register_jitable
def damping(m: Any, k: int, rate: float, absolute: float) -> float:
    """Damping of the muscle whose row starts at k, Hill's and the three-element model's [N·s]."""
    u, c = m.actuator_user, k + MUSCLE_ROW.damper
    return u[k + MUSCLE_ROW.damping] * absolute + u[k + MUSCLE_ROW.nominal_length] * three_element_damping(
        absolute - AMBIENT_PRESSURE, rate, u[c], u[c + 1], u[c + 2], u[c + 3], u[c + 4], u[c + 5], u[c + 6]
    )


@register_jitable
def weight_of_end(m: Any, k: int, last_absolute: float) -> float:
    """Weight θ of a step's end in the balance of the muscle whose row starts at k, from ½ to 1."""
    u = m.actuator_user
    relaxed = u[k + MUSCLE_ROW.cable_stiffness] * u[k + MUSCLE_ROW.nominal_length] * m.opt.timestep
    c = damping(m, k, 0.0, last_absolute)
    return 0.5 if relaxed <= 2.0 * c else 1.0 - c / relaxed


@register_jitable
def bias_beside_gain(d: Any, i: int, force: float, derivative: float) -> float:
    """Bias that makes the actuator's whole force `force` [N], and the derivative left for its gain."""
    ctrl = d.ctrl
    gained = d.actuator_velocity[i] * ctrl[i]
    ctrl[i] = derivative
    return gained + force


@register_jitable
def sole_pad_force(m: Any, d: Any, i: int, j: int) -> tuple[float, float]:
    """Upward force of the pad actuator i whose row starts at j [N], and what its gain carries [N·s/m]."""
    u = m.actuator_user
    floor, height = d.ctrl[int(u[j + PAD_ROW.floor])], d.actuator_length[i]
    force, damping = pad_force(
        floor, height, d.actuator_velocity[i], u[j + PAD_ROW.stiffness], u[j + PAD_ROW.damping]
    )
    damping *= 0.5
    if force > 0.0:
        damping += 0.25 * m.opt.timestep * force / (floor - height)
    return force, damping


@register_jitable
def friction_dyn(m: Any, d: Any, i: int, j: int) -> float:
    """Write the rates of a friction's states but the first to `act_dot`, and return that of the first."""
    u = m.actuator_user
    k = m.nuser_actuator * int(u[j + FRICTION_ROW.muscle])
    rate = d.userdata[int(u[k + MUSCLE_ROW.userdata]) + LEADER_DATA.rate]
    c, a = k + MUSCLE_ROW.friction_coefficients, m.actuator_actadr[i]
    return friction_rates(u[k + MUSCLE_ROW.friction], rate, d.act, a, u, c, m.opt.timestep, d.act_dot)

"""One muscle at its own length: its balance of forces and the slopes; friction; the sole's pad."""

from typing import Any

from afo_sim.common import AMBIENT_PRESSURE
from afo_sim.native.slots import AIR_ROW, CHAMBER_DATA, FRICTION_ROW, LEADER_DATA, MUSCLE_ROW, PAD_ROW
from afo_sim.physics import (
    Slopes,
    cable_tension,
    friction_of_dead_band,
    friction_of_motion,
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
        u[k + MUSCLE_ROW.law], contraction, pressure, u[k + MUSCLE_ROW.lowest_pressure],
        u[k + MUSCLE_ROW.return_stiffness], u[k + MUSCLE_ROW.braid_stiffness],
        u[k + MUSCLE_ROW.nominal_radius], u[k + MUSCLE_ROW.b], u[k + MUSCLE_ROW.braids],
        u[k + MUSCLE_ROW.contraction_scale], u[k + MUSCLE_ROW.rubber], u[k + MUSCLE_ROW.rubber_bore],
        u[k + MUSCLE_ROW.rubber_turn], u,
        k + MUSCLE_ROW.coefficients,
    )  # fmt: skip


@register_jitable
def cable(m: Any, d: Any, leader: int, contraction: float, shift: float) -> tuple[float, float]:
    """Tension [N] and slope [N/m] of a leader's cable, its anchors displaced by `shift` [m]."""
    u, k = m.actuator_user, m.nuser_actuator * leader
    own = u[k + MUSCLE_ROW.nominal_length] * (1.0 - contraction)
    stretch = d.actuator_length[leader] - u[k + MUSCLE_ROW.series_length] - own - shift
    return cable_tension(stretch, u[k + MUSCLE_ROW.cable_stiffness])


@register_jitable
def yield_force(u: Any, k: int, contraction: float, pressure: float, static: float) -> float:
    """Force by which its friction's dead band weakens the muscle whose row starts at k [N]."""
    dead_band = u[k + MUSCLE_ROW.friction_coefficients]
    if dead_band > pressure:
        dead_band = 0.0 if pressure < 0.0 else pressure
    weaker = static - law_slopes(u, k, contraction, pressure - dead_band)[0]
    return 0.0 if weaker < 0.0 else weaker


@register_jitable
def friction(
    m: Any, d: Any, k: int, contraction: float, moved: float, pressure: float, static: float
) -> tuple[float, float]:
    """Friction of the muscle whose row starts at k, positive while shortening [N], and its slope by κ [N].

    It opposes the step's own move: a rate that looks back has another sign where the muscle comes to rest.
    """
    u, per_step = m.actuator_user, 1.0 / m.opt.timestep
    model, f = u[k + MUSCLE_ROW.friction], k + MUSCLE_ROW.friction_coefficients
    if model == 0.0:
        return 0.0, 0.0
    if is_force(model):
        force, slope = friction_of_motion(model, contraction, per_step * moved, pressure, d.act, 0, u, f)
        return force, per_step * slope
    holder, yields = int(u[k + MUSCLE_ROW.friction_states]), yield_force(u, k, contraction, pressure, static)
    if holder >= 0:
        return friction_of_dead_band(model, yields, moved, d.act, m.actuator_actadr[holder], u, f)
    force, slope = friction_of_dead_band(model, yields, per_step * moved, d.act, 0, u, f)
    return force, per_step * slope


@register_jitable
def damping(m: Any, k: int, rate: float, absolute: float) -> float:
    """Damping of the muscle whose row starts at k, Hill's and the three-element model's [N·s]."""
    u, c = m.actuator_user, k + MUSCLE_ROW.damper
    return u[k + MUSCLE_ROW.damping] * absolute + u[k + MUSCLE_ROW.nominal_length] * three_element_damping(
        absolute - AMBIENT_PRESSURE, rate, u[c], u[c + 1], u[c + 2], u[c + 3], u[c + 4], u[c + 5], u[c + 6]
    )


@register_jitable
def beside_gain(m: Any, d: Any, i: int, state: int, force: float) -> float:
    """Bias that makes the actuator's whole force `force` [N]; its gain's input is what a state becomes."""
    return force + d.actuator_velocity[i] * (d.act[state] + m.opt.timestep * d.act_dot[state])


@register_jitable
def sole_pad_force(m: Any, d: Any, i: int, j: int) -> tuple[float, float]:
    """Upward force of the pad actuator i whose row starts at j [N], and what its gain carries [N·s/m]."""
    u = m.actuator_user
    floor, height = d.ctrl[i], d.actuator_length[i]
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
    u, data, step = m.actuator_user, d.userdata, m.opt.timestep
    k = m.nuser_actuator * int(u[j + FRICTION_ROW.muscle])
    own, chamber = int(u[k + MUSCLE_ROW.userdata]), m.nuser_actuator * int(u[k + MUSCLE_ROW.chamber])
    kappa = data[own + LEADER_DATA.contraction]
    pressure = data[int(u[chamber + AIR_ROW.userdata]) + CHAMBER_DATA.pressure] - AMBIENT_PRESSURE
    yields = yield_force(u, k, kappa, pressure, law_slopes(u, k, kappa, pressure)[0])
    moved = step * data[own + LEADER_DATA.rate]
    c, a = k + MUSCLE_ROW.friction_coefficients, m.actuator_actadr[i]
    return friction_rates(u[k + MUSCLE_ROW.friction], yields, moved, d.act, a, u, c, step, d.act_dot)

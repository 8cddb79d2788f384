"""A walker's own muscles, reflexes and hold on the floor, in MuJoCo's step beside the air.

A reflex stands before its leg's muscles: its dyn writes what it asks of them into `userdata`, from what the
nerves sent some steps ago. A muscle's dyn balances fibre and tendon at this step's posture. All states belong
to the posture one step back, as a network's do, so that a second `mj_forward` changes nothing.
"""

import math
from typing import Any

from afo_sim.native.air_block import block
from afo_sim.native.muscle import beside_gain, sole_pad_force
from afo_sim.native.slots import (
    GRIP_ACT,
    GRIP_ROW,
    LEG_MUSCLE_ACT,
    LEG_MUSCLE_DATA,
    LEG_MUSCLE_ROW,
    REFLEX_ACT,
    REFLEX_ROW,
)
from afo_sim.physics import (
    EARLY_STANCE,
    GASTROCNEMIUS,
    HAMSTRINGS,
    ILIOPSOAS,
    LEG_MUSCLES,
    LONG,
    MIDDLE,
    NERVE,
    NERVES,
    REFLEX,
    SHORT,
    SOLE_PADS,
    SOLEUS,
    TIBIALIS,
    VASTI,
    activated,
    balanced_fibre,
    excitations,
    muscle_power,
    next_state,
    passive_force,
    register_jitable,
)

MUSCLES = len(LEG_MUSCLES)
FLOOR_POINTS = 1024  # heights of an uneven floor, 1 m apart; beyond the last it goes on level
TOE_ACTIVATION = 0.2  # of the tibialis at which the toes are extended as in swing (assumed) [-]


@register_jitable
def leg_muscle_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Balance the leg muscle i whose row starts at j; its rates, and its tension in `userdata`."""
    u, a, step = m.actuator_user, m.actuator_actadr[i], m.opt.timestep
    place = int(u[j + LEG_MUSCLE_ROW.userdata])
    excitation = d.userdata[place + LEG_MUSCLE_DATA.excitation]
    last, before = d.act[a + LEG_MUSCLE_ACT.activation], d.act[a + LEG_MUSCLE_ACT.excitation]
    # the first states are of the first posture, not of one a step before
    activation = activated(last, 0.5 * (before + excitation), step) if d.time > 0.0 else last
    strong = u[j + LEG_MUSCLE_ROW.strength] * activation
    fastest, optimal = u[j + LEG_MUSCLE_ROW.fastest], u[j + LEG_MUSCLE_ROW.optimal]
    length, velocity, tension, along = balanced_fibre(
        d.actuator_length[i], d.act[a + LEG_MUSCLE_ACT.length], d.act[a + LEG_MUSCLE_ACT.velocity], strong,
        step, optimal, u[j + LEG_MUSCLE_ROW.slack], u[j + LEG_MUSCLE_ROW.width], u[j + LEG_MUSCLE_ROW.strain],
        fastest, u[j + LEG_MUSCLE_ROW.damping], u[j + LEG_MUSCLE_ROW.passive],
    )  # fmt: skip
    force, mass = u[j + LEG_MUSCLE_ROW.force], u[j + LEG_MUSCLE_ROW.mass]
    mass *= u[j + LEG_MUSCLE_ROW.strength]  # what is lost of a weak muscle makes no heat
    active = along - u[j + LEG_MUSCLE_ROW.damping] * velocity / fastest
    if u[j + LEG_MUSCLE_ROW.passive] > 0.0:
        active -= u[j + LEG_MUSCLE_ROW.passive] * passive_force(length)[0]
    heat, moving = muscle_power(
        excitation, activation, length, velocity, along, active, u[j + LEG_MUSCLE_ROW.slow],
    )  # fmt: skip
    d.userdata[place + LEG_MUSCLE_DATA.tension] = force * tension
    per_step = 1.0 / step
    d.act_dot[a + LEG_MUSCLE_ACT.excitation] = (excitation - before) * per_step
    d.act_dot[a + LEG_MUSCLE_ACT.activation] = (activation - last) * per_step
    d.act_dot[a + LEG_MUSCLE_ACT.length] = (length - d.act[a + LEG_MUSCLE_ACT.length]) * per_step
    d.act_dot[a + LEG_MUSCLE_ACT.velocity] = (velocity - d.act[a + LEG_MUSCLE_ACT.velocity]) * per_step
    d.act_dot[a + LEG_MUSCLE_ACT.force] = (tension - d.act[a + LEG_MUSCLE_ACT.force]) * per_step
    d.act_dot[a + LEG_MUSCLE_ACT.energy] = heat * mass + moving * force * optimal


@register_jitable
def toe_moment(m: Any, d: Any, i: int, j: int) -> float:
    """Moment of the toes' damper and extensors [N·m]; these have the tibialis' nerve and strength."""
    u, k = m.actuator_user, int(m.actuator_user[j + REFLEX_ROW.muscle]) + TIBIALIS
    at, toe = m.actuator_actadr[k] + LEG_MUSCLE_ACT.activation, m.actuator_trnid[2 * i]
    strong = u[m.nuser_actuator * k + LEG_MUSCLE_ROW.strength] * (d.act[at] + m.opt.timestep * d.act_dot[at])
    extension = u[j + REFLEX_ROW.extension] * min(strong / TOE_ACTIVATION, 1.0)
    return extension - m.dof_damping[toe] * d.qvel[toe]  # MuJoCo takes as much at the end of a step


@register_jitable
def floor_at(heights: Any, place: int, x: float) -> float:
    """Height of the floor [m]: from point to point a cubic that is level at both; 0 for a plane."""
    if place == 0 or not x > 0.0:
        return 0.0
    k = min(int(x), FLOOR_POINTS - 2)
    share = min(x - k, 1.0)
    first = heights[place + k]
    return first + (heights[place + k + 1] - first) * share * share * (3.0 - 2.0 * share)


@register_jitable
def load_on(m: Any, d: Any, j: int) -> float:
    """Load on the foot of the leg whose reflexes' row starts at j, over the body weight."""
    u, pad, total = m.actuator_user, int(m.actuator_user[j + REFLEX_ROW.pad]), 0.0
    for k in range(pad, pad + SOLE_PADS):
        total += sole_pad_force(m, d, k, m.nuser_actuator * k)[0]
    return total / u[j + REFLEX_ROW.weight]


@register_jitable
def ahead_of_trunk(m: Any, d: Any, j: int) -> float:
    """How far the foot's centre of mass is ahead of the trunk's, horizontally [m]."""
    u, slope = m.actuator_user, m.actuator_user[j + REFLEX_ROW.slope]
    foot, trunk = 3 * int(u[j + REFLEX_ROW.foot]), 3 * int(u[j + REFLEX_ROW.trunk])
    up = d.xipos[foot + 2] - d.xipos[trunk + 2]
    return math.cos(slope) * (d.xipos[foot] - d.xipos[trunk]) - math.sin(slope) * up


@register_jitable
def sent(m: Any, j: int, delay: float, now: int) -> int:
    """Where `userdata` holds what a leg's nerves, its row at j, sent `delay` [s] before step `now`."""
    u, back = m.actuator_user, int(delay / m.opt.timestep + 0.5)
    return int(u[j + REFLEX_ROW.userdata]) + NERVES * ((now - back) % int(u[j + REFLEX_ROW.slots]))


@register_jitable
def rate_now(d: Any, k: int, odd: int) -> float:
    """Rate of the joint k at the positions' own instant, from those half a step and one and a half before."""
    before, d.userdata[2 * k + odd] = d.userdata[2 * k + 1 - odd], d.qvel[k]
    return 1.5 * d.qvel[k] - 0.5 * before if d.time > 0.0 else before  # the first is known


@register_jitable
def add_centrifugal(m: Any, d: Any) -> None:
    """Add to the bias what rates of now ask beyond those of half a step ago."""
    # Where a hinge's rate squared grows by s beyond its parent's, all that it carries is pulled to it by s r.
    r, odd = block(), int(d.time / m.opt.timestep + 0.5) % 2
    r[1] = r[m.nv + 1] = 0.0
    for k in range(2, m.nv):  # hinges, behind two slides
        parent, body, turned = m.dof_parentid[k], m.dof_bodyid[k], -d.xaxis[3 * k + 1]
        r[k] = r[parent] + turned * d.qvel[k]
        r[m.nv + k] = r[m.nv + parent] + turned * rate_now(d, k, odd)
        growth = r[2 * m.nv + k] = r[m.nv + k] ** 2 - r[k] ** 2 - r[m.nv + parent] ** 2 + r[parent] ** 2
        x, z, mass = d.xanchor[3 * k], d.xanchor[3 * k + 2], m.body_subtreemass[body]
        moment_x, moment_z = mass * (d.subtree_com[3 * body] - x), mass * (d.subtree_com[3 * body + 2] - z)
        d.qfrc_bias[0] -= growth * moment_x
        d.qfrc_bias[1] -= growth * moment_z
        while parent > 1:
            crossed = (x - d.xanchor[3 * parent]) * moment_z - (z - d.xanchor[3 * parent + 2]) * moment_x
            d.qfrc_bias[k] += turned * r[2 * m.nv + parent] * crossed
            d.qfrc_bias[parent] += d.xaxis[3 * parent + 1] * growth * crossed
            parent = m.dof_parentid[parent]


@register_jitable
def reflex_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Let the reflexes whose row starts at j ask, by what the soles bear and which foot is ahead."""
    other = m.nuser_actuator * int(m.actuator_user[j + REFLEX_ROW.other])
    if j == 0:  # once for the body
        add_centrifugal(m, d)
        pad, floor = int(m.actuator_user[REFLEX_ROW.pad]), int(m.actuator_user[REFLEX_ROW.floor])
        for k in range(pad, pad + 2 * SOLE_PADS):  # the grips, in the pads' order, stand behind them
            d.ctrl[k] = floor_at(d.userdata, floor, d.actuator_length[k + 2 * SOLE_PADS])
    reflexes_of(
        m, d, i, j, load_on(m, d, j), load_on(m, d, other), ahead_of_trunk(m, d, j),
        ahead_of_trunk(m, d, other),
    )  # fmt: skip


@register_jitable
def reflexes_of(
    m: Any, d: Any, i: int, j: int, load: float, other_load: float, ahead: float, other_ahead: float
) -> None:
    """Let the nerves carry this step's signals, and ask the muscles for what those of earlier steps bring."""
    u, a, step = m.actuator_user, m.actuator_actadr[i], m.opt.timestep
    now = int(d.time / step + 0.5)
    place, first = int(u[j + REFLEX_ROW.userdata]), int(u[j + REFLEX_ROW.muscle])
    slot = place + NERVES * (now % int(u[j + REFLEX_ROW.slots]))
    for k in range(MUSCLES):
        own = m.actuator_actadr[first + k]
        d.userdata[slot + NERVE.force + k] = d.act[own + LEG_MUSCLE_ACT.force]
    for nerve, k in (
        (NERVE.tibialis_length, TIBIALIS),
        (NERVE.iliopsoas_length, ILIOPSOAS),
        (NERVE.hamstrings_length, HAMSTRINGS),
        (NERVE.soleus_length, SOLEUS),
        (NERVE.gastrocnemius_length, GASTROCNEMIUS),
    ):
        d.userdata[slot + nerve] = d.act[m.actuator_actadr[first + k] + LEG_MUSCLE_ACT.length]
    knee, pitch = d.qpos[int(u[j + REFLEX_ROW.knee])], d.qpos[int(u[j + REFLEX_ROW.pitch])]
    d.userdata[slot + NERVE.knee] = knee
    d.userdata[slot + NERVE.pitch] = pitch + u[j + REFLEX_ROW.slope]  # to the vertical
    d.userdata[slot + NERVE.knee_rate] = d.qvel[int(u[j + REFLEX_ROW.knee_rate])]
    d.userdata[slot + NERVE.pitch_rate] = d.qvel[int(u[j + REFLEX_ROW.pitch_rate])]
    d.ctrl[int(u[j + REFLEX_ROW.tissue])] = -knee

    before = int(d.act[a + REFLEX_ACT.phase] + 0.5)
    state = next_state(before, load, other_load, ahead, other_ahead, u[j + REFLEX_ROW.gains + REFLEX.load])
    came_down = 1.0 if state == EARLY_STANCE and before != EARLY_STANCE else 0.0
    d.act_dot[a + REFLEX_ACT.phase] = (state - d.act[a + REFLEX_ACT.phase]) / step
    d.act_dot[a + REFLEX_ACT.strikes] = came_down / step

    signals, data = block(), d.userdata
    short, middle, long = (  # of forces and lengths, which are of a step before
        sent(m, j, SHORT - step, now), sent(m, j, MIDDLE - step, now), sent(m, j, LONG - step, now),
    )  # fmt: skip
    for k in range(MUSCLES):
        at = middle if k == VASTI else long if k > VASTI else short
        signals[NERVE.force + k] = data[at + NERVE.force + k]
    for nerve in (NERVE.tibialis_length, NERVE.soleus_length, NERVE.gastrocnemius_length):
        signals[nerve] = data[long + nerve]
    for nerve in (NERVE.iliopsoas_length, NERVE.hamstrings_length):
        signals[nerve] = data[short + nerve]
    for nerve, rate, delay, after in (
        (NERVE.knee, NERVE.knee_rate, MIDDLE, middle), (NERVE.pitch, NERVE.pitch_rate, SHORT, short),
    ):  # fmt: skip
        at = sent(m, j, delay, now)
        signals[nerve] = data[at + nerve]
        signals[rate] = 0.5 * (data[at + rate] + data[after + rate])  # each is of half a step before
    own = m.nuser_actuator * first
    out = int(u[own + LEG_MUSCLE_ROW.userdata]) + LEG_MUSCLE_DATA.excitation
    excitations(state, u, j + REFLEX_ROW.gains, signals, d.userdata, out, len(LEG_MUSCLE_DATA))


@register_jitable
def load_under(m: Any, d: Any, j: int) -> float:
    """Load on the pad of the grip whose row starts at j [N]."""
    pad = int(m.actuator_user[j + GRIP_ROW.pad])
    return sole_pad_force(m, d, pad, m.nuser_actuator * pad)[0]


@register_jitable
def held_by_floor(m: Any, d: Any, i: int, j: int, load: float) -> tuple[float, float, float]:
    """Forward force of the floor on the grip whose row starts at j [N], its gain's [N·s/m], its place [m]."""
    # A spring from where the sole came down, |F| ≤ μ N; where it would be more, that place moves along.
    u = m.actuator_user
    pressed = u[j + GRIP_ROW.friction] * load
    at, anchor = d.actuator_length[i], d.act[m.actuator_actadr[i] + GRIP_ACT.anchor]
    stiff, damping = u[j + GRIP_ROW.stiffness], u[j + GRIP_ROW.damping]
    if pressed <= 0.0:
        return 0.0, 0.0, at
    force = -stiff * (at - anchor) - damping * d.actuator_velocity[i]
    if -pressed <= force <= pressed:
        return force, 0.5 * damping + 0.25 * m.opt.timestep * stiff, anchor
    bound = pressed if force > 0.0 else -pressed
    sprung = -stiff * (at - anchor)
    if sprung > pressed:
        anchor = at + pressed / stiff
    elif sprung < -pressed:
        anchor = at - pressed / stiff
    return bound, 0.0, anchor


@register_jitable
def grip_bias(m: Any, d: Any, i: int, j: int) -> float:
    """Bias of the grip i whose row starts at j; its last state is its gain's input."""
    force, _, _ = held_by_floor(m, d, i, j, load_under(m, d, j))
    return beside_gain(m, d, i, m.actuator_actadr[i] + GRIP_ACT.carried, force)


@register_jitable
def grip_dyn(m: Any, d: Any, i: int, j: int) -> None:
    """Write the rates of the grip i whose row starts at j."""
    a, step = m.actuator_actadr[i], m.opt.timestep
    _, damping, anchor = held_by_floor(m, d, i, j, load_under(m, d, j))
    d.act_dot[a + GRIP_ACT.anchor] = (anchor - d.act[a + GRIP_ACT.anchor]) / step
    d.act_dot[a + GRIP_ACT.carried] = (damping - d.act[a + GRIP_ACT.carried]) / step

"""Guides of a muscle's path: how far it turns where its cable slides, and the tension behind their friction.

The muscle hangs on its origin. So the cable slides over the guides on the origin's segment, at the speed at
which the whole path grows. It does not slide over those on the other segment, where it ends: between them no
length changes, and their friction does nothing. How cuff and plate give way is left out of the speed.
"""

from typing import Any

from afo_sim.native.slots import MUSCLE_ROW
from afo_sim.physics import capstan, register_jitable
from afo_sim.physics.series import turn

SITE = 3  # mjWRAP_SITE
MARGIN = 4.0  # by which the inertia that friction has to stop may be less than it is at the model's posture


@register_jitable
def turned(m: Any, d: Any, tendon: int) -> float:
    """Angles by which a spatial tendon turns at points and surfaces on its origin's body, together [rad]."""
    xyz, entry = d.wrap_xpos, m.tendon_adr[tendon]
    origin, here = m.site_bodyid[m.wrap_objid[entry]], -1
    before_x, before_y, before_z, total = 0.0, 0.0, 0.0, 0.0
    begun = False
    start = d.ten_wrapadr[tendon]
    for at in range(start, start + d.ten_wrapnum[tendon]):
        last, geom = here, d.wrap_obj[at]
        if geom >= 0:
            here = m.geom_bodyid[geom]
        else:  # the next site of the tendon; surfaces that it passes by have no point here
            while m.wrap_type[entry] != SITE:
                entry += 1
            here = m.site_bodyid[m.wrap_objid[entry]]
            entry += 1
        if at == start:
            continue
        if last != origin:
            break
        x, y = xyz[3 * at] - xyz[3 * at - 3], xyz[3 * at + 1] - xyz[3 * at - 2]
        z = xyz[3 * at + 2] - xyz[3 * at - 1]
        if x * x + y * y + z * z <= 1e-24:  # a surface that is just touched
            continue
        if begun:  # without a piece before it a turn would be that between zeros of either sign
            total += turn(before_x, before_y, before_z, x, y, z)
        begun, before_x, before_y, before_z = True, x, y, z
    return total


@register_jitable
def behind_guides(m: Any, d: Any, i: int, j: int, tension: float) -> tuple[float, float]:
    """Tension that the joint feels of the muscle actuator i whose row starts at j [N]; its secant [N·s/m]."""
    tendon = m.actuator_trnid[2 * i]
    friction = m.actuator_user[j + MUSCLE_ROW.wrap_friction]
    return capstan(tension, friction, turned(m, d, tendon), d.ten_velocity[tendon])


@register_jitable
def friction_carried(m: Any, d: Any, leader: int, k: int, tension: float) -> tuple[float, float]:
    """Ratio of the tensions behind and before the guides of a leader with its row at k [-], and damping."""
    u = m.actuator_user
    behind, secant = behind_guides(m, d, leader, k, tension)
    together = u[k + MUSCLE_ROW.parallel] * secant
    taken = MARGIN * m.opt.timestep * together * u[k + MUSCLE_ROW.inverse_mass]
    ratio = behind / tension if tension > 0.0 else 1.0
    return ratio, together * taken / (1.0 + taken)

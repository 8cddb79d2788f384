"""The floor under one point of the sole: a spring that loses energy, and never pulls."""

from afo_sim.physics.jitable import register_jitable

SOLE_PADS = 4  # under heel, ball, pulp and tip of a foot with toes


@register_jitable
def pad_force(
    floor: float, height: float, velocity: float, stiffness: float, damping: float
) -> tuple[float, float]:
    """Force of a pad between sole and floor, and its damping.

    F = k · max(0, R − z) · max(0, 1 − c ż): the damping grows with the depth, so that the force starts
    from zero however fast the pad comes down, and one that leaves fast does not stick.

    Parameters
    ----------
    floor : R, height at which the pad just touches [m]
    height, velocity : z, ż of the point, upward [m], [m/s]
    stiffness : k [N/m]
    damping : c, share of the force by velocity [s/m]

    Returns
    -------
    (force on the sole, upward, ≥ 0 [N]; −dF/dż [N·s/m])

    Source
    ------
    Hunt & Crossley 1975, J. Appl. Mech. 42(2), doi 10.1115/1.3423596, with a linear spring.
    """
    depth, give = floor - height, 1.0 - damping * velocity
    if depth < 0.0:
        depth = 0.0
    slope = stiffness * depth * damping
    if give < 0.0:
        give, slope = 0.0, 0.0
    return stiffness * depth * give, slope

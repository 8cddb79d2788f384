"""Coulomb friction whose dead band is a pressure, Hunt, Graber-Tilton & Quinn 2017."""

import math

from afo_sim.physics.friction.law import DEAD_BAND, Friction
from afo_sim.physics.jitable import register_jitable
from afo_sim.physics.law import LawParameter


@register_jitable
def hunt_friction(
    yields: float, contraction_rate: float, dead_band: float, creep_rate: float
) -> tuple[float, float]:
    """Coulomb friction of a dead band Q: F = W sgn κ̇, smoothed to W tanh(κ̇/κ̇_r).

    A muscle that holds a load creeps, at most at about κ̇_r.

    Parameters
    ----------
    yields : W, force by which the dead band Q of pressure weakens the muscle now [N], not negative
    contraction_rate : κ̇ [1/s]
    dead_band : Q, half the width of the hysteresis loop [Pa], which W stands for
    creep_rate : κ̇_r [1/s], above zero

    Returns
    -------
    (friction [N], its derivative by κ̇ [N·s])

    Source
    ------
    Hunt, Graber-Tilton & Quinn 2017, Modeling length effects of braided pneumatic actuators, ASME
    IDETC, V05AT08A008: P = … + 15.6 kPa · S, S = +1 shortening, −1 lengthening, 0 static.
    """
    sign = math.tanh(contraction_rate / creep_rate)
    return yields * sign, yields * (1.0 - sign * sign) / creep_rate


PARAMETERS = (
    DEAD_BAND,
    LawParameter(
        "creep_rate", "κ̇_r", "s^-1", 1e-6, 1.0, "contraction rate at which friction is 76 % there",
        (5e-3, 1.5e-2),
    ),
)  # fmt: skip

HUNT_2017 = Friction(
    name="hunt_2017",
    native_id=3,
    unit="Pa",
    n_state=0,
    parameters=PARAMETERS,
    coefficients=lambda braid, q: (q["dead_band"], q["creep_rate"]),
    kernel=hunt_friction,
    formula="F = W tanh(κ̇/κ̇_r), W what Q weakens the muscle by",
    validity="Festo Ø10, Q = 15.6 kPa; no force at rest, so a held muscle creeps",
    source="Hunt, Graber-Tilton & Quinn 2017",
)

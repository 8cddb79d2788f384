"""A muscle at rest and without friction: its force, and what inverts it."""

from collections.abc import Sequence
from dataclasses import dataclass

from afo_sim.physics.curves import CONTRACTED, HALVINGS, crossing
from afo_sim.physics.law import Braid
from afo_sim.physics.static_force import signed_force


@dataclass(frozen=True)
class AtRest:
    """Force law, braid stiffness and return force as the compiled muscle computes them, in tension only.

    `law` is the native id, whose `coefficients` follow; `lowest_pressure` [Pa] is that of the law's range,
    `braid_stiffness` [N] acts when the braid is stretched, `return_stiffness` [N] without air.
    """

    law: float
    coefficients: Sequence[float]
    lowest_pressure: float
    braid_stiffness: float
    return_stiffness: float
    braid: Braid
    braids: float

    def force(self, contraction: float, pressure: float) -> float:
        """Tension [N], ≥ 0, at a contraction ratio [-] and a gauge pressure [Pa]."""
        signed = self.signed(contraction, pressure)
        return 0.0 if signed < 0.0 else signed  # a NaN comes out here

    def signed(self, contraction: float, pressure: float) -> float:
        """Force [N], negative where the muscle is slack, at a contraction ratio and a gauge pressure [Pa]."""
        return signed_force(
            self.law,
            contraction,
            pressure,
            self.lowest_pressure,
            self.return_stiffness,
            self.braid_stiffness,
            self.braid.nominal_radius,
            self.braid.b,
            self.braids,
            self.coefficients,
            0,
        )

    def contraction(self, pressure: float, force: float, most_stretched: float) -> float:
        """Contraction ratio [-] at which a force [N] is carried at a gauge pressure [Pa].

        Between `most_stretched` and 0.7; of no force, where the muscle goes slack; NaN when none carries it.
        """
        if not (0.0 <= force <= self.force(most_stretched, pressure)):
            return float("nan")
        return crossing(
            lambda kappa: self.force(kappa, pressure) - force, (), most_stretched, CONTRACTED, HALVINGS
        )

    def pressure(self, force: float, contraction: float, highest: float) -> float:
        """Lowest gauge pressure [Pa], up to `highest`, that carries a force [N]; NaN when none does."""
        if not (0.0 <= force <= self.force(contraction, highest)):
            return float("nan")
        if self.force(contraction, 0.0) >= force:
            return 0.0
        return crossing(lambda gauge: force - self.force(contraction, gauge), (), 0.0, highest, HALVINGS)

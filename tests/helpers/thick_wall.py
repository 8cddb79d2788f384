"""Energy of a rubber tube in a braid by numbers: three principal stretches at each radius of its wall."""

import math
from typing import Any

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)


def wall_energy(contraction: Any, degrees: float, bore: float) -> Any:
    """U/(S L0) with S = π μ R0²/2, of the wall between radii at rest √ρ and 1, by Gauss-Legendre.

    The threads of constant length hold the outside; between it and R the rubber keeps its volume. Along λ,
    around r/R, across dr/dR.
    """
    angle, along = math.radians(degrees), np.asarray(1.0 - contraction)[..., None]
    outside = (1.0 - (along * math.cos(angle)) ** 2) / math.sin(angle) ** 2
    inner = math.sqrt(bore)
    rest = 0.5 * (1.0 + inner) + 0.5 * (1.0 - inner) * NODES
    radius = (outside - (1.0 - rest**2) / along) ** 0.5
    strain = along**2 + (radius / rest) ** 2 + (rest / (along * radius)) ** 2 - 3.0
    return 0.5 * (1.0 - inner) * np.sum(WEIGHTS * 2.0 * rest * strain, axis=-1)


def wall_tension(contraction: Any, degrees: float, bore: float) -> Any:
    """T/S = d(U/(S L0))/dλ = −d/dκ, by a complex step, which takes no difference."""
    return -np.imag(wall_energy(contraction + 1e-30j, degrees, bore)) / 1e-30

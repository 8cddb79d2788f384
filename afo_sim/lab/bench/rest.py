"""A muscle at rest: its force by the formula, and the loads, lengths and pressures it allows."""

from collections.abc import Callable

import numpy as np

from afo_sim.common.units import AMBIENT_PRESSURE
from afo_sim.description.muscle import Muscle
from afo_sim.physics.curves import crossing

LONGEST, SHORTEST = -0.5, 0.7  # contraction ratios between which anything is looked for


def rest_force(muscle: Muscle, contraction: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Tension at rest and without friction, exactly as the compiled muscle computes it.

    Law, braid stiffness and clamp to tension; the law as a muscle asks it (`muscle_static_force`).

    Units: contraction [-] (n,), pressure [Pa] (n,), returns [N].
    """
    return np.asarray(muscle.force(pressure, contraction=contraction))


def force_at(muscle: Muscle, contraction: float, pressure: float) -> float:
    """`rest_force` of one contraction [-] and gauge pressure [Pa]."""
    return float(rest_force(muscle, np.array([contraction]), np.array([pressure]))[0])


def slack(muscle: Muscle, pressure: float) -> float:
    """Contraction ratio from which a muscle at a gauge pressure [Pa] carries nothing [-]."""
    return _crossing(lambda x: force_at(muscle, x, pressure) - 1e-9, 0.0, SHORTEST)


def hanging(muscle: Muscle, load: float, pressure: float) -> float:
    """Contraction ratio at which a load [N] rests on a muscle at a gauge pressure [Pa]."""
    return _crossing(lambda x: force_at(muscle, x, pressure) - load, LONGEST, SHORTEST)


def lifting(muscle: Muscle, load: float, contraction: float, highest: float) -> float:
    """Lowest gauge pressure, up to `highest` [Pa], that carries a load [N] at a contraction [-]."""
    return _crossing(lambda p: load - force_at(muscle, contraction, p), 0.0, highest)


def damping(muscle: Muscle, pressure: float) -> float:
    """Largest dF/dκ̇ of a muscle's dampers at a gauge pressure [N·s]."""
    total = muscle.damping * (pressure + AMBIENT_PRESSURE)
    if muscle.damper is not None:
        above = muscle.damper.relaxing_above or muscle.damper.relaxing
        lines = (muscle.damper.contracting, muscle.damper.relaxing, above)
        total += muscle.nominal_length * max(b0 + b1 * pressure for b0, b1 in lines)
    return total


def _crossing(falling: Callable[[float], float], low: float, high: float) -> float:
    """Zero of a function that falls from low to high; one ulp of the interval is left after 52 halvings."""
    return crossing(falling, (), low, high, 52)

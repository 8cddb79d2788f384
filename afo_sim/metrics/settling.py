"""How the settled stride of a walk was found, and how well it repeats."""

import math

from afo_sim.metrics.metric import TIME, Metric, measured, tells


@tells(
    TIME,
    (
        "strides_solved",
        "",
        "Strides that the solver walked",
        "a wearer walks more until it settles",
    ),
    ("settled_air_change", "percent", "Change of the air over the settled stride", "largest, of mass and σ"),
    ("settled_angle_change", "deg", "Distance of the last two strides", "largest, of the ankle's angle"),
)
def settling_metrics(strides: int, air: float, angle: float) -> dict[str, Metric]:
    """Metrics of a stride that was solved for.

    Parameters
    ----------
    strides : walked in all [-]
    air : largest relative change of a chamber's air over the stride [-]
    angle : largest distance of the ankle's angle between the last two strides [rad]
    """
    values = {
        "strides_solved": float(strides),
        "settled_air_change": 100.0 * air,
        "settled_angle_change": math.degrees(angle),
    }
    return {name: measured(name, value) for name, value in values.items()}

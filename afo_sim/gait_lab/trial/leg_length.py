"""The leg's length, which tells a wrong unit of length."""

import numpy as np

from afo_sim.gait_lab.trial.leg_points import LegPoints

# Hip centre to ankle centre, toddlers to the tallest. Adults have 0.49 of the body's height (Winter 2009,
# segment lengths: thigh 0.245 H, shank 0.246 H); 1.2 m is 2.45 m of height, 0.15 m is 0.3 m.
LEG = (0.15, 1.2)  # [m]
UNITS = {1000.0: "millimetres", 100.0: "centimetres", 10.0: "decimetres", 0.001: "metres read as millimetres"}


def leg_length(points: LegPoints) -> float:
    """Hip to knee to ankle, the trial's median [m]; NaN if they are never seen together."""
    paths = {role: points.points[role].path for role in ("hip", "knee", "ankle")}
    thigh, shank = paths["hip"] - paths["knee"], paths["knee"] - paths["ankle"]
    lengths = np.linalg.norm(thigh, axis=1) + np.linalg.norm(shank, axis=1)
    return float(np.nanmedian(lengths)) if np.any(np.isfinite(lengths)) else float("nan")


def unit_doubt(points: LegPoints) -> str | None:
    """What a leg of impossible length says about the unit, in a sentence; None if the leg is possible.

    The range of legs spans less than a factor of 10, so that at most one of the usual units fits.
    """
    length = leg_length(points)
    if not np.isfinite(length) or LEG[0] <= length <= LEG[1]:
        return None
    seen = f"the {points.side} leg, hip to knee to ankle, is {length:.3g} m long"
    for factor, unit in UNITS.items():
        if LEG[0] <= length / factor <= LEG[1]:
            return f"{seen}: {unit}? divided by {factor:g} it is {length / factor:.2f} m; state the unit"
    return f"{seen}, and no unit of length makes it a leg of {LEG[0]:g} to {LEG[1]:g} m"

"""A gait cycle from published mean curves, which have angles, forces and moment but no path of the ankle."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from afo_sim.common.units import GRAVITY
from afo_sim.gait.checks import COP_FORCE, LATE_SWING
from afo_sim.gait.cycle import GaitCycle
from afo_sim.gait.hip_path import Chain, ankle_path
from afo_sim.gait.rocker import FootShape

ROWS = 201  # every 0.5 % of the stride, so that points at every 2 % stay what they were
ANGLES = ("shank_angle", "knee_angle", "ankle_angle")
FORCES = ("grf_x", "grf_z", "ankle_moment")


def resampled(phase: np.ndarray, curves: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Published points as smooth columns of ROWS rows over one closed stride.

    What an angle fails to close by is taken out as a straight line about mid-stride, as `FourierSeries.fit`
    does, so that the stride repeats; periodic cubic splines run through the points. Forces and moment are
    monotone between their points (PCHIP), so that nothing overshoots at heel strike and toe-off.

    Units: phase [-] (n,), curves (n,).
    """
    fine = np.linspace(0.0, 1.0, ROWS)
    columns = {"phase": fine}
    for name in ANGLES:
        values = curves[name] - (curves[name][-1] - curves[name][0]) * (phase - 0.5)
        values[-1] = values[0]  # equal to the last bit, which the spline asks for
        columns[name] = CubicSpline(phase, values, bc_type="periodic")(fine)
    return columns | {name: PchipInterpolator(phase, curves[name])(fine) for name in FORCES}


def centre_of_pressure(
    moment: np.ndarray, force_x: np.ndarray, force_z: np.ndarray, height: np.ndarray
) -> np.ndarray:
    """Where the ground presses, ahead of the ankle, so that its force has the ankle's moment [m] (n,).

    Units: moment [N·m/kg] (n,), force_x, force_z [body weights] (n,), height [m] (n,).
    """
    pressing = force_z > COP_FORCE
    ahead = -moment / GRAVITY - height * force_x
    return np.where(pressing, ahead / np.where(pressing, force_z, 1.0), np.nan)


def with_derived_path(cycle: GaitCycle, foot: FootShape, chain: Chain) -> GaitCycle:
    """The same stride with its ankle's path and centre of pressure derived from its other columns."""
    length = cycle.walking_speed * cycle.stride_time
    angles = cycle.shank_angle, cycle.knee_angle, cycle.ankle_angle
    path = ankle_path(cycle.phase, angles, cycle.grf_z, length, foot, chain)
    place = centre_of_pressure(cycle.ankle_moment, cycle.grf_x, cycle.grf_z, path.up)
    place = np.where(cycle.phase < LATE_SWING, place, np.nan)
    return dataclasses.replace(cycle, ankle_x=path.forward, ankle_z=path.up, cop_x=place)

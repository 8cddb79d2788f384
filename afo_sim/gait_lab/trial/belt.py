"""The treadmill's belt: its speed by the foot that stands on it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.gait_lab.readers.signals import low_pass
from afo_sim.gait_lab.trial.choices import Choices
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.travel import SMOOTH, seen

LOWEST = 0.25  # share of a stride in which a foot surely lies flat; derived from 15–35 %, `USUAL` [-]
RIPPLE = 0.005  # of a marker's height while the foot lies flat; assumed [m]
SWING = 0.03  # least rise of heel or toe that is a step; assumed [m]
STEADY = 0.08  # shortest time of a foot's rest that tells its speed; assumed [s]
BELT_ERROR = 0.05  # between the belt's speeds as given and as found
BELT_SPREAD = 0.1  # of the belt's speed from step to step, or between the feet; assumed


@dataclass(frozen=True, eq=False)
class StandingFoot:
    """What a foot does while it stands: nothing on a floor, a way back on a belt."""

    velocity: np.ndarray  # in the two level axes [m/s] (2,)
    speeds: np.ndarray  # of each time it stood [m/s] (k,)


def standing_foot(leg: LegPoints, up: np.ndarray, level: list[int], period: float | None) -> StandingFoot:
    """Velocity of a foot while it lies flat: both its ends at their lowest.

    Markers of feet on a floor creep forward meanwhile, by 1 to 2 % of walking speed in four recorded walks,
    so that a belt is found as much too slow.

    Units: up (3,), period [s].
    """
    nothing = StandingFoot(np.zeros(2), np.zeros(0))
    time, ends = seen(leg.time, np.hstack([leg.points["heel"].path, leg.points["toe"].path]))
    if len(time) < 10:
        return nothing
    ends = low_pass(time, ends, SMOOTH)
    heights = np.column_stack([ends[:, :3] @ up, ends[:, 3:] @ up])
    raised = np.max(heights - np.quantile(heights, 0.02, axis=0), axis=1)
    if raised.max() < SWING:
        return nothing
    swing = np.flatnonzero(raised > 0.5 * raised.max())
    reach = period or math.inf
    walks = (time >= time[swing[0]] - reach) & (time <= time[swing[-1]] + reach)
    low = walks & (raised <= np.quantile(raised[walks], LOWEST) + RIPPLE)
    edges = np.flatnonzero(np.diff(np.r_[False, low, False].astype(int)))
    runs = list(zip(edges[::2], edges[1::2], strict=True))
    # before the first and after the last swing the walker may stand on a belt that stands
    between = [run for run in runs if swing[0] < run[0] and run[1] <= swing[-1]]
    middle = 0.5 * (ends[:, level] + ends[:, [3 + k for k in level]])
    found, weights = [], []
    for start, stop in between or runs:
        clock = time[start:stop] - time[start:stop].mean()
        if clock[-1] - clock[0] >= STEADY:
            weights.append(float(clock @ clock))
            found.append(clock @ middle[start:stop] / weights[-1])
    if not found:
        return nothing
    return StandingFoot(np.average(found, axis=0, weights=weights), np.linalg.norm(found, axis=1))


def belt_speed_of(
    feet: Mapping[str, StandingFoot], found: float, choices: Choices
) -> tuple[float, list[str]]:
    """Speed of the belt under the chosen foot as given, or else as found [m/s], and warnings.

    Units: found [m/s].
    """
    warnings = []
    speeds = {side: float(np.linalg.norm(foot.velocity)) for side, foot in feet.items() if len(foot.speeds)}
    if found and max(speeds.values()) - min(speeds.values()) > BELT_SPREAD * found:
        each = ", ".join(f"{side} {speed:.2f}" for side, speed in speeds.items())
        warnings.append(f"the belts of the two feet differ: {each} m/s; the {choices.side} one counts")
        found = speeds.get(choices.side, found)
    steps = np.concatenate([foot.speeds for foot in feet.values()])
    if found and len(speeds) and np.ptp(steps) > 2.0 * BELT_SPREAD * found:
        seen = f"from {steps.min():.2f} to {steps.max():.2f} m/s"
        warnings.append(f"the belt's speed changes from step to step, {seen}; its mean counts")
    given = choices.belt_speed
    if given is None:
        return found, warnings
    if given and not found:
        raise InputError(
            "the feet stand still on the ground",
            field="belt_speed",
            value=given,
            allowed="none of a walk overground, or where the belt's travel is added already",
        )
    if abs(given - found) > BELT_ERROR * found:
        share = f"{100.0 * (given / found - 1.0):+.0f} %"
        seen = f"the standing foot moves at {found:.3g} m/s"
        warnings.append(f"belt_speed = {given:.3g} m/s is taken, but {seen} ({share})")
    return given, warnings

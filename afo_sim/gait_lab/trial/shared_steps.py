"""Steps that stand on two plates at once, of which one carries the other foot too."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from afo_sim.gait_lab.readers.plates import Plate
from afo_sim.gait_lab.trial.events import find_events
from afo_sim.gait_lab.trial.ground_force import EDGE, GroundForce
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.leg_points import LegPoints
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride
from afo_sim.gait_lab.trial.standing_on import stands_there
from afo_sim.gait_lab.trial.walking_frame import WalkingFrame

ELSEWHERE = 0.08  # share of the weight on other plates while the other foot swings (assumed) [-]
MIDDLE = (0.2, 0.8)  # part of the other foot's swing in which it surely stands nowhere (assumed) [-]


def without_shared_steps(
    strides: Sequence[RecordedStride],
    plates: Sequence[Plate],
    grounds: Mapping[str, GroundForce],
    motions: Mapping[str, LegMotion],
    legs: Mapping[str, LegPoints],
    frame: WalkingFrame,
) -> list[RecordedStride]:
    """The strides; those whose foot stands on a second plate as well are not loaded, and say so.

    While one foot swings, all that presses near the other is the other's. What a plate carries then that is
    not counted for that foot is lost to its force and moment, and to the body's mass.
    """
    swings = {side: _swings(motion) for side, motion in motions.items()}
    found = []
    for stride in strides:
        other = "left" if stride.side == "right" else "right"
        judged = stride.loaded and stride.closed is None and stride.side in grounds and other in swings
        during = [(a, b) for a, b in swings.get(other, ()) if stride.start < a and b < stride.toe_off]
        lost = _lost(stride.side, during, plates, grounds, legs, frame) if judged and during else 0.0
        if lost > ELSEWHERE:
            told = f"{100.0 * lost:.0f} % of the weight stands on another plate while the other foot swings"
            by = f"{stride.by}; the ground force is missing in part ({told})"
            stride = replace(stride, loaded=False, by=by)
        found.append(stride)
    return found


def _swings(motion: LegMotion) -> list[tuple[float, float]]:
    """The middle of each swing of a foot [s]."""
    events = find_events(motion)
    found = []
    for off in events.toe_offs:
        strike = next((time for time in events.strikes if time > off), None)
        if strike is not None and strike - off < events.stride_time:
            found.append((off + MIDDLE[0] * (strike - off), off + MIDDLE[1] * (strike - off)))
    return found


def _lost(
    side: str,
    during: Sequence[tuple[float, float]],
    plates: Sequence[Plate],
    grounds: Mapping[str, GroundForce],
    legs: Mapping[str, LegPoints],
    frame: WalkingFrame,
) -> float:
    """Share of what presses under a foot that is not counted for it [-]."""
    own = grounds[side]
    inside = _within(own.time, during)
    carried = 0.0
    for plate in plates:
        if plate.name not in own.plates:
            continue
        time, force = own.plates[plate.name]
        pressed = _within(time, during) & (force > EDGE)
        if np.any(pressed) and stands_there(time[pressed], plate.place[pressed], side, legs, frame):
            carried += float(np.mean(np.interp(own.time[inside], time, force)))
    return 1.0 - float(np.mean(own.force_z[inside])) / carried if carried > 0.0 else 0.0


def _within(time: np.ndarray, spans: Sequence[tuple[float, float]]) -> np.ndarray:
    found = np.zeros(len(time), dtype=bool)
    for start, end in spans:
        found |= (time >= start) & (time <= end)
    return found

"""Doubt about clocks: plates and motion that do not tell the same instants."""

from collections.abc import Sequence

import numpy as np

from afo_sim.gait_lab.trial.events import find_events
from afo_sim.gait_lab.trial.leg_motion import LegMotion
from afo_sim.gait_lab.trial.recorded_stride import RecordedStride

EARLY = 0.02  # of heel strikes by kinematics: 0 to 40 ms in four strides of two recorded walks [s]
APART = (-0.03, 0.04)  # of the events, beyond which clocks are doubted; kinematics are sure to 20 ms [s]
NEAR = 0.25  # that two events can be apart and still be the same [s] (assumed)


def clock_doubts(motion: LegMotion, strides: Sequence[RecordedStride]) -> list[str]:
    """A warning if the plates tell heel strikes and toe-offs later or earlier than the motion does.

    A force that comes 20 ms late moves the centre of pressure under the foot by 7 mm, 50 ms by 17 mm.
    """
    events = find_events(motion)
    loaded = [stride for stride in strides if stride.loaded and stride.closed is None]
    late = [_after(stride.start, events.strikes) for stride in loaded if stride.by.startswith("force")]
    left = [_after(stride.toe_off, events.toe_offs) for stride in loaded]
    strikes = [time - EARLY for time in late if time is not None]
    offs = [time for time in left if time is not None]
    if not strikes or not offs:
        return []
    shift = 0.5 * float(np.median(strikes) + np.median(offs))
    if APART[0] <= shift <= APART[1]:
        return []
    word = "after" if shift > 0.0 else "before"
    return [
        f"the plates tell heel strike and toe-off {1e3 * abs(shift):.0f} ms {word} the motion does: "
        "do they have the same clock?"
    ]


def _after(time: float, events: Sequence[float]) -> float | None:
    """How long after the nearest of some events something happened [s]; None if none is near."""
    if not events:
        return None
    apart = time - np.asarray(events)
    nearest = float(apart[np.argmin(np.abs(apart))])
    return nearest if abs(nearest) < NEAR else None

"""A stride that was found in a recording."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Closing:
    """How a recording without a whole stride was closed to one."""

    window: tuple[float, float]  # of the recording that is used [s]
    gap: float  # between its end and its beginning one period later [s]
    residual: Mapping[str, float]  # difference of the two ends that their velocities do not explain, by the
    # name of the motion's signal [rad], [m] or the ground's [N]; it is spread evenly over the period
    length: float  # of the stride: the way of the pelvis, or else of the ankle, that is continuous across
    # the gap [m]; residual["ankle_x"] is what the ankle's own would differ by


@dataclass(frozen=True)
class RecordedStride:
    """Heel strike to heel strike of one foot."""

    side: str  # "right" or "left"
    start: float  # [s]; may lie outside the recording if the stride is closed, as `end` may
    end: float  # [s]
    toe_off: float  # [s]
    by: str  # evidence of its ends, in words
    loaded: bool  # the whole stance is on plates
    closed: Closing | None = None

    @property
    def time(self) -> float:
        """Its duration [s]."""
        return self.end - self.start

    def window(self, share: tuple[float, float]) -> tuple[float, float]:
        """From when to when a part of the stride lasts [s]."""
        return self.start + share[0] * self.time, self.start + share[1] * self.time

"""Gait phase from a switch under the heel: time since heel strike over the mean of the last strides."""

from collections import deque

OPENS = 0.5  # share of the threshold below which the switch opens again [-]
BOUNCE = 0.4  # least duration of a stride; what closes sooner is the same contact [s]
LOST = 1.5  # durations of a stride without a heel strike, from which on the phase is not known [-]


class FootSwitch:
    """An estimator of the gait phase.

    Units: threshold [N].
    """

    def __init__(self, threshold: float, strides: int = 3):
        self.threshold, self.strides = threshold, strides
        self.reset()

    def reset(self) -> None:
        """Forget every stride."""
        self.durations: deque[float] = deque(maxlen=self.strides)
        self.since = 0.0  # heel strike, or the beginning [s]
        self.struck = False  # whether there was a heel strike
        self.closed = True  # a switch that is closed at first was not seen to close

    def update(self, value: float, dt: float) -> bool:
        """Take a sample, and tell whether the heel has struck in it.

        Units: value [N], dt [s].
        """
        self.since += dt
        closed = value >= (OPENS * self.threshold if self.closed else self.threshold)
        striking = closed and not self.closed and (not self.struck or self.since >= BOUNCE)
        if striking:
            self._strike()
        self.closed = closed
        return striking

    def _strike(self) -> None:
        if self.durations and self.since > LOST * self.stride_time:
            self.durations.clear()  # the walker stood: neither that stride nor those before it tell the next
        elif self.struck:
            self.durations.append(self.since)
        self.since, self.struck = 0.0, True

    @property
    def stride_time(self) -> float:
        """Mean duration of the last strides [s]; NaN before the first whole one."""
        return sum(self.durations) / len(self.durations) if self.durations else float("nan")

    @property
    def ready(self) -> bool:
        """Whether the phase is known: a whole stride was seen, and the next heel strike is not overdue."""
        return bool(self.durations) and self.since <= LOST * self.stride_time

    @property
    def phase(self) -> float:
        """Gait phase from 0 to 1 [-]; 1 where the next heel strike is late, 0 where it is not known."""
        return min(self.since / self.stride_time, 1.0) if self.ready else 0.0

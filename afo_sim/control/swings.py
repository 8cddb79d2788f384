"""Swings of a leg, from its shank's angle: where one ends, and whether it is one of those that are usual."""

import math
from typing import NamedTuple

RANGE = math.radians(25.0)  # that the shank moves in a swing at least
PAST = math.radians(6.0)  # that the shank has come back from an extreme when it counts as one
# By which a swing's extremes may differ from the usual ones, and by how much of that the usual ones follow.
ALIKE, TAUGHT = math.radians(4.0), 0.3
SETTLED = 3  # swings of another kind, one like the next, after which they are usual too


class Swing(NamedTuple):
    """The shank from its highest angle to its lowest [rad], the time that took, and the time since [s]."""

    high: float
    low: float
    duration: float
    ago: float


def _alike(one: Swing, other: Swing) -> bool:
    return abs(one.high - other.high) < ALIKE and abs(one.low - other.low) < ALIKE


class Swings:
    """Looks for swings: the shank's highest angle, and the lowest after it."""

    def __init__(self) -> None:
        self._falls = False
        self._before = self._low = math.inf
        self.high = -math.inf
        self._since_high = self._since_low = 0.0

    def after(self, value: float, dt: float) -> Swing | None:
        """The swing whose end this sample shows; None of most samples."""
        self._since_high += dt
        self._since_low += dt
        if self._falls:
            return self._falling(value)
        self._before = min(self._before, value)
        if value > self.high:
            self.high, self._since_high = value, 0.0
        elif value < self.high - PAST:
            if self.high - self._before > RANGE:
                self._falls, self._low, self._since_low = True, value, 0.0
            else:  # nothing came before it
                self.high, self._since_high = value, 0.0
        return None

    def _falling(self, value: float) -> Swing | None:
        if value < self._low:
            self._low, self._since_low = value, 0.0
            return None
        if not value >= self._low + PAST:  # nor where it was lost
            return None
        swing = Swing(self.high, self._low, self._since_high - self._since_low, self._since_low)
        self._falls, self._before = False, self._low
        self.high, self._since_high = value, 0.0
        return swing if swing.high - swing.low > RANGE else None


class UsualSwings:
    """The extremes of a walker's swings; one that walks otherwise, as in a turn, is a stranger to them."""

    def __init__(self) -> None:
        self._home: Swing | None = None  # of most of his walking
        self._now: Swing | None = None  # of late
        self._last: Swing | None = None
        self._same = 0  # swings unlike home, one like the next
        self.strange = False  # whether the last swing was of another kind
        self.returned = False  # whether it was of the first kind again, after a while of another

    @property
    def at_home(self) -> bool:
        """Whether he walks as he mostly does."""
        return not (self.strange or self._same)

    def take(self, swing: Swing) -> None:
        """Compare a swing with those before, and learn from it."""
        home, last = self._home or swing, self._last or swing
        at_home, again = _alike(swing, home), _alike(swing, last)
        self.strange = not (at_home or _alike(swing, self._now or swing))
        self.returned = self._same >= SETTLED and (at_home or not again)
        self._same = 0 if at_home or not again else self._same + 1
        self._last = swing
        if at_home:
            high, low = (old + TAUGHT * (new - old) for old, new in zip(home[:2], swing[:2], strict=True))
            self._home = self._now = swing._replace(high=high, low=low)
        elif self._same >= SETTLED:
            self._now, self.strange = swing, False

    def expect(self, high: float) -> None:
        """The shank should have been at its highest by now, and its highest since the last swing is this."""
        if self._now is not None and high < self._now.high - ALIKE:
            self.strange = True

    def miss(self) -> None:
        """No swing has ended where one should have."""
        self.strange = True

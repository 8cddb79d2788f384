"""The part of a stride in which the sole lies flat: after the foot has come down, before the heel rises."""

from dataclasses import dataclass

import numpy as np

WITHIN = (0.08, 0.40)  # of the stride; before it the foot comes down, after it every heel rises [-]
USUAL = (0.15, 0.35)  # that is taken where the foot is never steady [-]
LEAST = 0.08  # share of the stride in which a foot must be steady to be called flat; assumed [-]
_TURN = np.radians(1.0)  # of the sole about its mean; markers' noise is half of it; assumed [rad]
_RISE = 0.002  # of the ankle over its lowest; a heel that rises by 1 deg lifts it by as much; assumed [m]


@dataclass(frozen=True)
class FlatFoot:
    """Where the sole lies flat, as phases of the stride; `steady` is False where it was never found to."""

    start: float
    end: float
    steady: bool

    def holds(self, phase: np.ndarray) -> np.ndarray:
        """Mask of phases [-] (n,) that lie in it (n,)."""
        return np.asarray((phase >= self.start - 1e-9) & (phase <= self.end + 1e-9))

    @property
    def words(self) -> str:
        """Such as "12 to 29 % of the stride"."""
        return f"{100.0 * self.start:.0f} to {100.0 * self.end:.0f} % of the stride"


def flat_part(
    phase: np.ndarray, pitch: np.ndarray, height: np.ndarray, standing: np.ndarray | None = None
) -> FlatFoot:
    """The longest part about the steadiest 8 % of a stride in which the foot neither turns nor rises."""
    usual = FlatFoot(*USUAL, steady=False)
    inside = (phase >= WITHIN[0] - 1e-9) & (phase <= WITHIN[1] + 1e-9)
    inside &= np.isfinite(pitch) & np.isfinite(height)
    if standing is not None:
        inside &= standing
    where, turned, raised = phase[inside], pitch[inside], height[inside]
    cores = [
        (_unrest(turned[k:stop], raised[k:stop]), k, stop)
        for k, stop in enumerate(np.searchsorted(where, where + LEAST - 1e-9) + 1)
        if stop <= len(where)
    ]
    if not cores:
        return usual
    _, first, stop = min(cores)
    if not _steady(turned[first:stop], raised[first:stop]):
        return usual
    while True:  # a sample more, on the side where the foot is the steadier
        wider = [(k, m) for k, m in ((first - 1, stop), (first, stop + 1)) if k >= 0 and m <= len(turned)]
        wider = [(k, m) for k, m in wider if _steady(turned[k:m], raised[k:m])]
        if not wider:
            return FlatFoot(float(where[first]), float(where[stop - 1]), steady=True)
        first, stop = min(wider, key=lambda part: _unrest(turned[slice(*part)], raised[slice(*part)]))


def _unrest(turned: np.ndarray, raised: np.ndarray) -> float:
    """Range of pitch and of height, each over what a flat foot may have [-]."""
    return float(np.ptp(turned) / (2.0 * _TURN) + np.ptp(raised) / _RISE)


def _steady(turned: np.ndarray, raised: np.ndarray) -> bool:
    return bool(np.abs(turned - turned.mean()).max() <= _TURN and np.ptp(raised) <= _RISE)

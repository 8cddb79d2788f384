"""One segment of a model, laid over the markers that a trial shows of it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from afo_sim.gait_lab.trial.rigid_fit import RigidFit, fit_rigid

MISFIT = 0.020  # residual above which the model's marker places do not fit the trial [m] (assumed)


@dataclass(frozen=True, eq=False)
class Segment:
    """Points of a segment that the model and the trial both know, and the best place of the segment."""

    name: str  # "right thigh"
    local: Mapping[str, np.ndarray]  # point: its place in the segment's axes [m] (3,)
    seen: Mapping[str, np.ndarray]  # point: its path in the laboratory [m] (n, 3)
    missing: tuple[str, ...]  # markers of the model that the trial has not
    fit: RigidFit
    shared: tuple[str, ...] = ()  # joint centres among the points, that a neighbour placed

    @property
    def found(self) -> np.ndarray:
        """Where the segment has a place (n,)."""
        return np.isfinite(self.fit.rms)

    @property
    def rms(self) -> float:
        """Distance between seen and fitted points over the whole trial [m]."""
        return float(np.sqrt(np.nanmean(self.fit.rms**2))) if self.found.any() else float("nan")

    def with_centre(self, name: str, local: np.ndarray, path: np.ndarray) -> "Segment":
        """The same with a joint centre as one more point, its path (n, 3) placed by a neighbour."""
        return replace(
            lay(self.name, {**self.local, name: local}, {**self.seen, name: path}, len(path), self.missing),
            shared=tuple(dict.fromkeys((*self.shared, name))),
        )

    def error(self, place: np.ndarray) -> float:
        """Standard error in the sagittal plane of a point (3,) of the segment [m].

        First-order propagation of independent errors of the points, as large as the residual says. Skin
        that moves as one over the bone does not show in the residual: the true error is larger.
        """
        points = np.array(list(self.local.values()))
        count = len(points)
        variance = self.rms**2 * count / (3 * count - 6)
        away, arms = place - points.mean(axis=0), points - points.mean(axis=0)
        inertia = np.sum(arms**2) * np.eye(3) - arms.T @ arms
        cross = np.cross(np.eye(3), away)
        spread = variance * (np.eye(3) / count + cross.T @ np.linalg.pinv(inertia) @ cross)
        return float(np.sqrt(spread[0, 0] + spread[1, 1]))

    def remark(self) -> str:
        """What the segment was laid over, and how well."""
        return f"{self.name} laid over {', '.join(self.local)}: residual {1e3 * self.rms:.1f} mm RMS"

    def warnings(self) -> tuple[str, ...]:
        """A residual that says that model and trial disagree, with the worst point."""
        if not self.rms > MISFIT:
            return ()
        off = {
            name: float(np.sqrt(np.nanmean(np.sum((self.fit.place(place) - self.seen[name]) ** 2, axis=1))))
            for name, place in self.local.items()
        }
        worst = max(off, key=lambda name: off[name])
        return (
            f"the model's {self.name} misses the trial's markers by {1e3 * self.rms:.0f} mm RMS, most of all "
            f"{worst} by {1e3 * off[worst]:.0f} mm: another person's model, or a marker moved or swapped?",
        )


def lay(
    name: str,
    local: Mapping[str, np.ndarray],
    seen: Mapping[str, np.ndarray],
    count: int,
    missing: tuple[str, ...] = (),
) -> Segment:
    """Lay a segment over points that it has in its axes (3,) and in the laboratory, `count` = n of (n, 3)."""
    places = np.array([local[point] for point in seen]).reshape(-1, 3)
    paths = np.stack([seen[point] for point in seen], axis=1) if seen else np.empty((count, 0, 3))
    return Segment(name, {p: local[p] for p in seen}, dict(seen), missing, fit_rigid(places, paths))

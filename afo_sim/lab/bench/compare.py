"""Measured points laid over a test of the stand: what it would have read at each, and the error."""

from dataclasses import dataclass

import numpy as np

from afo_sim.common.errors import InputError
from afo_sim.description.muscle import Muscle
from afo_sim.lab.bench.measured import Measured
from afo_sim.lab.bench.measures import AXES
from afo_sim.lab.bench.rest import force_at
from afo_sim.lab.bench.trial import Trial

# Largest distance of a point from its curve in pressure [Pa], load [N] or contraction [-].
NEAR = {"isobaric": 1e3, "isotonic": 0.5, "isometric": 2e-3}
MANY = 12  # curves that a comparison makes by itself


@dataclass(frozen=True)
class Comparison:
    """Measured points and what the stand says of them, on the test's own axes (SI).

    curve : the curve that each point belongs to (n,)
    x, measured, predicted : abscissa, ordinate measured, and the mean of the ways up and down there (n,)
    left_out : points that belong to no curve, or lie beyond its ends
    """

    name: str
    curve: np.ndarray
    x: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    left_out: int

    @property
    def error(self) -> np.ndarray:
        """Prediction less measurement (n,)."""
        return self.predicted - self.measured

    @property
    def rms(self) -> float:
        """Root of the errors' mean square, in the error's unit."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def worst(self) -> float:
        """The largest error, in its unit."""
        return float(np.abs(self.error).max())


def points_of(kind: str, data: Measured, muscle: Muscle) -> dict[str, list[float]]:
    """The curves that measured points ask for, as arguments of the test: set points and where they begin."""
    if kind not in AXES:
        raise InputError(
            "cannot be compared with a static characteristic",
            field="compare",
            value=kind,
            allowed=", ".join(AXES),
        )
    pressure, contraction = data.pressure, _contraction(data, muscle)
    column = {"isobaric": pressure, "isotonic": data.force, "isometric": contraction}[kind]
    digits = {"isobaric": -3, "isotonic": 1, "isometric": 3}[kind]
    values = np.unique(np.round(column, digits)).tolist()
    if kind == "isobaric":
        top = muscle.limits.pressure * (1.0 + 1e-9)
        values = [p for p in values if p <= top and force_at(muscle, 0.0, p) > 10.0]
    elif kind == "isotonic":
        values = [f for f in values if 1.0 <= f < 0.999 * force_at(muscle, 0.0, float(pressure.max()))]
    if not 0 < len(values) <= MANY:
        raise InputError(
            f"its points lie on {len(values)} {kind} curves of this muscle",
            file=data.file,
            allowed=f"1 to {MANY}, or name the curves with `pressure`, `load` or `contraction`",
        )
    found = {"points": values}
    if kind == "isobaric":
        found["span"] = [
            max(float(contraction.min()), 0.95 * muscle.braid.lock) if contraction.min() < 0.0 else 0.0
        ]
    return found


def compare(trial: Trial, data: Measured) -> Comparison:
    """Readings of the stand at the conditions of measured points."""
    kind = trial.plan.kind
    contraction = _contraction(data, trial.plan.muscle)
    columns = {"pressure": data.pressure, "contraction": contraction, "force": data.force}
    abscissa, _, ordinate, _ = AXES[kind]
    own = {"isobaric": "pressure", "isotonic": "force", "isometric": "contraction"}[kind]
    found: list[tuple[int, float, float, float]] = []
    for point in range(len(data)):
        distance = np.abs(trial.plan.set_points - columns[own][point])
        k = int(np.argmin(distance))
        predicted = _read(trial, k, float(columns[abscissa][point]))
        if distance[k] <= NEAR[kind] and np.isfinite(predicted) and data.force[point] >= 0.0:
            found.append((k, columns[abscissa][point], columns[ordinate][point], predicted))
    if not found:
        raise InputError(f"no point lies on a curve of this {kind} test", file=data.file)
    curve, x, measured, predictions = (np.array(values) for values in zip(*found, strict=True))
    return Comparison(data.name, curve, x, measured, predictions, len(data) - len(found))


def _read(trial: Trial, k: int, x: float) -> float:
    """The mean of the last ways up and down at an abscissa; NaN beyond the curve's ends."""
    abscissa, _, ordinate, _ = AXES[trial.plan.kind]
    loop = trial.loop(k)
    values = []
    for down in np.unique(loop["branch"]):
        way = loop["branch"] == down
        order = np.argsort(loop[abscissa][way], kind="stable")
        at, y = loop[abscissa][way][order], loop[ordinate][way][order]
        edge = 1e-3 * (at[-1] - at[0])
        inside = at[0] - edge <= x <= at[-1] + edge
        values.append(float(np.interp(x, at, y)) if inside else np.nan)
    return float(np.mean(values))


def _contraction(data: Measured, muscle: Muscle) -> np.ndarray:
    """Contraction ratios of measured points, from their lengths where need be."""
    if data.contraction is not None:
        return data.contraction
    if data.change is None:
        raise InputError("has neither contraction nor length", file=data.file)
    return data.change / muscle.nominal_length

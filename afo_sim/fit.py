"""Measured characteristic → parameters of a law, with what the data can and cannot tell about them.

Least squares from several starts; 95 % intervals from the linearised model; a verdict that names the
parameters that the data do not tell apart; errors on points that the fit did not see.
"""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from afo_sim.characteristic import contractions, forces
from afo_sim.errors import InputError, nearest_name
from afo_sim.identifiability import Estimate, intervals, refused, verdict
from afo_sim.measured import Measured
from afo_sim.physics.law import Braid, Law, LawParameter
from afo_sim.physics.static_force import LAWS

Loss = Literal["linear", "soft_l1", "huber", "cauchy"]
Progress = Callable[[str], None]

STARTS = 12
GEOMETRY = {
    "braid_angle": LawParameter(
        "braid_angle", "α0", "rad", 0.0873, 0.872, "braid angle at rest", (0.3, 0.7), 0.436
    ),
    "end_length": LawParameter("end_length", "d", "m", 0.0, 0.5, "not contracting", (0.0, 0.06), 0.0),
}
NOMINAL_LENGTH = 0.2  # of a muscle whose data are contraction ratios, in laws that want a length [m]


@dataclass(frozen=True)
class Problem:
    """What is fitted to what: a law, its free parameters, the values of the others, the data."""

    law: Law
    data: tuple[Measured, ...]
    free: tuple[str, ...]
    fixed: Mapping[str, float]
    loss: Loss = "linear"

    def describe(self, name: str) -> LawParameter:
        return GEOMETRY[name] if name in GEOMETRY else self.law.parameter(name)

    @property
    def loaded(self) -> bool:
        """The residuals are changes of length [m] (a load was set), not forces [N]."""
        return self.data[0].loaded


@dataclass(frozen=True)
class Fit:
    """Parameters of a law, and how far they can be believed. SI.

    `half_width` is half the 95 % interval, infinite where it is refused; `verdict` says why. `held_out`
    are the errors [N or m] of points that the fit did not see: by what was left out, then group by group.
    """

    problem: Problem
    values: dict[str, float]
    half_width: dict[str, float]
    correlation: np.ndarray
    residuals: np.ndarray
    agreeing_starts: int
    verdict: tuple[str, ...]
    held_out: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)

    @property
    def rms(self) -> float:
        return rms(self.residuals)

    def held_out_rms(self, kind: str) -> float:
        """RMS over all points that were left out in turn, by pressure, load, curve, muscle or file."""
        return rms(np.concatenate(list(self.held_out[kind].values())))

    @property
    def worst(self) -> float:
        return float(np.abs(self.residuals).max())

    @property
    def identifiable(self) -> bool:
        return not self.verdict


def select(data: Measured) -> tuple[Measured, int]:
    """The points that a static law is about (p > 0, κ ≥ 0, F ≥ 0), and how many are not.

    Stretched, the braid carries; slack, nothing does; without air there is no muscle.
    """
    shortening = data.contraction if data.contraction is not None else data.change
    assert shortening is not None
    keep = (data.pressure > 0.0) & (data.force >= 0.0) & (shortening >= 0.0)
    return take(data, keep), int(np.sum(~keep))


def take(data: Measured, keep: np.ndarray) -> Measured:
    """Some points of the data."""
    return replace(
        data,
        pressure=data.pressure[keep],
        force=data.force[keep],
        curve=data.curve[keep],
        contraction=None if data.contraction is None else data.contraction[keep],
        change=None if data.change is None else data.change[keep],
    )


def pose(
    law_name: str,
    data: Sequence[Measured],
    *,
    free: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    loss: Loss = "linear",
) -> Problem:
    """Decide what of a law is free, from the data and from what the caller says.

    Parameters
    ----------
    law_name : of LAWS
    data : one Measured per muscle, all with the same kind of residual
    free : parameters to fit beside those that the law usually is fitted by
    fixed : parameters that are known [SI]
    loss : of scipy's `least_squares`

    Raises
    ------
    InputError
        Unknown law or parameter, data that do not determine the fit, or a length that is needed.
    """
    if law_name not in LAWS:
        raise InputError(
            "is an unknown law",
            field="--law",
            value=law_name,
            allowed=", ".join([*LAWS, "all"]),
            nearest=nearest_name(law_name, [*LAWS, "all"]),
        )
    law, given = LAWS[law_name], dict(fixed or {})
    known = [*(p.name for p in law.parameters), *GEOMETRY]
    for name in (*free, *given):
        if name not in known:
            raise InputError(
                f"is no parameter of {law_name}",
                field="--free" if name in free else "--fix",
                value=name,
                allowed=", ".join(known),
                nearest=nearest_name(name, known),
            )
    if len({d.loaded for d in data}) > 1:
        raise InputError(
            "are given in one file and loads in another: their errors cannot be added",
            field="force",
            allowed="forces in all files, or loads in all files",
        )
    changes = data[0].contraction is None
    wanted = [*law.fitted, *free]
    if changes and "braid_angle" in law.fitted:
        wanted.append("end_length")
    chosen = tuple(dict.fromkeys(name for name in wanted if name not in given))
    problem = Problem(law, tuple(data), chosen, _settled(law, data, chosen, given), loss)
    _require_enough(problem)
    return problem


def _settled(
    law: Law, data: Sequence[Measured], free: Sequence[str], given: Mapping[str, float]
) -> dict[str, float]:
    """The values of what is not free: as given, as the data's header says, or the default."""
    settled = dict(given)
    for name, parameter in (*((p.name, p) for p in law.parameters), *GEOMETRY.items()):
        if name in free or name in settled:
            continue
        stated = data[0].facts.get(name)
        if stated is None and parameter.default is None:
            raise InputError(
                f"is neither free nor fixed in {law.name}",
                field="--free",
                value=name,
                allowed=f'--free {name}, or --fix {name}="…"',
            )
        settled[name] = float(stated if stated is not None else parameter.default or 0.0)
    for d in data:
        if "bore" not in d.facts:
            raise InputError(
                "must be told", file=d.file, field="bore", allowed='a header line "# bore: 20 mm"'
            )
        if d.contraction is None and "total_length" not in d.facts:
            raise InputError(
                "must be told",
                file=d.file,
                field="total_length",
                allowed='a header line "# total_length: 21.5 cm"',
            )
    return settled


def _require_enough(problem: Problem) -> None:
    points = sum(len(d) for d in problem.data)
    file = problem.data[0].file
    pressures = np.unique(np.round(np.concatenate([d.pressure for d in problem.data]), -2))
    if points <= len(problem.free):
        raise InputError(
            f"holds {points} usable points for the {len(problem.free)} parameters of {problem.law.name}",
            file=file,
            allowed="more points than parameters; or a law with fewer, or --fix NAME=VALUE",
        )
    if len(pressures) < 2:
        raise InputError(
            "holds one pressure only: how the force depends on pressure cannot be told",
            file=file,
            field="pressure",
            value=f"{pressures[0] * 1e-5:g} bar" if len(pressures) else "none",
            allowed="at least two pressures",
        )


def predict(problem: Problem, values: Mapping[str, float], data: Measured) -> np.ndarray:
    """What the law says where the data were measured: force [N], or change of length [m]."""
    everything = {**problem.fixed, **values}
    total = data.facts.get("total_length", NOMINAL_LENGTH)
    active = total - (everything["end_length"] if data.contraction is None else 0.0)
    braid = Braid(active, data.facts["bore"] / 2.0, everything["braid_angle"])
    coefficients = problem.law.coefficients(braid, everything)
    if data.loaded:
        scale = active if data.contraction is None else 1.0
        return scale * contractions(problem.law.native_id, coefficients, data.force, data.pressure)
    kappa = data.contraction if data.contraction is not None else data.change / active  # type: ignore[operator]
    return forces(problem.law.native_id, coefficients, kappa, data.pressure)


def errors(problem: Problem, values: Mapping[str, float], data: Sequence[Measured]) -> np.ndarray:
    """Prediction less measurement over several data sets [N or m]."""
    parts = []
    for d in data:
        measured = d.force if not d.loaded else (d.change if d.contraction is None else d.contraction)
        parts.append(predict(problem, values, d) - measured)
    return np.concatenate(parts)


def fit(problem: Problem, *, seed: int = 0, starts: int = STARTS) -> Fit:
    """Fit a law from several starts.

    Parameters
    ----------
    problem : from `pose`
    seed : of the starts
    starts : how many

    Returns
    -------
    Fit, without held-out errors
    """
    found = _search(problem, problem.data, _starts(problem, starts, seed))
    best = min(found, key=lambda f: f.cost)
    agreeing = int(sum(f.cost <= best.cost * 1.001 + 1e-300 for f in found))
    scale = _scales(problem)
    values = dict(zip(problem.free, best.x * scale, strict=True))
    residuals = errors(problem, values, problem.data)
    half, correlation, verdict = _believe(problem, best, residuals, scale)
    return Fit(problem, values, half, correlation, residuals, agreeing, tuple(verdict))


def _scales(problem: Problem) -> np.ndarray:
    """The size of each free parameter, so that the search sees numbers near one."""
    return np.array([max(map(abs, problem.describe(n).start)) or 1.0 for n in problem.free])


def _bounds(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    described = [problem.describe(name) for name in problem.free]
    lower, upper = np.array([p.lower for p in described]), np.array([p.upper for p in described])
    if "end_length" in problem.free:
        shortest = min(d.facts["total_length"] for d in problem.data)
        upper[problem.free.index("end_length")] = 0.8 * shortest
    return lower, upper


def _starts(problem: Problem, count: int, seed: int) -> np.ndarray:
    described = [problem.describe(name) for name in problem.free]
    low, high = np.array([p.start for p in described]).T
    return low + (high - low) * qmc.LatinHypercube(len(described), seed=seed).random(count)


def _search(problem: Problem, data: Sequence[Measured], starts: np.ndarray) -> list:
    """The optimiser's results from each start."""
    scale, (lower, upper) = _scales(problem), _bounds(problem)
    size = float(np.ptp(_measurements(problem, data))) or 1.0

    def residuals(z: np.ndarray) -> np.ndarray:
        return errors(problem, dict(zip(problem.free, z * scale, strict=True)), data) / size

    found = []
    for start in starts:
        z = np.clip(start, lower, upper) / scale
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            found.append(
                least_squares(
                    residuals,
                    z,
                    jac="3-point",
                    bounds=(lower / scale, upper / scale),
                    x_scale="jac",
                    loss=problem.loss,
                    f_scale=0.01,
                    ftol=1e-12,
                    xtol=1e-12,
                    gtol=1e-12,
                    max_nfev=300,
                )
            )
    return found


def _measurements(problem: Problem, data: Sequence[Measured]) -> np.ndarray:
    return np.concatenate(
        [d.force if not d.loaded else (d.change if d.contraction is None else d.contraction) for d in data]
    )


def _believe(
    problem: Problem, best: object, residuals: np.ndarray, scale: np.ndarray
) -> tuple[dict[str, float], np.ndarray, list[str]]:
    """95 % half-widths, correlations, and what the data cannot tell."""
    n, k = best.jac.shape  # type: ignore[attr-defined]
    size = float(np.ptp(_measurements(problem, problem.data))) or 1.0
    variance = float(np.sum((residuals / size) ** 2)) / (n - k)
    half, correlation = intervals(best.jac, variance, n - k)  # type: ignore[attr-defined]
    values, half = best.x * scale, half * scale  # type: ignore[attr-defined]
    lower, upper = _bounds(problem)
    shown = [f"{value:.4g} ± {width:.3g}" for value, width in zip(values, half, strict=True)]
    found = Estimate(problem.free, values, half, np.abs(values), lower, upper, shown)
    lines = list(verdict(found, correlation, n))
    widths = dict(zip(problem.free, half.tolist(), strict=True))
    return {n: np.inf if n in refused(lines) else w for n, w in widths.items()}, correlation, lines


def held_out(
    result: Fit, test: Sequence[Measured] = (), report: Progress | None = None, *, groups: bool = True
) -> Fit:
    """Errors on points that the fit did not see: curves, pressures, loads, muscles, other files.

    Parameters
    ----------
    result : a fit
    test : further data, only predicted
    report : called with what is being left out
    groups : leave groups out in turn; without, only `test` is predicted

    Returns
    -------
    Fit, with `held_out` filled: the errors of each group when it was left out
    """
    found: dict[str, dict[str, np.ndarray]] = {}
    for kind, members in _groups(result.problem) if groups else ():
        if report is not None:
            report(f"{result.problem.law.name}: leaving out one {kind} after another")
        missed = {label: _leave_out(result, masks) for label, masks in members}
        if all(m is not None for m in missed.values()):
            found[kind] = {label: m for label, m in missed.items() if m is not None}
    if test:
        found["file"] = {other.name: errors(result.problem, result.values, [other]) for other in test}
    return replace(result, held_out=found)


def rms(values: np.ndarray) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def _groups(problem: Problem) -> Iterator[tuple[str, list[tuple[str, list[np.ndarray]]]]]:
    """What can be left out: by kind, each group's name and its masks, one per data set."""
    data = problem.data
    by_kind = {"pressure": [np.round(d.pressure * 1e-5, 3) for d in data]}
    if any(d.curve.dtype.kind != "f" for d in data):
        by_kind["curve"] = [d.curve for d in data]
    if problem.loaded:
        by_kind["load"] = [np.round(d.force, 2) for d in data]
    if len(data) > 1:
        by_kind["muscle"] = [np.full(len(d), d.name) for d in data]
    units = {"pressure": " bar", "load": " N"}
    for kind, labels in by_kind.items():
        groups = np.unique(np.concatenate(labels))
        if len(groups) > 1:
            yield (
                kind,
                [(f"{g}{units.get(kind, '')}", [label == g for label in labels]) for g in groups],
            )


def _leave_out(result: Fit, masks: Sequence[np.ndarray]) -> np.ndarray | None:
    """Errors on a group when the law is fitted to the rest; None when the rest does not suffice."""
    problem = result.problem
    rest = [take(d, ~m) for d, m in zip(problem.data, masks, strict=True)]
    seen = [d for d in rest if len(d)]
    left = [take(d, m) for d, m in zip(problem.data, masks, strict=True) if m.any()]
    if sum(len(d) for d in seen) <= len(problem.free):
        return None
    whole = np.array([result.values[name] for name in problem.free])
    starts = np.vstack([whole, _starts(problem, 3, 1)])
    best = min(_search(problem, seen, starts), key=lambda f: f.cost)
    return errors(problem, dict(zip(problem.free, best.x * _scales(problem), strict=True)), left)

"""A static fit as it is posed: law, free and held parameters, data, and the law's predictions of them."""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.stats import qmc

from afo_sim.common import EXAMPLES, InputError, JsonMapping, unknown
from afo_sim.lab.measured import Measured, levels
from afo_sim.lab.solution import FitParameter, FitProblem
from afo_sim.physics import LAWS, Braid, Law, LawParameter, contractions, forces

Loss = Literal["linear", "soft_l1", "huber", "cauchy"]
Data = Sequence[Measured]
Values = Mapping[str, float]

GEOMETRY = {
    "braid_angle": LawParameter(
        "braid_angle", "α0", "rad", 0.0873, 0.872, "braid angle at rest", (0.3, 0.7), 0.436
    ),
    "end_length": LawParameter("end_length", "d", "m", 0.0, 0.5, "not contracting", (0.0, 0.06), 0.0),
}
SLACK = 1e-3  # of the largest force: a gauge that reads less than this reads zero
NOMINAL_LENGTH = 0.2  # of a muscle whose data are contraction ratios, in laws that want a length [m]
OUTLYING = 0.01  # residual, over the data's range, from which a robust loss first doubts a point


def described(law: Law) -> dict[str, LawParameter]:
    """What can be free or held in a law: its parameters, and the braid's."""
    return {p.name: p for p in (*law.parameters, *GEOMETRY.values())}


@dataclass(frozen=True)
class LawProblem(FitProblem):
    """A law, its free parameters, the values of the others, and the data that they are fitted to."""

    law: Law  # that is fitted
    data: tuple[Measured, ...]  # that it is fitted to
    free: tuple[FitParameter, ...]  # parameters
    fixed: Values  # values of the other parameters [SI], by name
    loss: Loss = "linear"  # of an error: how far points that lie off count
    outlying: float = OUTLYING  # error from which it doubts a point [-]

    near, least_size, counted = 1e-6, 0.0, "points"

    @property
    def loaded(self) -> bool:
        """The residuals are changes of length [m] (a load was set), not forces [N]."""
        return self.data[0].loaded

    @property
    def options(self) -> JsonMapping:
        """Of scipy's least_squares."""
        tight = dict.fromkeys(("ftol", "xtol", "gtol"), 1e-12)
        loss = {"loss": self.loss, "f_scale": self.outlying}
        return {"jac": "3-point", "x_scale": "jac", "max_nfev": 300, **loss, **tight}

    def starts(self, count: int, seed: int) -> np.ndarray:
        """Coordinates among the usual values, each part of every range once."""
        low, high, size = np.array([(p.low, p.high, p.size) for p in self.free]).T
        return (low + (high - low) * qmc.LatinHypercube(len(low), seed=seed).random(count)) / size

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Errors over the range of the measurements."""
        measured = np.concatenate([d.response for d in self.data])
        return errors(self, self.values(x), self.data) / (float(np.ptp(measured)) or 1.0)

    def search(self, x: np.ndarray) -> OptimizeResult:
        """Where a search from `x` ends."""
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            return super().search(x)

    def jacobian(self, best: OptimizeResult) -> tuple[np.ndarray, np.ndarray]:
        """Without the loss, which weights the search's own; without readings that are agreed to be slack."""
        options = {**self.options, "loss": "linear", "max_nfev": 1}
        heard = ~agreed_slack(self, self.values(best.x), self.data)
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
            return least_squares(self.residuals, best.x, bounds=self.bounds, **options).jac[heard], heard

    def variance(self, residuals: np.ndarray, freedom: float) -> float:
        """Σψ²/freedom/(mean ψ′)², ψ = ρ′(z) f of scipy's loss ρ(z), z = (f/outlying)² (Huber 1981, 7.6)."""
        z = (residuals / self.outlying) ** 2
        beyond = np.where(z > 1.0, z, 1.0)
        first, second = {
            "linear": (np.ones_like(z), np.zeros_like(z)),
            "soft_l1": ((1.0 + z) ** -0.5, -0.5 * (1.0 + z) ** -1.5),
            "huber": (beyond**-0.5, np.where(z > 1.0, -0.5 * beyond**-1.5, 0.0)),
            "cauchy": (1.0 / (1.0 + z), -1.0 / (1.0 + z) ** 2),
        }[self.loss]
        slope = float(np.mean(first + 2.0 * z * second))
        if slope <= 1e-12:  # all of them are outliers: the loss tells no width
            return math.inf
        return float(np.sum((first * residuals) ** 2)) / freedom / slope**2

    def settled(self, best: OptimizeResult) -> bool:
        """The other starts tell."""
        return True

    def take(self, keep: np.ndarray) -> "LawProblem":
        """A subset of the points, with outliers yet to be found."""
        masks = np.split(keep, np.cumsum([len(d) for d in self.data])[:-1])
        kept = tuple(take(d, mask) for d, mask in zip(self.data, masks, strict=True) if mask.any())
        return replace(self, data=kept, outlying=OUTLYING)

    @property
    def telling(self) -> int:
        """Readings of a pulling muscle: a slack one is hardly informative."""
        return sum(len(d) - (0 if d.slack is None else int(d.slack.sum())) for d in self.data)

    @property
    def kinds(self) -> dict[str, list[np.ndarray]]:
        """What can be left out in turn: by kind, the label of every point of each data set."""
        found = {"pressure": pressure_levels(self.data)}
        if any(d.curve.dtype.kind != "f" for d in self.data):
            found["curve"] = [d.curve for d in self.data]
        if self.loaded:
            found["load"] = [np.round(d.force, 2) for d in self.data]
        if len(self.data) > 1:
            found["muscle"] = [np.full(len(d), d.name) for d in self.data]
        return found

    def parts(self, kind: str) -> dict[str, np.ndarray]:
        """Which points are left out together, by a name for people."""
        unit, labels = {"pressure": " bar", "load": " N"}.get(kind, ""), np.concatenate(self.kinds[kind])
        groups = np.unique(labels)
        return {f"{group}{unit}": labels == group for group in groups} if len(groups) > 1 else {}

    def missed(self, values: Values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Errors [N or m]; every point counts alike."""
        found = errors(self, values, self.data)
        return found, np.ones_like(found), np.zeros_like(found)


def select(data: Measured) -> tuple[Measured, int]:
    """The points that a static law is about (p > 0, κ ≥ 0, F ≥ 0), and how many are not."""
    shortening = data.contraction if data.contraction is not None else data.change
    assert shortening is not None
    slack = np.zeros(len(data), dtype=bool)
    if not data.loaded and len(data):
        slack = np.abs(data.force) <= SLACK * max(float(data.force.max()), 0.0)
    keep = (data.pressure > 0.0) & ((data.force >= 0.0) | slack) & (shortening >= 0.0)
    return take(replace(data, slack=slack), keep), int(np.sum(~keep))


def take(data: Measured, keep: np.ndarray) -> Measured:
    """Some points of the data."""
    names = ("pressure", "force", "curve", "contraction", "change", "slack")
    known = {name: getattr(data, name) for name in names}
    return replace(data, **{name: x[keep] for name, x in known.items() if x is not None})


def pose(
    law_name: str, data: Data, *, free: Sequence[str] = (), fixed: Values | None = None, loss: Loss = "linear"
) -> LawProblem:
    """Decide which parameters of a law are free, from the data and the caller's choice."""
    if law_name not in LAWS:
        raise unknown(law_name, [*LAWS, "all"], field="law", problem="is an unknown law")
    law, given = LAWS[law_name], dict(fixed or {})
    changes = data[0].contraction is None
    _require_sensible(law, data, free, given)
    given = _stated(data, [*free, *given]) | given
    wanted = [*law.fitted, *free]
    if changes and "braid_angle" in law.fitted:
        wanted.append("end_length")
    chosen = tuple(dict.fromkeys(name for name in wanted if name not in given))
    settled = _settled(law, data, chosen, given)
    searched = []
    for p in (described(law)[name] for name in chosen):  # ends are shorter than any muscle
        upper = 0.8 * min(d.facts["total_length"] for d in data) if p.name == "end_length" else p.upper
        usual, size = EXAMPLES[p.unit].partition(" ")[2] if p.unit else "", max(map(abs, p.start)) or 1.0
        searched.append(FitParameter(p.name, p.unit, usual, p.lower, upper, *p.start, size))
    problem = LawProblem(law, tuple(data), tuple(searched), settled, loss)
    _require_enough(problem)
    return problem


def _require_sensible(law: Law, data: Data, free: Sequence[str], given: Values) -> None:
    """Refuse parameters that the law does not have, that it cannot have so, or that do nothing here."""
    known = described(law)
    for name in (*free, *given):
        if name not in known:
            field, problem = "free" if name in free else "fixed", f"is not a parameter of {law.name}"
            raise unknown(name, known, field=field, problem=problem)
    if len({d.loaded for d in data}) > 1:
        problem = "are given in one file and loads in another: their errors cannot be added"
        raise InputError(problem, field="force", allowed="forces in all files, or loads in all files")
    if data[0].contraction is not None and "end_length" in (*free, *given):
        problem = "has no effect where contraction ratios were measured"
        raise InputError(problem, field="free" if "end_length" in free else "fixed", value="end_length")
    for name, value in given.items():
        p = known[name]
        if not p.lower <= value <= p.upper:
            shown, allowed = f"{value:g} {p.unit}".strip(), f"{p.lower:g} to {p.upper:g} {p.unit}".strip()
            raise InputError("is out of range", field=f"fixed.{name}", value=shown, allowed=allowed)


def _stated(data: Data, but: Sequence[str]) -> dict[str, float]:
    """The braid's numbers that headers state: they are held, unless they are asked to be free."""
    found: dict[str, float] = {}
    for name in GEOMETRY:
        values = {d.facts[name] for d in data if name in d.facts}
        if name in but or not values:
            continue
        if len(values) > 1:
            problem = "is stated differently in the files, but is fitted with one value"
            raise InputError(problem, field=name, allowed=f"the same in all files, or free: {name}")
        found[name] = values.pop()
    return found


def _settled(law: Law, data: Data, free: Sequence[str], given: Values) -> dict[str, float]:
    """The values of what is not free: as given, or the default."""
    settled = dict(given)
    for name, parameter in described(law).items():
        if name in free or name in settled:
            continue
        if parameter.default is None:
            problem = f"is neither free nor fixed in {law.name}"
            allowed = "a value to hold, or one of the parameters to fit as well"
            raise InputError(problem, field=name, allowed=allowed)
        settled[name] = parameter.default
    for d in data:
        needed = {"bore": "20 mm"} | ({"total_length": "21.5 cm"} if d.contraction is None else {})
        for name in (name for name in needed if name not in d.facts):
            header = f'"# {name}: {needed[name]}"; in Python facts={{"{name}": "{needed[name]}"}} too'
            raise InputError("must be stated", file=d.file, field=name, allowed=f"a header line {header}")
    return settled


def _require_enough(problem: LawProblem) -> None:
    file, law = problem.data[0].file, problem.law.name
    pressures = np.unique(np.concatenate(pressure_levels(problem.data)))
    if len(pressures) < 2:
        text = "contains only one pressure: how the force depends on pressure cannot be identified"
        only = f"{pressures[0]:g} bar" if len(pressures) else "none"
        raise InputError(text, file=file, field="pressure", value=only, allowed="at least two pressures")
    if not problem.free:
        held = ", ".join(name for name in problem.fixed if name in (*GEOMETRY, *problem.law.fitted))
        allowed = "one of them free, or not stated"
        raise InputError(
            "has no free parameter left to fit", file=file, field=law, value=held, allowed=allowed
        )
    if problem.telling <= len(problem.free):
        text = f"holds {problem.telling} usable points for the {len(problem.free)} parameters of {law}"
        allowed = "more points than parameters; or a law with fewer, or some of them held"
        raise InputError(text, file=file, allowed=allowed)


def pressure_levels(data: Data) -> list[np.ndarray]:
    """The pressure that each point was meant to be taken at: what a regulator and a sensor scatter is one."""
    every = np.concatenate([d.pressure for d in data])
    level = levels(every, 2e4)
    means = np.array([round(float(every[level == k].mean()) * 1e-5, 3) for k in np.unique(level)])
    return np.split(means[level], np.cumsum([len(d) for d in data])[:-1])


def predict(problem: LawProblem, values: Values, data: Measured) -> np.ndarray:
    """The law's force [N], or change of length [m], where the data were measured."""
    everything = {**problem.fixed, **values}
    total = data.facts.get("total_length", NOMINAL_LENGTH)
    active = total - (everything["end_length"] if data.contraction is None else 0.0)
    braid = Braid(active, data.facts["bore"] / 2.0, everything["braid_angle"])
    coefficients = problem.law.coefficients(braid, everything)
    if data.loaded:
        scale = active if data.contraction is None else 1.0
        return scale * contractions(problem.law.native_id, coefficients, data.force, data.pressure)
    kappa = data.contraction if data.contraction is not None else np.asarray(data.change) / active
    return forces(problem.law.native_id, coefficients, kappa, data.pressure)


def errors(problem: LawProblem, values: Values, data: Data) -> np.ndarray:
    """Prediction less measurement over several data sets [N or m]."""
    parts = []
    for d in data:
        found, slack = predict(problem, values, d), False if d.slack is None else d.slack
        parts.append(np.where(slack & (found < 0.0), 0.0, found) - d.response)
    return np.concatenate(parts)


def agreed_slack(problem: LawProblem, values: Values, data: Data) -> np.ndarray:
    """Readings of a slack muscle that the law, too, says is slack: they say nothing of its parameters."""
    parts = [
        np.zeros(len(d), dtype=bool) if d.slack is None else d.slack & (predict(problem, values, d) <= 0.0)
        for d in data
    ]
    return np.concatenate(parts)

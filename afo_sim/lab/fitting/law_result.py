"""Fits of force laws to a measured characteristic: points in, ranked laws and a muscle that runs out."""

import dataclasses
import math
import os
import pathlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from afo_sim.common import assets
from afo_sim.common.errors import InputError, unknown
from afo_sim.common.units import parse_quantity
from afo_sim.description.covariance import FitCovariance
from afo_sim.description.muscle import Muscle
from afo_sim.lab.bench.measured import HEADER, Measured, check_facts, read_measured
from afo_sim.lab.fitting.law_fit import LawFit, fit_law, held_out
from afo_sim.lab.fitting.law_muscle import LIKE, muscle, residual_unit, usual
from afo_sim.lab.fitting.law_problem import GEOMETRY, LawProblem, Loss, pose, select
from afo_sim.lab.fitting.law_ranking import doubts, rank
from afo_sim.physics.laws import LAWS
from afo_sim.simulation.display_hooks import shown

HOLD_OUT = ("all", "none", "pressure", "load", "curve", "muscle")


@dataclass(frozen=True, repr=False)
class StaticFit:
    """Laws fitted to a characteristic, best first; laws that could not be fitted, and why.

    `left_out` counts the points that no static law is about; `like` is the muscle from which comes what the
    data do not tell.
    """

    fits: tuple[LawFit, ...]
    skipped: dict[str, str]
    left_out: int
    like: str

    def __repr__(self) -> str:
        """One line: the best law, its parameters, its error."""
        values = ", ".join(map(self._parameter_text, self.parameters))
        factor, unit = residual_unit(self.best)
        error = f"{factor * self.best.rms:.3g} {unit} RMS over {len(self.residuals)} points"
        others = f"; best of {len(self.fits)} laws" if len(self.fits) > 1 else ""
        return f"<StaticFit: {self.ranking[0]} with {values}; {error}{others}>"

    def _parameter_text(self, name: str) -> str:
        value, unit = usual(self.parameters[name], self.best.problem.describe(name).unit)
        return f"{name} = {value:.4g} {unit}".rstrip()

    def _repr_html_(self) -> str:  # asked for by Jupyter
        return shown().html(self)

    @property
    def best(self) -> LawFit:
        """The fit that is ranked first."""
        return self.fits[0]

    @property
    def muscle(self) -> Muscle:
        """The fitted muscle, ready to run; with data of several muscles, the first of `muscles`."""
        return next(iter(self.muscles.values()))

    @property
    def muscles(self) -> dict[str, Muscle]:
        """The fitted muscle of each data set, by the data's name."""
        data_sets = self.best.problem.data
        return {data.name: muscle(self.best, data, self.like) for data in data_sets}

    @property
    def parameters(self) -> dict[str, float]:
        """The best law's fitted parameters [SI]."""
        return {name: float(value) for name, value in self.best.values.items()}

    @property
    def intervals(self) -> dict[str, tuple[float, float] | None]:
        """95 % interval of each of them [SI]; None where the data do not tell it."""
        values = self.best.values
        return {
            name: None if math.isinf(half) else (float(values[name] - half), float(values[name] + half))
            for name, half in self.best.half_width.items()
        }

    @property
    def covariance(self) -> FitCovariance | None:
        """Covariance of the best law's parameters; its `matrix` [SI] goes with its `parameters`.

        It holds the parameters that the data tell together, whether or not they tell each alone. None where
        they tell none, the points are too few, or the starts end in different places.
        """
        return self.best.covariance

    @property
    def residuals(self) -> np.ndarray:
        """Prediction less measurement of the best law, point by point [N or m]."""
        return self.best.residuals

    @property
    def ranking(self) -> tuple[str, ...]:
        """The laws that were fitted, best first."""
        return tuple(fit.problem.law.name for fit in self.fits)

    @property
    def slack(self) -> int:
        """Readings of zero that are taken as of a slack muscle."""
        return sum(int(d.slack.sum()) for d in self.best.problem.data if d.slack is not None)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to look twice, each a sentence."""
        return tuple(doubts(self.fits))


def fit(
    data: Any,
    *,
    law: str = "all",
    hold_out: str = "all",
    test: Any = (),
    free: Sequence[str] = (),
    fixed: Mapping[str, Any] | None = None,
    facts: Mapping[str, Any] | None = None,
    loss: str = "linear",
    like: str = LIKE,
    report: Callable[[str], None] = lambda text: None,
) -> StaticFit:
    """Fit one force law, or all of them, to a measured characteristic.

    Parameters
    ----------
    data : path to a CSV, {title with unit: array}, a pandas DataFrame of such titles, or a list of these, one
        for each muscle
    law : name, or "all"
    hold_out : what is left out in turn to tell the error on unseen points, of HOLD_OUT
    test : further data that are predicted, not fitted
    free : parameters to fit beside those that the law usually is fitted by
    fixed : parameters to hold, for example {"braid_angle": "24 deg"}
    facts : what the data do not say of the muscle, for example {"bore": "20 mm"}
    loss : "linear", "soft_l1", "huber" or "cauchy"; the last three bear outliers
    like : muscle to take from what the data do not tell
    report : called with what is being done

    Returns
    -------
    StaticFit

    Raises
    ------
    InputError
        A file, column, unit, law, parameter or argument is wrong, or no law can be fitted to the data.

    Examples
    --------
    >>> muscle = load("muscle", "dmsp_20")
    >>> share, bar = np.tile(np.linspace(0.0, 0.2, 9), 3), np.repeat([2.0, 3.0, 4.0], 9)
    >>> force = muscle.force(1e5 * bar, contraction=share)
    >>> data = {"pressure [bar]": bar, "contraction [-]": share, "force [N]": force}
    >>> facts = {"total_length": "30 cm", "end_length": "0 cm", "bore": "20 mm"}
    >>> fitted = fit(data, law="sarosi_2012", facts=facts, hold_out="none")
    >>> again = fitted.muscle.force("3.5 bar", contraction=0.1)
    >>> bool(abs(again - muscle.force("3.5 bar", contraction=0.1)) < 5.0)  # [N]
    True
    """
    fixed, facts = dict(fixed or {}), dict(facts or {})
    _check(law, hold_out, loss, like, fixed)
    sources, tests = _several(data), _several(test)
    _require_different(sources, tests)
    points, left_out = _read(sources, facts)
    unseen, _ = _read(tests, facts)
    problems, skipped = _problems(law, points, free, fixed, loss)
    found = []
    for problem in problems:
        report(f"fitting {problem.law.name}")
        result = fit_law(problem)
        found.append(_with_held_out(result, unseen, hold_out, report))
    return StaticFit(tuple(rank(found)), skipped, left_out, like)


def _problems(
    law: str, points: Sequence[Measured], free: Sequence[str], fixed: Mapping[str, Any], loss: str
) -> tuple[list[LawProblem], dict[str, str]]:
    """The problem of one law, or of each that the data can tell; the reasons why not of the others."""
    found, skipped, refused = [], {}, []
    for name in LAWS if law == "all" else [law]:
        try:
            held = _fixed(name, fixed, only=law != "all")
            found.append(pose(name, points, free=free, fixed=held, loss=loss))  # type: ignore[arg-type]
        except InputError as error:
            if law != "all":
                raise
            skipped[name] = error.problem
            refused.append(error)
    if not found:
        first = refused[0]
        about = f"{first.field} " if first.field else ""
        problem = f"no law can be fitted: {about}{first.problem}"
        raise InputError(problem, file=points[0].file, allowed=first.allowed)
    return found, skipped


def _several(data: Any) -> list[Any]:
    """The data sets of an argument that may hold one or more."""
    return list(data) if isinstance(data, list | tuple) else [data]


def _with_held_out(
    result: LawFit, unseen: Sequence[Measured], hold_out: str, report: Callable[[str], None]
) -> LawFit:
    """The fit with the held-out errors that were asked for; those of further data always."""
    if hold_out != "none" or unseen:
        result = held_out(result, unseen, report, groups=hold_out != "none")
    if hold_out in ("all", "none"):
        return result
    if hold_out not in result.held_out:
        raise InputError(
            "cannot be left out of these data",
            field="hold_out",
            value=hold_out,
            allowed=", ".join(["all", "none", *result.held_out]),
        )
    kept = {kind: e for kind, e in result.held_out.items() if kind in (hold_out, "file")}
    return dataclasses.replace(result, held_out=kept)


def _check(law: str, hold_out: str, loss: str, like: str, fixed: Mapping[str, Any]) -> None:
    parameters = {p.name for each in LAWS.values() for p in each.parameters} | set(GEOMETRY)
    checks: list[tuple[str, str, Sequence[str], str]] = [
        ("hold_out", hold_out, HOLD_OUT, "is no choice"),
        ("loss", loss, get_args(Loss), "is no choice"),
        ("law", law, ("all", *LAWS), "is no choice"),
    ]
    checks += [("fixed", name, sorted(parameters), "is no parameter of any law") for name in fixed]
    for field, value, allowed, problem in checks:
        if value not in allowed:
            raise unknown(value, allowed, field=field, problem=problem)
    try:
        assets.find("muscle", like)
    except InputError as error:
        raise InputError(
            error.problem, field="like", value=like, allowed=error.allowed, nearest=error.nearest
        ) from None


def _require_different(sources: Sequence[Any], tests: Sequence[Any]) -> None:
    """Refuse a file that is to be fitted twice, or fitted and predicted."""
    files = [pathlib.Path(s).resolve() for s in sources if isinstance(s, str | os.PathLike)]
    others = [pathlib.Path(s).resolve() for s in tests if isinstance(s, str | os.PathLike)]
    for file in files:
        if [*files, *others].count(file) > 1:
            raise InputError("is given twice: its points would count double", file=file)


def _read(sources: Sequence[Any], facts: Mapping[str, Any]) -> tuple[list[Measured], int]:
    """The usable points of each data set, with what the caller tells of the muscle; how many are not."""
    values: dict[str, Any] = {}
    for key, text in facts.items():
        unit = HEADER.get(key)
        if unit is None:
            names = [name for name, si in HEADER.items() if si]
            raise unknown(key, names, field="facts", problem="is nothing that can be told")
        values[key] = _quantity(f"facts.{key}", text, unit)
    check_facts(None, values, "facts")
    data, left_out = [], 0
    for source in sources:
        measured = read_measured(source, values)
        usable, dropped = select(measured)
        if not len(usable):
            raise InputError("has no point with pressure, tension and contraction", file=measured.file)
        data.append(usable)
        left_out += dropped
    return data, left_out


def _fixed(law: str, texts: Mapping[str, Any], *, only: bool) -> dict[str, float]:
    """Values of the parameters that are held; with several laws, of those that this law has."""
    units = {p.name: p.unit for p in (*LAWS[law].parameters, *GEOMETRY.values())}
    known = {name: text for name, text in texts.items() if name in units}
    if only and len(known) < len(texts):
        name = next(name for name in texts if name not in units)
        raise unknown(name, units, field="fixed", problem=f"is no parameter of {law}")
    return {name: _quantity(f"fixed.{name}", text, units[name]) for name, text in known.items()}


def _quantity(field: str, text: Any, unit: str) -> float:
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(str(error), field=field, value=text) from None

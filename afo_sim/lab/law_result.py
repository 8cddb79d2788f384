"""Fits of force laws to a measured characteristic: points in, ranked laws and a muscle that runs out."""

import dataclasses
import math
import pathlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import cast, get_args

import numpy as np

from afo_sim.common import InputError, Notice, Shown, assets, quantity_at, unknown, write_json, write_sealed
from afo_sim.description import FitCovariance, Muscle, toml_text
from afo_sim.lab import law_muscle
from afo_sim.lab.law_fit import LawFit, doubt, fit_law, held_out
from afo_sim.lab.law_problem import LawProblem, Loss, described, pose, select
from afo_sim.lab.measured import HEADER, Measured, check_facts, read_measured, require_once, several
from afo_sim.lab.solution import held_out_json, held_out_lines, require_left_out
from afo_sim.physics import LAWS

HOLD_OUT = ("all", "none", "pressure", "load", "curve", "muscle")
Tables = list[tuple[str, list[str], list[list[str]]]]


@dataclass(frozen=True, repr=False)
class StaticFit(Shown):
    """Laws fitted to a characteristic, best first; laws that could not be fitted, and why.

    fits : each law's, the best first
    skipped : {law: why it could not be fitted}
    left_out : points that no static law is about
    like : the muscle from which comes what the data do not tell
    """

    fits: tuple[LawFit, ...]
    skipped: dict[str, str]
    left_out: int
    like: str

    def __repr__(self) -> str:
        """One line: the best law, its parameters, its error."""
        free, found = self.best.problem.free, self.parameters
        values = ", ".join(f"{p.name} = {p.number(found[p.name]):.4g} {p.shown}".rstrip() for p in free)
        factor, unit = law_muscle.residual_unit(self.best)
        error = f"{factor * self.best.rms:.3g} {unit} RMS over {len(self.residuals)} points"
        others = f"; best of {len(self.fits)} laws" if len(self.fits) > 1 else ""
        return f"<StaticFit: {self.ranking[0]} with {values}; {error}{others}>"

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
        return {data.name: law_muscle.muscle(self.best, data, self.like) for data in data_sets}

    @property
    def parameters(self) -> dict[str, float]:
        """The best law's fitted parameters [SI]."""
        return {name: float(value) for name, value in self.best.values.items()}

    @property
    def intervals(self) -> dict[str, tuple[float, float] | None]:
        """95 % interval of each of them [SI]; None where the data do not identify it."""
        values = self.best.values
        return {
            name: None if math.isinf(half) else (float(values[name] - half), float(values[name] + half))
            for name, half in self.best.half_width.items()
        }

    @property
    def covariance(self) -> FitCovariance | None:
        """Of the best law's parameters that the data identify together [SI]; None of starts that differ."""
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
    def warnings(self) -> tuple[Notice, ...]:
        """Reasons to look twice."""
        return tuple(law_muscle.doubts(self.fits))


def fit_laws(
    data: object, *, law: str = "all", hold_out: str = "all", test: object = (), free: Sequence[str] = (),
    fixed: Mapping[str, object] | None = None, facts: Mapping[str, object] | None = None,
    loss: str = "linear", like: str = law_muscle.LIKE, report: Callable[[str], None] = lambda text: None,
) -> StaticFit:  # fmt: skip
    """Fit one force law, or all of them, to a measured characteristic; arguments as of `fit`."""
    fixed, facts = dict(fixed or {}), dict(facts or {})
    _check(law, hold_out, loss, like, fixed)
    sources, tests = several(data), several(test)
    require_once([*sources, *tests])
    points, left_out = _read(sources, facts)
    unseen, _ = _read(tests, facts)
    problems, skipped = _problems(law, points, free, fixed, loss)
    found = [_fitted(problem, unseen, hold_out, report) for problem in problems]
    return StaticFit(tuple(law_muscle.rank(found)), skipped, left_out, like)


def _problems(
    law: str, points: Sequence[Measured], free: Sequence[str], fixed: Mapping[str, object], loss: str
) -> tuple[list[LawProblem], dict[str, str]]:
    """The problem of one law, or of each that the data can identify; the reasons why not of the others."""
    found, skipped, refused = [], {}, []
    for name in LAWS if law == "all" else [law]:
        try:
            held = _fixed(name, fixed, only=law != "all")
            found.append(pose(name, points, free=free, fixed=held, loss=cast(Loss, loss)))
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


def _fitted(
    problem: LawProblem, unseen: Sequence[Measured], hold_out: str, report: Callable[[str], None]
) -> LawFit:
    """The fit with the held-out errors that were asked for; those of further data always."""
    report(f"fitting {problem.law.name}")
    result = fit_law(problem)
    if hold_out != "none" or unseen:
        result = held_out(result, unseen, report, groups=hold_out != "none")
    if hold_out in ("all", "none"):
        return result
    require_left_out([hold_out], result.held_out)
    kept = {kind: e for kind, e in result.held_out.items() if kind in (hold_out, "file")}
    return dataclasses.replace(result, held_out=kept)


def _check(law: str, hold_out: str, loss: str, like: str, fixed: Mapping[str, object]) -> None:
    choices = {"hold_out": (hold_out, HOLD_OUT), "loss": (loss, get_args(Loss)), "law": (law, ("all", *LAWS))}
    for field, (value, allowed) in choices.items():
        if value not in allowed:
            raise unknown(value, allowed, field=field)
    parameters = {name for each in LAWS.values() for name in described(each)}
    for name in fixed:
        if name not in parameters:
            problem = "is not a parameter of any law"
            raise unknown(name, sorted(parameters), field="fixed", problem=problem)
    try:
        assets.find("muscle", like)
    except InputError as error:
        raise error.replaced(file=None, field="like", value=like) from None


def _read(sources: Sequence[object], facts: Mapping[str, object]) -> tuple[list[Measured], int]:
    """The usable points of each data set, with what the caller states of the muscle; how many are not."""
    values: dict[str, float] = {}
    for key, text in facts.items():
        unit = HEADER.get(key)
        if unit is None:
            names = [name for name, si in HEADER.items() if si]
            raise unknown(key, names, field="facts", problem="is not a known fact")
        values[key] = quantity_at(f"facts.{key}", text, unit)
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


def _fixed(law: str, texts: Mapping[str, object], *, only: bool) -> dict[str, float]:
    """Values of the parameters that are held; with several laws, of those that this law has."""
    units = {name: p.unit for name, p in described(LAWS[law]).items()}
    known = {name: text for name, text in texts.items() if name in units}
    if only and len(known) < len(texts):
        name = next(name for name in texts if name not in units)
        raise unknown(name, units, field="fixed", problem=f"is not a parameter of {law}")
    return {name: quantity_at(f"fixed.{name}", text, units[name]) for name, text in known.items()}


def write(result: StaticFit, folder: pathlib.Path) -> None:
    """Write muscle.toml and fit.json; with data of several muscles, a folder for each muscle."""
    best = result.best
    stems = [data.file.stem for data in best.problem.data]
    told = {
        "fits": [_fit_as_json(each) for each in result.fits],
        "skipped": result.skipped,
        "ranked_by": law_muscle.criterion(result.fits),
        "warnings": list(result.warnings),
        "slack_readings": result.slack,
        "left_out": result.left_out,
    }
    write_json(folder / "fit.json", told, "law fit")
    for data in best.problem.data:
        own = data.file.stem if stems.count(data.file.stem) == 1 else data.name.replace("/", "_")
        place = folder / own if len(stems) > 1 else folder
        law_muscle.muscle(best, data, result.like)  # it must be one
        text = toml_text(law_muscle.muscle_table(best, data, result.like), exact=False)
        write_sealed(place / "muscle.toml", text, "muscle")


def _fit_as_json(each: LawFit) -> dict[str, object]:
    """A fit as plain data, SI but for the residuals, whose unit is stated."""
    factor, unit = law_muscle.residual_unit(each)
    return {
        "law": each.problem.law.name,
        "values": each.values,
        "fixed": dict(each.problem.fixed),
        "half_width_95": each.half_width,  # null where it is refused
        "correlation": each.solution.correlation.tolist(),
        "covariance": None if each.covariance is None else each.covariance.model_dump(mode="json"),
        "verdict": list(each.verdict),
        "points": len(each.residuals),
        "residual_unit": unit,
        "rms": factor * each.rms,
        "worst": factor * each.worst,
        "agreeing_starts": each.agreeing_starts,
        "starts": each.starts,
        "held_out": held_out_json(each.held_out, factor),
    }


def _covariance_line(best: LawFit) -> str:
    """What stands in the table [covariance], or why there is none, and whether it is too narrow."""
    told = best.covariance
    if told is None:
        return "no covariance is written: the points, or the search, do not determine the parameters"
    names = [key.rpartition(".")[2] for key in told.parameters]
    held = [name for name in best.values if name not in names]
    line = f"covariance of {', '.join(names)} with {told.freedom} degrees of freedom"
    line += f"; {', '.join(held)} held at the fitted value: the data do not identify it" if held else ""
    doubtful = doubt(best.problem, best.residuals)
    return f"{line}; {doubtful}" if doubtful else line


def tables(result: StaticFit) -> Tables:
    """(title, header, rows) to print: the ranking where there are several laws, the best law's parameters."""
    _, unit = law_muscle.residual_unit(result.best)
    shown: Tables = []
    if len(result.fits) + len(result.skipped) > 1:
        header = ["law", "parameters", f"RMS [{unit}]"]
        header += [f"{kind} left out [{unit}]" for kind in law_muscle.kinds(result.fits)]
        rows, columns = [], law_muscle.kinds(result.fits)
        for each in result.fits:
            factor, _ = law_muscle.residual_unit(each)
            held = [f"{factor * each.held_out[k].rms:.3g}" if k in each.held_out else "-" for k in columns]
            refused, count = sum(map(math.isinf, each.half_width.values())), len(each.values)
            told = f"{count - refused} of {count}" if refused else "all"
            ends = [f"{each.agreeing_starts} of {each.starts}", told]
            rows.append([each.problem.law.name, str(count), f"{factor * each.rms:.3g}", *held, *ends])
        rows += [[law, "", "", *[""] * len(columns), "", reason] for law, reason in result.skipped.items()]
        title = f"laws, best first by the {law_muscle.criterion(result.fits)}"
        shown.append((title, [*header, "starts agree", "intervals"], rows))
    rows, best = [], result.best
    for p in best.problem.free:
        value, width = best.values[p.name], best.half_width[p.name]
        number = p.number(value)
        interval = "refused" if math.isinf(width) else f"± {width * number / value if value else width:.3g}"
        rows.append([p.name, f"{number:.5g}", interval, p.shown])
    shown.append((best.problem.law.name, ["parameter", "value", "95 % interval", "unit"], rows))
    return shown


def remarks(result: StaticFit) -> list[str]:
    """Lines below the tables: errors, what the data do not determine, what was left out."""
    best = result.best
    factor, unit = law_muscle.residual_unit(best)
    line = f"{len(best.residuals)} points: {factor * best.rms:.3g} {unit} RMS, worst "
    line += f"{factor * best.worst:.3g} {unit}; {best.agreeing_starts} of {best.starts} starts agree"
    lines = [line, *held_out_lines(best.held_out, factor, unit)]
    lines += [f"not identified by the data: {line}" for line in best.verdict]
    lines.append(_covariance_line(best))
    if result.slack:
        line = f"{result.slack} readings of 0 N are taken as a slack muscle, whose force a law may predict "
        line += "below zero; put a load of 0 N at which contraction was measured into a column `load`"
        lines.append(line)
    if result.left_out:
        line = f"{result.left_out} points without pressure or tension, or of a stretched muscle, were left "
        lines.append(f"{line}out: static laws do not apply to them")
    lacking = dict.fromkeys(name for data in best.problem.data for name in law_muscle.taken_over(data))
    if lacking:
        lines.append(f"grade C at most: {', '.join(lacking)} are taken from {result.like}, not measured")
    return lines + [f"warning: {warning}" for warning in result.warnings]

"""A fit as it is asked for on the command line: files and names in, fits, tables and remarks out."""

import dataclasses
import pathlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, get_args

from afo_sim.bench.measured import HEADER, Measured, check_facts, read_measured
from afo_sim.common.errors import InputError, nearest_name
from afo_sim.common.units import parse_quantity
from afo_sim.fitting import law_files as fit_files
from afo_sim.fitting.law_files import kinds, parameter_rows, ranking_rows, residual_unit
from afo_sim.fitting.law_fit import Fit, fit, held_out
from afo_sim.fitting.law_problem import GEOMETRY, Loss, pose, select
from afo_sim.physics.laws import LAWS

HOLD_OUT = ("all", "none", "pressure", "load", "curve", "muscle")


@dataclass(frozen=True)
class Request:
    """What was asked for; `fixed` and `told` still as text."""

    files: tuple[pathlib.Path, ...]
    test: tuple[pathlib.Path, ...]
    law: str
    hold_out: str
    free: tuple[str, ...]
    fixed: Mapping[str, Any]
    told: Mapping[str, Any]
    loss: str
    like: str


@dataclass(frozen=True)
class Answer:
    """Fits, best first; laws that could not be fitted, and why; points that no static law is about."""

    fits: tuple[Fit, ...]
    skipped: dict[str, str]
    left_out: int


def answer(request: Request, report: Callable[[str], None] = lambda text: None) -> Answer:
    """Read, fit, and leave out in turn.

    Parameters
    ----------
    request : what was asked for
    report : called with what is being done

    Returns
    -------
    Answer

    Raises
    ------
    InputError
        A file, column, unit, law, parameter or option is wrong, or no law can be fitted to the data.
    """
    _check(request)
    data, left_out = _read(request.files, request.told)
    test, _ = _read(request.test, request.told)
    laws = list(LAWS) if request.law == "all" else [request.law]
    found, skipped = [], {}
    for name in laws:
        report(f"fitting {name}")
        try:
            fixed = _fixed(name, request.fixed, only=request.law != "all")
            problem = pose(name, data, free=request.free, fixed=fixed, loss=request.loss)  # type: ignore[arg-type]
        except InputError as error:
            if request.law != "all":
                raise
            skipped[name] = error.problem
            continue
        result = fit(problem)
        if request.hold_out != "none":
            result = held_out(result, test, report)
        elif test:
            result = held_out(result, test, report, groups=False)
        found.append(_only(result, request.hold_out))
    if not found:
        raise InputError(f"no law can be fitted: {next(iter(skipped.values()))}", file=request.files[0])
    return Answer(tuple(fit_files.rank(found)), skipped, left_out)


def _only(result: Fit, hold_out: str) -> Fit:
    """The held-out errors that were asked for; those of further files always."""
    if hold_out in ("all", "none"):
        return result
    if hold_out not in result.held_out:
        raise InputError(
            "cannot be left out of these data",
            field="--hold-out",
            value=hold_out,
            allowed=", ".join(["all", "none", *result.held_out]),
        )
    kept = {kind: e for kind, e in result.held_out.items() if kind in (hold_out, "file")}
    return dataclasses.replace(result, held_out=kept)


def _check(request: Request) -> None:
    for field, value, allowed in (
        ("--hold-out", request.hold_out, HOLD_OUT),
        ("--loss", request.loss, get_args(Loss)),
        ("--law", request.law, ("all", *LAWS)),
    ):
        if value not in allowed:
            raise InputError(
                "is no choice",
                field=field,
                value=value,
                allowed=", ".join(allowed),
                nearest=nearest_name(value, allowed),
            )
    fit_files.require_like(request.like)
    known = {p.name for law in LAWS.values() for p in law.parameters} | set(GEOMETRY)
    for name in request.fixed:
        if name not in known:
            raise InputError(
                "is no parameter of any law",
                field="--fix",
                value=name,
                allowed=", ".join(sorted(known)),
                nearest=nearest_name(name, known),
            )
    resolved = [file.resolve() for file in (*request.files, *request.test)]
    for file in request.files:
        if resolved.count(file.resolve()) > 1:
            raise InputError("is given twice: its points would count double", file=file)


def _read(files: tuple[pathlib.Path, ...], told: Mapping[str, Any]) -> tuple[list[Measured], int]:
    """The usable points of each file, with what the caller tells of the muscle; how many are not."""
    facts: dict[str, Any] = {}
    for key, text in told.items():
        unit = HEADER.get(key)
        if unit is None:
            names = [name for name, si in HEADER.items() if si]
            raise InputError(
                "is nothing that can be told",
                field="--tell",
                value=key,
                allowed=", ".join(names),
                nearest=nearest_name(key, names),
            )
        facts[key] = _quantity("--tell", key, text, unit)
    check_facts(None, facts, "--tell")
    data, left_out = [], 0
    for file in files:
        measured = read_measured(file, facts)
        usable, dropped = select(measured)
        if not len(usable):
            raise InputError("has no point with pressure, tension and contraction", file=file)
        data.append(usable)
        left_out += dropped
    return data, left_out


def _fixed(law: str, texts: Mapping[str, Any], *, only: bool) -> dict[str, float]:
    """Values of the parameters that are held; with several laws, of those that this law has."""
    units = {p.name: p.unit for p in (*LAWS[law].parameters, *GEOMETRY.values())}
    known = {name: text for name, text in texts.items() if name in units}
    if only and len(known) < len(texts):
        name = next(name for name in texts if name not in units)
        raise InputError(
            f"is no parameter of {law}",
            field="--fix",
            value=name,
            allowed=", ".join(units),
            nearest=nearest_name(name, units),
        )
    return {name: _quantity("--fix", name, text, units[name]) for name, text in known.items()}


def _quantity(option: str, key: str, text: Any, unit: str) -> float:
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(str(error), field=f"{option} {key}", value=text) from None


def write(found: Answer, folder: pathlib.Path, like: str) -> None:
    """Write the muscle, the numbers and the figure."""
    fit_files.write_fit(found.fits, found.skipped, folder, like)


def tables(found: Answer) -> list[tuple[str, list[str], list[list[str]]]]:
    """(title, header, rows) to print: the ranking where there are several laws, the best law's parameters."""
    best = found.fits[0]
    _, unit = residual_unit(best)
    shown = []
    if len(found.fits) + len(found.skipped) > 1:
        header = ["law", "parameters", f"RMS [{unit}]"]
        header += [f"{kind} left out [{unit}]" for kind in kinds(found.fits)]
        kind = fit_files.ranked_by(found.fits)
        title = f"laws, best on {kind}s left out first" if kind else "laws, best on the fitted points first"
        rows = ranking_rows(found.fits, found.skipped)
        shown.append((title, [*header, "starts agree", "intervals"], rows))
    rows = parameter_rows(best)
    shown.append((best.problem.law.name, ["parameter", "value", "95 % interval", "unit"], rows))
    return shown


def remarks(found: Answer) -> list[str]:
    """Lines to print below the tables: errors, what the data do not tell, what was left out."""
    best = found.fits[0]
    factor, unit = residual_unit(best)
    lines = [
        f"{len(best.residuals)} points: {factor * best.rms:.3g} {unit} RMS, worst {factor * best.worst:.3g} "
        f"{unit}; {best.agreeing_starts} of {best.starts} starts agree"
    ]
    for kind in best.held_out:
        groups = best.held_out[kind]
        each = ", ".join(f"{label}: {factor * fit_files.rms(errors):.2g}" for label, errors in groups.items())
        word = "predicted" if kind == "file" else f"{kind} left out in turn"
        lines.append(f"{word}: {factor * best.held_out_rms(kind):.3g} {unit} RMS ({each})")
    lines += [f"data do not tell: {line}" for line in best.verdict]
    if found.left_out:
        lines.append(
            f"{found.left_out} points without pressure or tension, or stretched, were left out: no static "
            "law is about them"
        )
    return lines

"""A static fit in files and in words: muscle.toml, fit.json, tables and remarks to print."""

import math
import pathlib
from typing import Any

from afo_sim.common.writing import write_json, write_text
from afo_sim.description.portable import toml_text
from afo_sim.lab.fitting.identifiability import rms
from afo_sim.lab.fitting.law_covariance import doubt
from afo_sim.lab.fitting.law_fit import LawFit
from afo_sim.lab.fitting.law_muscle import muscle, muscle_table, residual_unit, taken_over, usual
from afo_sim.lab.fitting.law_ranking import criterion, kinds
from afo_sim.lab.fitting.law_result import StaticFit

Tables = list[tuple[str, list[str], list[list[str]]]]


def write(found: StaticFit, folder: pathlib.Path) -> None:
    """Write muscle.toml and fit.json; with data of several muscles, a folder for each muscle.

    Parameters
    ----------
    found : from `fit`
    folder : made if need be

    Raises
    ------
    InputError
        The folder cannot be written to, or the fit ends where no muscle can be.
    """
    best = found.best
    stems = [data.file.stem for data in best.problem.data]
    write_json(folder / "fit.json", as_json(found))
    for data in best.problem.data:
        own = data.file.stem if stems.count(data.file.stem) == 1 else data.name.replace("/", "_")
        place = folder / own if len(stems) > 1 else folder
        muscle(best, data, found.like)  # it must be one
        write_text(place / "muscle.toml", toml_text(muscle_table(best, data, found.like)))


def as_json(found: StaticFit) -> dict[str, Any]:
    """The fits as plain data, SI but for the residuals, whose unit is stated."""
    return {
        "fits": [_fit_as_json(each) for each in found.fits],
        "skipped": found.skipped,
        "ranked_by": criterion(found.fits),
        "warnings": list(found.warnings),
        "slack_readings": found.slack,
        "left_out": found.left_out,
    }


def _fit_as_json(each: LawFit) -> dict[str, Any]:
    factor, unit = residual_unit(each)
    finite = {name: None if math.isinf(w) else w for name, w in each.half_width.items()}
    return {
        "law": each.problem.law.name,
        "values": each.values,
        "fixed": dict(each.problem.fixed),
        "half_width_95": finite,
        "correlation": each.correlation.tolist(),
        "covariance": None if each.covariance is None else each.covariance.model_dump(mode="json"),
        "verdict": list(each.verdict),
        "points": len(each.residuals),
        "residual_unit": unit,
        "rms": factor * each.rms,
        "worst": factor * each.worst,
        "agreeing_starts": each.agreeing_starts,
        "starts": each.starts,
        "held_out": {
            kind: {"rms": factor * each.held_out_rms(kind)}
            | {label: factor * rms(errors) for label, errors in groups.items()}
            for kind, groups in each.held_out.items()
        },
    }


def _covariance_line(best: LawFit) -> str:
    """What stands in the table [covariance], or why there is none, and whether it is too narrow."""
    told = best.covariance
    if told is None:
        return "no covariance is written: the points or the search do not settle the parameters"
    names = [key.rpartition(".")[2] for key in told.parameters]
    held = [name for name in best.values if name not in names]
    line = f"covariance of {', '.join(names)} with {told.freedom} degrees of freedom"
    line += f"; {', '.join(held)} held at the fitted value: the data do not tell it" if held else ""
    doubtful = doubt(best.problem, best.residuals)
    return f"{line}; {doubtful}" if doubtful else line


def tables(found: StaticFit) -> Tables:
    """(title, header, rows) to print: the ranking where there are several laws, the best law's parameters."""
    _, unit = residual_unit(found.best)
    shown: Tables = []
    if len(found.fits) + len(found.skipped) > 1:
        header = ["law", "parameters", f"RMS [{unit}]"]
        header += [f"{kind} left out [{unit}]" for kind in kinds(found.fits)]
        title = f"laws, best first by the {criterion(found.fits)}"
        rows = _ranking_rows(found)
        shown.append((title, [*header, "starts agree", "intervals"], rows))
    rows = _parameter_rows(found.best)
    shown.append((found.best.problem.law.name, ["parameter", "value", "95 % interval", "unit"], rows))
    return shown


def _parameter_rows(best: LawFit) -> list[list[str]]:
    """Name, value, half the 95 % interval, unit of every free parameter."""
    rows = []
    for name, value in best.values.items():
        shown, unit = usual(value, best.problem.describe(name).unit)
        width = best.half_width[name]
        interval = "refused" if math.isinf(width) else f"± {width * shown / value if value else width:.3g}"
        rows.append([name, f"{shown:.5g}", interval, unit])
    return rows


def _ranking_rows(found: StaticFit) -> list[list[str]]:
    rows, columns = [], kinds(found.fits)
    for each in found.fits:
        factor, _ = residual_unit(each)
        held = [f"{factor * each.held_out_rms(k):.3g}" if k in each.held_out else "-" for k in columns]
        refused = sum(math.isinf(w) for w in each.half_width.values())
        count = len(each.values)
        intervals = "all" if not refused else f"{count - refused} of {count}"
        agree = f"{each.agreeing_starts} of {each.starts}"
        rows.append([each.problem.law.name, str(count), f"{factor * each.rms:.3g}", *held, agree, intervals])
    return rows + [[law, "", "", *[""] * len(columns), "", reason] for law, reason in found.skipped.items()]


def remarks(found: StaticFit) -> list[str]:
    """Lines to print below the tables: errors, what the data do not tell, what was left out."""
    best = found.best
    factor, unit = residual_unit(best)
    lines = [
        f"{len(best.residuals)} points: {factor * best.rms:.3g} {unit} RMS, worst {factor * best.worst:.3g} "
        f"{unit}; {best.agreeing_starts} of {best.starts} starts agree"
    ]
    for kind in best.held_out:
        groups = best.held_out[kind]
        each = ", ".join(f"{label}: {factor * rms(errors):.2g}" for label, errors in groups.items())
        word = "predicted" if kind == "file" else f"{kind} left out in turn"
        lines.append(f"{word}: {factor * best.held_out_rms(kind):.3g} {unit} RMS ({each})")
    lines += [f"data do not tell: {line}" for line in best.verdict]
    lines.append(_covariance_line(best))
    if found.slack:
        lines.append(
            f"{found.slack} readings of 0 N are taken as of a slack muscle, whose force a law may put below "
            "zero; a load of 0 N at which the contraction was measured belongs into a column `load`"
        )
    if found.left_out:
        lines.append(
            f"{found.left_out} points without pressure or tension, or stretched, were left out: no static "
            "law is about them"
        )
    lacking = dict.fromkeys(name for data in best.problem.data for name in taken_over(data))
    if lacking:
        lines.append(f"grade C at most: {', '.join(lacking)} are taken over from {found.like}, not measured")
    return lines + [f"warning: {warning}" for warning in found.warnings]

"""A torque fit in files and in words: the fitted orthosis, its numbers, tables and remarks to print."""

import pathlib
import re

import numpy as np

from afo_sim.common import JsonDict, write_json, write_sealed
from afo_sim.description import reader, toml_text
from afo_sim.description.portable import portable
from afo_sim.lab.identifiability import rms
from afo_sim.lab.solution import held_out_json, held_out_lines
from afo_sim.lab.torque_fit import TorqueFit
from afo_sim.lab.torque_laws import moves
from afo_sim.lab.torque_problem import errors
from afo_sim.lab.torque_solution import root_mean_square

NUMBERS, ORTHOSIS = "fit_torque.json", "orthosis.toml"
FILES = (NUMBERS, ORTHOSIS, "fit_torque.png", "fit_torque.pdf")

Table = tuple[str, list[str], list[list[str]]]


def write(fit: TorqueFit, folder: pathlib.Path, place: pathlib.Path) -> None:
    """Write fit_torque.json and orthosis.toml; with an orthosis for each group, a folder for each."""
    write_json(folder / NUMBERS, as_json(fit), "torque fit")
    lacking = [f"# not identified by the readings: {line}" for line in fit.verdict]
    for name, own in folders(fit).items():
        (folder / own).mkdir(parents=True, exist_ok=True)
        table = {"orthosis": fit.orthoses[name].model_dump(mode="json", exclude_none=True)}
        # with its cuff and plate beside it where they are not shipped
        text = "\n".join(
            [*lacking, toml_text(portable(table, place / own, folder / own)["orthosis"], exact=False)]
        )
        write_sealed(folder / own / ORTHOSIS, text, "orthosis", folder / own)
        reader.load("orthosis", folder / own / ORTHOSIS)  # it must be one


def folders(fit: TorqueFit) -> dict[str, pathlib.Path]:
    """Where the orthosis of each group is written: one for all, or a folder for each."""
    names = [g.readings.group for g in fit.problem.groups]
    if len({id(g.orthosis) for g in fit.problem.groups}) == 1:
        return {names[0]: pathlib.Path()}
    return {name: pathlib.Path(re.sub(r"[^\w-]", "_", name)) for name in names}


def as_json(fit: TorqueFit) -> JsonDict:
    """The fit as plain data, SI."""
    problem, intervals = fit.problem, fit.intervals
    return {
        "data": list(dict.fromkeys(g.readings.file.name for g in problem.groups)),
        "chamber": problem.chamber,
        "torque": "difference" if problem.difference else "device",
        "parameters": {
            p.name: {
                "value": fit.parameters[p.name],
                "unit": p.unit,
                "interval_95": intervals[p.name],
                "refused": fit.reason(p.name) or None,
            }
            for p in problem.free
        },
        "correlation": fit.solution.correlation.tolist(),
        "verdict": list(fit.verdict),
        "settings": len(problem),
        "readings": float(problem.column("weight").sum()),
        "independent_errors": fit.solution.independent,
        "correlation_of_neighbouring_errors": fit.solution.memory,
        "rms": fit.rms,
        "rms_cuff": _cuff_error(fit),
        "held_out": held_out_json(fit.held_out),
        "without": {
            each.dropped: {"values": each.values, "rms_held_out": each.rms, "predicts_as_well": each.beaten}
            for each in fit.alternatives
        },
        "judged_by": fit.judged_by or None,
        "laws": {
            each.law: {
                "values": each.solution.values,
                "intervals_95": {name: each.ends(name) for name in each.solution.values},
                "rms": root_mean_square(each.solution),
                "rms_held_out": each.rms_held_out,
                "fits_comparably": each.comparable,
                "beyond_its_range": list(each.beyond),
            }
            for each in fit.laws
        },
        "shared_errors": {each.cause: each.values for each in fit.shared},
        "one_by_one": fit.apart.values if fit.apart else None,
        "chance_that_groups_agree": fit.apart.chance if fit.apart else None,
        "points": {
            "group": [problem.groups[k].readings.group for k in problem.of_group],
            **{c: problem.column(c).tolist() for c in ("angle", "pressure", "torque", "weight")},
            "residual": fit.residuals.tolist(),
        },
        "remarks": list(fit.remarks),
        "warnings": list(fit.warnings),
    }


def _cuff_error(fit: TorqueFit) -> float | None:
    """RMS error of the cuff's displacement [m]; None where none was read."""
    missed = errors(fit.problem, fit.parameters)["cuff"]
    missed = missed[np.isfinite(missed)]
    return rms(missed) if len(missed) else None


def tables(fit: TorqueFit) -> list[Table]:
    """(title, header, rows) to print: parameters, without each, with shared errors, by group."""
    free = fit.problem.free
    rows = []
    for p in free:
        interval = fit.intervals[p.name]
        belief = "refused" if interval is None else " to ".join(f"{p.number(end):.3g}" for end in interval)
        rows.append([p.name, f"{p.number(fit.parameters[p.name]):.4g}", belief, p.shown])
    shown = [("parameters", ["parameter", "value", "95 % interval", "unit"], rows)]
    if fit.laws:
        left = [f"{next(iter(fit.held_out))} left out"] if fit.laws[0].rms_held_out is not None else []
        header = ["law", *(f"{p.name} [{p.shown}]" for p in free), "RMS [N·m]", *left, "fits"]
        title = "each law of the muscle with its own interval; those above include all comparable laws"
        rows = []
        for law in fit.laws:
            cells = []
            for p in free:
                value = p.number(law.solution.values.get(p.name, np.nan))
                ends = dict.fromkeys(f"{p.number(end):.3g}" for end in law.ends(p.name) or ())
                cells.append(f"{value:.3g}" + (f" ({' to '.join(ends)})" if len(ends) > 1 else ""))
            cells += [f"{root_mean_square(law.solution):.3g}"]
            cells += [] if law.rms_held_out is None else [f"{law.rms_held_out:.3g}"]
            beyond = "".join(f"; beyond its range of {n.data['quantity']}" for n in law.beyond)
            rows.append([law.law, *cells, ("comparably" if law.comparable else "worse") + beyond])
        shown.append((title, header, rows))
    if fit.alternatives:
        kind, header = fit.judged_by, ["fit", *(p.name for p in free), "RMS [N·m]"]
        own = [p.text(fit.parameters[p.name]) for p in free]
        rows = [["as asked", *own, f"{fit.held_out[kind].rms:.3g}"]]
        for each in fit.alternatives:
            cells = [p.text(each.values[p.name]) if p.name in each.values else "-" for p in free]
            rows.append([f"without {each.dropped}", *cells, f"{each.rms:.3g}"])
        shown.append((f"with and without each parameter; error of the {kind} left out", header, rows))
    if fit.identifiable or any(fit.intervals.values()):
        rows = [[each.cause, *(p.text(each.values[p.name]) for p in free)] for each in fit.shared]
        shown.append(("not in the intervals: the same fit with", ["", *(p.name for p in free)], rows))
    if fit.apart:
        groups = fit.apart.values.items()
        rows = [[group, *(p.text(values[p.name]) for p in free)] for group, values in groups]
        shown.append(("each group fitted alone", ["group", *(p.name for p in free)], rows))
    return shown


def remarks(fit: TorqueFit) -> list[str]:
    """Lines to print below the tables."""
    problem = fit.problem
    readings = problem.column("weight").sum()
    largest = float(np.abs(fit.residuals).max())
    lines = [*fit.remarks]
    text = f"{readings:.0f} readings: {fit.rms:.3g} N·m RMS, worst {largest:.3g} N·m, on a mean torque of "
    lines.append(f"{text}{np.abs(problem.column('torque')).mean():.3g} N·m")
    cuff = _cuff_error(fit)
    if cuff is not None:
        lines.append(f"displacement of the cuff: {1e3 * cuff:.3g} mm RMS")
    lines += held_out_lines(fit.held_out)
    lines += [line for line in moves(fit.laws, problem.free) if line.severity == "note"]
    if not fit.laws:
        line = "no second law of the muscle was fitted: "
        lines.append(f"{line}how much these numbers depend on the law is not known")
    lines += [f"not identified by the readings: {line}" for line in fit.verdict]
    return lines + [f"warning: {warning}" for warning in fit.warnings]

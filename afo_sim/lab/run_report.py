"""A dynamic fit in files and in words: the fitted scenario, its numbers, tables and remarks to print."""

import pathlib

from afo_sim.common import JsonDict, write_json, write_sealed
from afo_sim.description import reader, toml_text
from afo_sim.description.portable import portable
from afo_sim.lab.run_fit import FitRun

SCENARIO, NUMBERS = "scenario.toml", "fit_run.json"


def write(fit: FitRun, folder: pathlib.Path) -> None:
    """Write fit_run.json and, if a search has settled, scenario.toml."""
    write_json(folder / NUMBERS, _as_json(fit), "run fit")
    if fit.values and fit.converged:
        comments = [f"# Fitted to {fit.problem.log.file.name}; all else is unchanged."]
        for p in (p for p in fit.problem.free if not p.keys):
            comments.append(f"# {p.name} = {fit.value_text(p)}, of the log: {fit.belief(p)}")
        text = "\n".join([*comments, toml_text(portable(fit.scenario.resolved(), folder), exact=False)])
        write_sealed(folder / SCENARIO, text, "scenario", folder)
        reader.load("scenario", folder / SCENARIO)  # it must be one


def _as_json(fit: FitRun) -> JsonDict:
    """The fit as plain data, SI."""
    problem = fit.problem
    return {
        "log": problem.log.file.name,
        "scenario": problem.scenario["name"],
        "parameters": {
            p.name: {
                "start": p.low,
                "value": fit.values[p.name],
                "interval_95": fit.interval[p.name],
                "refused": fit.reason(p.name) or None,
                "unit": p.unit,
                "sets": {key: share * fit.values[p.name] for key, share in p.keys.items()},
            }
            for p in problem.free
        },
        "correlation": fit.correlation.tolist(),
        "verdict": list(fit.verdict),
        "channels": {
            channel.title: {
                "columns": list(channel.columns),
                "unit": channel.si,
                "noise": problem.noise[channel.title],
                "rms_before": errors.before,
                "rms_after": errors.after,
                "rms_before_held_out": errors.before_held_out,
                "rms_held_out": errors.held_out,
                "chi_squared": errors.chi_squared,
                "chi_squared_held_out": errors.chi_squared_held_out,
            }
            for channel, errors in zip(problem.log.channels, fit.errors.values(), strict=True)
        },
        "warnings": list(fit.warnings),
        "held_out_share": problem.hold_out,
        "samples": len(problem.log.time),
        "errors_in_noise": fit.misfit,
        "correlation_of_neighbouring_errors": fit.memory,
        "runs": fit.runs,
        "converged": fit.converged,
    }


def tables(fit: FitRun) -> list[tuple[str, list[str], list[list[str]]]]:
    """(title, header, rows) to print: the parameters, then the errors of each channel."""
    rows = []
    for p in fit.problem.free:
        interval = fit.interval[p.name]
        belief = f"refused: {fit.reason(p.name)}"
        if interval is not None:
            belief = " to ".join(f"{p.number(end):.4g}" for end in interval)
        values = (f"{p.number(value):.4g}" for value in (p.low, fit.values[p.name]))
        rows.append([p.name, *values, p.shown, belief])
    found = [("parameters", ["parameter", "start", "fitted", "unit", "95 % interval"], rows)] if rows else []
    header = ["channel", "unit", "noise", "before", "after"]
    if fit.problem.hold_out and fit.values:
        header += ["held out: before", "after"]
    channels = []
    for channel in fit.problem.log.channels:
        errors = fit.errors[channel.title]
        numbers = [fit.problem.noise[channel.title], errors.before, errors.after]
        numbers += [e for e in (errors.before_held_out, errors.held_out) if e is not None]
        cells = [f"{number / channel.scale:.3g}" for number in numbers]
        channels.append([channel.title, channel.unit, *cells])
    return [*found, ("errors, RMS", header, channels)]


def remarks(fit: FitRun) -> list[str]:
    """Lines to print below the tables."""
    samples, plural = len(fit.problem.log.time), "s" if fit.runs > 1 else ""
    lines = [f"{samples} samples, {fit.runs} run{plural}; the errors are {fit.misfit:.3g} times the noise"]
    if not fit.converged:
        lines.append("the search stopped before it converged")
    lines += [f"not identified by the log: {line}" for line in fit.verdict]
    lines += [f"warning: {warning}" for warning in fit.warnings]
    return lines

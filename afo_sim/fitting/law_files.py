"""What a fit leaves behind: a muscle that runs at once, its numbers, a figure of the residuals."""

import math
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from afo_sim.bench.measured import Measured
from afo_sim.common import assets
from afo_sim.common.errors import InputError
from afo_sim.common.toml_text import toml_text
from afo_sim.common.units import EXAMPLES, format_quantity, in_unit
from afo_sim.common.writing import together, write_json, write_text
from afo_sim.description import reader
from afo_sim.fitting.law_fit import Fit, rms
from afo_sim.fitting.law_problem import NOMINAL_LENGTH, predict, pressure_levels, take
from afo_sim.show.figure import COLOURS, RESOLUTION, STYLE

LIKE = "s1_215mm"  # whose damping, masses and stiffness a fitted muscle takes over, unless told


def usual(value: float, si: str) -> tuple[float, str]:
    """A value in the unit that people use for it."""
    unit = EXAMPLES[si].partition(" ")[2] if si else ""
    return (in_unit(value, si, unit), unit) if unit else (value, "")


def residual_unit(fit: Fit) -> tuple[float, str]:
    """Factor and unit in which residuals are shown: newtons, or centimetres of length."""
    if not fit.problem.loaded:
        return 1.0, "N"
    return (100.0, "cm") if fit.problem.data[0].contraction is None else (1.0, "-")


def parameter_rows(fit: Fit) -> list[list[str]]:
    """Name, value, half the 95 % interval, unit of every free parameter, for a table."""
    rows = []
    for name, value in fit.values.items():
        shown, unit = usual(value, fit.problem.describe(name).unit)
        width = fit.half_width[name]
        interval = "refused" if math.isinf(width) else f"± {width * shown / value if value else width:.3g}"
        rows.append([name, f"{shown:.5g}", interval, unit])
    return rows


def ranking_rows(fits: Sequence[Fit], skipped: dict[str, str]) -> list[list[str]]:
    """The laws by their error on pressures that they did not see, for a table."""
    rows = []
    for fit in fits:
        factor, _ = residual_unit(fit)
        held = [f"{factor * fit.held_out_rms(k):.3g}" if k in fit.held_out else "-" for k in kinds(fits)]
        refused = sum(math.isinf(w) for w in fit.half_width.values())
        agree = f"{fit.agreeing_starts} of {fit.starts}"
        rows.append(
            [
                fit.problem.law.name,
                str(len(fit.values)),
                f"{factor * fit.rms:.3g}",
                *held,
                agree,
                "all" if not refused else f"{len(fit.values) - refused} of {len(fit.values)}",
            ]
        )
    return rows + [[law, "", "", *[""] * len(kinds(fits)), "", reason] for law, reason in skipped.items()]


def kinds(fits: Sequence[Fit]) -> list[str]:
    """What was left out in turn, over several fits."""
    return list(dict.fromkeys(kind for fit in fits for kind in fit.held_out))


def rank(fits: Sequence[Fit]) -> list[Fit]:
    """Best first: by the error on what was left out, pressures first; on the data where nothing was."""
    kind = ranked_by(fits)

    def error(fit: Fit) -> float:
        return fit.held_out_rms(kind) if kind in fit.held_out else math.inf

    return sorted(fits, key=lambda fit: (error(fit), fit.rms))


def ranked_by(fits: Sequence[Fit]) -> str:
    """The kind of held-out error that laws are ranked by; "" where nothing was left out."""
    return next((kind for kind in kinds(fits) if kind != "file"), "")


def write_fit(fits: Sequence[Fit], skipped: dict[str, str], folder: pathlib.Path, like: str = LIKE) -> None:
    """Write muscle.toml, fit.json and fit.png/.pdf of the best of several fits.

    Parameters
    ----------
    fits : best first
    skipped : laws that could not be fitted, and why
    folder : made if need be; with data of several muscles, a folder for each is made in it
    like : muscle from which comes what the data do not tell

    Raises
    ------
    InputError
        The folder cannot be written to, or there is no such muscle.
    """
    best = fits[0]
    data_sets = best.problem.data
    stems = [data.file.stem for data in data_sets]
    told = {"fits": [_as_json(fit) for fit in fits], "skipped": skipped}
    with together(folder) as scratch:
        write_json(scratch / "fit.json", told)
        for data in data_sets:
            own = data.file.stem if stems.count(data.file.stem) == 1 else data.name.replace("/", "_")
            place = scratch / own if len(data_sets) > 1 else scratch
            write_text(place / "muscle.toml", muscle_toml(best, data, like))
            _require_a_muscle(place / "muscle.toml", best)
        for suffix in ("png", "pdf"):
            draw(fits, scratch / f"fit.{suffix}", suffix)


def _require_a_muscle(path: pathlib.Path, fit: Fit) -> None:
    """Refuse a fit that ends where no muscle can be; the message is about the data, not the file."""
    try:
        reader.load("muscle", path)
    except InputError as error:
        raise InputError(
            f"the fit of {fit.problem.law.name} is no muscle: {error.field} {error.problem}",
            file=fit.problem.data[0].file,
            value=error.value,
            allowed=error.allowed,
        ) from None


def _as_json(fit: Fit) -> dict[str, Any]:
    factor, unit = residual_unit(fit)
    finite = {name: None if math.isinf(w) else w for name, w in fit.half_width.items()}
    return {
        "law": fit.problem.law.name,
        "values": fit.values,
        "fixed": dict(fit.problem.fixed),
        "half_width_95": finite,
        "correlation": fit.correlation.tolist(),
        "verdict": list(fit.verdict),
        "points": len(fit.residuals),
        "residual_unit": unit,
        "rms": factor * fit.rms,
        "worst": factor * fit.worst,
        "agreeing_starts": fit.agreeing_starts,
        "starts": fit.starts,
        "held_out": {
            kind: {"rms": factor * fit.held_out_rms(kind)}
            | {label: factor * rms(errors) for label, errors in groups.items()}
            for kind, groups in fit.held_out.items()
        },
    }


def muscle_toml(fit: Fit, data: Measured, like: str = LIKE) -> str:
    """A muscle of one data set, every number with its source; what was not measured comes from `like`."""
    law, told = fit.problem.law, f"told with {data.file.name}"
    taken = assets.read_toml(assets.find("muscle", like))
    over = {key: _value(taken[key]) for key in ("damping", "braid_stiffness", "dead_volume", "mass")}
    values, sources = over, dict.fromkeys(over, _source("assumed", f"taken over from {like}, not measured"))

    def state(key: str, value: float, source: dict[str, str]) -> None:
        values[key], sources[key] = format_quantity(value, "m"), source

    # with contraction ratios the law was fitted for this length, which some laws depend on
    length = data.facts.get("total_length")
    assumed = _source("assumed", "contraction ratios were measured")
    state("total_length", length or NOMINAL_LENGTH, _source("user", told) if length else assumed)
    state("bore", data.facts["bore"], _source("user", told))
    fitted = ["braid_angle"]
    if data.contraction is None:
        fitted.append("end_length")
    else:
        state("end_length", 0.0, _source("assumed", "contractions were given: braid only"))
    for name in fitted:
        values[name], sources[name] = _fitted(fit, name)
    table = {
        "description": f"{data.file.stem}: {law.name} fitted to {_files(fit)}",
        "grade": "A" if fit.identifiable else "C",
        "law": law.name,
        **values,
        "provenance": sources,
        "laws": {law.name: _law_table(fit, data)},
        "limits": _limits(fit, data),
    }
    return toml_text(table)


def _fitted(fit: Fit, name: str) -> tuple[str | float, dict[str, str]]:
    """A parameter's value as text, and what is known of it."""
    si = fit.problem.describe(name).unit
    if name not in fit.values:
        return format_quantity(fit.problem.fixed[name], si), _source("assumed", "held during the fit")
    factor, unit = residual_unit(fit)
    summary = f"fitted with {fit.problem.law.name} to {_files(fit)}, {factor * fit.rms:.3g} {unit} RMS"
    belief = "no interval: the data do not tell it alone"
    if math.isfinite(fit.half_width[name]):
        shown, usual_unit = usual(fit.half_width[name], si)
        belief = f"95 % interval ± {shown:.3g} {usual_unit}".rstrip()
    return format_quantity(fit.values[name], si), _source("fitted", f"{summary}; {belief}")


def _law_table(fit: Fit, data: Measured) -> dict[str, Any]:
    """The law's parameters, and the range that was measured, no more."""
    found = {p.name: _fitted(fit, p.name) for p in fit.problem.law.parameters}
    return {
        **{name: value for name, (value, _) in found.items()},
        "pressure_range": [format_quantity(p, "Pa") for p in (data.pressure.min(), data.pressure.max())],
        "contraction_range": [0.0, _greatest_contraction(fit, data)],
        "provenance": {name: source for name, (_, source) in found.items()},
    }


def _limits(fit: Fit, data: Measured) -> dict[str, Any]:
    """What a muscle may be asked for: what it was asked for when it was measured."""
    highest = _source("derived", f"the highest of {data.file.name}")
    return {
        "pressure": format_quantity(float(data.pressure.max()), "Pa"),
        "force": format_quantity(max(float(data.force.max()), 1.0), "N"),
        "contraction_min": -0.03,
        "contraction_max": _greatest_contraction(fit, data),
        "provenance": {
            **dict.fromkeys(("pressure", "force", "contraction_max"), highest),
            "contraction_min": _source("assumed", "as comparable fluidic muscles"),
        },
    }


def _greatest_contraction(fit: Fit, data: Measured) -> float:
    """The greatest measured contraction ratio [-], within what a muscle can be described with."""
    active = data.facts.get("total_length", 1.0) - {**fit.problem.fixed, **fit.values}["end_length"]
    kappa = data.contraction if data.contraction is not None else data.change / active  # type: ignore[operator]
    return min(max(float(kappa.max()), 0.01), 0.6)


def _files(fit: Fit) -> str:
    return ", ".join(data.file.name for data in fit.problem.data)


def _source(kind: str, source: str) -> dict[str, str]:
    return {"kind": kind, "source": source}


def _value(entry: Any) -> Any:
    """The value of a description's entry, with or without its source."""
    return entry["value"] if isinstance(entry, dict) else entry


def draw(fits: Sequence[Fit], path: pathlib.Path, suffix: str = "png") -> None:
    """Draw the best fit over the data, its residuals, and the laws' errors where there are several.

    Parameters
    ----------
    fits : best first
    path, suffix : file and format
    """
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    best = fits[0]
    count = len(best.problem.data) + 1 + (len(fits) > 1)
    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(1, count, figsize=(3.6 * count, 3.3), layout="constrained")
        for axis, data in zip(axes, best.problem.data, strict=False):
            _draw_curves(axis, best, data)
        _draw_residuals(axes[len(best.problem.data)], best)
        if len(fits) > 1:
            _draw_ranking(axes[-1], fits)
        figure.suptitle(f"{best.problem.law.name}: {best.problem.law.formula}")
        figure.savefig(path, dpi=RESOLUTION, format=suffix)
        pyplot.close(figure)


def _draw_curves(axis: Any, fit: Fit, data: Measured) -> None:
    """Points, and the law's line through them at each pressure."""
    factor, unit = residual_unit(fit)
    levels = pressure_levels(fit.problem.data)[fit.problem.data.index(data)]
    for level in np.unique(levels):
        colour = _colour(data, level * 1e5)
        points = take(data, levels == level)
        label = f"{level:g} bar"
        if data.loaded:
            line = _line(points, force=np.linspace(0.7 * points.force.min(), 1.1 * points.force.max(), 60))
            measured = points.change if points.change is not None else points.contraction
            axis.plot(line.force, factor * predict(fit.problem, fit.values, line), color=colour)
            axis.plot(points.force, factor * np.asarray(measured), "o", ms=4, color=colour, label=label)
        else:
            x = points.contraction if points.contraction is not None else points.change
            grid = np.linspace(0.0, float(np.max(x)) * 1.05 + 0.005, 80)  # type: ignore[arg-type]
            name = "contraction" if points.contraction is not None else "change"
            line = _line(points, **{name: grid})
            axis.plot(grid, predict(fit.problem, fit.values, line), color=colour)
            axis.plot(x, points.force, "o", ms=4, color=colour, label=label)
    axis.set_title(data.name)
    axis.set_xlabel("load [N]" if data.loaded else "contraction ratio κ [-]")
    axis.set_ylabel(f"change of length [{unit}]" if data.loaded else "force [N]")
    if data.loaded and data.contraction is not None:
        axis.set_ylabel("contraction ratio κ [-]")
    if not data.loaded and data.contraction is None:
        axis.set_xlabel("change of length [m]")
    axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]) if data.loaded else 0.0)
    axis.legend()


def _colour(data: Measured, pressure: float) -> Any:
    from matplotlib import colormaps

    return colormaps["viridis"](0.9 * (pressure - data.pressure.min()) / max(np.ptp(data.pressure), 1.0))


def _line(points: Measured, **columns: np.ndarray) -> Measured:
    """A data set to predict a smooth curve at: the points' mean pressure, other columns replaced."""
    import dataclasses

    size = len(next(iter(columns.values())))
    blank = {"force": np.zeros(size)} | columns
    return dataclasses.replace(
        points, pressure=np.full(size, points.pressure.mean()), curve=np.zeros(size), **blank
    )


def _draw_residuals(axis: Any, fit: Fit) -> None:
    """Errors over pressure: seen by the fit, and when their pressure was left out."""
    factor, unit = residual_unit(fit)
    pressure = np.concatenate([d.pressure for d in fit.problem.data]) * 1e-5
    axis.axhline(0.0, color="0.6", lw=0.8)
    axis.plot(pressure - 0.04, factor * fit.residuals, "o", ms=3, color=COLOURS[1], label="fitted")
    for k, (label, errors) in enumerate(fit.held_out.get("pressure", {}).items()):
        at = np.full(len(errors), float(label.split()[0]) + 0.04)
        axis.plot(at, factor * errors, "x", ms=4, color=COLOURS[0], label="left out" if k == 0 else None)
    axis.margins(x=0.08)
    axis.set_xlabel("gauge pressure [bar]")
    axis.set_ylabel(f"prediction − measurement [{unit}]")
    axis.set_title(f"{factor * fit.rms:.3g} {unit} RMS")
    axis.legend()


def _draw_ranking(axis: Any, fits: Sequence[Fit]) -> None:
    factor, unit = residual_unit(fits[0])
    places = np.arange(len(fits))[::-1]
    axis.barh(places + 0.2, [factor * f.rms for f in fits], 0.38, color=COLOURS[1], label="fitted")
    for kind, colour in zip(kinds(fits)[:1], COLOURS, strict=False):
        values = [factor * f.held_out_rms(kind) if kind in f.held_out else np.nan for f in fits]
        axis.barh(places - 0.2, values, 0.38, color=colour, label=f"{kind} left out")
    axis.set_yticks(places, [f.problem.law.name for f in fits])
    axis.set_xscale("log")
    axis.set_xlim(left=0.7 * factor * min(f.rms for f in fits))
    axis.set_xlabel(f"RMS error [{unit}]")
    axis.legend()


def require_like(like: str) -> None:
    """Refuse a muscle that is not there, before anything is computed."""
    try:
        assets.find("muscle", like)
    except InputError as error:
        raise InputError(
            error.problem, field="--like", value=like, allowed=error.allowed, nearest=error.nearest
        ) from None

"""The muscle of a fitted law, ready to run; laws by how well they predict, and doubts about that order."""

import math
from collections.abc import Sequence

import numpy as np

from afo_sim.common import InputError, Json, JsonDict, Notice, assets, format_quantity
from afo_sim.description import Muscle, reader
from afo_sim.lab.law_fit import LawFit
from afo_sim.lab.law_problem import NOMINAL_LENGTH, described
from afo_sim.lab.measured import Measured
from afo_sim.lab.solution import POINTS_PER_PARAMETER

LIKE = "s1_215mm"
# What a static characteristic does not tell of a muscle, and its unit.
BESIDE_THE_LAW = {"damping": "m^2*s", "braid_stiffness": "N", "dead_volume": "m^3", "mass": "kg"}
Sourced = dict[str, tuple[Json, dict[str, str]]]  # name → value as it is written, and what is known of it
FEWEST = {"pressure": 3, "load": 3}  # groups to leave out in turn: with two, each is extrapolated from one
GROSS = 3.0  # times the error of the law that fits best: the two rankings contradict each other


def residual_unit(fit: LawFit) -> tuple[float, str]:
    """Factor and unit in which residuals are shown: newtons, or centimetres of length."""
    if not fit.problem.loaded:
        return 1.0, "N"
    return (100.0, "cm") if fit.problem.data[0].contraction is None else (1.0, "-")


def taken_over(data: Measured) -> tuple[str, ...]:
    """The numbers that the data lack and another muscle supplies."""
    return tuple(name for name in BESIDE_THE_LAW if name not in data.facts)


def grade(fit: LawFit, data: Measured) -> str:
    """Grade of a fitted muscle: A only where every number of it was measured and identified."""
    length = data.contraction is None or "total_length" in data.facts
    return "A" if fit.identifiable and length and not taken_over(data) else "C"


def muscle_table(fit: LawFit, data: Measured, like: str = LIKE) -> JsonDict:
    """The description of one data set's muscle, as plain data that `reader.load` takes."""
    law, covariance = fit.problem.law, fit.covariance
    if covariance is not None:
        # a muscle whose contractions were measured has no end length, which other muscles' data may have told
        kept = [key for key in covariance.parameters if key != "end_length" or data.contraction is None]
        covariance = covariance.block(kept) if kept else None
    active = data.facts.get("total_length", 1.0) - {**fit.problem.fixed, **fit.values}["end_length"]
    kappa = data.contraction if data.contraction is not None else np.asarray(data.change) / active
    greatest = min(max(float(kappa.max()), 0.01), 0.6)  # within what a muscle can be described with
    highest = _source("derived", f"the highest of {data.file.name}")
    limits: Sourced = {
        "pressure": (format_quantity(float(data.pressure.max()), "Pa"), highest),
        "force": (format_quantity(max(float(data.force.max()), 1.0), "N"), highest),
        "contraction_min": (-0.03, _source("assumed", "as comparable fluidic muscles")),
        "contraction_max": (greatest, highest),
    }
    measured = {  # and no more
        "pressure_range": [format_quantity(p, "Pa") for p in (data.pressure.min(), data.pressure.max())],
        "contraction_range": [0.0, greatest],
    }
    told = _source("fitted", f"measured on this muscle, {data.file.name}")
    # force and contraction are its own, and differ from no other laboratory's
    own: Sourced = dict.fromkeys(("force_factor", "contraction_factor"), (1.0, told))
    return {
        "name": data.file.stem,
        "description": f"{data.file.stem}: {law.name} fitted to {_files(fit)}",
        "grade": grade(fit, data),
        "law": law.name,
        **_table(_beside_the_law(data, like) | _geometry(fit, data) | own),
        "laws": {law.name: _table({p.name: _fitted(fit, p.name) for p in law.parameters}) | measured},
        "limits": _table(limits),
        "covariance": None if covariance is None else covariance.model_dump(mode="json"),
    }


def _table(sourced: Sourced) -> JsonDict:
    values = {name: value for name, (value, _) in sourced.items()}
    return values | {"provenance": {name: source for name, (_, source) in sourced.items()}}


def muscle(fit: LawFit, data: Measured, like: str = LIKE) -> Muscle:
    """The muscle of one data set."""
    try:
        found: Muscle = reader.load("muscle", muscle_table(fit, data, like))
    except InputError as error:
        problem = f"the fit of {fit.problem.law.name} is not a valid muscle: {error.field} {error.problem}"
        raise error.replaced(problem=problem, file=data.file, field="", nearest=None) from None
    return found


def _beside_the_law(data: Measured, like: str) -> Sourced:
    """Damping, stiffness, dead volume and mass: as the data's header states them, else another muscle's."""
    other, found = assets.read_toml(assets.find("muscle", like)), Sourced()
    for name, unit in BESIDE_THE_LAW.items():
        own = other[name]["value"] if isinstance(other[name], dict) else other[name]
        found[name] = own, _source("assumed", f"taken from {like}, not measured")
        if name in data.facts:
            stated = _source("user", f"stated with {data.file.name}")
            found[name] = format_quantity(data.facts[name], unit), stated
    return found


def _geometry(fit: LawFit, data: Measured) -> Sourced:
    """Lengths, bore and braid angle."""
    given = _source("user", f"stated with {data.file.name}")
    # with contraction ratios the law was fitted for this length, which some laws depend on
    length = data.facts.get("total_length")
    assumed = _source("assumed", "contraction ratios were measured")
    ends = format_quantity(0.0, "m"), _source("assumed", "contractions were given: braid only")
    return {
        "total_length": (format_quantity(length or NOMINAL_LENGTH, "m"), given if length else assumed),
        "bore": (format_quantity(data.facts["bore"], "m"), given),
        "end_length": _fitted(fit, "end_length") if data.contraction is None else ends,
        "braid_angle": _fitted(fit, "braid_angle"),
    }


def _fitted(fit: LawFit, name: str) -> tuple[Json, dict[str, str]]:
    """A parameter's value as text, and what is known of it."""
    si = described(fit.problem.law)[name].unit
    if name not in fit.values:
        return format_quantity(fit.problem.fixed[name], si), _source("assumed", "held during the fit")
    factor, unit = residual_unit(fit)
    summary = f"fitted with {fit.problem.law.name} to {_files(fit)}, {factor * fit.rms:.3g} {unit} RMS"
    belief = "no interval: the data do not identify it on its own"
    if math.isfinite(fit.half_width[name]):
        p = next(p for p in fit.problem.free if p.name == name)
        belief = f"95 % interval ± {p.number(fit.half_width[name]):.3g} {p.shown}".rstrip()
    return format_quantity(fit.written[name], si), _source("fitted", f"{summary}; {belief}")


def _files(fit: LawFit) -> str:
    return ", ".join(data.file.name for data in fit.problem.data)


def _source(kind: str, source: str) -> dict[str, str]:
    return {"kind": kind, "source": source}


def kinds(fits: Sequence[LawFit]) -> list[str]:
    """The kinds of groups that were left out in turn, over several fits."""
    return list(dict.fromkeys(kind for fit in fits for kind in fit.held_out))


def _ranked_by(fits: Sequence[LawFit]) -> str:
    """The kind of held-out error that laws are ranked by; "" where too little or nothing was left out."""
    return next((kind for kind in kinds(fits) if kind != "file" and not _too_few(fits, kind)), "")


def rank(fits: Sequence[LawFit]) -> list[LawFit]:
    """Best first: by the error on what was left out, or else by the standard deviation of the residuals."""
    kind = _ranked_by(fits)
    errors = [fit.held_out[kind].rms if kind in fit.held_out else math.inf for fit in fits]
    ranked = sorted(zip(errors, fits, strict=True), key=lambda pair: (pair[0], pair[1].spread, pair[1].rms))
    best = ranked[0][1]
    # of errors within one standard error of the least a law that is determined (Breiman et al. 1984, CART)
    held = best.held_out.get(kind)
    squares = [held.of(name) ** 2 for name in held.parts] if held else [0.0, 0.0]
    most = ranked[0][0] ** 2 + np.std(squares, ddof=1) / math.sqrt(len(squares))
    best = next((fit for error, fit in ranked if error**2 < most and _determined(fit)), best)
    return sorted((fit for _, fit in ranked), key=lambda fit: fit is not best)


def _determined(fit: LawFit) -> bool:
    return all(map(math.isfinite, fit.half_width.values()))


def criterion(fits: Sequence[LawFit]) -> str:
    """The measure that the laws are ranked by, in words."""
    kind = _ranked_by(fits)
    return f"error on each {kind} left out in turn" if kind else "standard deviation about the fitted points"


def doubts(fits: Sequence[LawFit]) -> list[Notice]:
    """Reasons to look twice before taking the first of several ranked laws."""
    if len(fits) < 2:
        return []
    best = fits[0]
    found: list[Notice] = []
    factor, unit = residual_unit(best)
    for kind in kinds(fits):
        if _too_few(fits, kind):
            text = "only {groups} {subject}s: leaving one out extrapolates from the other, "
            text += "so laws are not ranked by it; measure at {fewest} or more"
            groups = _groups(fits, kind)
            found.append(Notice("too-few-groups", text, subject=kind, groups=groups, fewest=FEWEST[kind]))
    whole = list(filter(_determined, fits))
    if whole and not _determined(best):
        text = "the data do not determine all parameters of {subject}: trust it only where measured; "
        text += f"of {{whole}} they do ({factor * whole[0].rms:.3g} {unit} RMS), which --law fits alone"
        first, other = (fit.problem.law.name for fit in (best, whole[0]))
        found.append(Notice("law-not-determined", text, subject=first, whole=other))
    if not _ranked_by(fits) and not found:
        text = "nothing was held out: the order shows how well laws fit, not how well they predict"
        found.append(Notice("nothing-left-out", text))
    # more parameters than the points can bear fit anything
    sound = [f for f in fits if f.values and f.telling >= POINTS_PER_PARAMETER * len(f.values)]
    closest = min(sound or [best], key=lambda fit: fit.spread)
    if best.spread > GROSS * closest.spread:
        text = f"{{subject}} is first by the {criterion(fits)}, but misses the fitted points by "
        text += f"{factor * best.rms:.3g} {unit} RMS, and {{closest}} by {factor * closest.rms:.3g} {unit}: "
        text += "the two rankings contradict each other"
        first, other = best.problem.law.name, closest.problem.law.name
        found.append(Notice("orders-contradict", text, subject=first, closest=other))
    return found


def _groups(fits: Sequence[LawFit], kind: str) -> int:
    return max(len(fit.held_out[kind].errors) if kind in fit.held_out else 0 for fit in fits)


def _too_few(fits: Sequence[LawFit], kind: str) -> bool:
    return _groups(fits, kind) < FEWEST.get(kind, 1)

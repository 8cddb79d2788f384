"""A stand test as it is asked for on the command line: names and text in, tests, tables and remarks out."""

import functools
import pathlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from afo_sim.bench import trial as stand
from afo_sim.bench.compare import Comparison, compare, points_of
from afo_sim.bench.measured import Measured, read_measured
from afo_sim.bench.measures import AXES
from afo_sim.bench.plan import KINDS, Laboratory
from afo_sim.bench.static_load import static_load
from afo_sim.bench.trial import Trial
from afo_sim.common.errors import InputError, nearest_name
from afo_sim.common.units import GRAVITY, parse_quantity
from afo_sim.common.writing import check_writable
from afo_sim.description.muscle import Muscle
from afo_sim.description.reader import load as load_description
from afo_sim.show.stand_files import set_point_text, target, write

CHARACTERISTICS = tuple(AXES)  # what "all" means
# Which options a kind takes, beside those that all take.
TAKES = {
    "isobaric": ("pressure", "contraction", "length"),
    "isotonic": ("load", "pressure"),
    "isometric": ("contraction", "length", "pressure"),
    "step": ("pressure", "load", "contraction", "length", "valve"),
    "release": ("pressure", "load", "contraction", "length", "valve"),
}
PRINTED = {  # column title of a table: (measure, factor, unit)
    "isobaric": {
        "force": ("greatest_force", 1.0, "N"),
        "off formula": ("off_formula_share", 1.0, "%"),
        "off pressure": ("pressure_off", 1.0, "%"),
        "loop": ("loop_height", 1.0, "N"),
        "work lost": ("work_lost_per_cycle", 1.0, "J"),
    },
    "isotonic": {
        "contraction": ("greatest_contraction", 100.0, "%"),
        "off formula": ("off_formula_share", 1.0, "%"),
        "loop": ("loop_height", 100.0, "%"),
        "work lost": ("work_lost_per_cycle", 1.0, "J"),
    },
    "isometric": {
        "force": ("greatest_force", 1.0, "N"),
        "off formula": ("off_formula_share", 1.0, "%"),
    },
    "release": {
        "peak speed": ("peak_speed", 1.0, "m/s"),
        "τ": ("time_constant", 1e3, "ms"),
        "overshoot": ("overshoot", 1.0, "%"),
        "final contraction": ("final_contraction", 100.0, "%"),
        "lowest pressure": ("lowest_pressure", 1e-5, "bar"),
    },
}


@dataclass(frozen=True)
class Request:
    """What was asked for; quantities still as text."""

    kind: str
    muscles: tuple[str, ...]
    laws: tuple[str, ...] = ()
    frictions: tuple[str, ...] = ()
    values: Mapping[str, tuple[str, ...]] | None = None  # of pressure, load, length, contraction
    valve: str | None = None
    supply: str | None = None
    time: str | None = None
    static: bool = False
    compare: pathlib.Path | None = None
    sets: Mapping[str, Any] | None = None
    out: pathlib.Path = pathlib.Path("runs/stand")
    rrd: bool = True


@dataclass(frozen=True)
class Answer:
    """Tests of one kind, and how far each is from what was measured, where that was asked."""

    trials: tuple[Trial, ...]
    compared: tuple[Comparison, ...]
    files: tuple[pathlib.Path, ...]


def answer(request: Request, report: Callable[..., None] = lambda *_: None) -> list[Answer]:
    """Run every kind that was asked for on every muscle, law and friction; write the files.

    Parameters
    ----------
    request : what was asked for
    report : called with (steps done, steps in all, what)

    Returns
    -------
    one Answer a kind

    Raises
    ------
    InputError
        A name, quantity or range is wrong; what an option allows is said under the option's name.
    SimulationError
        A test became unstable.
    """
    kinds = _kinds(request)
    places = {kind: target(request.out, kind) for kind in kinds}
    if len(kinds) > 1 and request.out.suffix:
        raise InputError("is one table", field="--out", value=str(request.out), allowed="a folder")
    check_writable(places[kinds[0]].folder)
    data = None if request.compare is None else read_measured(request.compare)
    muscles = _muscles(request)
    found = []
    for kind in kinds:
        trials = []
        for number, muscle in enumerate(muscles, 1):
            what = f"{kind} {number} of {len(muscles)}: {muscle.name}, {muscle.law}"
            report(0, 0, what)
            trials.append(_trial(request, kind, muscle, data, functools.partial(_forward, report, what)))
        report(0, 0, f"writing {kind}")
        compared = tuple(compare(trial, data) for trial in trials) if data is not None else ()
        files = write(trials, compared, places[kind], rrd=request.rrd)
        found.append(Answer(tuple(trials), compared, tuple(files)))
    return found


def _forward(report: Callable[..., None], what: str, done: int, total: int) -> None:
    report(done, total, what)


def _kinds(request: Request) -> tuple[str, ...]:
    allowed = (*KINDS, "all")
    if request.kind not in allowed:
        raise InputError(
            "is no test",
            field="stand",
            value=request.kind,
            allowed=", ".join(allowed),
            nearest=nearest_name(request.kind, allowed),
        )
    kinds = CHARACTERISTICS if request.kind == "all" else (request.kind,)
    given = [name for name, texts in (request.values or {}).items() if texts]
    given += ["valve"] if request.valve is not None else []
    for name in given:
        if not any(name in TAKES[kind] for kind in kinds):
            takers = ", ".join(kind for kind, names in TAKES.items() if name in names)
            raise InputError(f"is nothing that {request.kind} takes", field=f"--{name}", allowed=takers)
    return kinds


def _muscles(request: Request) -> list[Muscle]:
    """Every muscle with every law and friction that was named."""
    found = []
    for name in request.muscles:
        for law in request.laws or (None,):
            for friction in request.frictions or (None,):
                chosen = {"law": law, "friction": friction}
                sets = {key: value for key, value in chosen.items() if value is not None}
                found.append(load_description("muscle", name, sets | dict(request.sets or {})))
    return found


def _trial(
    request: Request,
    kind: str,
    muscle: Muscle,
    data: Measured | None,
    progress: Callable[[int, int], None],
) -> Trial:
    try:
        plan = stand.PLANS[kind](
            muscle, laboratory=_laboratory(request), **_arguments(request, kind, muscle, data)
        )
        return stand.static(plan) if request.static else stand.run(plan, progress)
    except InputError as error:
        if error.field in ("pressure", "load", "contraction", "supply", "time"):
            option, value = f"--{error.field}", error.value
            if error.field == "contraction" and (request.values or {}).get("length"):
                option, value = "--length", ", ".join((request.values or {})["length"])
            raise InputError(
                f"{error.problem} ({muscle.name}, {kind})",
                field=option,
                value=value,
                allowed=error.allowed,
                nearest=error.nearest,
            ) from None
        raise


def _laboratory(request: Request) -> Laboratory:
    supply = None if request.supply is None else _quantity("supply", request.supply, "Pa")
    valve = None if request.valve is None else load_description("valve", request.valve)
    return Laboratory(supply=supply, valve=valve)


def _arguments(request: Request, kind: str, muscle: Muscle, data: Measured | None) -> dict[str, Any]:
    """What the plan of a kind takes, from text and from what is compared."""
    values = request.values or {}
    pressures = [_quantity("pressure", text, "Pa") for text in values.get("pressure", ())]
    loads = [_load(text) for text in values.get("load", ())]
    contractions = [_contraction(text) for text in values.get("contraction", ())]
    for text in values.get("length", ()):
        contractions.append(1.0 - _quantity("length", text, "m") / muscle.nominal_length)
    found: dict[str, Any] = {}
    if request.time is not None:
        found["duration"] = _quantity("time", request.time, "s")
    if kind in ("step", "release"):
        found |= {"pressures": pressures or None, "load": _one("load", loads)}
        held = _one("contraction", contractions)
        return found if held is None else found | {"contraction": held}
    told = points_of(kind, data, muscle) if data is not None else {}
    points = {"isobaric": pressures, "isotonic": loads, "isometric": contractions}[kind]
    name = {"isobaric": "pressures", "isotonic": "loads", "isometric": "contractions"}[kind]
    found[name] = points or told.get("points")
    if kind == "isobaric":
        found["span"] = _span("contraction", contractions, 0.0) if request.kind != "all" else None
        if found["span"] is None and "span" in told:
            found["span"] = (told["span"][0], None)
    else:
        found["span"] = _span("pressure", pressures, None if kind == "isotonic" else 0.0)
    return found


def _span(option: str, values: list[float], start: float | None) -> tuple[float | None, float] | None:
    """From and to; one value is the end, of several the least and the greatest."""
    if not values:
        return None
    return (start, values[0]) if len(values) == 1 else (min(values), max(values))


def _one(option: str, values: list[float]) -> float | None:
    if len(values) > 1:
        raise InputError("is given several times", field=f"--{option}", allowed="one for this test")
    return values[0] if values else None


def _quantity(option: str, text: str, unit: str) -> float:
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise InputError(str(error), field=f"--{option}", value=text) from None


def _load(text: str) -> float:
    """Newtons, or kilograms hung on it."""
    try:
        return parse_quantity(text, "N")
    except ValueError as error:
        try:
            return parse_quantity(text, "kg") * GRAVITY
        except ValueError:
            raise InputError(str(error), field="--load", value=text) from None


def _contraction(text: str) -> float:
    if text.strip().endswith("%"):
        return 0.01 * _quantity("contraction", text.strip().removesuffix("%"), "")
    return _quantity("contraction", text, "")


def tables(found: Answer) -> list[tuple[str, list[str], list[list[str]]]]:
    """(title, header, rows) to print: per muscle and law the numbers of every curve."""
    shown = []
    for trial in found.trials:
        printed = PRINTED.get(trial.plan.kind) or _step_columns(trial)
        present = {title: of for title, of in printed.items() if of[0] in trial.metrics[0]}
        header = ["curve", *(f"{title} [{unit}]" for title, (_, _, unit) in present.items())]
        rows = [
            [set_point_text(trial, k), *(f"{f * found[name].value:.4g}" for name, f, _ in present.values())]
            for k, found in enumerate(trial.metrics)
        ]
        shown.append((f"{trial.name}: {trial.plan.kind}", header, rows))
    return shown


def _step_columns(trial: Trial) -> dict[str, tuple[str, float, str]]:
    response = "force" if trial.plan.held else "contraction"
    factor, unit = (1.0, "N") if trial.plan.held else (100.0, "%")
    return {
        "dead time": (f"fill_{response}_dead_time", 1e3, "ms"),
        "pressure, 63 %": ("fill_pressure_time_constant", 1e3, "ms"),
        f"{response} τ": (f"fill_{response}_time_constant", 1e3, "ms"),
        "vented τ": (f"vent_{response}_time_constant", 1e3, "ms"),
        response: (f"filled_{response}", factor, unit),
        "air": ("air_per_fill", 1.0, "g"),
    }


def remarks(found: Answer) -> list[str]:
    """Lines to print below the tables: errors, S0's lines, limits that were left, time, files."""
    lines = []
    for trial in found.trials:
        if trial.plan.kind == "isobaric" and trial.plan.muscle.law in ("reynolds_2003", "serres_2009"):
            lines.append(f"{trial.name}: {static_load(trial).text}")
        if trial.plan.kind == "step":
            moving = max(m["still_moving"].value for m in trial.metrics)
            if moving > 1.0:
                lines.append(f"{trial.name}: still moving ({moving:.2g} %) when vented; take a longer --time")
        lines += [f"warning: {warning}" for warning in trial.warnings]
    for trial, compared in zip(found.trials, found.compared, strict=False):
        factor, unit = (100.0, "%") if trial.plan.kind == "isotonic" else (1.0, "N")
        left = f"; {compared.left_out} points lie on no curve" if compared.left_out else ""
        lines.append(
            f"{trial.name} against {compared.name}: {factor * compared.rms:.3g} {unit} RMS, worst "
            f"{factor * compared.worst:.3g} {unit}, {len(compared.x)} points{left}"
        )
    wall = sum(trial.wall_seconds for trial in found.trials)
    lines.append(f"{wall:.1f} s; written: {', '.join(str(file) for file in found.files)}")
    return lines

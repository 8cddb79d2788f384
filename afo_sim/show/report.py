"""A report of one run or of several side by side: one HTML file that needs nothing outside itself."""

import pathlib
from collections.abc import Callable, Iterator, Sequence

from afo_sim.common.errors import InputError
from afo_sim.common.writing import check_writable, write_text
from afo_sim.description.scenario_text import reference, worn
from afo_sim.metrics.words import in_short
from afo_sim.show import bands, effects, verdict
from afo_sim.show.numbers import doubts, of_walker
from afo_sim.show.report_figures import figures_over_cycle, figures_over_time
from afo_sim.show.report_tables import (
    gait_file,
    gaits_of,
    metric_groups,
    scenario_rows,
    sources,
    stride_tables,
)
from afo_sim.show.report_words import headed
from afo_sim.show.run_view import RunView
from afo_sim.show.style import RUN_STYLES, RUNS
from afo_sim.simulation.recording import read_recording

NAME = "report.html"
SUFFIXES = (".html", ".htm")
TEMPLATE = "report.html.j2"
TIME_POINTS = 2000  # of a curve over time, about


def write_report(
    folders: Sequence[pathlib.Path],
    out: pathlib.Path | None = None,
    *,
    tell: Callable[[str], None] | None = None,
) -> pathlib.Path:
    """Write the report of runs, whole or not at all.

    Parameters
    ----------
    folders : of runs, at most six; the others are compared with the first
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
    if target.suffix.lower() not in SUFFIXES or target.is_dir():
        raise InputError("is no HTML file", field="out", value=str(target), allowed="a name ending in .html")
    runs = read_runs(folders)
    check_writable(target.parent)
    write_text(target, page(runs))
    if tell:
        for remark in remarks(runs):
            tell(remark)
    return target


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
        RunView(label, colour, recording, TIME_POINTS, style)
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
    for name in gaits_of(runs):
        if gait_file(name) is None:
            found.append(
                f"the gait file {name} is not there any more: its source "
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
        told.append([*found, *of_walker(recording.scenario)])
    common = [note for note in told[0] if len(runs) > 1 and all(note in others for others in told)]
    own = [[note for note in notes if note not in common] for notes in told]
    for run, notes in [(None, common), *zip(runs, own, strict=True)]:
        if notes:
            yield run, [headed(note) for note in notes]


def _worn_differently(runs: Sequence[RunView]) -> list[str]:
    """A note where walking runs wear or are compared with different things."""
    found = []
    for words, note in (
        (worn, "the runs wear different things ({}). Part of what differs between them is the sole's doing"),
        (reference, "the runs are compared with different walks ({}). Their lifts do not compare"),
    ):
        told = {run.label: words(run.recording.scenario) for run in runs if run.walks}
        told = {label: what for label, what in told.items() if what}
        if len(set(told.values())) > 1:
            found.append(note.format("; ".join(f"{label}: {what}" for label, what in told.items())))
    return found


def page(runs: Sequence[RunView]) -> str:
    """The whole HTML text of a report; the runs after the first are compared with it."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    title = runs[0].label
    if len(runs) > 1:
        title += f" compared with {', '.join(run.label for run in runs[1:])}"
    walking = [run for run in runs if run.walks and run.strides]
    others = [run for run in runs if run not in walking and len(run.recording["time"]) > 1]
    environment = Environment(
        loader=PackageLoader("afo_sim.show", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(TEMPLATE).render(
        title=title,
        runs=runs,
        verdicts=verdict.of_report(runs),
        effects=effects.of_report(runs),
        bands=bands.of_report(runs),
        in_short=[(run, in_short(run.recording.metrics, reference(run.recording.scenario))) for run in runs],
        notes=list(_notes(runs)),
        remarks=[headed(remark) for remark in remarks(runs)],
        warnings=[(run, headed(warning)) for run in runs for warning in run.recording.warnings],
        scenario=list(scenario_rows(runs)),
        over_cycle=list(figures_over_cycle(walking)) if walking else [],
        over_time=list(figures_over_time(others)) if others else [],
        groups=list(metric_groups(runs)),
        any_strides=any(run.recording.strides for run in runs),
        strides=list(stride_tables(runs)),
        sources=list(sources(runs)),
    )

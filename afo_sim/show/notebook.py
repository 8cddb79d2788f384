"""Results as a notebook shows them: runs with two small figures; sweeps, searches and fits as tables."""

import base64
import pathlib
import tempfile
from collections.abc import Callable, Sequence
from html import escape

from afo_sim.description.scenario_text import reference
from afo_sim.lab.fitting import law_report, run_scenario, torque_report
from afo_sim.lab.fitting.law_result import StaticFit
from afo_sim.lab.fitting.run_fit import FitRun
from afo_sim.lab.fitting.torque_fit import TorqueFit
from afo_sim.metrics.metric import Metric
from afo_sim.metrics.words import in_short, number, unit, words
from afo_sim.show import bands, effects, sweep_tables, verdict
from afo_sim.show.numbers import decisive
from afo_sim.show.run_figure import draw_angle, draw_torque
from afo_sim.simulation.recording import Recording
from afo_sim.study.findings import findings
from afo_sim.study.results import Results
from afo_sim.study.search import words as search_words
from afo_sim.study.search.best import BestDesign
from afo_sim.study.sizing.result import Sizing
from afo_sim.study.words import chosen

WIDTH = 380  # of a figure [px]
RIGHT, LEFT = "text-align: right", "text-align: left"
EDGES = {"good": "#1b7a4b", "doubtful": "#b57900", "bad": "#a52a1a", "unknown": "#777"}  # of an answer
BEST_CASES = 3  # of a sweep, for each metric

Table = tuple[str, list[str], list[list[str]]]  # title, header, rows


def html(result: Recording | Results | BestDesign | StaticFit | FitRun | TorqueFit | Sizing) -> str:
    """A result as one HTML element that needs nothing outside itself."""
    if isinstance(result, Recording):
        return recording_html(result)
    if isinstance(result, Results):
        found = findings(result, chosen(result, []))
        return _element(repr(result), sweep_tables.tables(found, BEST_CASES), found.remarks)
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
        f'<tr><td style="{LEFT}; white-space: nowrap; border-left: 6px solid {EDGES[answer.status]}"><b>'
        f'{escape(verdict.badge(answer))}</b></td><td style="{LEFT}"><b>{escape(answer.question)}</b> '
        f"{escape(answer.text)} <small>Limit: {escape(verdict.limit(recording, answer))}.</small></td></tr>"
        for answer in recording.verdict
    )
    return f"<table>{rows}</table>"


def _element(head: str, tables: Sequence[Table], lines: Sequence[str]) -> str:
    """Tables with their titles, the remarks below."""
    parts = [f"<b>{escape(head.strip('<>'))}</b>"]
    for title, header, rows in tables:
        cells = "".join(f'<th style="{LEFT}">{escape(name)}</th>' for name in header)
        lines_of = ("".join(f'<td style="{LEFT}">{escape(cell)}</td>' for cell in row) for row in rows)
        body = "".join(f"<tr>{line}</tr>" for line in lines_of)
        parts.append(f"<table><caption>{escape(title)}</caption><tr>{cells}</tr>{body}</table>")
    parts += [f"<div>{escape(line)}</div>" for line in lines]
    return f"<div>{''.join(parts)}</div>"


def _picture(draw: Callable[[Recording, pathlib.Path], None], recording: Recording) -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "figure.png"
        draw(recording, path)
        data = base64.b64encode(path.read_bytes()).decode()
    return f'<img width="{WIDTH}" style="background: white" src="data:image/png;base64,{data}">'


def _numbers(metrics: dict[str, Metric], *, unfolded: bool) -> str:
    """A table of all numbers; of a walk, which opens with its verdict, folded."""
    rows = "".join(
        f'<tr title="{escape(words(name).meaning)}"><td style="text-align: left">{escape(words(name).label)}'
        f'</td><td style="{RIGHT}">{number(metric.value, metric.unit)}</td><td>{escape(unit(metric))}</td>'
        f'<td style="text-align: left"><code>{escape(name)}</code></td></tr>'
        for name, metric in metrics.items()
    )
    begin = "<details open>" if unfolded else "<details>"
    return f"{begin}<summary>{len(metrics)} numbers</summary><table>{rows}</table></details>"

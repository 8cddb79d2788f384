"""Results as a notebook shows them: runs with two small figures; sweeps, searches and fits as tables."""

import base64
import pathlib
import tempfile
from collections.abc import Callable, Sequence
from html import escape
from typing import Any

from afo_sim.description.scenario_text import reference
from afo_sim.metrics import Metric, in_short, number, unit, words
from afo_sim.show import bands, effects
from afo_sim.show import verdict_texts as verdict
from afo_sim.show.numbers import decisive
from afo_sim.show.run_figure import draw_angle, draw_torque
from afo_sim.simulation import Recording

_WIDTH = 380  # of a figure [px]
_RIGHT, _LEFT = "text-align: right", "text-align: left"
_EDGES = {"good": "#1b7a4b", "doubtful": "#b57900", "bad": "#a52a1a", "unknown": "#777"}  # of an answer
_BEST_CASES = 3  # of a sweep, for each metric

_Table = tuple[str, list[str], list[list[str]]]  # title, header, rows


def html(result: Any) -> str:
    """A run, a study's or a fit's result as one HTML element that needs nothing outside itself."""
    if isinstance(result, Recording):
        return recording_html(result)
    of_study = type(result).__module__.startswith("afo_sim.study.")
    return _element(repr(result), *(_study_tables(result) if of_study else _fit_tables(result)))


def _study_tables(result: Any) -> tuple[Sequence[_Table], Sequence[str]]:
    """Tables and remarks of a sweep, a search or a sizing."""
    from afo_sim.show import sweep_tables
    from afo_sim.study import BestDesign, Results, chosen
    from afo_sim.study.findings import findings
    from afo_sim.study.search import best as search_words

    if isinstance(result, Results):
        found = findings(result, chosen(result, []))
        return sweep_tables.tables(found, _BEST_CASES), found.remarks
    if isinstance(result, BestDesign):
        return search_words.tables(result.summary), search_words.statement(result.summary)
    return [result.table], result.remarks


def _fit_tables(result: Any) -> tuple[Sequence[_Table], Sequence[str]]:
    """Tables and remarks of a fit to points, torques or a log."""
    from afo_sim.lab import StaticFit, TorqueFit, law_result, run_report, torque_report

    if isinstance(result, StaticFit):
        return law_result.tables(result), law_result.remarks(result)
    if isinstance(result, TorqueFit):
        return torque_report.tables(result), torque_report.remarks(result)
    return run_report.tables(result), run_report.remarks(result)


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

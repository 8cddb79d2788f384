"""A recording as a notebook shows it: status, warnings, numbers, two small figures."""

import base64
import pathlib
import tempfile
from collections.abc import Callable
from html import escape

from afo_sim.metrics.metric import Metric
from afo_sim.metrics.words import in_short, number, unit, words
from afo_sim.show.run_figure import draw_angle, draw_torque
from afo_sim.simulation.recording import Recording

FEW = 12  # numbers that stand there unfolded
WIDTH = 380  # of a figure [px]
RIGHT = "text-align: right"


def html(recording: Recording) -> str:
    """The recording as one HTML element that needs nothing outside itself.

    Parameters
    ----------
    recording : a run; of one without rows there are no figures
    """
    rows = len(recording["time"]) if "time" in recording.columns else 0
    parts = [f"<b>{escape(str(recording.scenario['name']))}</b>: {escape(recording.status)}, {rows} rows"]
    parts += [f"<div>⚠ {escape(warning)}</div>" for warning in recording.warnings]
    parts += [f"<div>{escape(sentence)}</div>" for sentence in in_short(recording.metrics)]
    if rows > 1:
        parts += [_picture(draw, recording) for draw in (draw_angle, draw_torque)]
    if recording.metrics:
        parts.append(_numbers(recording.metrics))
    return f"<div>{''.join(parts)}</div>"


def _picture(draw: Callable[[Recording, pathlib.Path], None], recording: Recording) -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "figure.png"
        draw(recording, path)
        data = base64.b64encode(path.read_bytes()).decode()
    return f'<img width="{WIDTH}" style="background: white" src="data:image/png;base64,{data}">'


def _numbers(metrics: dict[str, Metric]) -> str:
    rows = "".join(
        f'<tr title="{escape(words(name).meaning)}"><td style="text-align: left">{escape(words(name).label)}'
        f'</td><td style="{RIGHT}">{number(metric.value, metric.unit)}</td><td>{escape(unit(metric))}</td>'
        f'<td style="text-align: left"><code>{escape(name)}</code></td></tr>'
        for name, metric in metrics.items()
    )
    unfolded = " open" if len(metrics) <= FEW else ""
    return f"<details{unfolded}><summary>{len(metrics)} numbers</summary><table>{rows}</table></details>"

"""A run on the terminal: of walking the verdict and what may change it, of others every number."""

import os
import re
import shutil
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from afo_sim.cli.common import print_table
from afo_sim.common import installed

_QUANTITY = re.compile(r"(?<=\d) (?=[^\W\d]{1,3}\b)")  # between a number and its unit
_STYLES = {"✓": "bold green", "!": "bold yellow", "✗": "bold red", "?": "bold"}
_FEW = 2  # changes that are listed on a screen
_SPELLED = str.maketrans(  # for a terminal that does not know them
    {"✓": "+", "✗": "x", "−": "-", "–": "-", "·": "*", "°": " deg", "≥": ">=", "≤": "<=", "×": "x", "²": "^2"}
)


def print_run(recording: Any, folder: Path, *, numbers: bool = False) -> None:
    """Print a run."""
    has_verdict = bool(recording.verdict)
    if has_verdict:
        _print_verdict(recording)
    if numbers or not has_verdict:
        _print_numbers(recording)
    _print_warnings(recording, has_verdict)
    if numbers or not has_verdict:
        timing = recording.timing
        print_line(
            f"{timing['steps']} steps in {timing['wall_seconds']:.2f} s "
            f"({timing['steps_per_second'] / 1000:.0f} thousand a second)"
        )
    more = "" if numbers or not has_verdict else "; every number: --numbers"
    look = f"; look at it with: afo-sim view {folder}" if installed("rerun") else ""
    print_line(f"written to {folder}{look}{more}")


def _print_verdict(recording: Any) -> None:
    """The answers, what to change first, and bands."""
    from afo_sim.show import bands, effects
    from afo_sim.show import verdict_texts as verdict

    name, what = recording.scenario["name"], recording.scenario.get("description") or ""
    title = f"{name}: {what}" if what else name
    print_line(
        title if _width() is None else textwrap.shorten(title, _width() or 80, placeholder=" …"), style="bold"
    )
    for line in verdict.lines(recording):
        print_line(line, hang=verdict.INDENT, badge=verdict.INDENT)
    for line in (*_first(effects.lines(recording)), *bands.lines(recording)):
        print_line(line, hang=len(line) - len(line.lstrip()) + 2)


def _first(lines: list[str]) -> list[str]:
    """The title of a list and its first lines, for one screen; the report has all."""
    return lines if _width() is None else lines[: 1 + _FEW]


def _print_numbers(recording: Any) -> None:
    """The table of metrics, and those that say nothing."""
    from afo_sim.show import printed, undefined
    from afo_sim.simulation import found_step_errors

    metrics, errors = recording.metrics, found_step_errors(recording)
    left_out = {name: why for name, m in metrics.items() if (why := undefined(name, m)) is not None}
    found = {name: printed(name, metric) for name, metric in metrics.items() if name not in left_out}
    rows = [[name, value, metrics[name].unit] for name, value in found.items()]
    header = ["metric", "value", "unit"]
    if errors:
        header.insert(2, "step error")  # numerical alone: not how far the model is off
        for row in rows:
            row.insert(2, f"{errors[row[0]]:+.2g}" if row[0] in errors else "–")
    print_table(recording.scenario["name"], header, rows)
    for why in dict.fromkeys(left_out.values()):
        print_line(f"left out, {why}: {', '.join(name for name in left_out if left_out[name] == why)}")


def _print_warnings(recording: Any, has_verdict: bool) -> None:
    """Warnings, and notes of what is not to be believed."""
    from afo_sim.show import cautions, decisive, of_walker

    for warning in recording.warnings:
        if has_verdict and getattr(warning, "code", "") == "skin-pressure":
            continue  # the answer about the skin says it
        print_line(f"warning: {warning}", hang=9)
    of_run = recording.scenario, recording.metrics, recording.strides
    notes = decisive(*of_run) if has_verdict else [*cautions(*of_run), *of_walker(recording.scenario)]
    for note in notes:
        print_line(f"note: {note}", hang=6)


def print_line(text: str, *, hang: int = 0, badge: int = 0, style: str = "") -> None:
    """A text in the terminal's width, further lines indented; whole where a file or program reads it."""
    from rich.console import Console
    from rich.text import Text

    shown = Text("\n".join(_wrapped(text, hang)), style=style)
    if badge:
        shown.stylize(_STYLES.get(text[0], ""), 0, badge)
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    try:
        shown.plain.encode(encoding)
    except UnicodeEncodeError:
        spelled = shown.plain.replace(" °", "°").translate(_SPELLED)
        plain = spelled.encode(encoding, "replace").decode(encoding)
        print(plain)
        return
    if sys.stdout.isatty():
        Console(highlight=False).print(shown, soft_wrap=True)
    else:
        print(shown.plain)


def _wrapped(text: str, hang: int) -> Iterator[str]:
    width = _width()
    if width is None or len(text) <= width:
        yield text
        return
    kept = _QUANTITY.sub("\N{NO-BREAK SPACE}", text)
    for line in textwrap.wrap(
        kept,
        max(width, hang + 20),
        subsequent_indent=" " * hang,
        break_long_words=False,
        break_on_hyphens=False,
    ):
        yield line.replace("\N{NO-BREAK SPACE}", " ")


def _width() -> int | None:
    """Columns of the terminal; None where there is none, and COLUMNS does not say how many."""
    if sys.stdout.isatty() or os.environ.get("COLUMNS"):
        return shutil.get_terminal_size().columns
    return None

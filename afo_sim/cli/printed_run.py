"""A run on the terminal: a screen of what decides, or every number."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from afo_sim.cli.common import print_line, print_table, wrapped
from afo_sim.common import Mixed, installed

if TYPE_CHECKING:
    from afo_sim.metrics import Answer
    from afo_sim.simulation import Both, Recording

_LINES = 23  # that a run prints unasked: they fit a terminal of 24 rows
_WARNING = "warning: "
_Line = tuple[str, int]  # a text, and by how much its further lines are indented
_Lines = Sequence[_Line]
_Judged = Sequence[tuple["Recording", "Answer"]]


def print_run(recording: "Recording", folder: Path, *, numbers: bool = False) -> None:
    """Print a run: a screen of what decides, or with `numbers` everything."""
    from afo_sim.simulation import answers_of

    answers = answers_of(recording)
    look = f"; to view: afo-sim view {folder}" if installed("rerun") else ""
    written = f"written to {folder}{look}"
    if numbers:
        _print_all(recording)
        print_line(written)
    else:
        _print_in_short(recording, answers, written)


def _print_in_short(recording: "Recording", answers: Sequence["Answer"], written: str) -> None:
    """The answers, then as many warnings, changes and notes as fit on a screen."""
    from afo_sim.metrics import decides
    from afo_sim.show import bands, effects, in_brief, known
    from afo_sim.simulation import STEP_STUDY, step_line

    notes = [(f"note: {in_brief(note_lines(recording))}", 6)] if note_lines(recording) else []
    step = effects.first_step(recording)
    warned = warning_lines(recording, bool(answers))
    decisive = warning_lines(recording, bool(answers), only=decides)  # printed however many lines it takes
    folded = [line for line in warned if line not in decisive]
    remarks = [*folded, *notes, *([(step, 2)] if step else [])]
    taken = recording.studies.get(STEP_STUDY, {})
    remarks += [(step_line(recording), 2)] if taken.get("step") != taken.get("asked") else []
    if not answers:
        remarks += [(f"{name} {value}", 2) for name, value in known(recording.metrics)]
    title = _title(recording)
    print_line(title, style="bold")
    drawn = [(line, 2) for line in bands.brief(recording)]
    print_answers(
        [(recording, answer) for answer in answers], remarks, [(written, 2)], first=[*decisive, *drawn],
        above=_rows([(title, 2)]),
    )  # fmt: skip


def print_answers(
    judged: _Judged, remarks: _Lines, tail: _Lines, *, first: _Lines = (), whole: bool = False, above: int = 1
) -> None:
    """Answers with their runs, closing lines, and as many remarks as fit on a screen."""
    from afo_sim.metrics import closing
    from afo_sim.show import verdict_texts as verdict

    shown = verdict.full(judged) if whole else verdict.brief(judged)
    answered = [(line, verdict.INDENT) for line in shown]
    names = {name for recording, _ in judged for name in recording.metrics}
    ends = [*((line, 0) for line in closing([answer for _, answer in judged], names) if judged), *tail]
    for line, hang in answered:
        print_line(line, hang=hang, badge=hang)
    room = _LINES - above - _rows([*answered, *first, *ends])
    for line, hang in (*first, *(remarks if whole else _fitting(remarks, room)), *ends):
        print_line(line, hang=hang)


def _rows(lines: _Lines) -> int:
    return sum(len(list(wrapped(line, hang))) for line, hang in lines)


def _fitting(remarks: _Lines, room: int) -> list[_Line]:
    """The first remarks that fit; the last line says how many are left out."""
    kept: list[_Line] = []
    for line in remarks:
        room -= _rows([line])
        if room < 1:
            break
        kept.append(line)
    left = remarks[len(kept) :]
    warnings = sum(line.startswith(_WARNING) for line, _ in left)
    more = f"{len(left)} more line{'s' if len(left) > 1 else ''}" if left else ""
    more += f" ({warnings} of warnings) and " if warnings else " and " if left else ""
    return [*kept, (f"… {more}all numbers: add --numbers", 2)]


def _title(recording: "Recording") -> str:
    name, what = recording.described["name"], recording.described.get("description") or ""
    return f"{name}: {what}" if what else name


def _print_all(recording: "Recording") -> None:
    """The full answers, what to change first, bands, every number, warnings and notes."""
    from afo_sim.show import bands, effects
    from afo_sim.show import verdict_texts as verdict

    print_line(_title(recording), style="bold")
    for line in verdict.lines(recording):
        print_line(line, hang=verdict.INDENT, badge=verdict.INDENT)
    for line in (*effects.lines(recording), *bands.lines(recording)):
        print_line(line)
    _print_numbers(recording)
    for line, hang in warning_lines(recording, bool(recording.verdict)):
        print_line(line, hang=hang)
    for note in note_lines(recording):
        print_line(f"note: {note}", hang=6)
    timing = recording.timing
    steps, speed = timing["steps"], timing["steps_per_second"] / 1000
    print_line(f"{steps} steps in {timing['wall_seconds']:.2f} s ({speed:.0f} thousand per second)")


def _print_numbers(recording: "Recording") -> None:
    """The table of metrics, and which have no value."""
    from afo_sim.show import printed, undefined
    from afo_sim.simulation import found_step_errors, step_line

    metrics, errors = recording.metrics, found_step_errors(recording)
    left_out = {name: why for name, m in metrics.items() if (why := undefined(name, m)) is not None}
    found = {name: printed(name, metric) for name, metric in metrics.items() if name not in left_out}
    rows = [[name, value, metrics[name].unit] for name, value in found.items()]
    header = ["metric", "value", "unit"]
    if errors:
        header[2:2] = ["step error", "allowed"]  # numerical alone: not how far the model is off
        for row in rows:
            error = errors.get(row[0])
            row[2:2] = ["–", "–"] if error is None else [f"{error.error:+.2g}", f"{error.bound:.2g}"]
    print_table(recording.described["name"], header, rows)
    print_line(step_line(recording))
    for why in dict.fromkeys(left_out.values()):
        print_line(
            f"without a value ({why}): {', '.join(name for name in left_out if left_out[name] == why)}"
        )


def warning_lines(
    recording: "Recording | Both", has_answers: bool, only: Callable[[str], bool] = bool
) -> list[_Line]:
    """Each warning once; of several of one kind the first, and what else it concerns."""
    kinds: dict[str, list[Mixed]] = {}
    for warning in filter(only, dict.fromkeys(recording.warnings)):
        code = getattr(warning, "code", "")
        if not (has_answers and code == "skin-pressure"):  # the answer about the skin says it
            kinds.setdefault(code or str(warning), []).append(warning)
    found = []
    for first, *others in kinds.values():
        subjects = dict.fromkeys(str(each.subject) for each in others if each.subject != first.subject)
        also = f" (and {len(others)} more of this kind)" if others else ""
        also = f" (also: {', '.join(subjects)})" if subjects else also
        found.append((f"{_WARNING}{first}{also}", 9))
    return found


def note_lines(recording: "Recording") -> list[Mixed]:
    """Reasons to doubt the numbers."""
    from afo_sim.show import cautions, decisive, of_walker

    of_run = recording.described, recording.metrics, recording.strides
    walks = bool(recording.verdict)
    return decisive(*of_run) if walks else [*cautions(*of_run), *of_walker(recording.described)]

"""The verdict of a walk as it is shown: a mark, a word and a colour of one meaning for each answer."""

from collections.abc import Sequence

from afo_sim.common import JsonDict
from afo_sim.metrics import ADDS, AIR, HEEL, HELP, LIFT, PUSH_OFF, QUESTIONS, SKIN, Answer, closing
from afo_sim.show.run_names import begun
from afo_sim.show.run_view import RunView
from afo_sim.simulation import Recording, Worse, limits_of

MARKS = {"good": "✓", "doubtful": "!", "bad": "✗", "unknown": "?"}  # of a text font: one cell wide
INDENT = 12  # columns of a terminal before an answer
Judged = tuple[Recording, Answer]  # a run, which has the limits, and one of its answers
_LIMITS_OF = {  # {answer: the limits that it is compared with}
    HELP: ("toe_clearance",),
    LIFT: ("toe_clearance",),
    HEEL: ("contact_pitch",),
    PUSH_OFF: ("torque_against_push_off", "work_against_push_off"),
    AIR: ("strides_per_bottle", "bottle_volume", "bottle_pressure"),
    ADDS: ("toe_clearance",),
    SKIN: ("skin_pressure", "blood_flow_pressure"),
}
_NOT_COMPARED = "Not compared with a walk without the device."  # beside runs that are


def badge(answer: Answer | Worse) -> str:
    """The status as mark and word."""
    return f"{MARKS[answer.status]} {answer.word}"


def lines(recording: Recording) -> list[str]:
    """For the terminal, each after its badge of `INDENT` columns; none where there is nothing to report."""
    found = full([(recording, answer) for answer in recording.verdict])
    ends = [" " * INDENT + line for line in closing(recording.verdict, recording.metrics)]
    return [*found, *ends] if found else []


def full(judged: Sequence[Judged]) -> list[str]:
    """Whole answers for a terminal, each after its badge, with its limit in brackets."""
    return [
        f"{badge(answer):<{INDENT}}{answer.question} {answer.text} ({limit(recording, answer)})"
        for recording, answer in judged
    ]


def lead(recording: Recording, among: int = 1) -> str:
    """The first answer, and which of the others are not good."""
    first, *others = recording.verdict
    found, statuses = [first.text], ["bad", "doubtful", "unknown"]
    if among == 2 and first.brief:
        found = [f"{first.word}: {first.brief}."]
    elif among > 1:
        found, others, statuses = [], list(recording.verdict), [*statuses, "good"]
    for status in statuses:
        answers = [answer for answer in others if answer.status == status]
        if names := [_shown(answer) for answer in answers if status != "good" or answer.brief]:
            found.append(f"{status.upper()}: {', '.join(names)}.")
    return " ".join(found)


def _shown(answer: Answer) -> str:
    return answer.name.replace("_", "-")


def brief(judged: Sequence[Judged]) -> list[str]:
    """For a terminal: a line each, with the kind of its limit."""
    width = max((len(_shown(answer)) for _, answer in judged), default=0) + 2
    found = []
    for recording, answer in judged:
        kinds = f" [{_kinds(recording, answer)}]" if answer.brief and answer.name in _LIMITS_OF else ""
        text = f"{answer.brief or answer.text}{kinds}"
        found.append(f"{badge(answer):<{INDENT}}{_shown(answer):<{width}}{text}")
    return found


def markdown(recording: Recording) -> str:
    """For the viewer, as a list; "" where there is nothing to report."""
    items = [
        f"- **{answer.word}** · **{answer.question}** {answer.text} *Limit: {limit(recording, answer)}.*"
        for answer in recording.verdict
    ]
    ends = (line.replace("*", r"\*") for line in closing(recording.verdict, recording.metrics))
    return "\n".join([*items, "", f"*{' '.join(ends)}*"] if items else [])


def of_report(runs: Sequence[RunView]) -> list[JsonDict]:
    """What the report's part report_verdict.html.j2 draws; empty where there is nothing to report."""
    judged = [(run, answers) for run in runs if (answers := run.recording.verdict)]
    rows = []
    for name in QUESTIONS:
        named = [(run, {a.name: a for a in answers}.get(name)) for run, answers in judged]
        if not any(answer for _, answer in named):
            continue
        cells: list[JsonDict] = []
        for run, found in named:
            answer = found or Answer(name, QUESTIONS[name], "unknown", _NOT_COMPARED, "")
            kinds = f" [{_kinds(run.recording, answer)}]" if answer.brief and answer.limit else ""
            stated = limit(run.recording, answer) if answer.limit else ""
            short = begun(answer.brief or answer.text) + kinds
            cell = {"run": run, "answer": answer, "badge": badge(answer), "brief": short, "limit": stated}
            cells.append(cell)
        limits = {cell["limit"] for cell in cells if cell["answer"].limit}
        same = limits.pop() if len(limits) == 1 else ""  # where the runs have one limit
        rows.append({"question": QUESTIONS[name], "limit": same, "cells": cells})
    return rows


def limit(recording: Recording, answer: Answer) -> str:
    """An answer's limit and its kind: published, derived or assumed."""
    return f"{answer.limit}; {_kinds(recording, answer)}"


def _kinds(recording: Recording, answer: Answer) -> str:
    sources = limits_of(recording).provenance
    named = _LIMITS_OF[answer.name]
    return ", ".join(dict.fromkeys(sources[name].kind if name in sources else "user" for name in named))

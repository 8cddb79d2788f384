"""Results as a notebook shows them: on one short page the answer, a picture, tables and remarks."""

import pathlib
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from html import escape
from typing import Any

from afo_sim import lab, show, study
from afo_sim.common import ROOM, Foreign, Function, InputError, Json, JsonDict, missing_extra
from afo_sim.description import amount, facts
from afo_sim.description.scenario_text import reference
from afo_sim.metrics import closing, in_short
from afo_sim.show import bands, drawing, effects
from afo_sim.show import verdict_texts as verdict
from afo_sim.show.in_words import image
from afo_sim.show.numbers import decisive, known
from afo_sim.show.run_figure import draw_in_short
from afo_sim.simulation import answers_of

_EDGES = {"GOOD": "#1b7a4b", "DOUBTFUL": "#b57900", "BAD": "#a52a1a", "UNKNOWN": "#777"}  # of an answer
_STYLE = "<style>.afo td,.afo th,.afo caption{text-align:left}</style>"
_BEST_CASES = 3  # of a sweep, for each metric
_NUMBERS = 24  # of a run that does not walk

_Table = tuple[str, Sequence[str], Iterable[Sequence[str]]]  # title, header, rows
_Draw = Callable[[pathlib.Path], object]  # writes a PNG at a path, or beside it
_Result = Any  # of the class by whose name _PAGES has it: importing that class takes long
_Parts = Iterable[str | _Table | _Draw]  # of a page: lines, tables, pictures


def html(result: object) -> str | None:
    """A result as one self-contained HTML element; None if its text suffices."""
    parts = next((_PAGES[kind.__name__] for kind in type(result).__mro__ if kind.__name__ in _PAGES), None)
    if parts is None:
        return None
    head = f"<b>{escape(repr(result).strip('<>'))}</b>"
    found, left, room = [_STYLE, head], 0, ROOM - 2 * len(head.encode())
    for text in (text for part in parts(result) for text in _texts(part)):
        size = 0 if text.startswith(("<img", "</")) else len(text.encode())
        kept = size <= room
        found, left, room = [*found, text] if kept else found, left + (not kept), room - kept * size
    more = f"<div>… and {left} more lines than have room here</div>" if left else ""
    return f'<div class="afo">{"".join(found)}{more}</div>'


def _texts(part: str | _Table | _Draw) -> Iterator[str]:
    """The pieces of a part, each of which may be left out."""
    if callable(part):
        yield _picture(part)
    elif isinstance(part, str):
        yield f"<div>{escape(part)}</div>"
    else:
        title, header, rows = part
        head = "".join(f"<th>{escape(name)}</th>" for name in header)
        yield f"<table><caption>{escape(title)}</caption><tr>{head}</tr>"
        for row in rows:
            shown = ""
            for cell in row:
                colour = _EDGES.get(cell.rpartition(" ")[2])  # of an answer's badge
                edge = f' style="border-left:6px solid {colour};white-space:nowrap"' if colour else ""
                shown += f"<td{edge}>{escape(cell)}</td>"
            yield f"<tr>{shown}</tr>"
        yield "</table>"


def _picture(draw: _Draw) -> str:
    """A picture half as wide as it has pixels; where there is none, why."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            draw(pathlib.Path(folder) / "figure.png")
        except (InputError, ModuleNotFoundError) as error:
            return f"<div>no picture: {escape(str(missing_extra(error) or error))}</div>"
        file = next(pathlib.Path(folder).glob("*.png"))
        width = int.from_bytes(file.read_bytes()[16:20]) // 2  # of a PNG's header
        return image(file, f"display:block;background:white;width:{width}px")


def _recording(run: _Result) -> _Parts:
    """Verdict, figure, bands, warnings, changes and notes; of a run that does not walk its first numbers."""
    if run.verdict:
        said = ((each, f"{each.question} {each.text}") for each in run.verdict)
        yield "", (), ((verdict.badge(a), f"{text} Limit: {verdict.limit(run, a)}.") for a, text in said)
    elif run.ok:
        yield from verdict.brief([(run, a) for a in answers_of(run)])
    yield from closing(answers_of(run), run.metrics)
    yield partial(draw_in_short, run)
    yield from (*bands.lines(run), *_marked(run.warnings), *effects.lines(run))
    if run.verdict:
        yield from decisive(run.described, run.metrics, run.strides)
    yield from in_short(run.metrics, reference(run.described))
    if not run.verdict:
        yield _numbers(run.metrics)


def _marked(warnings: Iterable[str]) -> Iterator[str]:
    return (f"⚠ {warning}" for warning in warnings)


def _numbers(metrics: _Result) -> _Table:
    found = known(metrics)[:_NUMBERS]
    return f"{len(found)} of {len(metrics)} numbers", (), found


def _both(legs: _Result) -> _Parts:
    worse = ((each, each.answers.get(each.leg) or [*each.answers.values()][-1]) for each in legs.verdict)
    yield "", (), ((verdict.badge(w), w.leg, f"{w.question} {answer.text}") for w, answer in worse)
    if legs.ok:
        yield partial(show.draw_both, legs)
    yield from _marked(legs.warnings)
    yield _numbers(legs.numbers)
    yield from legs.notes


def _sweep(results: _Result) -> _Parts:
    from afo_sim.study.findings import findings

    found = findings(results, study.chosen(results, []))
    for name, size, fill in show.drawings(found):
        if name == "main_effects":
            yield partial(show.write_figure, size=size, fill=fill)
    yield from found.remarks
    yield from show.tables(found, _BEST_CASES)


def _fit(found: _Result) -> _Parts:
    """Of points, torques or a log."""
    from afo_sim.lab import law_result, run_report, torque_report

    made: dict[str, tuple[Foreign, Function]] = {
        "StaticFit": (law_result, show.write_fit_figure),
        "TorqueFit": (torque_report, show.write_torque_figure),
        "FitRun": (run_report, show.write_log_figure),
    }
    words, draw = made[type(found).__name__]
    yield lambda path: draw(found, path.parent)
    yield from words.tables(found)
    yield from words.remarks(found)


def _stand(tests: _Result) -> _Parts:
    for own in map(tests.of, tests.kinds):
        yield partial(show.draw_trials, own.trials, own.compared)
    for trial in tests.trials:
        yield from _marked(trial.warnings)
        yield lab.printed(trial)


def _described(what: _Result) -> _Parts:
    """A description: a muscle's force, an orthosis' drawing, and the keys that are not as by default."""
    kind = type(what).__name__
    if kind == "Muscle":
        from afo_sim.lab.stand import stand

        yield partial(show.draw_trials, stand("isobaric", what, static=True).trials, ())
    elif kind == "Orthosis":
        yield partial(drawing.draw, what)
    own = what.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    yield "", (), facts(what.resolved()) if kind == "Scenario" else _keys(own)


def _keys(table: JsonDict, path: str = "") -> Iterator[tuple[str, str, str]]:
    """Dotted key, value in the unit of people, kind of source; a product within another is its name."""
    for key, value in table.items():
        name, source = f"{path}{key}", table.get("provenance", {}).get(key, {}).get("kind", "")
        if key in ("provenance", "description", *([] if path else ["name"])):
            continue
        if not isinstance(value, dict):
            yield name, _usual(value), source
        elif value.get("name") or key in ("laws", "frictions"):
            yield name, value.get("name") or ", ".join(value), source
        else:
            yield from _keys(value, f"{name}.")


def _usual(value: Json) -> str:
    """A value as a file may write it, an SI number in the unit that people use."""
    if isinstance(value, list):
        return f"[{', '.join(map(_usual, value))}]"
    number, _, unit = str(value).partition(" ")
    try:
        return amount(float(number), unit, 4)
    except (ValueError, TypeError):
        return str(value)


_PAGES: dict[str, Callable[[_Result], _Parts]] = {
    "Recording": _recording,
    "Both": _both,
    "Results": _sweep,
    "BestDesign": lambda it: (*study.statement(it.summary), *study.tables(it.summary)),
    "Sizing": lambda it: (partial(show.draw_size, it), it.table, *it.remarks),
    "Effects": lambda it: (effects.table(it),),
    "StaticFit": _fit,
    "TorqueFit": _fit,
    "FitRun": _fit,
    "Stand": _stand,
    "Trial": lambda it: _stand(lab.Stand((it,))),
    "Design": lambda it: (partial(show.write_drawing, it), *_marked(it.warnings), ("", *drawing.table(it))),
    "TorqueMaps": lambda it: (lambda path: show.draw(it, path.with_suffix("")), *_marked(it.warnings)),
    "AirScheme": lambda it: (partial(show.write_air, it), *show.ways(it)),
    "Imported": lambda it: (partial(show.draw_leg, it.leg, it.name), *it.notes, ("", (), it.rows)),
    "Exported": lambda it: (*it.notes, ("", (), it.rows)),
    "Validation": lambda it: lab.summary(it).splitlines(),
    "Paper": lambda it: lab.markdown(it).splitlines(),
    "Described": _described,
}  # by the name of the class: showing one imports no other

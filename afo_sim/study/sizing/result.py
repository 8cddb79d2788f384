"""The answer to "which is the smallest that meets this": every candidate, and the best."""

import csv
import io
import math
import os
import pathlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from afo_sim.common import Notice, Shown
from afo_sim.metrics import UNITS, words
from afo_sim.study.folder import write_answer
from afo_sim.study.sizing.requirement import Requirement, Tried, as_number, closeness
from afo_sim.study.sizing.trial import Trials, sentence_of

if TYPE_CHECKING:
    import pandas


Table = tuple[str, list[str], list[list[str]]]  # title, header, rows
Draw = Callable[["Sizing", pathlib.Path], None]


def _table_of(
    kind: str, requirements: Sequence[Requirement], air: str, tried: Sequence[Tried], best: Tried | None
) -> Table:
    """The margin of each candidate that was run to each limit, its air, and which limits it fails."""
    ran = [each for each in tried if each.status == "run"]
    facts = list(dict.fromkeys(name for each in ran for name in each.candidate.facts))
    limits = [_joined(f"{k}", UNITS.get(r.unit, r.unit)) for k, r in enumerate(requirements, 1)]
    header = [kind, *facts, *limits, f"air [{words(air).unit}]", "meets all"]
    rows = []
    for each in ran:
        cells = [_cell(each.candidate.facts.get(name, "")) for name in facts]
        cells += [_margin(each, requirement) for requirement in requirements]
        value = each.values.get(air, math.nan)
        cells.append("–" if math.isnan(value) else f"{value:.3f}")
        mark = "▶" if best is not None and each.name == best.name else " "
        rows.append([f"{mark} {each.name}", *cells, _verdict(each, requirements)])
    return f"{kind}: margins to the limits", header, rows


def _cell(fact: str) -> str:
    """A fact; * stands for its doubt."""
    return f"{fact.data['value']} *" if isinstance(fact, Notice) else fact


def _legend(requirements: Sequence[Requirement]) -> list[str]:
    """What each number stands for."""
    return [f"{k}: {each.label} {each.wanted}" for k, each in enumerate(requirements, 1)]


def _remarks_of(tried: Sequence[Tried]) -> Iterator[str]:
    """What was not run, and notes on what was; those that are alike in one line."""
    grouped: dict[str, list[str]] = {}
    for each in tried:
        if each.status != "run":
            grouped.setdefault(f"not run, {each.status}: {each.reason}", []).append(each.name)
        for note in each.notes:
            grouped.setdefault(note, []).append(each.name)
    for text, names in grouped.items():
        yield f"{', '.join(names)}: {text}"


def _margin(each: Tried, requirement: Requirement) -> str:
    margin = each.margin(requirement)
    if not math.isfinite(margin):
        return "–" if math.isnan(margin) else "endless"
    if requirement.unit == "h":
        return f"{margin:+.2f}".replace("-", "−")
    return as_number(margin, requirement.unit)


def _joined(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _verdict(each: Tried, requirements: Sequence[Requirement]) -> str:
    if each.meets:
        return "yes"
    labels = {requirement.label: f"{k}" for k, requirement in enumerate(requirements, 1)}
    return f"no: {', '.join(labels.get(name, name) for name in each.short)}"


def nearest_miss(tried: Sequence[Tried], requirements: Sequence[Requirement], nothing: str) -> str:
    """A sentence for where nothing meets what is wanted: the one that comes closest, and how close."""
    ran = [each for each in tried if each.status == "run"]
    if not ran:
        return f"{nothing} could be run: {tried[0].reason}" if tried else f"{nothing} is there to try"
    labels = {each.label for each in requirements}
    closest = min(ran, key=lambda each: (bool(each.short.keys() - labels), closeness(each, requirements)))
    how = sentence_of(requirements, closest.values)
    how += "".join(f", but {how}" for name, how in closest.short.items() if name not in labels)
    return f"{nothing} that was tried meets all limits; closest comes {closest.name}: {how}"


def best_of(tried: Sequence[Tried]) -> Tried | None:
    """The smallest that meets all limits: of those without a doubt if there are any; None where none does."""
    meeting = [each for each in tried if each.meets]
    return next((each for each in meeting if not each.candidate.doubt), meeting[0] if meeting else None)


def smallest(tried: Sequence[Tried], requirements: Sequence[Requirement], what: str, kind: str) -> str:
    """The sentence that names the smallest candidate that meets all limits and why the next fails."""
    best = best_of(tried)
    if best is None:
        return nearest_miss(tried, requirements, f"no {kind}")
    how = sentence_of(requirements, best.values)
    doubt = f" ({best.candidate.doubt})" if best.candidate.doubt else ""
    smaller = [each for each in tried[: tried.index(best)] if each.status == "run"]
    text = f"{best.name}{doubt} is the smallest {what} that meets all limits: {how}"
    doubted = [each for each in smaller if each.meets]  # only doubts can be before the best
    failing = [each for each in smaller if not each.meets]
    if failing:
        which = "the next smaller" if failing[-1] is smaller[-1] else "smaller"
        text += f"; {failing[-1].name}, {which}, fails: {failing[-1].why}"
    for each in doubted[:2]:
        text += f"; {each.name} would do, and is smaller, but: {each.candidate.doubt}"
    return text


def larger_is_worse(tried: Sequence[Tried], what: str) -> list[str]:
    """Notes of larger candidates that fail what a smaller one meets."""
    best = best_of(tried)
    if best is None:
        return []
    worse = [each for each in tried[tried.index(best) + 1 :] if each.status == "run" and each.short]
    if not worse:
        return []
    shown = "; ".join(f"{each.name} ({each.why})" for each in worse[:3])
    more = f"; and {len(worse) - 3} more" if len(worse) > 3 else ""
    return [f"a larger {what} is not better: {shown}{more}"]


@dataclass(frozen=True, repr=False)
class Sizing(Shown):
    """Candidates of one kind against limits, and the smallest that meets them.

    kind : "valve", "tube", "supply", "muscle" or "pressure"
    scenario : its name
    requirements : the limits that were held
    air : the metric of the air that it takes
    axis : what `size` of the candidates is, its unit, and how many of it are one SI unit
    tried : every candidate, from the smallest to the largest
    best : the smallest that meets all; None where none does
    answer : one sentence
    notes : what to mind of it
    asked : the pressure that "does it suffice" was asked of; None where nobody asked
    interval : of a pressure: the next lower one that was tried, which fails, and the answer [Pa]
    request : what was asked for, as plain data
    """

    kind: str
    scenario: str
    requirements: tuple[Requirement, ...]
    air: str
    axis: tuple[str, str, float]
    tried: tuple[Tried, ...]
    best: Tried | None
    answer: str
    notes: tuple[str, ...] = ()
    asked: Tried | None = None
    interval: tuple[float, float] | None = None
    request: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        trials: Trials,
        kind: str,
        axis: tuple[str, str, float],
        tried: Sequence[Tried],
        best: Tried | None,
        **said: Any,
    ) -> "Sizing":
        """The answer of candidates that were tried; `said` are answer, notes, asked and interval."""
        return cls(
            kind, trials.scenario.name, trials.requirements, trials.air, axis, tuple(tried), best, **said
        )

    @property
    def holds(self) -> bool:
        """Whether what was asked for suffices; without such a question, whether anything does."""
        return self.best is not None if self.asked is None else self.asked.meets

    @property
    def table(self) -> Table:
        """Title, header and rows for people, of what was run; ▶ marks the best."""
        return _table_of(self.kind, self.requirements, self.air, self.tried, self.best)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the table's numbers mean, what was not run and why, and what to mind."""
        return (*_legend(self.requirements), *_remarks_of(self.tried), *self.notes)

    def to_json(self) -> dict[str, Any]:
        """Contents of size.json."""
        return {
            "kind": self.kind,
            "scenario": self.scenario,
            "limits": [str(each) for each in self.requirements],
            "answer": self.answer,
            "notes": list(self.notes),
            "best": None if self.best is None else self.best.name,
            "asked": None if self.asked is None else self.asked.name,
            "holds": self.holds,
            "interval_bar": None
            if self.interval is None
            else [1e-5 * p if math.isfinite(p) else None for p in self.interval],
            "tried": [self._row(each) for each in self.tried],
            "request": self.request,
        }

    def _row(self, each: Tried) -> dict[str, Any]:
        return {
            "name": each.name,
            "size": _plain(each.candidate.size),
            "facts": dict(each.candidate.facts),
            "sets": dict(each.candidate.sets),
            "status": each.status,
            "reason": each.reason,
            "meets": each.meets,
            "values": {name: _plain(value) for name, value in each.values.items()},
            "margins": {str(r): _plain(each.margin(r)) for r in self.requirements},
            "short": dict(each.short),
            "notes": list(each.notes),
        }

    @property
    def columns(self) -> list[str]:
        """Of the CSV and of `to_pandas`."""
        units = [f"{r.metric} [{r.unit}]" for r in self.requirements]
        margins = [f"margin {r} [{r.unit}]" for r in self.requirements]
        facts = list(dict.fromkeys(name for each in self.tried for name in each.candidate.facts))
        label, unit, _ = self.axis
        air = f"{self.air} [{words(self.air).unit}]"
        size = [f"{label} [{unit}]" if unit else label]
        return ["name", *size, *facts, "status", "meets", *units, *margins, air, "why"]

    @property
    def rows(self) -> list[list[Any]]:
        """One for each candidate, by `columns`; what is not known is NaN."""
        facts = list(dict.fromkeys(name for each in self.tried for name in each.candidate.facts))
        found = []
        for each in self.tried:
            own: list[Any] = [each.name, self.axis[2] * each.candidate.size]
            own += [each.candidate.facts.get(name, "") for name in facts]
            own += [each.status, each.meets]
            own += [each.values.get(r.metric, math.nan) for r in self.requirements]
            own += [each.margin(r) for r in self.requirements]
            own += [
                each.values.get(self.air, math.nan),
                "; ".join(filter(None, [each.reason, *each.short.values(), *each.notes])),
            ]
            found.append(own)
        return found

    def csv(self) -> str:
        """Contents of size.csv: a row for each candidate."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        for row in self.rows:
            writer.writerow([f"{cell:.6g}" if isinstance(cell, float) else cell for cell in row])
        return text.getvalue()

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each candidate, from the smallest to the largest (needs pandas)."""
        import pandas

        return pandas.DataFrame(self.rows, columns=self.columns)

    def save(self, folder: str | os.PathLike[str], draw: Draw | None = None) -> pathlib.Path:
        """Write size.csv and size.json, and size.png if `draw` is given; together or not at all.

        Parameters
        ----------
        folder : made if need be
        draw : called with this answer and the path of the figure

        Returns
        -------
        the folder
        """
        return write_answer(pathlib.Path(folder), "size", self, draw)

    def __repr__(self) -> str:
        ran = sum(each.status == "run" for each in self.tried)
        return f"<Sizing of a {self.kind} for {self.scenario!r}, {ran} run: {self.answer}>"


def _plain(value: float) -> float | str | None:
    """A number as JSON has it: "endless" of what has no end, None of what is not known."""
    if math.isinf(value):
        return "endless"
    return None if math.isnan(value) else value

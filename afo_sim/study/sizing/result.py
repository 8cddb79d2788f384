"""The answer to "which is the smallest that meets this": every candidate, and the best."""

import csv
import io
import itertools
import math
import os
import pathlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from afo_sim.common import Shown, as_stored, check_writable, together, with_code, write_json, write_text
from afo_sim.metrics import UNITS, words
from afo_sim.study.effects import BEYOND_LIMIT
from afo_sim.study.sizing.candidates import Candidate
from afo_sim.study.sizing.limits import Requirement, signed

if TYPE_CHECKING:
    import pandas

Draw = Callable[["Sizing", pathlib.Path], None]
Table = tuple[str, list[str], list[list[str]]]  # title, header, rows
ALLOWED = "allowed pressure"  # what a pressure beyond it fails
VERDICT = "verdict"  # of a run that meets all limits, and is doubted or misses what they do not hold
_C = "C: sonic conductance [dm³/(s·bar)]; b: critical pressure ratio"


@dataclass(frozen=True)
class Kind:
    """What can be sized: what its size is, with unit and factor from SI, and what its facts mean."""

    axis: tuple[str, str, float]
    what: str
    options: tuple[str, ...]
    notes: tuple[str, ...] = ()


KINDS = {
    "pressure": Kind(("supply pressure", "bar", 1e-5), "pressure", ("at", "between")),
    "valve": Kind(
        ("sonic conductance C", "dm³/(s·bar)", 1e8),
        "valve",
        ("chamber", "side", "proportional"),
        (f"{_C}; *: assumed",),
    ),
    "tube": Kind(("bore", "mm", 1e3), "tube", ("length",), (f"{_C} of the tube alone",)),
    "supply": Kind(
        ("mass of the source", "kg", 1.0),
        "source by mass",
        ("hours", "strides"),
        (
            "g, l: mass and volume of the source; mean, peak: flow out of it [l/min] of the free gas",
            "each run starts with a full source; strides and hours are for its content down to the set "
            "pressure, as it cools at the run's mean flow; air before the first step is not subtracted",
        ),
    ),
    "muscle": Kind(
        ("volume of all muscles at rest", "ml", 1e6),
        "set of muscles by volume",
        ("group", "count"),
        (
            "volume: of all braids at rest; link: so that the muscle is taut at the same ankle angle; "
            "grade: of the muscle's numbers, A measured to D guessed; *: not measured",
        ),
    ),
}


@dataclass(frozen=True, repr=False)
class Sizing(Shown):
    """Candidates of one kind with their limits, and the smallest that meets them.

    kind : "valve", "tube", "supply", "muscle" or "pressure"
    scenario : its name
    requirements : the limits that were held
    tried : every candidate, from the smallest to the largest
    air : the metric of the air that it takes
    part : whose it is: the group of muscles, or the chamber of a valve; "" of the others
    request : what was asked for, as plain data
    asked : the pressure that "does it suffice" was asked of; None where nobody asked
    interval : of a pressure: the next lower one that was tried, which fails, and the answer [Pa]
    notes : what to mind
    """

    kind: str
    scenario: str
    requirements: tuple[Requirement, ...]
    tried: tuple[Candidate, ...]
    air: str
    part: str = ""
    request: dict[str, object] = field(default_factory=dict)
    asked: Candidate | None = None
    interval: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()

    @property
    def ran(self) -> list[Candidate]:
        """Those that were run."""
        return [each for each in self.tried if each.status == "run"]

    @property
    def best(self) -> Candidate | None:
        """The smallest that meets all: of those without a doubt if there are any; None where none does."""
        meeting = [each for each in self.tried if each.meets]
        return next((each for each in meeting if not each.doubt), meeting[0] if meeting else None)

    @property
    def holds(self) -> bool:
        """Whether the requested candidate suffices; without one, whether any does."""
        return self.best is not None if self.asked is None else self.asked.meets

    @property
    def _what(self) -> str:
        return KINDS[self.kind].what + (f" for {self.part}" if self.part else "")

    @property
    def answer(self) -> str:
        """One sentence."""
        best, asked = self.best, self.asked
        if asked is not None:
            least = "no tried pressure suffices"
            if best is not None:
                least = f"the lowest that suffices is {best.name}{self._lowest(best)}"
            how = self._reached(asked) if asked.status == "run" else f"it was {asked.status} ({asked.reason})"
            verdict = f"is {asked.short[ALLOWED]}" if ALLOWED in asked.short else "does not suffice"
            mind = "".join(f"; note: {note}" for note in with_code(asked.notes, BEYOND_LIMIT) if asked.meets)
            return f"{asked.name} {'suffices' if asked.meets else verdict}: {how}; {least}{mind}"
        if best is None:
            return self._nearest_miss()
        doubt = f" ({best.doubt})" if best.doubt else ""
        text = f"{best.name}{doubt} is the smallest {self._what} that meets all limits: "
        text += self._reached(best)
        smaller = [each for each in self.ran if each.size < best.size]
        failing = [each for each in smaller if not each.meets]
        if failing:
            following = "the next smaller" if failing[-1] is smaller[-1] else "smaller"
            text += f"; {failing[-1].name}, {following}, fails: {failing[-1].why}"
        elif not smaller:
            text += self._lowest(best) or "; no smaller one could be tried"
        if best.doubt:
            return f"{text}; nothing without this reservation meets them"
        would = [e for e in self.ran if e.meets and e.doubt and not best.size <= e.size < math.inf]
        for doubt, those in itertools.groupby(would, key=lambda each: each.doubt):
            text += f"; {', '.join(each.name for each in those)} would also suffice, but: {doubt}"
        return text

    def _lowest(self, best: Candidate) -> str:
        return ", the lowest tried" if self.kind == "pressure" and best is self.tried[0] else ""

    def _nearest_miss(self) -> str:
        """Where nothing meets what is wanted: the one that comes closest, and how close."""
        ran, what = self.ran, self._what
        if not ran:
            why = f" could be run: {self.tried[0].reason}" if self.tried else " exists to try"
            return f"no {what}{why}"
        if all(ALLOWED in each.short for each in ran):
            return f"no tried {what} is allowed: {ran[0].name} is {ran[0].short[ALLOWED]}"
        labels = {each.label for each in self.requirements}
        closest = min(ran, key=lambda each: (bool(each.short.keys() - labels), self._missing(each)))
        how = self._reached(closest)
        how += "".join(f", but {why}" for name, why in closest.short.items() if name not in labels)
        span = f" from {ran[0].name} to {ran[-1].name}" if self.kind == "pressure" else ""
        return f"no tried {what}{span} meets all limits; the closest is {closest.name}: {how}"

    def _missing(self, each: Candidate) -> float:
        """The largest shortfall as a share of its bound; inf of what is not known."""
        margins = [(each.margin(r), abs(r.bound) or 1.0) for r in self.requirements]
        return max((math.inf if math.isnan(m) else max(-m, 0.0) / of for m, of in margins), default=0.0)

    def _reached(self, each: Candidate) -> str:
        found = [r.reached(each.values.get(r.metric, math.nan)) for r in self.requirements]
        found += [each.short[VERDICT]] if VERDICT in each.short else []
        found += [f"{name.replace('_', '-')} {word}" for name, word in (each.said or {}).items()]
        return ", ".join(found)

    def worse(self) -> list[str]:
        """That larger candidates fail what a smaller one meets."""
        best = self.best
        after = [] if best is None else [e for e in self.ran if best.size < e.size < math.inf and e.short]
        after = [each for each in after if ALLOWED not in each.short]
        if not after:
            return []
        return [
            f"larger is not better: {len(after)} larger ones fail, first {after[0].name} ({after[0].why})"
        ]

    @property
    def table(self) -> Table:
        """Title, header and rows for people, of what was run; ▶ marks the best."""
        numbers = {r.label: f"{k}" for k, r in enumerate(self.requirements, 1)}
        facts = list(dict.fromkeys(name for each in self.ran for name in each.facts))
        units = [UNITS.get(r.unit, r.unit) for r in self.requirements]
        limits = [f"{k} [{unit}]" if unit else f"{k}" for k, unit in enumerate(units, 1)]
        header = [self.kind, *facts, *limits, f"air [{words(self.air).unit}]", "limits met"]
        rows, best = [], self.best
        for each in self.ran:
            air = each.values.get(self.air, math.nan)
            fails = ", ".join(numbers.get(name, name) for name in each.short)
            rows.append(
                [
                    f"{'▶' if best is not None and each.name == best.name else ' '} {each.name}",
                    *(each.facts.get(name, "") for name in facts),
                    *(_margin(each.margin(r), r.unit) for r in self.requirements),
                    "–" if math.isnan(air) else f"{air:.3f}",
                    f"no: {fails}" if fails else "yes",
                ]
            )
        return f"{self.kind}: margins to the limits", header, rows

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the table's numbers mean, what was not run and why, and what to mind."""
        grouped: dict[str, list[str]] = {}
        for each in self.tried:
            reason = [] if each.status == "run" else [f"not run, {each.status}: {each.reason}"]
            for note in (*reason, *each.notes):
                grouped.setdefault(note, []).append(each.name)
        legend = (f"{k}: {each.label} {each.wanted}" for k, each in enumerate(self.requirements, 1))
        return (*legend, *(f"{', '.join(names)}: {text}" for text, names in grouped.items()), *self.notes)

    def rows(self) -> list[dict[str, object]]:
        """One for each candidate; what is not known is NaN."""
        label, unit, factor = KINDS[self.kind].axis
        facts = list(dict.fromkeys(name for each in self.tried for name in each.facts))
        return [
            {
                "name": each.name,
                f"{label} [{unit}]": factor * (each.size if math.isfinite(each.size) else math.nan),
            }
            | {name: each.facts.get(name, "") for name in facts}
            | {"status": each.status, "meets": each.meets}
            | {f"{r.metric} [{r.unit}]": each.values.get(r.metric, math.nan) for r in self.requirements}
            | {f"margin {r} [{r.unit}]": each.margin(r) for r in self.requirements}
            | {f"{self.air} [{words(self.air).unit}]": each.values.get(self.air, math.nan)}
            | {"why": "; ".join(filter(None, [each.reason, *each.short.values(), *each.notes]))}
            for each in self.tried
        ]

    def to_json(self) -> dict[str, object]:
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
            "interval_bar": self.interval and [_plain(1e-5 * p) for p in self.interval],
            "tried": [
                {name: _plain(value) for name, value in row.items()} | {"sets": dict(each.sets)}
                for row, each in zip(self.rows(), self.tried, strict=True)
            ],
            "request": self.request,
        }

    def csv(self) -> str:
        """Contents of size.csv: a row for each candidate."""
        text, rows = io.StringIO(), self.rows()
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})
        return text.getvalue()

    def to_pandas(self) -> "pandas.DataFrame":
        """A row for each candidate, from the smallest to the largest (needs pandas)."""
        import pandas

        return pandas.DataFrame(self.rows())

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
        target = pathlib.Path(folder)
        check_writable(target)
        with together(target, ("size.csv", "size.json", "size.png")) as scratch:
            write_text(scratch / "size.csv", self.csv())
            write_json(scratch / "size.json", as_stored(self.to_json(), target), "answer")
            if draw is not None:
                draw(self, scratch / "size.png")
        return target

    def __repr__(self) -> str:
        return f"<Sizing of a {self.kind} for {self.scenario!r}, {len(self.ran)} run: {self.answer}>"


def _margin(margin: float, unit: str) -> str:
    if not math.isfinite(margin):
        return "–" if math.isnan(margin) else "endless"
    return f"{margin:+.2f}".replace("-", "−") if unit == "h" else signed(margin, unit)


def _plain(value: object) -> object:
    """A value as JSON has it: "endless" of what has no end, None of what is not known."""
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return None if math.isnan(value) else "endless"

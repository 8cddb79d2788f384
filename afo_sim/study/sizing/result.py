"""The answer to "which is the smallest that meets this": every candidate, and the best."""

import csv
import io
import math
import os
import pathlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from afo_sim.common.writing import check_writable, json_text, together
from afo_sim.metrics.metric_words import words
from afo_sim.simulation.display_hooks import shown as pictures
from afo_sim.study.sizing.candidate import Tried
from afo_sim.study.sizing.requirement import Requirement
from afo_sim.study.sizing.table import Table, legend, remarks_of, table_of

if TYPE_CHECKING:
    import pandas

FILES = ("size.csv", "size.json", "size.png")
Draw = Callable[["Sizing", pathlib.Path], None]


@dataclass(frozen=True, repr=False)
class Sizing:
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

    @property
    def holds(self) -> bool:
        """Whether what was asked for suffices; without such a question, whether anything does."""
        return self.best is not None if self.asked is None else self.asked.meets

    @property
    def table(self) -> Table:
        """Title, header and rows for people, of what was run; ▶ marks the best."""
        return table_of(self.kind, self.requirements, self.air, self.tried, self.best)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the table's numbers mean, what was not run and why, and what to mind."""
        return (*legend(self.requirements), *remarks_of(self.tried), *self.notes)

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
            "tried": [self._told(each) for each in self.tried],
            "request": self.request,
        }

    def _told(self, each: Tried) -> dict[str, Any]:
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
        target = pathlib.Path(folder)
        check_writable(target)
        with together(target, FILES) as scratch:
            (scratch / "size.csv").write_text(self.csv(), encoding="utf-8")
            (scratch / "size.json").write_text(json_text(self.to_json()), encoding="utf-8")
            if draw is not None:
                draw(self, scratch / "size.png")
        return target

    def __repr__(self) -> str:
        ran = sum(each.status == "run" for each in self.tried)
        return f"<Sizing of a {self.kind} for {self.scenario!r}, {ran} run: {self.answer}>"

    def _repr_html_(self) -> str:  # asked for by Jupyter
        return pictures().html(self)


def _plain(value: float) -> float | str | None:
    """A number as JSON has it: "endless" of what has no end, None of what is not known."""
    if math.isinf(value):
        return "endless"
    return None if math.isnan(value) else value

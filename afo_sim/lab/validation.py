"""Every published number of the four papers, the force laws and valves' flows, against the simulator."""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from afo_sim.common import Shown
from afo_sim.lab import validation_knee, validation_laws, validation_s1
from afo_sim.lab.validation_row import Row

PARTS = (
    validation_laws.s0,
    *validation_s1.PARTS,
    validation_laws.s2,
    *validation_laws.PARTS,
    validation_laws.tube,
    *validation_knee.PARTS,
    validation_laws.smc,
    validation_laws.festo,
)
HEADER = ("source", "quantity", "published", "simulated", "error", "tolerance", "how well sourced", "")
OTHERS = "What is not good, and why:"
SOURCING = HEADER.index("how well sourced")
LEGEND = (
    "In brackets: what printed numbers imply, or a separate computation gives, where the number is not "
    "printed or printed wrongly. Held out: the error on what a fit did not see. Second-hand: read in public "
    "code or as quoted by others. Maker's: a theoretical curve, not measured. Compared: no agreement can be "
    "demanded. `--json` has the cells of the tables and the reason of every tolerance."
)


class Validation(Shown, list[Row]):
    """Rows of a validation, which show how they came out."""

    def __repr__(self) -> str:
        return f"<Validation: {verdict(self)}>"


def validate(report: Callable[[int, int], None] | None = None) -> Validation:
    """Compare what was published with what is simulated.

    Parameters
    ----------
    report : called with (parts done, parts in all)

    Returns
    -------
    rows, one per published number or curve; the cells of S1's tables are rows too, marked `cell`. Each names
    its source, quantity, unit, what was published and simulated, the tolerance and the `outcome`;
    `pandas.DataFrame(rows)` makes a table of them.

    Examples
    --------
    >>> [row.quantity for row in validate() if row.outcome == "FAILED"]  # doctest: +SKIP
    []
    """
    found = Validation()
    for done, part in enumerate(PARTS, 1):
        found += part()
        if report is not None:
            report(done, len(PARTS))
    return found


def record(row: Row) -> dict[str, Any]:
    """A row as plain values for JSON; what is not finite is null."""
    values = dataclasses.asdict(row)
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in values.items()}


def table(rows: Sequence[Row]) -> list[list[str]]:
    """The rows as texts under HEADER, without the cells that passed."""
    return [
        [
            row.source,
            _quantity(row),
            _published(row),
            "" if row.simulated is None else f"{row.simulated:.4g}",
            _error(row),
            "" if row.tolerance is None else f"{row.tolerance:.3g}",
            row.sourcing,
            row.outcome,
        ]
        for row in rows
        if not (row.cell and row.outcome == "good")
    ]


def remarks(rows: Sequence[Row]) -> list[str]:
    """Reasons why a source is contradicted or cannot be held to, one line each."""
    sources: dict[str, list[str]] = {}
    for row in rows:
        if row.outcome in ("FAILED", "erratum", "disagrees", "compared", "lost"):
            sources.setdefault(row.why, []).append(f"{row.source}, {row.outcome}")
    return [f"{'; '.join(dict.fromkeys(where))}: {why}." for why, where in sources.items()]


def verdict(rows: Sequence[Row]) -> str:
    """One line: how many rows came out how."""
    counted = Counter(row.outcome for row in rows if not row.cell)
    cells = [row for row in rows if row.cell]
    good = sum(row.outcome == "good" for row in cells)
    parts = ", ".join(f"{count} {outcome}" for outcome, count in counted.items())
    return f"{parts}; of {len(cells)} cells of tables {good} good"


def summary(rows: Sequence[Row]) -> str:
    """The verdict, of each source the value nearest to its tolerance, and every row that is not good."""
    counted = Counter(row.source for row in rows if row.outcome != "lost")
    good: dict[str, list[Row]] = {}
    others: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        if row.outcome == "good":
            good.setdefault(row.source, []).append(row)
        else:
            others.setdefault((row.source, row.outcome, row.sourcing, row.why), []).append(row)
    lines = [f"{verdict(rows)}.", ""]
    for source, of in good.items():
        nearest = max(of, key=lambda row: round(abs(row.error or 0.0) / (row.tolerance or 1.0), 2))
        count = f"{len(of)} of {counted[source]}"
        lines.append(f"- **{source}**, {count} ({nearest.sourcing}): {_brief(nearest, nearest)}")
    lines += ["", OTHERS, ""]
    for (source, outcome, sourcing, why), of in others.items():
        values = "; ".join(_brief(row, of[0]) for row in of)
        lines.append(f"- **{source}**, {outcome} ({sourcing}): {values}. {why[0].upper()}{why[1:]}.")
    return "\n".join(lines) + "\n"


def _brief(row: Row, first: Row) -> str:
    """Quantity and numbers; of the quantity only the word or two by which it differs from the first one's."""
    if row.error is None:
        return row.quantity
    words, others = row.quantity.split(), first.quantity.split()
    differ = [word for word, other in zip(words, others, strict=False) if word != other]
    alike = row is not first and len(words) == len(others) and len(differ) < 3
    quantity = " ".join(differ if alike else words).strip(",")
    numbers = _error(row) if row.simulated is None else f"{_published(row)} → {row.simulated:.4g}"
    notes = [] if row.tolerance is None else [f"±{row.tolerance:.3g}"]
    notes += [f"held out: {_held_out(row)}"] if row.held_out else []
    return f"{quantity}: {numbers} {row.unit}".strip() + (f" ({'; '.join(notes)})" if notes else "")


def _quantity(row: Row) -> str:
    text = f"{row.quantity} [{row.unit}]" if row.unit else row.quantity
    return f"{text}; held out: {_held_out(row)}" if row.held_out else text


def _held_out(row: Row) -> str:
    return ", ".join(f"{error:.3g} by {kind}" for kind, error in row.held_out.items())


def _published(row: Row) -> str:
    if row.points > 1:
        return f"{row.points} points"
    parts = [] if row.published is None else [f"{row.published:.6g}"]
    if row.expected is not None:
        parts.append(f"({row.expected:.4g})")
    return " ".join(parts) or "–"


def _error(row: Row) -> str:
    if row.error is None:
        return ""
    small = row.tolerance is not None and abs(row.error) < 0.01 * row.tolerance
    return "0" if small else f"{row.error:.3g}"

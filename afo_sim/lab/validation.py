"""Every published number of the four papers, the force laws and valves' flows, against the simulator."""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from afo_sim.lab import validation_air, validation_knee, validation_laws, validation_s1
from afo_sim.lab.validation_row import Row

PARTS = (
    validation_laws.s0,
    *validation_s1.PARTS,
    *validation_laws.S2_PARTS,
    *validation_laws.PARTS,
    *validation_air.TUBE_PARTS,
    *validation_knee.PARTS,
    *validation_air.VALVE_PARTS,
)
HEADER = ("source", "quantity", "published", "simulated", "error", "tolerance", "how well sourced", "")
SOURCING = HEADER.index("how well sourced")
LEGEND = (
    "In brackets: what the printed numbers imply, or a separate computation from them gives, where it is not "
    "printed or printed wrongly. Held out: the error on what a fit did not see. Second-hand: read in public "
    "code or as quoted by others. Maker's: a theoretical curve, not measured. Compared: no agreement can be "
    "demanded. Every tolerance has its reason in `--json`, where the cells of the tables stand too."
)


def validate(report: Callable[[int, int], None] | None = None) -> list[Row]:
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
    found: list[Row] = []
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


def markdown(rows: Sequence[Row]) -> str:
    """Table, legend and remarks as Markdown, as they stand in the README."""
    lines = [HEADER, ["---"] * len(HEADER), *table(rows)]
    text = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return "\n\n".join([text, LEGEND, "\n".join(f"- {remark}" for remark in remarks(rows))]) + "\n"


def _quantity(row: Row) -> str:
    text = f"{row.quantity} [{row.unit}]" if row.unit else row.quantity
    unseen = ", ".join(f"{error:.3g} by {kind}" for kind, error in row.held_out.items())
    return f"{text}; held out: {unseen}" if unseen else text


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

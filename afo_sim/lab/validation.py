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
SUMMARY_HEADER = ("source", "within", "worst: published → simulated (tolerance)")
OUTSIDE = "What is not within a tolerance, with the reason, published → simulated:"
# What a source's values are.
ABOUT = {
    "S1 table I": "bench, 21.5 cm muscle",
    "S1 table II": "bench, 12 cm muscle",
    "S1 tables I, II": "one fit to both",
    "S1 table III": "S1's simulation, 21.5 cm",
    "S1 table IV": "S1's simulation, 12 cm",
    "S1 eq. 1, 2": "geometric and Hill model agree",
    "S1 eq. 1": "sentence: force falls with pressure",
    "S1": "largest contraction",
    "S2 figure 4": "force at −3 %, 600 kPa",
    "S2 eq. 3–7": "`kerscher_2006`, maker's curves",
    "S2 eq. 8–9": "`maximum_force`, maker's curves",
    "S2 eq. 10": "`sarosi_2012`, maker's curves",
    "S2 eq. 11": "`polynomial`, maker's curves",
    "S2 figure 6": "angles of the arm",
    "S3 eq. 5": "a and n of the law",
    "S3 figure 10": "force curves",
    "Sárosi 2012": "forces, maker's curves",
    "Reynolds 2003": "coefficients",
    "Serres 2009": "coefficients",
    "Bolen 2026": "forces, maker's curves",
    "Martens & Boblan 2017": "maker's curves",
    "Abed 2025, doi 10.1109/IC2AI62984.2025.10932214": "C and b of a tube",
    "Bolen, pin knee": "torques measured on a joint",
    "SMC EUS11-83B-UK": "flows of valves",
    "SMC": "worked example of a flow",
    "Festo MPYE 2025/03": "flow of a valve",
    "Festo 8035170": "flow of a valve",
}
SOURCING = HEADER.index("how well sourced")
LEGEND = (
    "In brackets: what printed numbers imply, or a separate computation gives; it is not printed. Held out: "
    "the error on what a fit did not see. Second-hand: read in public code or as quoted by others. Maker's: "
    "a theoretical curve, not measured. Compared: no agreement can be demanded. `--json` has the cells of "
    "the tables and the reason of every tolerance."
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
    """Every row as Markdown: the table that `afo-sim validate` prints, its legend and remarks."""
    lines = [HEADER, ["---"] * len(HEADER), *table(rows)]
    text = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return "\n\n".join([text, LEGEND, "\n".join(f"- {remark}" for remark in remarks(rows))]) + "\n"


def summary(rows: Sequence[Row]) -> str:
    """A line for each published table or figure, then every value that is not within a tolerance."""
    sources: dict[str, list[Row]] = {}
    for row in rows:
        if row.outcome != "lost":
            sources.setdefault(row.source, []).append(row)
    lines = [SUMMARY_HEADER, ["---"] * len(SUMMARY_HEADER)]
    for source, of in sources.items():
        within = f"{sum(row.outcome == 'good' for row in of)} of {len(of)}"
        lines.append([f"{source}: {ABOUT[source]}", within, _numbers(max(of, key=_badness), unit=True)])
    text = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return "\n\n".join([text, OUTSIDE, _outside(rows)]) + "\n"


def _outside(rows: Sequence[Row]) -> str:
    """Every row that is not good, with both numbers, below its reason."""
    reasons: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        if row.outcome != "good":
            reasons.setdefault((row.source, row.outcome, row.sourcing, row.why), []).append(row)
    return "\n".join(
        f"- **{source}**, {sourcing if outcome == 'lost' else f'{outcome} ({sourcing})'}: "
        f"{'; '.join(_brief(row, of[0]) for row in of)}. {why[0].upper()}{why[1:]}."
        for (source, outcome, sourcing, why), of in reasons.items()
    )


def _brief(row: Row, first: Row) -> str:
    """Quantity and numbers; of the quantity only the word or two by which it differs from the first one's."""
    if row.outcome == "lost":
        return _quantity(row)
    words, others = _quantity(row).split(), _quantity(first).split()
    differ = [word for word, other in zip(words, others, strict=False) if word != other]
    alike = row is not first and len(words) == len(others) and len(differ) < 3
    return f"{' '.join(differ if alike else words).strip(',')}: {_numbers(row)}"


def _numbers(row: Row, *, unit: bool = False) -> str:
    """Both numbers, or the error of a curve; with the tolerance, and what a fit did not see."""
    both = row.simulated is not None
    text = f"{_published(row)} → {row.simulated:.4g}" if both else f"{row.error:.3g}"
    text += f" {row.unit}" if unit and row.unit else ""
    text += "" if both else f" over {row.points} points"
    text += "" if row.tolerance is None else f" (±{row.tolerance:.3g})"
    return f"{text}; held out: {_held_out(row)}" if unit and row.held_out else text


def _badness(row: Row) -> tuple[bool, bool, float]:
    """Order of what is worst: not good, with both numbers, by its share of the tolerance or of the number."""
    reference = row.published if row.published is not None else row.expected
    share = abs(row.error or 0.0) / (row.tolerance or abs(reference or 1.0))
    return row.outcome != "good", reference is not None, share


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

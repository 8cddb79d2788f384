"""Every published number of the four papers, the force laws and valves' flows, and the simulated one."""

from collections import Counter
from collections.abc import Sequence

from afo_sim.common import Shown
from afo_sim.lab.paper_values import rows_of, validated
from afo_sim.lab.validation_row import Report, Row, counted

PAPERS = ("S0", "S1", "S2", "S3")
EXACT = 1e-8  # below which a number is round-off, and is not told
OTHERS = "What does not agree, and why:"


class Validation(Shown, list[Row]):
    """Rows of a validation, which show how they came out."""

    def __repr__(self) -> str:
        return f"<Validation: {verdict(self)}>"


def validate(progress: Report = None) -> Validation:
    """Compare published with simulated numbers.

    Parameters
    ----------
    progress : called with (rows done, rows in all)

    Returns
    -------
    rows, one per published number or curve; the cells of S1's tables are rows too, marked `cell`. Each names
    its source, quantity, unit, published and simulated value, tolerance and `outcome`;
    `pandas.DataFrame(rows)` makes a table of them.

    Examples
    --------
    >>> [row.quantity for row in validate() if row.outcome == "FAILED"]  # doctest: +SKIP
    []
    """
    return Validation(row for one in counted(validated(), progress) for row in rows_of(one))


def verdict(rows: Sequence[Row]) -> str:
    """One line: how many rows came out how."""
    counted = Counter(row.outcome for row in rows if not row.cell)
    cells = [row for row in rows if row.cell]
    good = sum(row.outcome == "agrees" for row in cells)
    parts = ", ".join(f"{count} {outcome}" for outcome, count in counted.items())
    return f"{parts}; of {len(cells)} cells of tables {good} agree"


def summary(rows: Sequence[Row]) -> str:
    """The verdict, each source's value nearest to its tolerance, and rows that do not agree."""
    counted = Counter(row.source for row in rows if row.outcome != "lost")
    good: dict[str, list[Row]] = {}
    others: dict[tuple[str, ...], list[Row]] = {}
    for row in rows:
        if row.source[:2] in PAPERS and row.passed:
            continue
        if row.outcome == "agrees":
            good.setdefault(row.source, []).append(row)
        else:
            others.setdefault((row.source, row.outcome, row.sourcing, row.why), []).append(row)
    lines = [f"{verdict(rows)}. The papers S0 to S3 in full: `afo-sim paper S1`.", ""]
    for source, of in good.items():
        nearest = max(of, key=lambda row: round(abs(row.error or 0.0) / (row.tolerance or 1.0), 2))
        count = f"{len(of)} of {counted[source]}"
        lines.append(f"- **{source}**, {count} ({nearest.sourcing}): {brief(nearest, nearest)}")
    lines += ["", OTHERS, ""]
    for (source, outcome, sourcing, why), of in others.items():
        values = "; ".join(brief(row, of[0]) for row in of)
        lines.append(f"- **{source}**, {outcome} ({sourcing}): {values}. {why[0].upper()}{why[1:]}.")
    return "\n".join(lines) + "\n"


def brief(row: Row, first: Row) -> str:
    """Quantity and numbers; of the quantity only the word or two by which it differs from the first one's."""
    if row.error is None and row.simulated is None:
        return row.quantity
    words, others = row.quantity.split(), first.quantity.split()
    differ = [word for word, other in zip(words, others, strict=False) if word != other]
    alike = row is not first and len(words) == len(others) and len(differ) < 3
    quantity = " ".join(differ if alike else words).strip(",")
    theirs = f"{published(row)} → " if row.published is not None or row.expected else ""
    small = row.tolerance is not None and abs(row.error or 0.0) < 0.01 * row.tolerance
    numbers = "" if row.error is None else "0" if small else f"{row.error:.3g}"
    if row.simulated is not None:
        digits = 3 if row.error is None and abs(row.simulated) < 1e3 else 4
        numbers = theirs + ("0" if abs(row.simulated) < EXACT else f"{row.simulated:.{digits}g}")
    relative = 100.0 * (row.error or 0.0) / abs(row.published) if row.published else 0.0
    notes = [f"{relative:+.3g} %"] if abs(relative) >= 0.05 else []
    notes += [f"±{row.tolerance:.3g}"] if (row.tolerance or 0.0) > EXACT else []
    notes += [f"{name} {value:.3g}" for name, value in row.foils.items()]
    held_out = ", ".join(f"{error:.3g} by {kind}" for kind, error in row.held_out.items())
    notes += [f"held out: {held_out}"] if held_out else []
    return f"{quantity}: {numbers} {row.unit}".strip() + (f" ({'; '.join(notes)})" if notes else "")


def published(row: Row) -> str:
    """What was published, and in brackets what is implied."""
    parts = [] if row.published is None else [f"{row.published:.6g}"]
    return " ".join([*parts, *([] if row.expected is None else [f"({row.expected:.4g})"])])

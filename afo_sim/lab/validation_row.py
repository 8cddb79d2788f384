"""One published number or curve, the simulated one, and the outcome.

What a source says stands in `models/validation`: in a file a list of tables for each part, in a table what
its `rows` have in common. Keys are those of `Row`, those by which it is computed (`paper_values.py`), and

    published   as a text: as printed, right to half of the last digit
    share       the tolerance, as a share of what is published
    allowed     how far the simulated number may be from `expected`, which the source contradicts
    missed      the outcome beyond the tolerance, where that is a result and no fault of the simulator
    measure     "worst" error of a curve; by default the root mean square
    {key}       in a quantity or sourcing: another key of the row, or of its value
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeVar

import numpy as np

from afo_sim.common import JsonDict, JsonMapping, Keywords, Mixed
from afo_sim.lab.identifiability import rms

Outcome = Literal["agrees", "FAILED", "erratum", "disagrees", "cannot tell", "compared", "lost"]
# What a row has where nothing is told.
ABSENT: Keywords = {"published": None, "expected": None, "tolerance": None, "unit": "", "held_out": {}}
ABSENT |= {"foils": {}, "cell": False, "sourcing": ""}
Counted = TypeVar("Counted")
Report = Callable[[int, int], None] | None  # takes how many are done, and in all


def counted(items: Sequence[Counted], report: Report) -> Iterator[Counted]:
    """Each of some items, which is reported when it is done."""
    for done, each in enumerate(items, 1):
        yield each
        if report is not None:
            report(done, len(items))


@dataclass(frozen=True)
class Row:
    """A line of the validation, numbers in `unit`; `passed` is about this simulator, not about its source."""

    source: str  # of the published number
    quantity: str  # what it is
    published: float | None  # None of a curve, of what is lost, or is implied only
    simulated: float | None  # [unit]; None of what is lost
    error: float | None  # less published or expected; of a curve RMS or worst
    tolerance: float | None  # None where nothing can be demanded
    unit: str  # of all numbers
    sourcing: str  # how the number was read or measured
    passed: bool  # within the tolerance
    outcome: Outcome  # in a word
    why: str  # of the tolerance, or what is wrong with the source
    expected: float | None = None  # what is implied, or should stand where the source is wrong
    held_out: Mapping[str, float] = field(default_factory=dict)  # errors on points not seen
    foils: Mapping[str, float] = field(default_factory=dict)  # by models that must do worse
    points: int = 1  # that an error is over
    cell: bool = False  # one number of a table that has a row of its own

    @classmethod
    def of(cls, told: JsonMapping, value: Mixed) -> "Row":
        """What is stated with its value: a number, a curve's errors, or either as `simulated` of a table."""
        known: JsonDict = {**ABSENT, **told}
        known |= value if isinstance(value, Mapping) else {"simulated": value}
        quantity, sourcing = (known[key].format_map(known) for key in ("quantity", "sourcing"))
        if known.get("outcome") == "lost":
            nothing = (None,) * 4
            return cls(known["source"], quantity, *nothing, "", "not recoverable", True, "lost", known["why"])
        published, expected, tolerance = (known[key] for key in ("published", "expected", "tolerance"))
        if isinstance(published, str):
            tolerance, published = 0.5 * 10.0 ** -len(published.partition(".")[2]), float(published)
        if "share" in known:
            tolerance = known["share"] * published
        simulated, points = known["simulated"], 1
        reference = expected if published is None else published
        if isinstance(simulated, np.ndarray):
            error = float(np.abs(simulated).max()) if known.get("measure") == "worst" else rms(simulated)
            points, simulated, reference = len(simulated), None, 0.0
        else:
            simulated = float(simulated)
            error = simulated - (reference or 0.0)
        good = math.isfinite(error) and (tolerance is None or abs(error) <= tolerance)
        if "allowed" in known:
            good = abs(simulated - expected) <= known["allowed"]
        outcome: Outcome = known.get("missed", "FAILED") if math.isfinite(error) else "FAILED"
        if good:
            outcome = known.get("outcome", "compared" if tolerance is None else "agrees")
        as_well = any(abs(foil - reference) <= abs(error) for foil in known["foils"].values())
        outcome = "cannot tell" if as_well and outcome != "FAILED" else outcome
        told_error = None if reference is None else error
        numbers = (published, simulated, told_error, tolerance, known["unit"], sourcing)
        same = {key: known[key] for key in ("why", "expected", "held_out", "foils", "cell")}
        return cls(known["source"], quantity, *numbers, outcome != "FAILED", outcome, points=points, **same)

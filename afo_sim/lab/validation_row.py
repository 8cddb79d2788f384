"""One published number or curve beside what the simulator says to it, and how that came out.

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
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from afo_sim.lab.identifiability import rms

Outcome = Literal["agrees", "FAILED", "erratum", "disagrees", "cannot tell", "compared", "lost"]
# What a row has where nothing is told.
ABSENT: dict[str, Any] = {"published": None, "expected": None, "tolerance": None, "unit": "", "held_out": {}}
ABSENT |= {"foils": {}, "cell": False, "sourcing": ""}


@dataclass(frozen=True)
class Row:
    """A line of the validation, numbers in `unit`.

    `published` is a number that stands in the source, else None: for a curve of `points` numbers, for one
    that is lost, and for one that the source implies but does not print. That one is `expected`, and so is
    what should stand where the source is wrong. `error` is simulated less published (or expected), None
    without either, of a curve the root mean square or the worst. `tolerance` is None where nothing can be
    demanded; `why` is its reason, or what is wrong with the source. `held_out` are errors on points that the
    fit did not see, by what was left out. `foils` are the same number of models that must do worse: where
    one does as well, the source cannot tell. A `cell` is one number of a table that has a row of its own.
    `passed` is about this simulator: a paper that contradicts itself fails nothing where the expected number
    comes out.
    """

    source: str
    quantity: str
    published: float | None
    simulated: float | None
    error: float | None
    tolerance: float | None
    unit: str
    sourcing: str
    passed: bool
    outcome: Outcome
    why: str
    expected: float | None = None
    held_out: Mapping[str, float] = field(default_factory=dict)
    foils: Mapping[str, float] = field(default_factory=dict)
    points: int = 1
    cell: bool = False

    @classmethod
    def of(cls, told: Mapping[str, Any], value: Any) -> "Row":
        """What is told with its value: a number, a curve's errors, or either as `simulated` of a table."""
        known: dict[str, Any] = {**ABSENT, **told}
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

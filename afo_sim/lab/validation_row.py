"""One published number or curve beside what the simulator says to it, and how that came out."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from afo_sim.lab.identifiability import rms

Outcome = Literal["good", "FAILED", "erratum", "disagrees", "compared", "lost"]
NOT_RECOVERABLE = "not recoverable"


@dataclass(frozen=True)
class Row:
    """A line of the validation, numbers in `unit`.

    `published` is a number that stands in the source, else None: for a curve of `points` numbers, for one
    that is lost, and for one that the source implies but does not print. That one is `expected`, and so is
    what should stand where the source is wrong. `error` is simulated less published (or expected), of a
    curve the root mean square or the worst. `tolerance` is None where nothing can be demanded; `why` is
    its reason, or what is wrong with the source. `held_out` are errors on points that the fit did not see,
    by what was left out. A `cell` is one number of a table that has a row of its own. `passed` is about
    this simulator: a paper that contradicts itself fails nothing as long as the expected number comes out.
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
    points: int = 1
    cell: bool = False


def worst(errors: np.ndarray) -> float:
    """The largest absolute error."""
    return float(np.abs(errors).max())


@dataclass(frozen=True)
class About:
    """What rows of one source have in common: its name, their unit, how well sourced they are, and why."""

    source: str
    unit: str
    sourcing: str
    why: str

    def row(
        self,
        outcome: Outcome,
        good: object,
        quantity: str,
        error: float,
        simulated: float | None,
        *,
        published: float | None = None,
        expected: float | None = None,
        tolerance: float | None = None,
        **others: Any,
    ) -> Row:
        """A line of the validation, of an outcome if it is good and else failed."""
        verdict: tuple[bool, Outcome] = (True, outcome) if good else (False, "FAILED")
        numbers = (published, simulated, error, tolerance)
        how = (self.unit, self.sourcing)
        return Row(self.source, quantity, *numbers, *how, *verdict, self.why, expected, **others)

    def number(
        self, quantity: str, published: float, simulated: float, tolerance: float, **others: Any
    ) -> Row:
        """A printed number against ours."""
        error = float(simulated) - float(published)
        numbers = {"published": float(published), "tolerance": tolerance}
        return self.row(
            "good", abs(error) <= tolerance, quantity, error, float(simulated), **numbers, **others
        )

    def implied(self, quantity: str, expected: float, simulated: float, tolerance: float) -> Row:
        """A number that follows from printed ones but is not printed, against ours."""
        error = float(simulated) - float(expected)
        numbers = {"expected": float(expected), "tolerance": tolerance}
        return self.row("good", abs(error) <= tolerance, quantity, error, float(simulated), **numbers)

    def compared(self, quantity: str, published: float, simulated: float) -> Row:
        """A printed number beside ours where no agreement can be demanded."""
        error = simulated - published
        return self.row("compared", math.isfinite(error), quantity, error, simulated, published=published)

    def contradicted(
        self,
        outcome: Literal["erratum", "disagrees"],
        quantity: str,
        published: float | None,
        expected: float,
        simulated: float,
        allowed: float,
    ) -> Row:
        """A printed number that the source's own other numbers contradict; ours must be the expected one."""
        error = simulated - (expected if published is None else published)
        numbers = {"published": published, "expected": expected}
        return self.row(outcome, abs(simulated - expected) <= allowed, quantity, error, simulated, **numbers)

    def curve(
        self,
        quantity: str,
        errors: np.ndarray,
        tolerance: float | None,
        *,
        held_out: Mapping[str, float] | None = None,
        measure: Callable[[np.ndarray], float] = rms,
    ) -> Row:
        """Many numbers at once: `measure` over their errors; without a tolerance it is not judged."""
        error = measure(errors)
        outcome: Outcome = "compared" if tolerance is None else "good"
        good = math.isfinite(error) if tolerance is None else error <= tolerance
        counts: dict[str, Any] = {"held_out": held_out or {}, "points": len(errors)}
        return self.row(outcome, good, quantity, error, None, tolerance=tolerance, **counts)


def lost(source: str, quantity: str, why: str) -> Row:
    """A number that the paper printed and its text no longer holds. Nothing stands in for it."""
    return Row(source, quantity, None, None, None, None, "", NOT_RECOVERABLE, True, "lost", why)

"""One published number or curve beside what the simulator says to it, and how that came out."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

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


def number(
    source: str,
    quantity: str,
    published: float,
    simulated: float,
    tolerance: float,
    unit: str,
    *,
    sourcing: str,
    why: str,
    cell: bool = False,
) -> Row:
    """A printed number against ours."""
    published, simulated = float(published), float(simulated)
    error = simulated - published
    verdict = _verdict("good", abs(error) <= tolerance)
    return Row(
        source, quantity, published, simulated, error, tolerance, unit, sourcing, *verdict, why, cell=cell
    )


def implied(
    source: str,
    quantity: str,
    expected: float,
    simulated: float,
    tolerance: float,
    unit: str,
    *,
    sourcing: str,
    why: str,
) -> Row:
    """A number that follows from printed ones but is not printed, against ours."""
    expected, simulated = float(expected), float(simulated)
    error = simulated - expected
    verdict = _verdict("good", abs(error) <= tolerance)
    return Row(source, quantity, None, simulated, error, tolerance, unit, sourcing, *verdict, why, expected)


def curve(
    source: str,
    quantity: str,
    errors: np.ndarray,
    tolerance: float | None,
    unit: str,
    *,
    sourcing: str,
    why: str,
    held_out: Mapping[str, float] | None = None,
    measure: Callable[[np.ndarray], float] = rms,
) -> Row:
    """Many numbers at once: `measure` over their errors; without a tolerance it is not judged."""
    error = measure(errors)
    if tolerance is None:
        verdict = _verdict("compared", math.isfinite(error))
    else:
        verdict = _verdict("good", error <= tolerance)
    counts = {"held_out": held_out or {}, "points": len(errors)}
    return Row(source, quantity, None, None, error, tolerance, unit, sourcing, *verdict, why, **counts)  # type: ignore[arg-type]


def worst(errors: np.ndarray) -> float:
    """The largest absolute error."""
    return float(np.abs(errors).max())


def compared(
    source: str, quantity: str, published: float, simulated: float, unit: str, *, sourcing: str, why: str
) -> Row:
    """A printed number beside ours where no agreement can be demanded."""
    error = simulated - published
    verdict = _verdict("compared", math.isfinite(error))
    return Row(source, quantity, published, simulated, error, None, unit, sourcing, *verdict, why)


def contradicted(
    outcome: Literal["erratum", "disagrees"],
    source: str,
    quantity: str,
    published: float | None,
    expected: float,
    simulated: float,
    allowed: float,
    unit: str,
    *,
    sourcing: str,
    why: str,
) -> Row:
    """A printed number that the source's own other numbers contradict; ours must be the expected one."""
    error = simulated - (expected if published is None else published)
    verdict = _verdict(outcome, abs(simulated - expected) <= allowed)
    return Row(source, quantity, published, simulated, error, None, unit, sourcing, *verdict, why, expected)


def lost(source: str, quantity: str, why: str) -> Row:
    """A number that the paper printed and its text no longer holds. Nothing stands in for it."""
    return Row(source, quantity, None, None, None, None, "", NOT_RECOVERABLE, True, "lost", why)


def _verdict(outcome: Outcome, good: object) -> tuple[bool, Outcome]:
    return (True, outcome) if good else (False, "FAILED")

"""Laws by how well they predict, and the reasons to doubt that order."""

import math
from collections.abc import Sequence

from afo_sim.lab.fitting.identifiability import POINTS_PER_PARAMETER
from afo_sim.lab.fitting.law_fit import LawFit
from afo_sim.lab.fitting.law_muscle import residual_unit

FEWEST = {"pressure": 3, "load": 3}  # groups to leave out in turn: with two, each is extrapolated from one
GROSS = 3.0  # times the error of the law that fits best: the two orders contradict each other


def kinds(fits: Sequence[LawFit]) -> list[str]:
    """The kinds of groups that were left out in turn, over several fits."""
    return list(dict.fromkeys(kind for fit in fits for kind in fit.held_out))


def ranked_by(fits: Sequence[LawFit]) -> str:
    """The kind of held-out error that laws are ranked by; "" where too little or nothing was left out."""
    return next((kind for kind in kinds(fits) if kind != "file" and not _too_few(fits, kind)), "")


def rank(fits: Sequence[LawFit]) -> list[LawFit]:
    """Best first: by the error on what was left out, or else by the standard deviation of the residuals."""
    kind = ranked_by(fits)

    def error(fit: LawFit) -> float:
        return fit.held_out_rms(kind) if kind in fit.held_out else math.inf

    return sorted(fits, key=lambda fit: (error(fit), fit.spread, fit.rms))


def criterion(fits: Sequence[LawFit]) -> str:
    """The measure that the laws are ranked by, in words."""
    kind = ranked_by(fits)
    return f"error on each {kind} left out in turn" if kind else "standard deviation about the fitted points"


def doubts(fits: Sequence[LawFit]) -> list[str]:
    """Reasons to look twice before taking the first of several ranked laws."""
    if len(fits) < 2:
        return []
    best, found = fits[0], []
    factor, unit = residual_unit(best)
    for kind in kinds(fits):
        if _too_few(fits, kind):
            found.append(
                f"only {_groups(fits, kind)} {kind}s: one left out is extrapolated from the other, so the "
                f"laws are not ranked by it; measure at {FEWEST[kind]} or more"
            )
    if not ranked_by(fits) and not found:
        found.append("nothing was left out: the order says how laws fit, not how they predict")
    # more parameters than the points can bear fit anything
    sound = [
        fit
        for fit in fits
        if len(fit.residuals) - fit.silent >= POINTS_PER_PARAMETER * len(fit.values) and fit.values
    ]
    closest = min(sound or [best], key=lambda fit: fit.spread)
    if best.spread > GROSS * closest.spread:
        found.append(
            f"{best.problem.law.name} is first by the {criterion(fits)}, but misses the fitted points by "
            f"{factor * best.rms:.3g} {unit} RMS, and {closest.problem.law.name} by "
            f"{factor * closest.rms:.3g} {unit}: the two orders contradict each other"
        )
    return found


def _groups(fits: Sequence[LawFit], kind: str) -> int:
    return max(len(fit.held_out.get(kind, {})) for fit in fits)


def _too_few(fits: Sequence[LawFit], kind: str) -> bool:
    return _groups(fits, kind) < FEWEST.get(kind, 1)

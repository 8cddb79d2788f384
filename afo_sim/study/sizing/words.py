"""Sentences that all kinds of sizing have in common."""

from collections.abc import Sequence

from afo_sim.study.sizing.candidate import Tried, closeness
from afo_sim.study.sizing.requirement import Requirement
from afo_sim.study.sizing.trial import sentence_of


def nearest_miss(tried: Sequence[Tried], requirements: Sequence[Requirement], nothing: str) -> str:
    """A sentence for where nothing meets what is wanted: the one that comes closest, and how close."""
    ran = [each for each in tried if each.status == "run"]
    if not ran:
        return f"{nothing} could be run: {tried[0].reason}" if tried else f"{nothing} is there to try"
    labels = {each.label for each in requirements}
    closest = min(ran, key=lambda each: (bool(each.short.keys() - labels), closeness(each, requirements)))
    how = sentence_of(requirements, closest.values)
    how += "".join(f", but {told}" for name, told in closest.short.items() if name not in labels)
    return f"{nothing} that was tried meets all limits; closest comes {closest.name}: {how}"


def best_of(tried: Sequence[Tried]) -> Tried | None:
    """The smallest that meets all limits: of those without a doubt if there are any; None where none does."""
    meeting = [each for each in tried if each.meets]
    return next((each for each in meeting if not each.candidate.doubt), meeting[0] if meeting else None)


def smallest(tried: Sequence[Tried], requirements: Sequence[Requirement], what: str, kind: str) -> str:
    """The sentence that names the smallest candidate that meets all limits and why the next fails."""
    best = best_of(tried)
    if best is None:
        return nearest_miss(tried, requirements, f"no {kind}")
    how = sentence_of(requirements, best.values)
    doubt = f" ({best.candidate.doubt})" if best.candidate.doubt else ""
    smaller = [each for each in tried[: tried.index(best)] if each.status == "run"]
    text = f"{best.name}{doubt} is the smallest {what} that meets all limits: {how}"
    doubted = [each for each in smaller if each.meets]  # only doubts can be before the best
    failing = [each for each in smaller if not each.meets]
    if failing:
        which = "the next smaller" if failing[-1] is smaller[-1] else "smaller"
        text += f"; {failing[-1].name}, {which}, fails: {failing[-1].why}"
    for each in doubted[:2]:
        text += f"; {each.name} would do, and is smaller, but: {each.candidate.doubt}"
    return text


def larger_is_worse(tried: Sequence[Tried], what: str) -> list[str]:
    """Notes of larger candidates that fail what a smaller one meets."""
    best = best_of(tried)
    if best is None:
        return []
    worse = [each for each in tried[tried.index(best) + 1 :] if each.status == "run" and each.short]
    if not worse:
        return []
    told = "; ".join(f"{each.name} ({each.why})" for each in worse[:3])
    more = f"; and {len(worse) - 3} more" if len(worse) > 3 else ""
    return [f"a larger {what} is not better: {told}{more}"]

"""A verdict with uncertainty: what a share of drawn strides decides, by its exact bounds."""

import dataclasses
from bisect import bisect_left
from collections.abc import Mapping, Sequence

from afo_sim.metrics.answer import HELP, LIFT, Answer, Status, at_most, worst
from afo_sim.metrics.verdict import ENOUGH, UNSURE

KEPT = 0.9  # share of draws that a good answer must survive; assumed [-]
SURE = 0.95  # share of such sets of draws of which a bound holds, one-sided [-]
NO_RATE = "neither an accident rate nor the model's error"  # is a share of draws
MOST_DRAWS = 100_000  # that anybody would make


def with_draws(
    answers: Sequence[Answer], trips: float, draws: int, limit: tuple[float, float], kept: Mapping[str, float]
) -> tuple[Answer, ...]:
    """The answers of a run with its uncertain inputs drawn; help and toe are the worse of both."""
    # `trips` is the share of drawn strides that touch the floor, `kept` that of draws that keep each good
    # answer, by its name; less than KEPT make it doubtful
    drawn, remark = _judged(trips, draws, limit)
    touching = of_draws(trips, draws, "touches the floor", "touch the floor")
    stated = f"With all uncertain inputs varied together, of {draws} strides {touching}{remark}. "
    stated += f"This is {NO_RATE}."
    against = f"; of varied strides at most {percent(limit[0])} may touch, bad above {percent(limit[1])}"

    def judged(answer: Answer) -> Answer:
        if answer.status == "good" and answer.name in kept:
            share = kept[answer.name]
            answer = dataclasses.replace(answer, kept=share)
            if share < KEPT:
                text = (
                    f"{answer.text} That holds in only {percent(share)} of {draws} runs with varied inputs."
                )
                brief = f"{answer.brief}; holds in {percent(share)} of varied runs" if answer.brief else ""
                answer = dataclasses.replace(answer, status="doubtful", text=text, brief=brief)
        undecided = drawn == "unknown" and answer.status != "good"  # whether it is bad, too
        status = answer.status if undecided else worst([answer.status, drawn])
        if answer.name == LIFT:
            text, wide = f"{answer.text} {stated}", answer.limit + against
            brief = f"{answer.brief}; {percent(trips)} of varied strides trip" if answer.brief else ""
            return dataclasses.replace(answer, status=status, text=text, limit=wide, brief=brief)
        if answer.name == HELP and status != answer.status:
            text = answer.text.replace(ENOUGH, UNSURE)
            return dataclasses.replace(answer, status=status, text=text, brief="")
        return answer

    return tuple(map(judged, answers))


def _judged(share: float, draws: int, limit: tuple[float, float]) -> tuple[Status, str]:
    """The status of a share of draws, known where it is that of both bounds, and what else would decide."""

    def decided(number: int) -> bool:
        low, high = bounds(share, number)
        return at_most(low, limit) == at_most(high, limit)

    if decided(draws):
        return at_most(share, limit), ""
    needed = bisect_left(range(MOST_DRAWS), True, draws, key=decided)
    if needed < MOST_DRAWS:
        return "unknown", f": too few to decide; draw {needed} to decide if the share stays the same"
    return "doubtful", ": so close to a limit that no number of draws decides"


def of_draws(share: float, draws: int, one: str, many: str) -> str:
    """How many of some draws do something, and the share that chance in so few draws leaves open."""
    count, (low, high) = round(share * draws), bounds(share, draws)
    if not count:
        return f"none {one} (with more draws up to {percent(high)})"
    sure = f"with more draws {percent(low).removesuffix(' %')} to {percent(high)}"
    return f"{count} ({percent(share)}) {one if count == 1 else many} ({sure})"


def bounds(share: float, draws: int) -> tuple[float, float]:
    """Exact binomial bounds of a share of draws [-] (Clopper & Pearson 1934, doi 10.1093/biomet/26.4.404)."""
    from scipy.special import betaincinv  # slow to import; a verdict without draws does without

    k = share * draws
    low = float(betaincinv(k, draws - k + 1.0, 1.0 - SURE)) if share > 0.0 else 0.0
    return low, float(betaincinv(k + 1.0, draws - k, SURE)) if share < 1.0 else 1.0


def percent(share: float) -> str:
    """A share [-] for people: whole percent from 10 % on, two digits below."""
    return f"{100.0 * share:.0f} %" if share >= 0.0995 else f"{100.0 * share:.2g} %"

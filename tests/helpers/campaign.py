"""Campaigns: many random or damaged cases; the suite runs a seeded slice, the nightly script all of them."""

import datetime
import os
import random
from collections.abc import Iterable
from typing import Any

import pytest

NIGHTLY = bool(os.environ.get("AFO_SIM_NIGHTLY"))
# of damaged files: a fresh one a day, the last digit for the ten of a night
SEED = int(os.environ.get("AFO_SIM_FUZZ_SEED") or f"{datetime.date.today():%Y%m%d}0")

DAYS = 8  # on one of so many, by its name, a slow test runs in the whole suite
CASES = 4  # of a test, that the whole suite runs of more a day


def size(slice_: int, whole: int) -> int:
    """How many cases to run: a slice in the suite, the whole campaign at night."""
    return whole if NIGHTLY else slice_


def sampled(cases: Iterable[Any], most: int) -> list[Any]:
    """Near-equal cases: as many as the suite runs, others each day, in their order; all at night."""
    told = list(cases)
    if NIGHTLY or len(told) <= most:
        return told
    return [told[k] for k in sorted(random.Random(SEED).sample(range(len(told)), most))]


def of_other_days(items: Iterable[pytest.Item]) -> set[pytest.Item]:
    """What the suite leaves to other days: slow tests but one of DAYS, of a test's cases all but CASES.

    Cases of a slow test have the same days, since what they share is often what takes the time.
    """
    if NIGHTLY:
        return set()
    left_out, cases = set(), dict[str, list[pytest.Item]]()
    for item in items:
        name = item.nodeid.partition("[")[0]
        if item.get_closest_marker("slow") and random.Random(f"{SEED} {name}").random() > 1.0 / DAYS:
            left_out.add(item)
        elif name != item.nodeid:
            cases.setdefault(name, []).append(item)
    for name, each in cases.items():
        drawn = random.Random(f"{SEED} {name}").sample(range(len(each)), max(len(each) - CASES, 0))
        left_out |= {each[k] for k in drawn}
    return left_out


def nightly(reason: str) -> Any:
    """A mark of what runs at night alone, and why the day can do without it."""
    return pytest.mark.skipif(not NIGHTLY, reason=f"{reason}: at night")

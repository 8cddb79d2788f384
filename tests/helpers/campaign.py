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

DAYS = 4  # on one of so many, by its name, a slow test runs in the whole suite


def size(slice_: int, whole: int) -> int:
    """How many cases to run: a slice in the suite, the whole campaign at night."""
    return whole if NIGHTLY else slice_


def sampled(cases: Iterable[Any], most: int) -> list[Any]:
    """Near-equal cases: as many as the suite runs, others each day, in their order; all at night."""
    told = list(cases)
    if NIGHTLY or len(told) <= most:
        return told
    return [told[k] for k in sorted(random.Random(SEED).sample(range(len(told)), most))]


def of_the_day(test: str) -> bool:
    """Whether a slow test runs today, by its name: on one day of DAYS, and every night."""
    return NIGHTLY or random.Random(f"{SEED} {test}").random() < 1.0 / DAYS


def nightly(reason: str) -> Any:
    """A mark of what runs at night alone, and why the day can do without it."""
    return pytest.mark.skipif(not NIGHTLY, reason=f"{reason}: at night")

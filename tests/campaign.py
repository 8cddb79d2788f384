"""Campaigns: many random or damaged cases; the suite runs a seeded slice, the nightly script all of them."""

import os

NIGHTLY = bool(os.environ.get("AFO_SIM_NIGHTLY"))


def size(slice_: int, whole: int) -> int:
    """How many cases to run: a slice in the suite, the whole campaign at night."""
    return whole if NIGHTLY else slice_

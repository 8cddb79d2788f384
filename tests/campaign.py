"""Campaigns: many random or damaged cases, of which the suite runs a seeded slice and the nightly script all."""

import os

NIGHTLY = bool(os.environ.get("AFO_SIM_NIGHTLY"))


def size(slice_: int, whole: int) -> int:
    """How many cases to run: a slice in the suite, the whole campaign at night."""
    return whole if NIGHTLY else slice_

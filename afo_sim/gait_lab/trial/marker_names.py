"""Markers' names read: prefix, side, and the place in lower case without punctuation."""

import re
from collections.abc import Iterator, Sequence

from afo_sim.gait_lab.trial.choices import SIDES

Reading = tuple[str, str]  # side, or "" for none; the rest of the name
# Computed signals that a C3D keeps among its points.
COMPUTED = re.compile(r"(angle|moment|force|power|grf|scale|score)s?\d*$")


def plain(name: str) -> str:
    """A name in lower case without `subject:` and punctuation."""
    return re.sub("[^a-z0-9]", "", name.split(":")[-1].lower())


def readings(names: Sequence[str]) -> dict[str, list[Reading]]:
    """Ways to read each of a file's names, the likeliest first; computed signals are left out.

    Units: returns [(side, rest), …].
    """
    markers = [name for name in names if not COMPUTED.search(plain(name))]
    start = _common_start([_bare(name) for name in markers])
    return {name: list(_readings(_bare(name).removeprefix(start))) for name in markers}


def _readings(bare: str) -> Iterator[Reading]:
    whole = plain(bare)
    yield "", whole
    for side in SIDES:
        if whole.startswith(side):
            yield side, whole.removeprefix(side)
    for side in SIDES:
        if whole.startswith(side[0]):
            yield side, whole[1:]
    for side in SIDES:
        if whole.endswith(side):
            yield side, whole.removesuffix(side)
    end = re.search(r"(?:[^A-Za-z0-9]([RrLl])|(?<=[a-z0-9])([RL]))$", bare)
    if end:
        yield {"r": "right", "l": "left"}[(end[1] or end[2]).lower()], whole[:-1]


def _bare(name: str) -> str:
    return name.strip().split(":")[-1]


def _common_start(names: Sequence[str]) -> str:
    """What all names begin with, to a separator; never a side's letter or word."""
    if len(names) <= 3:
        return ""
    first, last = min(names), max(names)  # what these two share, all share
    same = next(
        (k for k, pair in enumerate(zip(first, last, strict=False)) if len(set(pair)) > 1), len(first)
    )
    found = re.match(r".*[_.\- ]", first[:same])
    return found[0] if found and plain(found[0]) not in ("r", "l", *SIDES) else ""

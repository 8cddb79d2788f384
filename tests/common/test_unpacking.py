"""Compressed data unpack to what they were, and to no more than is allowed."""

import zlib
from collections.abc import Callable

import pytest

from afo_sim.common import unpack

PLAIN = bytes(range(256)) * 40


@pytest.mark.parametrize("most", [len(PLAIN), len(PLAIN) + 1, 10**9])
def test_data_come_back(most: int) -> None:
    assert unpack(zlib.compress(PLAIN), most) == PLAIN


@pytest.mark.parametrize(
    "damaged",
    [
        lambda: zlib.compress(PLAIN + b"x"),
        lambda: zlib.compress(bytes(2**28)),
        lambda: zlib.compress(PLAIN)[:-1],
        lambda: b"",
        lambda: b"no such data",
    ],
    ids=["one byte more", "256 MB of 260 kB", "cut short", "empty", "something else"],
)
def test_what_is_larger_or_damaged_is_refused(damaged: Callable[[], bytes]) -> None:
    with pytest.raises((ValueError, zlib.error)):
        unpack(damaged(), len(PLAIN))

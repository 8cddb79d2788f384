"""Memory that stays flat over many cases."""

import ctypes
import functools
import sys

M_MMAP_THRESHOLD = -3  # malloc.h of glibc
LARGE = 1 << 20  # bytes


@functools.cache
def keep_flat() -> None:
    """Have glibc give large blocks back as soon as they are freed; elsewhere nothing.

    It raises the size from which it does so whenever such a block is freed, up to 32 MB. Rows of hundreds of
    steps then lie between small things that live longer, and the heap grows by some 60 kB a case.
    """
    if sys.platform != "linux":
        return
    try:
        ctypes.CDLL(None).mallopt(M_MMAP_THRESHOLD, LARGE)
    except (AttributeError, OSError):  # another C library
        return

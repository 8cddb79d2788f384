"""Memory that stays flat over many cases."""

import ctypes
import functools
import gc
import sys

M_MMAP_THRESHOLD = -3  # malloc.h of glibc
LARGE = 1 << 20  # bytes


@functools.cache
def keep_flat() -> None:
    """Let the collector leave alone what is there, and glibc give large blocks back when they are freed.

    A collection looks at everything that was ever imported, for a few objects of a case. glibc raises the
    size from which it gives back whenever such a block is freed, up to 32 MB. Rows of hundreds of steps then
    lie between small things that live longer, and the heap grows by some 60 kB a case.
    """
    gc.freeze()
    if sys.platform != "linux":
        return
    try:
        ctypes.CDLL(None).mallopt(M_MMAP_THRESHOLD, LARGE)
    except (AttributeError, OSError):  # another C library
        return

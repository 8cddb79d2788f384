"""Scalar kernels in SI units: no MuJoCo, no files. They run as plain Python and inside numba.

`register_jitable` leaves a kernel an ordinary Python function, and lets compiled code call it.
Kernels are total: they raise nothing, and a NaN that goes in comes out. `Any` in their signatures is an
address of doubles to compiled code, an array or a list to Python.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

"""physics → MuJoCo's actuator callbacks: parameter slots, compiled functions, and their installation.

`Any` is in kernels mjModel and mjData (m, d) or an address of doubles; elsewhere what numba and LLVM compile.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

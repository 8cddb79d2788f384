"""Parameter sweeps: many cases of one scenario, and looking at what came out.

import afo_sim.study
frame = afo_sim.study.read("sweeps/a").to_pandas()
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from afo_sim.study.results import Results as Results
    from afo_sim.study.results import read as read

_PUBLIC = {"Results": "results", "read": "results"}
__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    # Imported when first asked for, as in the package above.
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"afo_sim.study.{_PUBLIC[name]}"), name)

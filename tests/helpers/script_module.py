"""Scripts as modules."""

import importlib
import sys
from types import ModuleType

from documents import ROOT

FOLDER = str(ROOT / "scripts")


def load_script(name: str) -> ModuleType:
    """scripts/NAME.py, which may import what lies beside it."""
    if FOLDER not in sys.path:
        sys.path.append(FOLDER)
    return importlib.import_module(name)

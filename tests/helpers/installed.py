"""Whether a package of an extra is there, asked without importing it."""

import importlib.util
from typing import Any

import pytest


def needs(*packages: str) -> Any:
    """A mark: the test is skipped where a package is missing."""
    missing = [package for package in packages if importlib.util.find_spec(package) is None]
    return pytest.mark.skipif(bool(missing), reason=f"{', '.join(missing)} is not installed")

"""The libraries that an installation may leave out, and the sentence where a missing one is needed.

The extras are those of `pyproject.toml`; a test holds the two tables against each other.
"""

import importlib
import importlib.util

from afo_sim.common.errors import InputError
from afo_sim.common.open_types import Foreign

# {extra: the packages, as they are imported, that it brings}
EXTRAS = {
    "legs": ("yourdfpy", "trimesh", "lxml"),
    "study": ("SALib", "cma", "pandas", "xarray", "distributed"),
    "rl": ("dm_control", "dm_env", "gymnasium"),
    "show": ("matplotlib", "jinja2"),
    "rerun": ("rerun",),
    "studio": ("starlette", "uvicorn", "websockets"),
    "compile": ("numba",),
}
_EXTRA_OF = {package: extra for extra, packages in EXTRAS.items() for package in packages}
_WITH = {
    "labmaze": "dm_control",
    "rerun_cli": "rerun",
    "mpl_toolkits": "matplotlib",
    "PIL": "matplotlib",
    "dask": "distributed",
    "llvmlite": "numba",
}
NOTES = {
    "dm_control": "; on Python 3.13 its part labmaze has no wheel: take Python 3.11 or 3.12",
    "numba": "; it compiles your own laws, and the package's own code after a change",
}


class MissingExtra(InputError, ImportError):
    """A library of an extra is not installed; `package` is its name, `extra` what brings it."""

    def __init__(self, package: str, extra: str):
        self.package, self.extra = package, extra
        how = f"pip install 'afo-sim[{extra}]', or -e '.[{extra}]' in a clone"
        super().__init__(f"this needs the library {package}: {how}{NOTES.get(package, '')}")


def missing_extra(error: BaseException) -> MissingExtra | None:
    """The sentence for an import that failed; None where no extra would mend it."""
    if isinstance(error, MissingExtra):
        return error
    if not isinstance(error, ModuleNotFoundError):
        return None
    package = (error.name or "").partition(".")[0]
    package = _WITH.get(package, package)
    return MissingExtra(package, _EXTRA_OF[package]) if package in _EXTRA_OF else None


def installed(package: str) -> bool:
    """Whether a library of an extra is there; it is not imported."""
    try:
        return importlib.util.find_spec(package) is not None
    except (ImportError, ValueError):
        return False


def optional(module: str) -> Foreign:
    """A module of a library that an extra brings, imported when it is asked for."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        if (missing := missing_extra(error)) is None:
            raise
        raise missing from None

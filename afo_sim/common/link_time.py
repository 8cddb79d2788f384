"""Link-time optimisation of what numba compiles: a called function is optimised with its last caller alone.

By itself numba optimises each function and makes machine code of it, and does both again in every function
that calls it. Here a called function stays what numba wrote of it, until all that calls it is linked.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core.codegen import JITCodeLibrary, JITCPUCodegen


class CalledLibrary(JITCodeLibrary):
    """LLVM's code of a function that only compiled functions call."""

    def add_linking_library(self, library: Any) -> None:
        """Note a called function's library; it is linked when this one is, and not optimised before."""
        self._linking_libraries.append(library)

    def get_pointer_to_function(self, name: str) -> int:
        """0: no machine code."""
        return 0

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_specific(self) -> None:
        pass


class CalledCodegen(JITCPUCodegen):
    """The maker of `CalledLibrary`."""

    _library_class = CalledLibrary

    def _add_module(self, module: Any) -> None:
        pass

    def set_env(self, env_name: str, env: Any) -> None:
        """Nothing: it would be written into machine code."""


@contextmanager
def only_called(context: Any) -> Iterator[None]:
    """A block in which numba compiles called functions alone; who calls them brings a library."""
    own = context._internal_codegen
    context._internal_codegen = CalledCodegen("called functions")
    try:
        yield
    finally:
        context._internal_codegen = own

"""From Python to machine code, by numba.

numba's own C callbacks print what a function raises, and go on; for that they call functions of numba, and
code that calls them cannot be loaded without it. Here a function says itself what becomes of an exception.

By itself numba optimises each function and makes machine code of it, and does both again in every function
that calls it. Here a called function stays what numba wrote of it, until all that calls it is linked: it is
optimised with its last caller alone.

Code is made for any processor of the platform, not for this one: it is kept, and shipped. numba allows LLVM
neither to fuse nor to reorder sums and products, so every processor computes the same bits.
"""

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import compiler
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from afo_sim.common.machine_code import Code, Compiled, start_numba


class AnyProcessor(JITCPUCodegen):
    """The maker of machine code that uses what all processors of the platform have."""

    def _get_host_cpu_name(self) -> str:
        return "generic"

    def _get_host_cpu_features(self) -> str:
        return ""


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


_Raised = Callable[[Any, Any], None]  # (builder, arguments): writes what is done after an exception


@global_compiler_lock
def compile_all(functions: Sequence[Callable[..., Any]], signature: Any, raised: _Raised) -> Compiled:
    """Compile functions of one signature."""
    start_numba()
    collects = gc.isenabled()
    gc.disable()  # Python's collector would search numba's objects again and again
    try:
        compiled = [_compile(function, signature, raised) for function in functions]
    finally:
        if collects:
            gc.enable()
    return [_code(*each) for each in compiled], any(library.has_dynamic_globals for _, library in compiled)


def _compile(function: Callable[..., Any], signature: Any, raised: _Raised) -> tuple[str, Any]:
    """Symbol and library of a function as a C function."""
    flags = compiler.Flags()
    cpu_target.options.parse_as_flags(flags, {"nopython": True, "error_model": "numpy"})
    flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
    flags.no_compile = True  # before `_c_function` is there
    context = cpu_target.target_context
    library = AnyProcessor("machine code").create_library(function.__qualname__)
    library.enable_object_caching()
    with only_called(context):
        types, kinds = cpu_target.typing_context, (signature.args, signature.return_type)
        found = compiler.compile_extra(types, context, function, *kinds, flags, {}, library)
        library.add_ir_module(_c_function(context, found.fndesc, raised))
        library.finalize()
    return found.fndesc.llvm_cfunc_wrapper_name, library


def _c_function(context: Any, described: Any, raised: _Raised) -> Any:
    """A module with a C function that calls a compiled one."""
    module = context.create_module("callback")
    convention, signature = context.call_conv, (described.restype, described.argtypes)
    compiled = ir.Function(module, convention.get_function_type(*signature), described.llvm_func_name)
    arguments = [context.get_value_type(kind) for kind in described.argtypes]
    form = ir.FunctionType(context.get_value_type(described.restype), arguments)
    function = ir.Function(module, form, described.llvm_cfunc_wrapper_name)
    builder = ir.IRBuilder(function.append_basic_block("entry"))
    status, found = convention.call_function(builder, compiled, *signature, function.args)
    with builder.if_then(status.is_error, likely=False):
        raised(builder, function.args)
    builder.ret(found)
    return module


def _code(symbol: str, library: Any) -> Code:
    _, _, (binary, bitcode) = library.serialize_using_object_code()
    module = llvm.parse_bitcode(bitcode)
    outside = [v.name for v in (*module.functions, *module.global_variables) if v.is_declaration]
    return Code(symbol, binary, tuple(name for name in outside if not name.startswith("llvm.")))

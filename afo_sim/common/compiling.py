"""From Python to machine code, by numba.

numba's C callback prints what its function raises, and goes on; for that it calls functions of Python and
numba, and code that calls them cannot be loaded without them. Here a function gives another result instead.

Code is made for any processor of the platform, not for this one: it is kept, and shipped. numba allows LLVM
neither to fuse nor to reorder sums and products, so every processor computes the same bits. It finds what is
outside it relative to itself, so that a library of it is loaded without changes to its text.
"""

import gc
from collections.abc import Sequence

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, register_jitable

from afo_sim.common.machine_code import USER_KERNELS, Code, start, symbol, table_size
from afo_sim.common.open_types import Foreign, Function

_OF_THIS_PROCESS = "numba.dynamic.globals"  # names of addresses in it: nobody else has such a symbol


def compile_all(kind: str, functions: Sequence[Function], signature: Foreign, raised: Function) -> list[Code]:
    """Machine code of each function of a kind, as a C function of one signature.

    After an exception the result is that of `raised` of the same arguments, which compiled code may call.
    """
    start()
    collects = gc.isenabled()
    gc.disable()  # Python's collector would search numba's objects again and again
    try:
        guarded = [_guarded(function, raised, len(signature.args)) for function in functions]
        return [_compile(symbol(kind, k), function, signature) for k, function in enumerate(guarded)]
    finally:
        if collects:
            gc.enable()


def _guarded(function: Function, raised: Function, count: int) -> Function:
    """A function of so many arguments that raises nothing; numba compiles no callback of `*arguments`."""
    names = {"function": register_jitable(function), "raised": register_jitable(raised)}
    told = ", ".join(f"a{k}" for k in range(count))
    lines = "try:", f"  return function({told})", "except Exception:", f"  return raised({told})"
    exec("\n ".join((f"def guarded({told}):", *lines)), names)
    return names["guarded"]


def _compile(symbol: str, function: Function, signature: Foreign) -> Code:
    callback = numba.cfunc(signature, nopython=True, error_model="numpy")(function)
    module = llvm.parse_assembly(callback.inspect_llvm())
    own: list[Foreign] = []
    needs: list[Foreign] = []
    for each in (*module.functions, *module.global_variables):
        (needs if each.is_declaration or each.name.startswith(_OF_THIS_PROCESS) else own).append(each)
    for each in own:
        each.linkage = "internal"
    entry = module.get_function(callback.native_name)
    entry.linkage, entry.name = "external", symbol
    target = llvm.Target.from_triple(llvm.get_process_triple())
    any_processor = target.create_target_machine(opt=3, reloc="pic")
    outside = tuple(each.name for each in needs if not each.name.startswith("llvm."))
    return Code(symbol, any_processor.emit_object(module), outside)


@intrinsic
def user_kernels(typing_context: Foreign) -> Foreign:
    """Where the table of a user's own kernels begins."""

    def generate(context: Foreign, builder: Foreign, signature: Foreign, arguments: Foreign) -> Foreign:
        kind = ir.ArrayType(ir.IntType(64), table_size())
        table = builder.module.globals.get(USER_KERNELS) or ir.GlobalVariable(
            builder.module, kind, USER_KERNELS
        )
        return builder.bitcast(table, ir.IntType(64).as_pointer())

    return types.CPointer(types.int64)(), generate


@intrinsic
def two_numbers(typing_context: Foreign) -> Foreign:
    """A pointer to two numbers, which live as long as the calling function runs."""

    def generate(context: Foreign, builder: Foreign, signature: Foreign, arguments: Foreign) -> Foreign:
        return cgutils.alloca_once(builder, ir.DoubleType(), size=2)

    return types.CPointer(types.float64)(), generate


_NUMBERS = types.CPointer(types.float64)
# x, y, z, row and place in it, memory and place in it, where to write
_TAKEN = *[types.float64] * 3, _NUMBERS, types.int64, _NUMBERS, types.int64, _NUMBERS


def user_signature() -> Foreign:
    """Of a kernel of a user's own."""
    return types.float64(*_TAKEN)


@intrinsic
def call_kernel(
    typing_context: Foreign, address: Foreign, x: Foreign, y: Foreign, z: Foreign, u: Foreign, c: Foreign,
    act: Foreign, a: Foreign, out: Foreign,
) -> Foreign:  # fmt: skip
    """Call such a kernel by its address."""

    def generate(context: Foreign, builder: Foreign, signature: Foreign, arguments: Foreign) -> Foreign:
        kinds = [context.get_value_type(each) for each in _TAKEN]
        function = ir.FunctionType(ir.DoubleType(), kinds).as_pointer()
        return builder.call(builder.inttoptr(arguments[0], function), arguments[1:])

    return types.float64(types.int64, *_TAKEN), generate

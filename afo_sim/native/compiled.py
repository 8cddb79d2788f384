"""The callbacks as machine code: compiled once, then taken from the user's cache folder.

Compiling takes seconds, and loading what was compiled takes milliseconds. The code in the cache knows nothing
of the process that compiled it: `mju_error` is a symbol, which each process resolves for itself. It is loaded
into an engine of its own, so that its names cannot meet those of functions that numba compiles later. Where
one symbol is unknown, LLVM leaves all calls of an object file at address 0, without a word: the symbols that
the code needs stand beside it, and are looked up before.

A file of the cache is found by everything that its code follows from: the sources of the rooms below,
MuJoCo's layout, the compilers, the processor and numba's settings.
"""

import ctypes
import functools
import hashlib
import os
import pathlib
import pickle
import platform
from typing import Any, NamedTuple

import llvmlite
import llvmlite.binding as llvm
import mujoco
import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.extending import intrinsic

from afo_sim.common import user_cache
from afo_sim.common.errors import CallbackError
from afo_sim.native.callbacks import define
from afo_sim.native.complaints import COMPLAINTS
from afo_sim.native.refuse import marked_only
from afo_sim.native.struct_layout import SIGNATURE


class Code(NamedTuple):
    """Machine code of one callback."""

    symbol: str
    binary: bytes  # object file
    needs: tuple[str, ...]  # symbols outside it


_KIND = "callbacks"
_PACKAGE = pathlib.Path(__file__).resolve().parents[1]
_ROOMS = ("common", "physics", "native")  # whose code is compiled, or makes what is
_ERROR = "afo_sim_mju_error"
_MJF_ACT = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)


def callbacks() -> tuple[Any, Any]:
    """C function pointers for MuJoCo: act_bias, act_dyn."""
    llvm.add_symbol(_ERROR, _address_of_mju_error())
    rtsys.initialize(cpu_target.target_context)  # the symbols of numba, which compiled code calls
    key = fingerprint()
    bias, dyn = (_loaded(code) for code in _stored(key) or _compile(key))
    return bias, dyn


def mujoco_library() -> pathlib.Path:
    """The MuJoCo shared library that the bindings have loaded (CallbackError where there is none)."""
    folder = pathlib.Path(mujoco.__file__).parent
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for found in sorted(folder.glob(pattern)):
            return found
    raise CallbackError(f"no MuJoCo library is found in {folder}")


def _address_of_mju_error() -> int:
    error = ctypes.CDLL(str(mujoco_library())).mju_error
    return ctypes.cast(error, ctypes.c_void_p).value or 0


@functools.cache
def _sources(package: pathlib.Path = _PACKAGE) -> str | None:
    """SHA-256 of the rooms' files; None where they are not there to be read."""
    found, files = hashlib.sha256(), sorted(p for room in _ROOMS for p in (package / room).rglob("*.py"))
    try:
        for path in files:
            content = path.read_bytes()
            found.update(f"{path.relative_to(package).as_posix()} {len(content)}\n".encode() + content)
    except OSError:
        return None
    return found.hexdigest() if files else None


_sources()  # now, with the import: a file that is edited later is not the code that runs


def fingerprint() -> str | None:
    """SHA-256 of everything that the machine code follows from; None where that is unknown."""
    sources = _sources()
    if sources is None:
        return None
    settings = sorted((name, value) for name, value in os.environ.items() if name.startswith("NUMBA_"))
    versions = (platform.python_version(), mujoco.__version__, numba.__version__, llvmlite.__version__)
    processor = cpu_target.target_context.codegen().magic_tuple()
    return hashlib.sha256(repr((sources, versions, processor, SIGNATURE, settings)).encode()).hexdigest()


def _stored(key: str | None) -> list[Code]:
    """The callbacks' code from the cache; none where it is missing, or cannot run in this process."""
    stored = user_cache.read(_KIND, key) if key else None
    codes = [Code(*code) for code in pickle.loads(stored)] if stored else []
    known = all(llvm.address_of_symbol(name) for code in codes for name in code.needs)
    return codes if known else []


def _compile(key: str | None) -> list[Code]:
    """Compile the callbacks, and store their code for later processes."""
    kernels = (marked_only(kernel, _fail) for kernel in define(_fail))
    compiled = [numba.cfunc(SIGNATURE, nopython=True, error_model="numpy")(kernel) for kernel in kernels]
    codes = [_code_of(function.native_name, function._library) for function in compiled]
    of_this_process = any(function._library.has_dynamic_globals for function in compiled)  # its addresses
    if key and not of_this_process:
        user_cache.write(_KIND, key, pickle.dumps([tuple(code) for code in codes]))
    return codes


def _code_of(symbol: str, library: Any) -> Code:
    _, _, (binary, bitcode) = library.serialize_using_object_code()
    module = llvm.parse_bitcode(bitcode)
    outside = [v.name for v in (*module.functions, *module.global_variables) if v.is_declaration]
    return Code(symbol, binary, tuple(name for name in outside if not name.startswith("llvm.")))


def _loaded(code: Code) -> Any:
    """The C function pointer of a callback."""
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code.binary))
    engine.finalize_object()
    pointer = _MJF_ACT(engine.get_function_address(code.symbol))
    pointer.engine = engine  # type: ignore[attr-defined]  # keeps the machine code alive
    return pointer


@intrinsic
def _fail(typing_context: Any, complaint: Any, actuator: Any) -> Any:
    """Call `mju_error`, which jumps out of the step; MuJoCo's bindings turn it into an exception."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        complaint, actuator = arguments
        texts = _constant(builder, [f"{text} %d".encode() for text in COMPLAINTS])
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t], var_arg=True), _ERROR
        )
        text = builder.bitcast(builder.gep(texts, [complaint.type(0), complaint]), cgutils.voidptr_t)
        builder.call(function, [text, builder.trunc(actuator, cgutils.int32_t)])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64), generate


def _constant(builder: Any, texts: list[bytes]) -> Any:
    """A constant array of texts of one length, each ended by zeros."""
    width = max(map(len, texts)) + 1
    rows = [cgutils.make_bytearray(text.ljust(width, b"\0")) for text in texts]
    table = ir.Constant(ir.ArrayType(rows[0].type, len(rows)), rows)
    return cgutils.global_constant(builder, "complaints", table)

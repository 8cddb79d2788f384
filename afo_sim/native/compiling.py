"""The callbacks from Python to machine code; what a kernel raises is a complaint like others."""

import ctypes
from typing import Any

import numpy as np
from llvmlite import ir
from mujoco.introspect.ast_nodes import ArrayType, PointerType
from numba import from_dtype, types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    lower_setattr_generic,
    models,
    overload,
    register_model,
)

from afo_sim.common import Code, compiling
from afo_sim.native.air_block import BLOCK, block
from afo_sim.native.callbacks import define
from afo_sim.native.error_codes import COMPLAINTS, MJU_ERROR, RAISED
from afo_sim.native.planar import walk_on
from afo_sim.native.refuse import marked_only
from afo_sim.native.struct_layout import PLACES, READ, c_type, declarations
from afo_sim.physics import register_all


class StructPointer(types.Opaque):
    """numba type: a pointer to the MuJoCo struct `name`."""

    def __init__(self, name: str):
        self.struct = name
        super().__init__(name=f"{name}*")


register_model(StructPointer)(models.OpaqueModel)


def _field(struct: str, name: str) -> tuple[int, bool, Any] | None:
    """(number in READ, whether to load rather than take the address, numba type) of a field."""
    if (struct, name) not in READ:
        return None
    number, declared = READ.index((struct, name)), declarations(struct)[name].type
    if isinstance(declared, PointerType | ArrayType):
        element = from_dtype(np.dtype(c_type(declared.inner_type)))
        return number, isinstance(declared, PointerType), types.CPointer(element)
    if issubclass(c_type(declared), ctypes.Structure):
        return number, False, StructPointer(declared.name.rstrip("_"))
    return number, True, from_dtype(np.dtype(c_type(declared)))


@infer_getattr
class _StructAttributes(AttributeTemplate):
    key = StructPointer

    def generic_resolve(self, typ: Any, attr: str) -> Any:
        field = _field(typ.struct, attr)
        return field[2] if field else None


@lower_getattr_generic(StructPointer)
def _lower_getattr(context: Any, builder: Any, typ: Any, value: Any, attr: str) -> Any:
    pointer, load = _place(context, builder, typ, value, attr)
    return builder.load(pointer) if load else pointer


@lower_setattr_generic(StructPointer)
def _lower_setattr(context: Any, builder: Any, signature: Any, values: Any, attr: str) -> None:
    pointer, _ = _place(context, builder, signature.args[0], values[0], attr)
    builder.store(values[1], pointer)


def _place(context: Any, builder: Any, typ: Any, value: Any, attr: str) -> tuple[Any, bool]:
    """Where a field stands, as a pointer to what it is; whether it is to be loaded from there."""
    field = _field(typ.struct, attr)
    assert field is not None
    number, load, result = field
    table = builder.module.globals.get(PLACES)
    if table is None:
        table = ir.GlobalVariable(builder.module, ir.ArrayType(ir.IntType(64), len(READ)), PLACES)
    offset = builder.load(cgutils.gep_inbounds(builder, table, 0, number))
    offset.set_metadata("invariant.load", builder.module.add_metadata([]))
    pointer = cgutils.pointer_add(builder, value, offset)
    llvm_type = context.get_value_type(result)
    return builder.bitcast(pointer, llvm_type.as_pointer() if load else llvm_type), load


_MODEL, _DATA, _NUMBERS = StructPointer("mjModel"), StructPointer("mjData"), types.CPointer(types.float64)
SIGNATURE = types.float64(_MODEL, _DATA, types.int32)
PLANAR = types.int64(_MODEL, _DATA, _NUMBERS, _NUMBERS, _NUMBERS, types.int64, types.int64, types.int64)


def compile_callbacks() -> list[Code]:
    """Machine code of act_bias and act_dyn."""
    kernels = [marked_only(kernel, _fail) for kernel in define(_fail)]
    register_all()
    return compiling.compile_all("callbacks", kernels, SIGNATURE, _raised)


def compile_planar() -> list[Code]:
    """Machine code of the steps of a planar walker."""
    register_all()
    return compiling.compile_all("planar", [walk_on], PLANAR, lambda *arguments: -2 - RAISED)


def _raised(m: Any, d: Any, i: int) -> float:
    """What a callback gives after an exception, as in a law of one's own: a complaint."""
    _fail(RAISED, i)
    return 0.0


@overload(block, inline="always")
def _on_the_stack() -> Any:
    """Tell numba that `block` is room on the stack of the function that asks for it."""
    return lambda: _room()


@intrinsic
def _room(typing_context: Any) -> Any:
    """A pointer to the numbers of a block, not set, which live as long as the calling function runs."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        room = cgutils.alloca_once(builder, ir.DoubleType(), size=BLOCK)
        room.align = 64  # a line of the cache
        return room

    return types.CPointer(types.float64)(), generate


@intrinsic
def _fail(typing_context: Any, complaint: Any, actuator: Any) -> Any:
    """Call `mju_error`, which jumps out of the step; MuJoCo's bindings turn it into an exception."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        complaint, actuator = arguments
        _complain(builder, complaint, builder.trunc(actuator, cgutils.int32_t))
        return context.get_dummy_value()

    return types.void(types.int64, types.int64), generate


def _complain(builder: Any, complaint: Any, actuator: Any) -> None:
    texts = _constant(builder, [f"{text} %d".encode() for text in COMPLAINTS])
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(ir.VoidType(), [cgutils.voidptr_t], var_arg=True), MJU_ERROR
    )
    text = builder.bitcast(builder.gep(texts, [complaint.type(0), complaint]), cgutils.voidptr_t)
    builder.call(function, [text, actuator])


def _constant(builder: Any, texts: list[bytes]) -> Any:
    """A constant array of texts of one length, each ended by zeros."""
    width = max(map(len, texts)) + 1
    rows = [cgutils.make_bytearray(text.ljust(width, b"\0")) for text in texts]
    table = ir.Constant(ir.ArrayType(rows[0].type, len(rows)), rows)
    return cgutils.global_constant(builder, "complaints", table)

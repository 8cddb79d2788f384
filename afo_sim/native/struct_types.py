"""Fields of mjModel and mjData inside numba.

    def bias(m, d, i):
        return m.actuator_user[m.nuser_actuator * i] * d.actuator_length[i]

compiles with SIGNATURE. The numba type's name contains the layout, so that compiled code of another MuJoCo
can never be taken for this one's.
"""

import ctypes
from typing import Any

from mujoco.introspect.ast_nodes import ArrayType, PointerType, ValueType
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models, register_default
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr

from afo_sim.native.struct_layout import c_struct, c_type, declarations, layout_hash

_NUMBA_TYPES = {
    ctypes.c_double: types.float64,
    ctypes.c_float: types.float32,
    ctypes.c_int: types.int32,
    ctypes.c_int64: types.int64,
    ctypes.c_uint64: types.uint64,
    ctypes.c_uint: types.uint32,
    ctypes.c_bool: types.uint8,
    ctypes.c_ubyte: types.uint8,
    ctypes.c_char: types.uint8,
}


class StructPointer(types.Opaque):
    """numba type: a pointer to the MuJoCo struct `name`."""

    def __init__(self, name: str):
        self.struct = name
        super().__init__(name=f"{name}*[{layout_hash(name)}]")


register_default(StructPointer)(models.OpaqueModel)


def _field(struct: str, name: str) -> tuple[int, bool, Any] | None:
    """(offset, whether to load rather than take the address, numba type) of a field."""
    declaration = declarations(struct).get(name)
    if declaration is None:
        return None
    offset = getattr(c_struct(struct), name).offset
    declared = declaration.type
    if isinstance(declared, PointerType | ArrayType):
        element = _NUMBA_TYPES.get(c_type(declared.inner_type))
        load = isinstance(declared, PointerType)
        return (offset, load, types.CPointer(element)) if element is not None else None
    if isinstance(declared, ValueType):
        scalar = _NUMBA_TYPES.get(c_type(declared))
        if scalar is not None:
            return offset, True, scalar
        return offset, False, StructPointer(declared.name.rstrip("_"))
    return None


@infer_getattr
class _StructAttributes(AttributeTemplate):
    key = StructPointer

    def generic_resolve(self, typ: Any, attr: str) -> Any:
        field = _field(typ.struct, attr)
        return field[2] if field else None


@lower_getattr_generic(StructPointer)
def _lower_getattr(context: Any, builder: Any, typ: Any, value: Any, attr: str) -> Any:
    field = _field(typ.struct, attr)
    assert field is not None
    offset, load, result = field
    pointer = cgutils.pointer_add(builder, value, offset)
    llvm_type = context.get_value_type(result)
    if load:
        return builder.load(builder.bitcast(pointer, llvm_type.as_pointer()))
    return builder.bitcast(pointer, llvm_type)


SIGNATURE = types.float64(StructPointer("mjModel"), StructPointer("mjData"), types.int32)

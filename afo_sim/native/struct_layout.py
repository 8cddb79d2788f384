"""Fields of mjModel and mjData inside numba, laid out as the installed MuJoCo declares them.

    @numba.cfunc(SIGNATURE)
    def bias(m, d, i):
        return m.actuator_user[m.nuser_actuator * i] * d.actuator_length[i]

Declaration order and types come from `mujoco.introspect`, the C ABI's rules from ctypes; nothing is
hand-counted. `verify` compares the result with the bindings' own pointers. The numba type's name
contains the layout, so that compiled code of another MuJoCo can never be taken for this one's.
"""

import ctypes
import functools
import hashlib
from typing import Any

import mujoco
import numpy as np
from mujoco.introspect import enums, structs
from mujoco.introspect.ast_nodes import ArrayType, PointerType, ValueType
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models, register_default
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr

from afo_sim.common.errors import CallbackError

_C_TYPES: dict[str, Any] = {
    "mjtNum": ctypes.c_double if np.dtype(mujoco.MJTNUM_DTYPE).itemsize == 8 else ctypes.c_float,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_bool,
    "mjtSize": ctypes.c_int64,
    "double": ctypes.c_double,
    "float": ctypes.c_float,
    "int": ctypes.c_int,
    "unsigned int": ctypes.c_uint,
    "unsigned": ctypes.c_uint,
    "char": ctypes.c_char,
    "unsigned char": ctypes.c_ubyte,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_void_p,
    "uint64_t": ctypes.c_uint64,
    "int64_t": ctypes.c_int64,
    "uint32_t": ctypes.c_uint32,
    "int32_t": ctypes.c_int32,
    "uint16_t": ctypes.c_uint16,
    "bool": ctypes.c_bool,
    "void": None,
}
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


def _ctype(declared: Any) -> Any:
    if isinstance(declared, PointerType):
        return ctypes.c_void_p
    if isinstance(declared, ArrayType):
        element = _ctype(declared.inner_type)
        for extent in reversed(declared.extents):
            element = element * extent
        return element
    if isinstance(declared, ValueType):
        name = declared.name
        if name in _C_TYPES:
            return _C_TYPES[name]
        if name.rstrip("_") in structs.STRUCTS:
            return _struct(name.rstrip("_"))
        if name in enums.ENUMS:
            return ctypes.c_int
        raise CallbackError(f"MuJoCo {mujoco.__version__} declares the unknown C type {name!r}")
    union = type(declared).__name__ == "AnonymousUnionDecl"
    members = [(field.name, _ctype(field.type)) for field in declared.fields]
    return type("anonymous", (ctypes.Union if union else ctypes.Structure,), {"_fields_": members})


@functools.cache
def _struct(name: str) -> Any:
    members = [(field.name, _ctype(field.type)) for field in structs.STRUCTS[name].fields]
    return type(name, (ctypes.Structure,), {"_fields_": members})


@functools.cache
def _declarations(name: str) -> dict[str, Any]:
    return {field.name: field for field in structs.STRUCTS[name].fields}


def _layout_hash(name: str) -> str:
    layout = _struct(name)
    text = ";".join(f"{n}:{getattr(layout, n).offset}:{t}" for n, t in layout._fields_)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class StructPointer(types.Opaque):
    """numba type: a pointer to the MuJoCo struct `name`."""

    def __init__(self, name: str):
        self.struct = name
        super().__init__(name=f"{name}*[{_layout_hash(name)}]")


register_default(StructPointer)(models.OpaqueModel)


def _field(struct: str, name: str) -> tuple[int, bool, Any] | None:
    """(offset, whether to load rather than take the address, numba type) of a field."""
    declaration = _declarations(struct).get(name)
    if declaration is None:
        return None
    offset = getattr(_struct(struct), name).offset
    declared = declaration.type
    if isinstance(declared, PointerType | ArrayType):
        element = _NUMBA_TYPES.get(_ctype(declared.inner_type))
        load = isinstance(declared, PointerType)
        return (offset, load, types.CPointer(element)) if element is not None else None
    if isinstance(declared, ValueType):
        scalar = _NUMBA_TYPES.get(_ctype(declared))
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


@functools.cache
def verify() -> int:
    """Compare every field of a probe model with the bindings' own view of it.

    Returns
    -------
    int : number of fields compared

    Raises
    ------
    CallbackError
        The installed MuJoCo lays its structs out differently from what it declares.
    """
    model = mujoco.MjModel.from_xml_string(_PROBE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    compared = 0
    for name, owner in (("mjModel", model), ("mjData", data)):
        raw = _struct(name).from_address(owner._address)
        for field in _declarations(name):
            seen, stored = getattr(owner, field, None), getattr(raw, field)
            if isinstance(seen, np.ndarray) and seen.size:
                if stored is None:  # an arena array that is not allocated: a stand-in is shown
                    continue
                stored = stored if isinstance(stored, int) else ctypes.addressof(stored)
                seen = seen.ctypes.data
            elif not (type(seen) in (int, float) and type(stored) in (int, float)):
                continue
            if seen != stored:
                raise CallbackError(
                    f"MuJoCo {mujoco.__version__} does not lay out {name}.{field} as it declares; "
                    "native muscle callbacks would read the wrong memory. "
                    'Install a MuJoCo within this package\'s pins, or run with callback = "python".'
                )
            compared += 1
    return compared


_PROBE = """<mujoco><size nuserdata="1"/><worldbody><body><joint name="j"/><geom size=".1"/></body>
</worldbody><tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>
<actuator><general tendon="t" dyntype="user" gaintype="user" biastype="user" user="1"/></actuator>
</mujoco>"""

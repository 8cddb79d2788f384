"""Places of the fields of mjModel and mjData in memory, as the installed MuJoCo declares them.

Declaration order and types come from `mujoco.introspect`, the C ABI's rules from ctypes; nothing is
hand-counted. `verify` compares the result with the bindings' own pointers.
"""

import ctypes
import functools
import json
import pathlib
from typing import Any

import mujoco
import numpy as np
from mujoco.introspect import enums, structs
from mujoco.introspect.ast_nodes import ArrayType, PointerType, ValueType

from afo_sim.common import CallbackError, machine_code

_C_TYPES: dict[str, Any] = {
    "mjtNum": ctypes.c_double if np.dtype(mujoco.MJTNUM_DTYPE).itemsize == 8 else ctypes.c_float,
    "mjtByte": ctypes.c_ubyte, "mjtBool": ctypes.c_bool, "mjtSize": ctypes.c_int64, "double": ctypes.c_double,
    "float": ctypes.c_float, "int": ctypes.c_int, "unsigned int": ctypes.c_uint, "unsigned": ctypes.c_uint,
    "char": ctypes.c_char, "unsigned char": ctypes.c_ubyte, "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_void_p, "uint64_t": ctypes.c_uint64, "int64_t": ctypes.c_int64,
    "uint32_t": ctypes.c_uint32, "int32_t": ctypes.c_int32, "uint16_t": ctypes.c_uint16,
    "bool": ctypes.c_bool, "void": None,
}  # fmt: skip


def c_type(declared: Any) -> Any:
    """The ctypes type of a declaration."""
    if isinstance(declared, PointerType):
        return ctypes.c_void_p
    if isinstance(declared, ArrayType):
        element = c_type(declared.inner_type)
        for extent in reversed(declared.extents):
            element = element * extent
        return element
    if isinstance(declared, ValueType):
        name = declared.name
        if name in _C_TYPES:
            return _C_TYPES[name]
        if name.rstrip("_") in structs.STRUCTS:
            return c_struct(name.rstrip("_"))
        if name in enums.ENUMS:
            return ctypes.c_int
        raise CallbackError(f"MuJoCo {mujoco.__version__} declares the unknown C type {name!r}")
    union = type(declared).__name__ == "AnonymousUnionDecl"
    members = [(field.name, c_type(field.type)) for field in declared.fields]
    return type("anonymous", (ctypes.Union if union else ctypes.Structure,), {"_fields_": members})


@functools.cache
def c_struct(name: str) -> Any:
    """A struct of MuJoCo as ctypes lays it out."""
    members = [(field.name, c_type(field.type)) for field in structs.STRUCTS[name].fields]
    return type(name, (ctypes.Structure,), {"_fields_": members})


@functools.cache
def declarations(name: str) -> dict[str, Any]:
    """The fields of a struct by name, as MuJoCo declares them."""
    return {field.name: field for field in structs.STRUCTS[name].fields}


# What compiled code reads, and the library around it. They find the places in a table, and so serve every
# layout with these types.
_READ = {
    "mjModel": "actuator_actadr actuator_trnid actuator_user body_subtreemass dof_bodyid dof_damping "
    "dof_parentid geom_bodyid key_act nkey nuser_actuator nv opt signature site_bodyid tendon_adr wrap_objid "
    "wrap_type",
    "mjData": "act act_dot actuator_force actuator_length actuator_velocity ctrl qfrc_actuator qfrc_applied "
    "qfrc_bias qpos qvel subtree_com ten_velocity ten_wrapadr ten_wrapnum time userdata wrap_obj wrap_xpos "
    "xanchor xaxis xipos",
    "mjOption": "timestep",
}
READ = [(struct, name) for struct, names in _READ.items() for name in names.split()]
PLACES = "afo_sim_places"  # symbol of the table, by which compiled code finds it


@functools.cache
def places() -> Any:
    """The table: the offset of each field of READ; behind them, what a whole state is to MuJoCo."""
    offsets = (getattr(c_struct(struct), name).offset for struct, name in READ)
    return (ctypes.c_int64 * (len(READ) + 1))(*offsets, mujoco.mjtState.mjSTATE_INTEGRATION.value)


def kinds() -> list[str]:
    """The declared type of each field of READ, and the size of MuJoCo's numbers [bytes]."""
    if missing := [f"{at}.{name}" for at, name in READ if name not in declarations(at)]:
        raise CallbackError(f"MuJoCo {mujoco.__version__} has no {', '.join(missing)}; {_WAY_OUT}")
    size = ctypes.sizeof(_C_TYPES["mjtNum"])
    return [f"mjtNum: {size}", *(f"{at}.{name}: {declarations(at)[name].type}" for at, name in READ)]


_WAY_OUT = 'install a MuJoCo within this package\'s pins, or run with callback = "python"'
LAYOUTS = pathlib.Path(__file__).with_name("layouts.json")  # tables of MuJoCo's versions, by their numbers


def c_header(row: int, layout: float) -> str:
    """What the library in C knows of rows and of MuJoCo's versions, the installed one among them."""
    known = json.loads(LAYOUTS.read_text()) | {str(mujoco.mj_version()): list(places())}
    names = [f"{struct}_{name}" for struct, name in READ]
    tables = (f"{{{number}, {{{', '.join(map(str, table))}}}}}" for number, table in known.items())
    words = ", ".join(f"{int(n) // 10**6}.{int(n) // 1000 % 1000}.{int(n) % 1000}" for n in known)
    return f"""#include <stdint.h>
enum {{ {", ".join(names)}, AFO_STATE, AFO_PLACES, AFO_LAYOUTS = {len(known)}, AFO_ROW = {row},
       AFO_USER_KERNELS = {machine_code.table_size()},
       AFO_ACTUATOR = {mujoco.mjtObj.mjOBJ_ACTUATOR.value}, AFO_KEY = {mujoco.mjtObj.mjOBJ_KEY.value} }};
#define AFO_ROWS_LAYOUT {layout}
#define AFO_KNOWN "{words}"
static const struct {{ int version; int64_t places[AFO_PLACES]; }} AFO_LAYOUT[] = {{
  {f",{chr(10)}  ".join(tables)}
}};
"""


@functools.cache
def verify() -> int:
    """Compare every field of a probe model with the bindings' own view of it."""
    model = mujoco.MjModel.from_xml_string(_PROBE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    compared = 0
    owners: dict[str, Any] = {"mjModel": model, "mjData": data}
    raw = {name: c_struct(name).from_address(owner._address) for name, owner in owners.items()}
    owners["mjOption"], raw["mjOption"] = model.opt, raw["mjModel"].opt
    for name, owner in owners.items():
        for field in declarations(name):
            seen, stored = getattr(owner, field, None), getattr(raw[name], field)
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
                    f"native muscle callbacks would read the wrong memory; {_WAY_OUT}"
                )
            compared += 1
    return compared


_PROBE = """<mujoco><size nuserdata="1"/><worldbody><body><joint name="j"/><geom size=".1"/></body>
</worldbody><tendon><fixed name="t"><joint joint="j" coef="1"/></fixed></tendon>
<actuator><general tendon="t" dyntype="user" gaintype="user" biastype="user" user="1"/></actuator>
</mujoco>"""

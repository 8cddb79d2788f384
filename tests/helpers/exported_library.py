"""An exported folder through its own library, by the ten functions of afo_sim.h; it needs no afo_sim."""

import ctypes
import math
import pathlib
import sys
from typing import Any

NAME = "afo_sim" + {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")


class Variable(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_char_p) for name in ("name", "unit", "description")),
        ("input", ctypes.c_int),
    ]


class Failed(Exception):
    """What a function of the library said."""


def loaded(folder: pathlib.Path) -> Any:
    return ctypes.CDLL(str(folder / NAME))


def opened(folder: pathlib.Path) -> "Simulation":
    return Simulation(folder, loaded(folder))


class Simulation:
    """A simulation of an exported folder."""

    def __init__(self, folder: pathlib.Path, library: Any):
        self.own, number, at = library, ctypes.c_int, ctypes.c_void_p
        told: dict[str, tuple[Any, list[Any]]] = {
            "open": (at, [ctypes.c_char_p, ctypes.c_char_p, number]),
            "close": (None, [at]),
            "step": (number, [at, number]),
            "find": (number, [at, ctypes.c_char_p]),
            "describe": (ctypes.POINTER(Variable), [at, number]),
            "set": (number, [at, number, ctypes.c_double]),
            "get": (ctypes.c_double, [at, number]),
            "state": (number, [at, at]),
            "restore": (number, [at, at]),
            "reset": (number, [at]),
            "timestep": (ctypes.c_double, [at]),
            "error": (ctypes.c_char_p, [at]),
        }
        for name, (result, arguments) in told.items():
            function = getattr(library, f"afo_{name}")
            function.restype, function.argtypes = result, arguments
        said = ctypes.create_string_buffer(400)
        self.at = library.afo_open(str(folder).encode(), said, len(said))
        if not self.at:
            raise Failed(said.value.decode(errors="replace"))

    def close(self) -> None:
        self.own.afo_close(self.at)

    @property
    def error(self) -> str:
        return self.own.afo_error(self.at).decode(errors="replace")

    def _asked(self, result: int) -> None:
        if result:
            raise Failed(self.error)

    def find(self, name: str) -> int:
        return self.own.afo_find(self.at, name.encode())

    def step(self, steps: int = 1) -> None:
        self._asked(self.own.afo_step(self.at, steps))

    def set(self, name: str, value: float = math.nan) -> None:
        self._asked(self.own.afo_set(self.at, self.find(name), value))

    def get(self, name: str) -> float:
        return self.own.afo_get(self.at, self.find(name))

    def reset(self) -> None:
        self._asked(self.own.afo_reset(self.at))

    def variables(self) -> list[Variable]:
        found = []
        while each := self.own.afo_describe(self.at, len(found)):
            found.append(each.contents)
        return found

    def outputs(self) -> list[str]:
        return [v.name.decode() for v in self.variables() if not v.input and v.name]

    @property
    def state(self) -> Any:
        found = (ctypes.c_double * self.own.afo_state(self.at, None))()
        self.own.afo_state(self.at, found)
        return found

    @state.setter
    def state(self, state: Any) -> None:
        self._asked(self.own.afo_restore(self.at, state))

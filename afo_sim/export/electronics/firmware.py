"""A board's program in the loop of a run, in C or in Python."""

import ctypes
import math
import os
import pathlib
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from afo_sim.common import Function, InputError, JsonDict, child_environment, unknown, write_bytes
from afo_sim.control import Coils, Command, Log, Observation

_HERE = pathlib.Path(__file__).with_name("templates")
_CALLS: JsonDict = {  # of board_t, in its order
    "micros": ctypes.CFUNCTYPE(ctypes.c_uint64),
    "read": ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_char_p),
    "write": ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_int, ctypes.c_int),
}


class Program(Protocol):
    """A board's program in Python; `board` is the `Firmware` that calls it."""

    def setup(self, board: "Firmware") -> None: ...

    def loop(self, board: "Firmware") -> None: ...


class Firmware:
    """A controller: a board's program, in lockstep with the simulation."""

    def __init__(
        self, program: str | os.PathLike[str] | Program, chambers: Sequence[str], *, loop: float = 1e-4,
        options: Sequence[str] = (),
    ):  # fmt: skip
        if not 1e-6 <= loop <= 1.0:
            raise InputError("is out of range", field="loop", value=loop, allowed="1e-6 to 1 [s]")
        self.program = _CProgram(program, options) if isinstance(program, str | os.PathLike) else program
        self.chambers, self.longest = list(chambers), float(loop)
        self.reset()

    def reset(self) -> None:
        """Go back to the beginning: the next call sets the program up."""
        self._coils: dict[str, Coils] = dict.fromkeys(self.chambers, (False, False))
        self._changes: list[tuple[float, dict[str, Coils]]] = []
        self._seen: Observation | None = None
        self._time, self._reading = 0.0, 0

    @property
    def log(self) -> Log:
        """The coils since the beginning, to the time between two loops."""
        rows = ((time, *row) for time, coils in self._changes for row in coils.items())
        return Log.of(rows, self._time, list(self._coils))

    def __call__(self, seen: Observation) -> Mapping[str, Command]:
        """Each coil's share of the period from now to the next command."""
        begins, self._seen, self._time = self._seen is None, seen, seen.time
        if begins:
            self._reading = self._micros()
            self.program.setup(self)
        count, loops = max(math.ceil(seen.period / self.longest - 1e-9), 1), []
        for k in range(count):
            self._time = round(seen.time + k * seen.period / count, 9)
            last, begin = self._reading - 1, self._micros()
            if last < begin + 1e6 * seen.period / count:  # else the last loop still waits
                self._reading = max(last, begin)
                self.program.loop(self)
            loops.append(list(self._coils.values()))
            if not self._changes or self._changes[-1][1] != self._coils:
                self._changes.append((self._time, dict(self._coils)))
        self._time = round(seen.time + seen.period, 9)
        return dict(zip(self._coils, map(tuple, np.mean(loops, axis=0).tolist()), strict=True))

    def micros(self) -> int:
        """Time since the beginning [us]; within a loop a call takes 1 us, assumed, so that a wait ends."""
        self._reading += 1
        return self._reading - 1

    def _micros(self) -> int:
        """The simulation's time [us]."""
        return round(1e6 * self._time)

    def read(self, column: str) -> float:
        """The last sample of a column or a sensor [SI]."""
        assert self._seen is not None
        if not math.isfinite(value := self._seen[column]):  # any comparison with it is false
            raise InputError("is not a number", field=column, value=value)
        return value

    def write(self, chamber: str, inlet: object, outlet: object) -> None:
        """Whether a chamber's coils have current from now on."""
        if chamber not in self._coils:
            raise unknown(chamber, self._coils, field="chamber", problem="the orthosis has no such chamber")
        self._coils[chamber] = (bool(inlet), bool(outlet))


class _CProgram:
    """A board's program in C: a file that includes board.h, or the folder of an export."""

    def __init__(self, source: str | os.PathLike[str], options: Sequence[str]):
        self._source = pathlib.Path(source)
        self._code = _compiled(self._source, options)
        self._library = self._loaded()

    def _loaded(self) -> ctypes.CDLL:
        """A library of its own, whose variables are shared with none and have their first values."""
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            library = pathlib.Path(folder, "program.so")
            write_bytes(library, self._code)
            try:
                loaded = ctypes.CDLL(str(library))
            except OSError as error:
                problem = f"is compiled, but cannot be loaded: {str(error).removeprefix(f'{library}: ')}"
                allowed = "a C file of all that it calls, and a folder TMPDIR from which programs may run"
                raise InputError(problem, file=self._source, field="firmware", allowed=allowed) from None
        for name in ("setup", "loop"):
            if not hasattr(loaded, name):
                raise InputError(f"defines no {name}(const board_t *)", file=self._source, field="firmware")
        return loaded

    def setup(self, board: Firmware) -> None:
        """Call a fresh library's setup, with this board from now on."""
        self._library = self._loaded()
        self._calls = [kind(self._kept(getattr(board, name))) for name, kind in _CALLS.items()]
        self._board = (ctypes.c_void_p * len(_CALLS))(*(ctypes.cast(c, ctypes.c_void_p) for c in self._calls))
        self._errors: list[BaseException] = []
        self._call(self._library.setup)

    def loop(self, board: Firmware) -> None:
        """Call C's loop."""
        self._call(self._library.loop)

    def _kept(self, call: Function) -> Function:
        """A call with C's texts, whose error is kept until C returns: none can pass through C."""

        def kept(*given: object) -> object:
            try:
                return call(*(each.decode() if isinstance(each, bytes) else each for each in given))
            except BaseException as error:  # sys.exit() and Ctrl-C, too
                self._errors.append(error)
                return 0

        return kept

    def _call(self, function: Function) -> None:
        function(self._board)
        if self._errors:
            raise self._errors[0]


def _compiled(source: pathlib.Path, options: Sequence[str]) -> bytes:
    """The library that the compiler makes; InputError where it makes none."""
    file = source if source.is_file() else _HERE / "program.c"
    if file != source and not (source / "valves" / "valves.h").is_file():
        raise InputError("is neither a C file nor the folder of an export", file=source, field="firmware")
    environment = child_environment({"LC_ALL": "C"})
    found = (shutil.which(name, path=environment.get("PATH")) for name in ("cc", "gcc", "clang"))
    if (compiler := next(filter(None, found), None)) is None:
        raise InputError("needs a C compiler, but this machine has none", field="firmware", value=str(source))
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        library = pathlib.Path(folder, "program.so")
        command = [compiler, "-std=c99", "-O1", "-shared", "-fPIC", f"-I{_HERE}", f"-I{source.absolute()}"]
        command += ["-o", str(library), str(file.absolute()), *options]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
        if done.returncode:
            said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr[:200])
            raise InputError(f"the compiler refuses it: {said.strip()}", file=source, field="firmware")
        return library.read_bytes()

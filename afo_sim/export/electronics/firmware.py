"""A board's program in the loop of a run: in Python in this process, in C in a child of limited rights."""

import ctypes
import math
import os
import pathlib
import shutil
import tempfile
import types
import weakref
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from afo_sim.common import (
    ALONE,
    Child,
    ChildEnded,
    Function,
    InputError,
    JsonDict,
    Mixed,
    check_regular,
    child_environment,
    complaint,
    unknown,
    write_bytes,
)

if TYPE_CHECKING:  # a child is ready at once without
    from afo_sim.control import Coils, Command, Log, Observation

PATIENCE = 9.0  # with a program in C, for one control period; any controller has 10 s [s]
COMPILING = 12.0  # [s]
_LARGEST = 2**24  # file in C [B]
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
        self.chambers, self.longest = list(chambers), float(loop)
        self.program: Program | _CProgram
        if isinstance(program, str | os.PathLike):
            self.program = _CProgram(pathlib.Path(program), options, (self.chambers, self.longest))
        else:
            self.program = program
        self.reset()

    def reset(self) -> None:
        """Go back to the beginning: the next call sets the program up."""
        self._coils: dict[str, Coils] = dict.fromkeys(self.chambers, (False, False))
        self._changes: list[tuple[float, dict[str, Coils]]] = []
        self._seen: Observation | None = None
        self._time, self._reading = 0.0, 0

    @property
    def log(self) -> "Log":
        """The coils since the beginning, to the time between two loops."""
        from afo_sim.control import Log

        rows = ((time, *row) for time, coils in self._changes for row in coils.items())
        return Log.of(rows, self._time, list(self._coils))

    def __call__(self, seen: "Observation") -> Mapping[str, "Command"]:
        """Each coil's share of the period from now to the next command."""
        begins, self._seen, self._time = self._seen is None, seen, seen.time
        if isinstance(self.program, _CProgram):
            commands, changes = self.program.period(seen, begins)
            self._changes += changes
            self._time = round(seen.time + seen.period, 9)
            return commands
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
            loops.append(dict(self._coils))
            if not self._changes or self._changes[-1][1] != self._coils:
                self._changes.append((self._time, loops[-1]))
        self._time = round(seen.time + seen.period, 9)
        inlets, outlets = ({c: sum(at[c][k] for at in loops) / count for c in self._coils} for k in (0, 1))
        return {chamber: (inlets[chamber], outlets[chamber]) for chamber in self._coils}

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
    """A board's program in C, in a child: a file that includes board.h, or the folder of an export."""

    def __init__(self, source: pathlib.Path, options: Sequence[str], board: tuple[list[str], float]):
        self._source, self._code, self._board = source, _compiled(source, options), board
        self._begin()

    def _begin(self) -> None:
        """Load it in a child of its own, in which variables have their first values."""
        self._child, self._columns = Child(f"{__name__}:serve", ALONE), list[str]()
        weakref.finalize(self, self._child.close)
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            library = pathlib.Path(folder, "program.so")
            write_bytes(library, self._code)
            self._child.send((str(library), *self._board))
            self._heard()
        self._begun = False

    def _heard(self) -> Mixed:
        """What the child answers: coils, or a column that it needs; InputError also where it has ended."""
        try:
            said = self._child.receive(PATIENCE)
        except ChildEnded as error:
            raise InputError(f"the program {error}", file=self._source, field="firmware") from None
        if isinstance(said, InputError):
            raise said if said.field else said.replaced(file=self._source, field="firmware")
        return said

    def period(self, seen: "Observation", begins: bool) -> Mixed:
        """Commands and changes of one control period; the first is of a program that has just begun."""
        if begins and self._begun:
            self._child.close()
            self._begin()
        self._begun = True
        known = {column: seen[column] for column in self._columns}
        self._child.send((seen.time, seen.period, known))
        while isinstance(said := self._heard(), str):
            self._columns.append(said)
            self._child.send(seen[said])
        return said


class _Samples(dict[str, float]):
    """What a parent has sent for a control period; it is asked for another column."""

    def __init__(self, ask: Function, time: float, period: float, known: dict[str, float]) -> None:
        self._ask, self.time, self.period = ask, time, period
        super().__init__(known)

    def __missing__(self, column: str) -> float:
        self[column] = self._ask(str(column))
        return self[column]


def serve(receive: Function, send: Function) -> None:
    """Be the board of a program in C, as a child."""

    def guarded(call: Function) -> Function:
        def called(*given: object) -> object:
            try:
                return call(*(g.decode(errors="replace") if isinstance(g, bytes) else g for g in given))
            except BaseException as error:  # none can pass through C
                send(error)
                os._exit(1)

        return called

    library, chambers, loop = receive()
    try:
        loaded = ctypes.CDLL(library)
    except OSError as error:
        problem = f"is compiled, but cannot be loaded: {str(error).removeprefix(f'{library}: ')}"
        allowed = "a C file of all that it calls, and a folder TMPDIR from which programs may run"
        return send(InputError(problem, allowed=allowed))
    for name in ("setup", "loop"):
        if not hasattr(loaded, name):
            return send(InputError(f"defines no {name}(const board_t *)"))
    given: Mixed
    program = types.SimpleNamespace(setup=lambda _: loaded.setup(given), loop=lambda _: loaded.loop(given))
    board = Firmware(program, chambers, loop=loop)
    calls = [kind(guarded(getattr(board, name))) for name, kind in _CALLS.items()]
    given = (ctypes.c_void_p * len(calls))(*(ctypes.cast(call, ctypes.c_void_p) for call in calls))
    send(None)
    told = 0
    while True:
        seen: Mixed = _Samples(lambda column: send(column) or receive(), *receive())
        commands = board(seen)
        send((commands, board._changes[told:]))
        told = len(board._changes)


def _compiled(source: pathlib.Path, options: Sequence[str]) -> bytes:
    """The library that the compiler makes; InputError where it makes none."""
    file = source if source.is_file() else _HERE / "program.c"
    if file != source and not (source / "valves" / "valves.h").is_file():
        raise InputError("is neither a C file nor the folder of an export", file=source, field="firmware")
    check_regular(file, _LARGEST)
    places = child_environment().get("PATH")
    found = (shutil.which(name, path=places) for name in ("cc", "gcc", "clang"))
    if (compiler := next(filter(None, found), None)) is None:
        raise InputError("needs a C compiler, but this machine has none", field="firmware", value=str(source))
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        library = pathlib.Path(folder, "program.so")
        command = [compiler, "-std=c99", "-O1", "-shared", "-fPIC", f"-I{_HERE}", f"-I{source.absolute()}"]
        command += ["-o", str(library), str(file.absolute()), *options]
        if said := complaint(command, pathlib.Path(folder), COMPILING):
            raise InputError(f"the compiler refuses it: {said}", file=source, field="firmware")
        return library.read_bytes()

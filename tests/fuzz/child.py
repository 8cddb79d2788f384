"""Commands on damaged files, in one process: how each ended; an end of the process is the parent's.

A line of the input is a row of `Damage`, or ["base", "seed"] of one to be drawn, or ["$", "folder",
"word", …] of a command among odd files. By hand:
    echo '["trc", "20260101 7"]' | PYTHONPATH=tests:tests/helpers python -m fuzz.child FOLDER
"""

import contextlib
import faulthandler
import functools
import io
import json
import os
import pathlib
import resource
import shutil
import sys
import traceback
from collections.abc import Callable, Sequence

from fuzz import odd
from fuzz.bases import BASES, IMPORT
from fuzz.damage import Damage, drawn

from afo_sim.cli import app, error_handler
from afo_sim.common import AfoSimError

LONGEST = 20.0  # of a command [s]
LARGEST = 2 * 2**20  # of the process [KiB]
_DRAWN = 50  # one of so many imports is drawn too


def _peak() -> int:
    """Of this program [KiB]: ru_maxrss would be that of the process, which was pytest's before."""
    status = pathlib.Path("/proc/self/status").read_text()
    own = int(status.partition("VmHWM:")[2].split()[0])
    return max(own, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)


def ended(folder: pathlib.Path, damage: Damage, whole: bytes) -> tuple[str, str]:
    """How the command ended on a damaged file, and its words."""
    base = BASES[damage.base]
    base.path(folder).write_bytes(damage.of(whole))
    reader = None if base.command else functools.partial(base.read, folder)
    return answered(folder, base.command, reader, bounded=damage.operator != "none")


def _code_of(reader: Callable[[], object]) -> int:
    """The exit code of a command that would only read."""
    try:
        reader()
    except (AfoSimError, json.JSONDecodeError) as error:  # whose callers name the file
        print(error, file=sys.stderr)
        return 2
    except Exception:
        traceback.print_exc()
        return 70
    return 0


def answered(
    folder: pathlib.Path,
    command: Sequence[str],
    reader: Callable[[], object] | None = None,
    *,
    bounded: bool = True,
) -> tuple[str, str]:
    """How a command or a function ended, and its words."""
    said, sys.argv = io.StringIO(), ["afo-sim", *command]
    os.chdir(folder)
    if bounded:
        faulthandler.dump_traceback_later(LONGEST, exit=True)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
            code = error_handler.run(app) if reader is None else _code_of(reader)
    finally:
        faulthandler.cancel_dump_traceback_later()
    words = said.getvalue()
    for bug in folder.glob("afo-sim-bug-*"):
        words = bug.read_text("utf-8", "replace")[-1500:]
        bug.unlink()
    if "more memory than there is" in words or _peak() > LARGEST:
        return "memory", words[-500:]
    if code not in (0, 1, 2, 3):
        return "traceback", words
    if (code and not words.strip()) or len(words) > 6000:
        return "wordless or wordy", words[-500:]
    return "refused" if code == 2 else "fine", words[:200]


def main(folder: pathlib.Path) -> None:
    """Answer each line of the standard input with one: the damage, how it ended, what was said."""
    import afo_sim.show

    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no part of the answer
    resource.setrlimit(resource.RLIMIT_AS, (8 * 2**30, 8 * 2**30))
    draw = afo_sim.show.draw_gait
    for number, line in enumerate(sys.stdin):
        name, *rest = json.loads(line)
        if name == "$":
            print(line, file=sys.stderr, flush=True)
            odd.make(folder / rest[0])
            how, words = answered(folder / rest[0], rest[1:])
            print(json.dumps([name, *rest, how, words]), file=answers, flush=True)
            continue
        place = folder / name
        if not place.is_dir():
            making = folder / f"{name}.{os.getpid()}"
            making.mkdir(parents=True)
            BASES[name].make(making)
            shutil.copy(BASES[name].path(making), making / "whole")
            making.rename(place)
            whole = (place / "whole").read_bytes()
            ended(place, Damage(name, "none", ""), whole)  # what it compiles is no part of a case's time
        raw = (place / "whole").read_bytes()
        damage = Damage(name, *rest) if len(rest) > 1 else drawn(name, raw, rest[0])
        print(json.dumps(list(vars(damage).values())), file=sys.stderr, flush=True)
        if BASES[name].command[:2] == IMPORT:
            afo_sim.show.draw_gait = draw if number % _DRAWN == _DRAWN - 1 else lambda *given: None
        how, words = ended(place, damage, raw)
        print(json.dumps([*vars(damage).values(), how, words]), file=answers, flush=True)
        shutil.rmtree(place / "out", ignore_errors=True)
        if how == "memory":  # the peak stays: a new process goes on
            return


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve())

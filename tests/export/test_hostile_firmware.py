"""Programs in C that do what none should: each ends with a sentence, soon, and leaves nothing behind."""

import os
import pathlib
import sys
import tempfile
from collections.abc import Iterator
from itertools import pairwise
from types import SimpleNamespace

import pytest
from campaign import sampled
from export.boards import compiler
from installed import needs

from afo_sim.common import InputError
from afo_sim.export import Firmware
from afo_sim.export.electronics import firmware as module

pytestmark = [
    needs("psutil"),
    pytest.mark.skipif(sys.platform != "linux", reason="not every system has all limits"),
]

BEGIN = """#define _GNU_SOURCE
#include "board.h"
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
"""
SETUP, LOOP = "void setup(const board_t *b) { %s }", "void loop(const board_t *b) { %s }"
CALLED = "was stopped by SIGSYS"
CRASHED, WAITS = "was stopped by SIGSEGV", "gave no answer within"
WRITES = '{ char *text = "rubbish"; for (int k = 0; k < 256; k++) write(k, text, 7); }'
GOES_ON = None  # without harm: the comparison tells that it does not switch as it should


def loop(does: str) -> str:
    return (SETUP % "") + (LOOP % does)


def setup(does: str) -> str:
    return (SETUP % does) + (LOOP % "")


def beside(does: str) -> str:
    return does + loop("")


# {what it does: (C, what the sentence says)}
PROGRAMS: dict[str, tuple[str, str | None]] = {
    "exit 0": (loop("exit(0);"), r"ended itself \(exit code 0\)"),
    "exit 3": (loop("exit(3);"), r"ended itself \(exit code 3\)"),
    "exit in setup": (setup("exit(0);"), r"ended itself \(exit code 0\)"),
    "exit at once": (loop("_exit(0);"), r"ended itself \(exit code 0\)"),
    "abort": (loop("abort();"), "was stopped by SIGABRT"),
    "address 0": (loop("*(volatile int *)0 = 1;"), CRASHED),
    "a constant written to": (loop('*(volatile char *)"text" = 1;'), CRASHED),
    "divides by 0": (loop("volatile int zero = 0; zero = 7 / zero;"), "was stopped by SIGFPE"),
    "no instruction": (loop("__builtin_trap();"), "was stopped by SIGILL"),
    "calls without end": (
        "int deep(int k) { volatile char room[4096]; room[0] = k; return deep(k + 1) + room[0]; }"
        + loop("deep(0);"),
        CRASHED,
    ),
    "loops without end": (loop("for (;;);"), WAITS),
    "sets up without end": (setup("for (;;);"), WAITS),
    "sleeps": (loop("for (;;) sleep(1000);"), WAITS),
    "waits for a reading": (loop('while (b->read("a") < 9.0);'), WAITS),
    "reads what comes": (loop("char c; for (;;) if (read(3, &c, 1) < 0) pause();"), WAITS),
    "asks the clock without end": (loop("for (;;) b->micros();"), WAITS),
    "closes all": (loop("for (int k = 0; k < 256; k++) close(k);"), "ended itself|closed its files"),
    "closes all and waits": (
        loop("for (int k = 0; k < 256; k++) close(k); for (;;) pause();"),
        "has closed its files",
    ),
    "opens others": (
        loop(
            "for (int k = 0; k < 64; k++) close(k);"
            f'for (int k = 0; k < 64; k++) open("/dev/null", O_RDWR); {WRITES}'
        ),
        "has closed its files|gave no answer|ended itself",
    ),
    "writes to all": (loop(WRITES), "has sent what is no answer"),
    "writes zeros to all": (
        loop("char z[4096] = {0}; for (int k = 0; k < 9; k++) write(k, z, 4096);"),
        "has sent what is no answer",
    ),
    "writes to all without end": (loop(f"for (;;) {WRITES}"), "has sent what is no answer"),
    "prints without end": (loop('for (;;) { puts("x"); fputs("y", stderr); }'), WAITS),
    "fills the disk": (
        loop("FILE *f = tmpfile(); static char z[1 << 20]; while (fwrite(z, 1 << 20, 1, f)); abort();"),
        "was stopped by SIGABRT",
    ),
    "opens without end": (
        loop('for (int k = 0; k < 1000; k++) if (open("/dev/null", 0) < 0) abort();'),
        "was stopped by SIGABRT",
    ),
    "allocates without end": (
        loop("for (;;) { char *c = malloc(1 << 26); memset(c, 1, 4096); }"),
        CRASHED,
    ),
    "forks without end": (loop("for (;;) fork();"), CALLED),
    "starts a thread": (
        "void *on(void *_) { for (;;); }" + loop("pthread_t t; pthread_create(&t, 0, on, 0);"),
        CALLED,
    ),
    "starts a program": (loop('system("sleep 1000");'), CALLED),
    "becomes a program": (loop('execl("/bin/sleep", "sleep", "1000", (char *)0);'), "has closed its files"),
    "stops its parent": (loop("kill(getppid(), SIGKILL);"), CALLED),
    "stops everybody": (loop("kill(-1, SIGTERM);"), CALLED),
    "stops itself": (loop("raise(SIGKILL);"), r"was stopped by SIGKILL"),
    "pauses itself": (loop("raise(SIGSTOP);"), WAITS),
    "ignores all signals": (
        loop("for (int k = 1; k < 32; k++) signal(k, SIG_IGN); prctl(PR_SET_PDEATHSIG, 0); for (;;);"),
        WAITS,
    ),
    "jumps to where nothing is": ("jmp_buf at;" + loop("longjmp(at, 1);"), "was stopped by SIG"),
    "an alarm": (loop("alarm(1); for (;;) pause();"), "was stopped by SIGALRM"),
    "exits as it is loaded": (
        beside("__attribute__((constructor)) void first(void) { exit(0); }"),
        r"ended itself \(exit code 0\)",
    ),
    "hangs as it is loaded": (beside("__attribute__((constructor)) void first(void) { for (;;); }"), WAITS),
    "writes what is no number": (loop('b->write("d", (int)NAN, -7);'), GOES_ON),
    "an unknown chamber": (loop('b->write("no", 1, 0);'), "the orthosis has no such chamber"),
    "no chamber": (loop("b->write(0, 1, 0);"), "the orthosis has no such chamber"),
    "no column": (loop("b->read(0);"), "there is no column"),
    "a name of no letters": (loop('b->write("\\xff\\xfe", 1, 0);'), "the orthosis has no such chamber"),
    "includes itself": ('#include "own.c"\n' + loop(""), "nested depth|nested too deeply"),
    "includes what never ends": ('#include "/dev/zero"\n' + loop(""), "the compiler refuses it"),
    "includes a pipe": ('#include "pipe.h"\n' + loop(""), WAITS),
    "words that grow": (
        "#define A x x x x x x x x\n"
        + "".join(f"#define {b} {a} {a} {a} {a} {a} {a} {a} {a}\n" for a, b in pairwise("ABCDEFGHIJ"))
        + "int f(void) { return 0 J; }"
        + loop(""),
        "the compiler refuses it",
    ),
    "a large array": ("char large[1 << 30] = {1};" + loop(""), "the compiler refuses it"),
    "a long file": ("/*" + " " * 2**24 + "*/" + loop(""), "is too large"),
}


@pytest.fixture
def own(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[pathlib.Path]:
    """A place for a program; no process and no temporary file of it is left."""
    import psutil

    compiler("cc", "gcc", "clang")
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    os.mkfifo(tmp_path / "pipe.h")
    yield tmp_path / "own.c"
    assert psutil.wait_procs(psutil.Process().children(recursive=True), timeout=5)[1] == []
    assert list((tmp_path / "temporary").iterdir()) == []


class Seen(SimpleNamespace):
    def __getitem__(self, column: str) -> float:
        if column != "a":
            raise InputError("there is no column of this name", field=column)
        return 1.0


@pytest.mark.parametrize("does", sampled(PROGRAMS, 8))
def test_a_hostile_program_ends_with_a_sentence(
    does: str, own: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, says = PROGRAMS[does]
    own.write_text(BEGIN + code)
    if says == WAITS:
        monkeypatch.setattr(module, "COMPILING" if "include" in does else "PATIENCE", 2.0)
    try:
        with pytest.raises(InputError, match=says or "it goes on"):
            firmware = Firmware(own, ["d"])
            for k in range(20):
                firmware(Seen(time=1e-3 * k, period=1e-3))  # type: ignore[arg-type]
            raise InputError("it goes on")
    finally:
        firmware = None  # type: ignore[assignment]


def test_a_source_that_never_ends_is_no_program(own: pathlib.Path) -> None:
    for path in (own.with_name("pipe.h"), pathlib.Path("/dev/zero")):
        with pytest.raises(InputError, match="is neither a C file nor"):
            Firmware(path, ["d"])

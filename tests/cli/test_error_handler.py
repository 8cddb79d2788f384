"""Exit codes and messages for what no command foresees; no traceback on the terminal."""

import errno
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

import pytest
import typer
from command import Call

from afo_sim import cli
from afo_sim.cli import error_handler
from afo_sim.cli.doctor import kinds
from afo_sim.common import InputError


def commands() -> list[tuple[str, ...]]:
    own = [command.name or command.callback.__name__ for command in cli.app.registered_commands]
    gait = [("gait", str(command.name)) for command in cli.gait_app.registered_commands]
    return [(), ("gait",), *((name,) for name in own), *gait]


@pytest.mark.slow
@pytest.mark.parametrize("command", commands(), ids=" ".join)
def test_every_command_helps(command: tuple[str, ...], call: Call) -> None:
    for option in ("-h", "--help"):
        code, printed, complaint = call(*command, option)
        assert (code, complaint) == (0, "")
        assert printed.startswith(" ".join(("Usage: afo-sim", *command)))


def test_version_and_exit_codes_are_told(call: Call) -> None:
    import mujoco

    import afo_sim

    code, printed, _ = call("--version")
    assert code == 0
    assert re.match(r"afo-sim \d+\.\d+\.\d+\b", printed)
    assert f"mujoco {mujoco.__version__}" in printed
    told = call("--help")[1]
    assert all(f"\n  {number}" in told for number in (0, 1, 2, 3, 70, 130, 143))
    assert afo_sim.InputError("x").exit_code == 2


@pytest.mark.parametrize(
    "command",
    [
        *(("fit", "LOOP", "--law", "all"), ("fit", "LOOP", "--orthosis", "s1"), ("report", "LOOP")),
        *(("leg", "import", "LOOP"), ("leg", "import", "adult_75kg", "--out", "LOOP"), ("check", "LOOP")),
        *(("run", "seated", "--out", "LOOP"), ("refit", "s1", "--to", "arm", "--out", "LOOP")),
    ],
    ids=" ".join,
)
def test_links_in_a_circle_are_one_message(
    command: tuple[str, ...], tmp_path: pathlib.Path, call: Call
) -> None:
    loop = tmp_path / "loop.urdf"
    loop.symlink_to(loop)
    code, _, complaint = call(*(str(loop) if word == "LOOP" else word for word in command))
    assert (code, complaint.count("\n")) == (2, 1)
    assert str(loop)[:40] in complaint
    assert "bug" not in complaint


CASES = {
    "input": (InputError("is wrong", field="x"), 2, "x: is wrong"),
    "disk": (OSError(errno.ENOSPC, "No space left", "a.csv"), 2, "a.csv: the disk is full"),
    "long": (OSError(errno.ENAMETOOLONG, "File name too long", "a" * 999), 2, f"{297 * 'a'}...: File name"),
    "permission": (PermissionError(errno.EACCES, "denied", "a.csv"), 2, "a.csv: you have no permission"),
    "strange": (OSError("broken"), 2, "broken"),
    "memory": (MemoryError("Unable to allocate 8 TiB"), 2, "more memory than there is: Unable to allocate"),
    "links": (RuntimeError("Symlink loop from 'a.csv'"), 2, "'a.csv': its symbolic links run in a circle"),
    "depth": (RecursionError("maximum"), 2, "nested too deeply"),
    "interrupt": (KeyboardInterrupt(), 130, "stopped"),
    "reader gone": (BrokenPipeError(), 0, ""),
}


@pytest.mark.parametrize("case", CASES)
def test_errors_are_one_message_and_a_code(
    case: str, tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    error, expected, words = CASES[case]

    def fails(path: pathlib.Path) -> None:
        raise error

    monkeypatch.setattr(kinds, "check_file", fails)
    monkeypatch.chdir(tmp_path)
    code, printed, complaint = call("check", "x.toml")
    assert code == expected
    assert words in complaint
    assert complaint.count("\n") == bool(words)
    assert "Traceback" not in printed + complaint
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("writable", [True, False])
def test_a_bug_leaves_a_file_to_send(
    writable: bool, tmp_path: pathlib.Path, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(path: pathlib.Path) -> None:
        raise ValueError("sarosi_2012 \udcff")  # a byte of a path that is not UTF-8

    here, temporary = tmp_path / "here", tmp_path / "temporary"
    here.mkdir()
    temporary.mkdir()
    monkeypatch.setattr(kinds, "check_file", fails)
    monkeypatch.setattr(error_handler.tempfile, "gettempdir", lambda: str(temporary))
    monkeypatch.chdir(here)
    if not writable:
        here.rmdir()  # root may write where others may not, but nobody can where nothing is
    code, printed, complaint = call("check", "my model.toml")
    assert code == 70
    assert "this is a bug in afo-sim (ValueError: sarosi_2012 \\udcff); please send" in complaint
    assert "Traceback" not in printed + complaint
    (file,) = (here if writable else temporary).iterdir()
    text = file.read_text("utf-8")
    assert file.name in complaint
    assert file.name.startswith("afo-sim-bug-")
    assert "command: afo-sim check 'my model.toml'" in text
    assert all(f"{name}: " in text for name in ("python", "afo-sim", "mujoco", "numpy", "system"))
    assert "ValueError: sarosi_2012 \\udcff" in text


def test_arguments_in_a_message_are_options_at_the_command_line() -> None:
    command = typer.main.get_command(cli.app).commands["optimise"]
    error = InputError("is old; see `out`", value=1, allowed="`changed=restart`, `nothing`, `rerun FILE`")
    error.others = (InputError("is not a number", field="threads", value="x"),)
    found = error_handler.with_options(error, command)
    assert str(found).splitlines() == [
        "1: is old; see --out; allowed: --if-changed restart, `nothing`, `rerun FILE` (1 more below)",
        "--threads = 'x': is not a number",
    ]
    of_a_file = InputError("is out of range", file="a.toml", field="threads", value=3)
    assert str(error_handler.with_options(of_a_file, command)) == str(of_a_file)
    keyed = InputError("is no quantity", field="noise.angle", value="1")
    fit = typer.main.get_command(cli.app).commands["fit"]
    assert error_handler.with_options(keyed, fit).field == "--noise angle"


SLOW = """
import pathlib, signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where tests run in the background
from afo_sim import cli
from afo_sim.cli.doctor import kinds
from afo_sim.common.writing import together
def works(path):
    with together(pathlib.Path("out")) as scratch:
        (scratch / "half").write_text("half")
        print("writing", flush=True)
        time.sleep(60)
kinds.check_file = works
sys.argv = ["afo-sim", "check", "x.toml"]
cli.main()
"""


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_signals_clean_up(number: int, code: int, tmp_path: pathlib.Path) -> None:
    command = [sys.executable, "-c", SLOW]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as done:
        try:
            assert done.stdout is not None
            assert done.stdout.readline() == "writing\n"
            assert [path.name[:8] for path in tmp_path.iterdir()] == [".out.new"]
            begun = time.monotonic()
            done.send_signal(number)
            _, complaint = done.communicate(timeout=30)
        finally:
            done.kill()
    assert done.returncode == code
    assert complaint == "afo-sim: stopped\n"
    assert not list(tmp_path.iterdir())
    assert time.monotonic() - begun < 30.0


MOMENTS = {
    "an import": """
class Finder:
    def find_spec(name, *_):
        if name == "typer":
            go()
sys.meta_path.insert(0, Finder)
""",
    "cleaning up, again": """
from afo_sim.cli.doctor import kinds
def works(path):
    try:
        go()
    finally:
        go()
kinds.check_file = works
""",
    "a destructor": """
from afo_sim.cli.doctor import kinds
class Passing:
    def __del__(self):
        go()
def works(path):
    Passing()
    time.sleep(5)
kinds.check_file = works
""",
    "the last flush": "from afo_sim.cli import error_handler\nerror_handler._flush = lambda: go() or 0",
    "the end": "import atexit\natexit.register(go)",
}
MOMENT = """
import os, signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where tests run in the background
def go():
    os.kill(os.getpid(), {})
{}
from afo_sim.cli import main
sys.argv = ["afo-sim", "check", "nothing.toml"]
main()
"""


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
@pytest.mark.parametrize("moment", MOMENTS)
def test_a_signal_at_any_moment_is_a_sentence(
    moment: str, number: int, code: int, tmp_path: pathlib.Path
) -> None:
    command = [sys.executable, "-c", MOMENT.format(int(number), MOMENTS[moment])]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=30)
    assert done.returncode == code
    assert moment == "the end" or done.stderr.endswith("afo-sim: stopped\n")
    assert "Traceback" not in done.stderr and not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")  # noqa: PTH110
def test_output_that_cannot_be_printed(tmp_path: pathlib.Path) -> None:
    command = [sys.executable, "-m", "afo_sim", "list", "muscles"]
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr == "afo-sim: the disk is full\n"
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as closed:
        done = subprocess.run(command, stdout=closed, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
def test_an_output_without_the_letters_gets_escapes() -> None:
    command = [sys.executable, "-m", "afo_sim", "list", "muscles"]
    ascii_only = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, env=ascii_only, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "S\\xe1rosi" in done.stdout


def test_a_path_that_is_no_text_is_refused_first(tmp_path: pathlib.Path, call: Call) -> None:
    code, printed, complaint = call("run", "--out", tmp_path / os.fsdecode(b"\xfe") / "run")
    assert (code, printed) == (2, "") and complaint.count("\n") == 1
    assert "'\\udcfe' is not a character of utf-8" in complaint
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="a POSIX shell")
def test_a_closed_output_is_no_fault() -> None:
    """`afo-sim … >&-`: Python then has no standard output at all."""
    command = f'"{sys.executable}" -m afo_sim --version >&-'
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")

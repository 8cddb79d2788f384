"""Errors of any kind as one message and an exit code; a traceback goes to a file."""

import contextlib
import datetime
import errno
import os
import platform
import re
import shlex
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import typer
from typer.core import TyperGroup

from afo_sim.common import RETIRED, AfoSimError, Foreign, InputError, check_encoding, newer, safe_children
from afo_sim.simulation import released

_BUG, _INTERRUPTED = 70, 130  # exit codes; those of input are AfoSimError's
_PACKAGES = ("afo-sim", "mujoco", "numpy", "numba", "scipy", "pyarrow", "rerun-sdk", "matplotlib", "typer")
# Arguments of the library whose options have another name.
_OPTIONS = {"changed": "if_changed", "screenshot": "picture", "draws": "uncertainty"}
_ALSO = {"ankle": "joint", "shank": "proximal", "foot": "distal"}  # where there is no option of that name
_ARGUMENT = re.compile(r"`(\w+)(?:=([^`]*))?`")  # in a text: `name` or `name=value`


class _Stopped(Exception):
    """An interrupt or a closed pipe on its way through Typer, which has its own exit codes for them."""


class Commands(TyperGroup):
    """A group of commands whose errors name options: `--body-mass` for the library's `body_mass`."""

    def __init__(self, **given: Foreign) -> None:
        super().__init__(**given)
        for option in self.params:
            if option.name == "extension":  # all commands take it, too
                for command in self.leaves():
                    command.params.append(option)

    def leaves(self) -> Iterator[Foreign]:
        """All commands, also those of the groups within."""
        for each in self.commands.values():
            yield from each.leaves() if isinstance(each, Commands) else (each,)

    def resolve_command(self, ctx: Foreign, args: list[str]) -> Foreign:
        """The command and the rest of the line; of older words what they are now, and one line each."""
        return super().resolve_command(ctx, newer(ctx.command_path, args))

    def get_command(self, ctx: Foreign, name: str) -> Foreign:
        """A command by its name; for a retired one, an error that names its successor."""
        found = super().get_command(ctx, name)
        if found is None and name in RETIRED:
            raise InputError("is retired", field=name, allowed=RETIRED[name])
        return found

    def invoke(self, ctx: Foreign) -> object:
        """Run the command."""
        try:
            with released():
                return super().invoke(ctx)
        except InputError as error:
            raise with_options(error, self.get_command(ctx, ctx.invoked_subcommand or "")) from error
        except (KeyboardInterrupt, BrokenPipeError) as error:
            raise _Stopped from error


def grouped(groups: Mapping[str, Sequence[str]]) -> type[Commands]:
    """Commands that `--help` shows in groups."""

    class Grouped(Commands):
        def format_commands(self, ctx: Foreign, formatter: Foreign) -> None:
            width = max(map(len, self.commands))
            for title, names in groups.items():
                with formatter.section(title):
                    room = formatter.width - width - 6
                    rows = [
                        (f"{name:{width}}", self.commands[name].get_short_help_str(room)) for name in names
                    ]
                    formatter.write_dl(rows)

    return Grouped


def with_options(error: InputError, command: Foreign) -> InputError:
    """An error of the library with a command's options for the arguments that it names."""
    parameters = {parameter.name: parameter for parameter in getattr(command, "params", ())}

    def option(argument: str) -> str | None:
        name = _OPTIONS.get(argument, argument)
        names = (name, name.removesuffix("s"), f"{name}s", _ALSO.get(name, name))
        found = (parameters.get(each) for each in names)
        parameter = next(filter(None, found), None)
        if parameter is None:
            return None
        if parameter.param_type_name == "option":
            return max(parameter.opts, key=len)
        return (parameter.metavar or argument.upper()).strip("[]")

    def field(name: str) -> str:
        argument, _, key = name.partition(".")
        return f"{option(argument)} {key}".strip() if option(argument) else name

    def named(found: re.Match[str]) -> str:
        return " ".join(filter(None, [option(found[1]), found[2]])) if option(found[1]) else found[0]

    return error.renamed(field, lambda words: _ARGUMENT.sub(named, words))


def print_version(asked: bool) -> None:
    """Print the version of this program and of the simulator below it, and stop."""
    if asked:
        from afo_sim.common.versions import versions

        found = versions()
        print(f"afo-sim {found['afo-sim']} (mujoco {found['mujoco']}, python {found['python']})")
        raise typer.Exit


def extend(context: typer.Context, files: list[str] | None) -> None:
    """Register what installed packages and the files of `--extension` have, before a command begins."""
    if files or not isinstance(context.command, Commands):
        from afo_sim.common import register, register_installed

        register_installed()
        register(*files or ())


def run(app: typer.Typer, received: Sequence[int] = ()) -> int:
    """Run a command line; what signals `received` have raised may have become another error on its way."""
    warnings.formatwarning = lambda text, *_, **__: f"warning: {text}\n"
    try:
        for word in sys.argv[1:]:
            check_encoding(word)
        with safe_children():  # MuJoCo's glfw starts a Python
            app(prog_name="afo-sim")
        code = 0
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    except BaseException as error:  # whatever ends a command has one message and a code
        cause = error.__cause__ if isinstance(error, _Stopped) and error.__cause__ else error
        code = _report(KeyboardInterrupt() if received else cause)
    return _flush() or code


def _report(error: BaseException) -> int:
    if isinstance(error, BrokenPipeError):
        return 0  # who reads the output has seen enough
    code, message = _message(error)
    with contextlib.suppress(OSError):
        print(f"afo-sim: {_encodable(message)}", file=sys.stderr, flush=True)
    return code


def _message(error: BaseException) -> tuple[int, str]:
    from afo_sim.common import missing_extra, reason

    error = missing_extra(error) or error
    if isinstance(error, AfoSimError):
        return error.exit_code, _bounded(str(error))
    if isinstance(error, KeyboardInterrupt):
        return _INTERRUPTED, "stopped"
    if isinstance(error, OSError):
        name = str(error.filename or "")
        name = name if len(name) <= 300 else f"{name[:297]}..."  # which is why it is refused
        return 2, ": ".join(part for part in (name, reason(error)) if part)
    if isinstance(error, RuntimeError) and str(error).startswith("Symlink loop from "):  # pathlib's own
        return 2, f"{str(error).removeprefix('Symlink loop from ')}: {reason(OSError(errno.ELOOP, ''))}"
    if isinstance(error, MemoryError):
        return 2, f"this needs more memory than there is{f': {error}' if str(error) else ''}"
    if isinstance(error, RecursionError):
        return 2, "the input is nested too deeply"
    if notes := getattr(error, "__notes__", None):  # it befell code of a user's own
        return 2, _bounded(f"{'; '.join(notes)}: {type(error).__name__}: {error}")
    file = _write_bug(error)
    where = f"please send {file}" if file else "no file with the details could be written"
    text = " ".join(str(error).split())
    short = text if len(text) <= 120 else text[:117] + "..."
    return _BUG, f"this is a bug in afo-sim ({type(error).__name__}: {short}); {where}"


def _bounded(text: str) -> str:
    """A message cut to 20 lines, and long lines to 1000 characters."""
    lines = [f"{line[:500]} … {line[-400:]}" if len(line) > 1000 else line for line in text.split("\n")]
    more = [f"… and {len(lines) - 20} more"] if len(lines) > 20 else []
    return "\n".join(lines[:20] + more)


def _encodable(text: str) -> str:
    """A text with escapes for the bytes of a path that is not UTF-8."""
    return text.encode(errors="backslashreplace").decode()


def _write_bug(error: BaseException) -> Path | None:
    """Write versions, command line and traceback to a file here, or else among the temporary files."""
    from afo_sim.common import write_text
    from afo_sim.common.versions import versions

    now = datetime.datetime.now()
    lines = [f"date: {now:%Y-%m-%d %H:%M:%S}", f"command: {shlex.join(['afo-sim', *sys.argv[1:]])}"]
    lines += [f"system: {platform.platform()}"]
    lines += [f"{package}: {version}" for package, version in versions(_PACKAGES).items()]
    text = "\n".join([*lines, "", *traceback.format_exception(error)])
    for folder in (Path, tempfile.gettempdir):
        with contextlib.suppress(InputError, OSError):
            file = Path(folder()) / f"afo-sim-bug-{now:%Y%m%d-%H%M%S}-{os.getpid()}.txt"
            write_text(file, _encodable(text))
            return file
    return None


def _flush() -> int:
    """Print what still waits; a code where the output's disk is full."""
    code = 0
    try:
        sys.stdout.flush()
    except OSError as error:
        code = _report(error)
        with contextlib.suppress(OSError, ValueError):  # or Python would try again as it ends, and complain
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, sys.stdout.fileno())
            os.close(nowhere)
    return code

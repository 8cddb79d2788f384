"""What the commands share: the applications they register with, options, progress, tables, quantities."""

import functools
import gc
import inspect
import os
import re
import shutil
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Annotated, TextIO

import typer
from typer import Argument, Option

from afo_sim.cli.error_handler import Commands, extend, print_version
from afo_sim.common import Function, InputError, JsonDict, Keywords, Mixed, parse_toml, unknown

_EPILOGUE = """Exit codes:

\b
0    success
1    a check, a published number or a replayed case differs; a size does not suffice
2    invalid input, or a system error (disk, permission, memory)
3    the simulation became unstable or its controller failed; rows up to then are written
70   an error in this program; a report that you can send is written
130  stopped by Ctrl-C
143  stopped by SIGTERM
"""
SIDES_HEADER = ["", "right", "left", "2 (L − R)/(L + R)"]  # of a table of both sides
Rows = list[list[str]]  # of a table
_SETTINGS = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    name="afo-sim",
    cls=Commands,
    help="Simulate ankle-foot orthoses with pneumatic artificial muscles.",
    epilog=_EPILOGUE,
    context_settings=_SETTINGS,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
gait_app = typer.Typer(cls=Commands, no_args_is_help=True, rich_markup_mode=None)
app.add_typer(gait_app, name="gait", help="Import your own walking data, and show it.")
leg_app = typer.Typer(cls=Commands, no_args_is_help=True, rich_markup_mode=None)
app.add_typer(leg_app, name="leg", help="Import a leg from MJCF or URDF, or export one.")


_Extension = Annotated[
    list[str] | None,
    Option(
        metavar="FILE", callback=extend, is_eager=True, expose_value=False,
        help="Python file with your own laws, metrics, columns, parts, …; before or after the command",
    ),
]  # fmt: skip


@app.callback()
def _options(
    version: bool = Option(
        False, "--version", callback=print_version, is_eager=True, help="print the version and exit"
    ),
    extension: _Extension = None,
) -> None:
    pass


Sets = Annotated[
    list[str] | None,
    Option(
        "--set",
        metavar="KEY=VALUE",
        help='set a key, for example supply.pressure="3 bar"; repeat for several',
    ),
]
RecordingOption = Annotated[
    bool | None, Option("--rrd/--no-rrd", help="write recording.rrd; by default where rerun is installed")
]
Rate = Annotated[str | None, Option(help='samples per second in the Rerun file, for example "200 Hz"')]
Threads = Annotated[int, Option(help="number of threads; 0: all of this machine")]
Workers = Annotated[int, Option(help="number of processes instead of threads")]
Scheduler = Annotated[str, Option(help="address of a running Dask cluster")]
Plain = Annotated[
    bool, Option("--plain", help="walk until strides settle instead of solving for the settled stride")
]
_EVERY = 10.0  # between two lines of progress where no terminal is [s]
_MOST_WORKERS = 4096
_MOST_SHORT = 9  # characters of a cell that is not broken in a table of whole names
_GAP = 2  # between two columns of a table
_QUANTITY = re.compile(r"(?<=\d) (?=[^\W\d]{1,3}\b)")  # between a number and its unit
_STYLES = {"✓": "bold green", "!": "bold yellow", "✗": "bold red", "?": "bold"}
_WHOLE = ("{", "[", '"', "|")  # begin lines of JSON, and rows of a table: no prose
_SPELLED = str.maketrans(  # for a terminal that does not know them
    {"✓": "+", "✗": "x", "−": "-", "–": "-", "·": "*", "°": " deg", "≥": ">=", "≤": "<=", "×": "x", "²": "^2"}
    | {"…": "...", "→": "->"}
)
Scenario = Annotated[str, Argument(help="name of a shipped scenario, or a TOML file")]


def drawn(rrd: bool | None) -> bool:
    """Whether a Rerun recording is written: without an option, if its library is installed."""
    from afo_sim.common import installed

    return installed("rerun") if rrd is None else rrd


def one_group(body: Callable[[Mixed], None]) -> Callable[..., None]:
    """A command whose options are the fields of the dataclass that its body takes."""
    (parameter,) = inspect.signature(body, eval_str=True).parameters.values()

    @functools.wraps(body)
    def command(**given: object) -> None:
        body(parameter.annotation(**given))

    command.__dict__["__signature__"] = inspect.signature(parameter.annotation)
    return command


def picked(options: object, *names: str) -> JsonDict:
    """Some of a command's options by their names."""
    return {name: getattr(options, name) for name in names}


def read_sets(
    sets: list[str] | None, field: str = "--set", example: str = 'supply.pressure="3 bar"'
) -> JsonDict:
    """`--set key=value` options as dotted keys and values; a value is TOML, or else plain text."""
    values: JsonDict = {}
    for text in sets or []:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise InputError("is not KEY=VALUE", field=field, value=text, allowed=example)
        try:
            values[key.strip()] = parse_toml(f"value = {value}")["value"]
        except ValueError:
            values[key.strip()] = value.strip()
    return values


def hertz_of(text: str) -> float:
    """A rate given on the command line [Hz]."""
    return quantity("--rate", text, "Hz", above=0.0)


def short_lived() -> None:
    """Spare a process that ends soon the search for garbage among all that is imported: 0.2 s of a run."""
    gc.set_threshold(100_000)


@contextmanager
def watching(live: bool) -> Iterator[Function | None]:
    """A viewer that shows a run live, or None."""
    if not live:
        yield None
        return
    from afo_sim.show import live_viewer

    with live_viewer() as watch:
        yield watch


def quantity(field: str, text: str, unit: str, **bounds: float) -> float:
    """A quantity given on the command line, in SI `unit` and its bounds; what is wrong names the option."""
    from afo_sim.description import Quantity

    asked = Quantity(unit, **bounds, exact=True)  # type: ignore[arg-type]  # of whose fields only bounds
    try:
        return asked.read(text)
    except ValueError as error:
        allowed = asked.span if bounds else ""
        raise InputError(str(error), field=field, value=text, allowed=allowed) from None


def check_counts(threads: int, workers: int) -> None:
    """Refuse numbers of threads and processes that no machine has."""
    for option, number in (("--threads", threads), ("--workers", workers)):
        if not 0 <= number <= _MOST_WORKERS:
            raise InputError("is out of range", field=option, value=number, allowed=f"1 to {_MOST_WORKERS}")


def check_side(side: str | None) -> None:
    """Refuse a side that no leg has."""
    if side is not None and side not in ("right", "left"):
        raise unknown(side, ("right", "left"), field="--side")


def check_changed(choice: str, dry_run: bool) -> None:
    """Refuse a way to deal with changes that there is not, or that a dry run would not stop at saying."""
    if choice not in (choices := ("refuse", "restart", "continue")):
        allowed = ", ".join(choices)
        raise InputError("is not a valid choice", field="--if-changed", value=choice, allowed=allowed)
    if dry_run and choice != "refuse":
        problem = "would change the folder, but --dry-run changes nothing"
        raise InputError(problem, field="--if-changed", value=choice, allowed="one of the two")


def duration(seconds: float) -> str:
    """A time in words."""
    for limit, unit, word in ((120.0, 1.0, "s"), (7200.0, 60.0, "min"), (172_800.0, 3600.0, "h")):
        if seconds < limit:
            number = seconds / unit
            return f"{number:.0f} {word}" if number >= 10.0 else f"{number:.2g} {word}"
    return f"{seconds / 86_400:.3g} days"


@contextmanager
def progress(title: str) -> Iterator[Callable[..., None]]:
    """A line on the terminal that moves while something takes time; elsewhere a line every 10 s."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    console = Console(stderr=True)
    if not console.is_terminal:
        with _plain_progress(title) as report:
            yield report
        return
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(title, total=None)

        def move(done: int, total: int, what: str = "simulating") -> None:
            progress.update(task, description=what, completed=done, total=total or None)

        yield move


@contextmanager
def _plain_progress(title: str) -> Iterator[Callable[..., None]]:
    """Lines for a log file, from a thread, since what takes time need not report."""
    state, over, began = [title], threading.Event(), time.monotonic()

    def report(done: int, total: int, what: str = "simulating") -> None:
        state[0] = f"{what}, {done / total:.0%}" if total else what

    def say() -> None:
        while not over.wait(_EVERY):
            print(f"afo-sim: {state[0]} ({duration(time.monotonic() - began)})", file=sys.stderr, flush=True)

    thread = threading.Thread(target=say, daemon=True)
    thread.start()
    try:
        yield report
    finally:
        over.set()
        thread.join()


def print_line(
    text: object = "", *, hang: int = 2, badge: int = 0, style: str = "", file: TextIO | None = None
) -> None:
    """A text wrapped to the terminal's width, with an indent; unwrapped for a file or program."""
    from rich.console import Console
    from rich.text import Text

    out, words = file or sys.stdout, str(text)
    shown = Text("\n".join(part for line in words.split("\n") for part in wrapped(line, hang)), style=style)
    if badge:
        shown.stylize(_STYLES.get(words[0], ""), 0, badge)
    encoding = getattr(out, "encoding", None) or "utf-8"
    try:
        shown.plain.encode(encoding)
    except UnicodeEncodeError:
        spelled = shown.plain.replace(" °", "°").translate(_SPELLED)
        print(spelled.encode(encoding, "replace").decode(encoding), file=out)
        return
    if out.isatty():
        Console(file=out, highlight=False).print(shown, soft_wrap=True)
    else:
        print(shown.plain, file=out)


def wrapped(text: str, hang: int) -> Iterator[str]:
    """The lines of a text at the terminal's width, further ones indented; whole for a file or program."""
    width = shutil.get_terminal_size().columns
    free = not sys.stdout.isatty() and not os.environ.get("COLUMNS")
    if free or len(text) <= width or text.lstrip().startswith(_WHOLE):
        yield text
        return
    for line in textwrap.wrap(
        _QUANTITY.sub("\N{NO-BREAK SPACE}", text),
        max(width, hang + 20),
        subsequent_indent=" " * (len(text) - len(text.lstrip()) + hang),
        break_long_words=False,
        break_on_hyphens=False,
    ):
        yield line.replace("\N{NO-BREAK SPACE}", " ")


def print_tables(tables: Iterable[tuple[str, list[str], Rows]], lines: Iterable[str] = ()) -> None:
    """Tables, and lines below them."""
    for title, header, rows in tables:
        print_table(title, header, rows)
    for line in lines:
        print_line(line)


def print_table(
    title: str, header: list[str], rows: Rows, droppable: int | None = None, *, whole_names: bool = False
) -> None:
    """Print aligned columns; long cells wrap, and columns that do not fit follow below."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    class _Console(Console):
        def on_broken_pipe(self) -> None:  # rich would end with exit code 1, that of a failed check
            raise BrokenPipeError

    console = _Console(width=None if droppable is None else shutil.get_terminal_size((200, 24)).columns)
    if droppable is not None and console.width < 140:
        header = header[:droppable] + header[droppable + 1 :]
        rows = [row[:droppable] + row[droppable + 1 :] for row in rows]
    columns = [[name, *cells] for name, *cells in zip(header, *rows, strict=True)]
    whole = [max(map(len, column)) for column in columns]
    least = [max(max(map(len, cell.split()), default=0) for cell in column) for column in columns]
    for k in range(len(header)):
        if k == 0 and (whole_names or len(header) == 2):
            least[k] = whole[k]
        elif whole_names and max(map(len, columns[k][1:]), default=0) <= _MOST_SHORT:
            least[k] = max(map(len, (*header[k].split(), *columns[k][1:])))
    look: Keywords = {"title_justify": "left", "title_style": "bold", "pad_edge": False, "box": None}
    for number, block in enumerate(_blocks(least, console.width)):
        table = Table(title=escape(title) if number == 0 else None, show_header=any(header), **look)
        for k, width in zip(block, _widths(block, least, whole, console.width), strict=True):
            table.add_column(escape(header[k]), overflow="fold", width=width)
        for row in rows:
            table.add_row(*(escape(row[k]) for k in block))
        console.print(table)
        console.print()


def _blocks(least: list[int], room: int) -> list[list[int]]:
    """Columns that fit side by side at their least widths; further ones below, with the first repeated."""
    blocks = [[0]]
    for k in range(1, len(least)):
        if len(blocks[-1]) > 1 and sum(least[i] + _GAP for i in (*blocks[-1], k)) - _GAP > room:
            blocks.append([0])
        blocks[-1].append(k)
    return blocks


def _widths(block: list[int], least: list[int], whole: list[int], room: int) -> list[int]:
    """Widths of a block's columns: the least ones, and what is left in equal parts."""
    widths = {k: least[k] for k in block}
    spare = room - sum(widths.values()) - _GAP * (len(block) - 1)
    if spare < 0:  # a word that is longer than the terminal is wide is folded
        widest = max(block, key=lambda k: widths[k])
        widths[widest] = max(widths[widest] + spare, 1)
    for number, k in enumerate(sorted(block, key=lambda k: whole[k] - least[k])):
        more = min(whole[k] - least[k], max(spare, 0) // (len(block) - number))
        widths[k] += more
        spare -= more
    return [widths[k] for k in block]

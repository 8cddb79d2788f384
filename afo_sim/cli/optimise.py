"""Command of the design search: optimise."""

import pathlib
from typing import TYPE_CHECKING, Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import (
    Scheduler,
    Threads,
    Workers,
    check_changed,
    check_counts,
    duration,
    print_table,
    progress,
)

if TYPE_CHECKING:
    from afo_sim.study.search.runner import Opened

CHANGED = ("refuse", "restart")


@app.command()
def optimise(
    source: Annotated[str, typer.Argument(metavar="SEARCH", help="a shipped search's name, or a TOML file")],
    out: Annotated[
        pathlib.Path | None, typer.Option(help="folder to write to; runs/<search> by default")
    ] = None,
    threads: Threads = 0,
    workers: Workers = 0,
    scheduler: Scheduler = "",
    if_changed: Annotated[
        str, typer.Option(help="where search file or code changed: refuse or restart")
    ] = "refuse",
    dry_run: Annotated[bool, typer.Option("--dry-run", help="say what it would take, and stop")] = False,
) -> None:
    """Search the design that serves an objective best within limits; started again, it goes on."""
    check_changed(if_changed, CHANGED, dry_run)
    check_counts(threads, workers)
    with progress("reading, compiling the muscles") as report:
        from afo_sim.study.runner import processors
        from afo_sim.study.search import answers, plan, runner, words

        search = plan.read(source)
        folder = out or pathlib.Path("runs") / search.file.stem
        opened = runner.open_search(search, folder, if_changed)  # type: ignore[arg-type]
        threads = threads or processors()
        print(_told(opened, workers or (1 if scheduler else threads)))
        if dry_run:
            return
        with answers.pool(threads, workers, scheduler) as who:
            best = runner.run(
                opened,
                who,
                lambda p: report(p.generations, p.most, f"{p.generations} of {p.most} generations"),
            )
    for title, header, rows in words.tables(best):
        print_table(title, header, rows)
    for line in words.statement(best):
        print(line)
    print(f"written to {folder}; run this design with: afo-sim run {folder / 'best.toml'}")


def _told(opened: "Opened", workers: int) -> str:
    if opened.finished:
        return "the search is finished: nothing is computed"
    search = opened.search
    count = search.generations * opened.cases
    time = duration(count * opened.seconds / workers)
    return f"up to {search.generations} generations of {opened.cases} cases; about {time} in all"

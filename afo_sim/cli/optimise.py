"""Command of the design search: optimise."""

import pathlib
from typing import TYPE_CHECKING, Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import (
    Plain,
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

CHANGED = ("refuse", "restart", "continue")


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
        str, typer.Option(help="where search file or code changed: refuse, restart or continue")
    ] = "refuse",
    plain: Plain = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="say what it would take, and stop")] = False,
) -> None:
    """Search the design that serves an objective best within limits; started again, it goes on."""
    check_changed(if_changed, CHANGED, dry_run)
    check_counts(threads, workers)
    with progress("reading, compiling the muscles") as report:
        from afo_sim.common.writing import replacing
        from afo_sim.show.numbers import unseen
        from afo_sim.show.search_figure import draw_search
        from afo_sim.study.pool import pool, processors
        from afo_sim.study.search import plan, runner, store
        from afo_sim.study.search.best import statement, tables

        search = plan.read(source)
        search = search.walked() if plain else search
        folder = out or pathlib.Path("runs") / search.file.stem
        opened = runner.open_search(search, folder, if_changed)  # type: ignore[arg-type]
        threads = threads or processors()
        print(_plan_text(opened, workers or (1 if scheduler else threads)))
        if dry_run:
            return
        with pool(threads, workers, scheduler) as who:
            best = runner.run(
                opened,
                who,
                lambda p: report(p.generations, p.most, f"{p.generations} of {p.most} generations"),
            )
        figure = folder / store.FIGURE
        if not opened.finished or not figure.is_file():
            with replacing(figure) as path:
                draw_search(opened.problem, opened.units, store.read_designs(folder), path)
    for title, header, rows in tables(best):
        print_table(title, header, rows)
    for line in statement(best):
        print(line)
    for line in unseen(opened.scenario, opened.problem.aim.metrics):
        print(line)
    print(f"written to {folder}; run this design with: afo-sim run {folder / 'best.toml'}")


def _plan_text(opened: "Opened", workers: int) -> str:
    if opened.finished:
        return "the search is finished: nothing is computed"
    search = opened.search
    count = search.starts * search.generations * opened.cases
    time = duration(count * opened.seconds / workers)
    each = f"up to {search.generations} generations of {opened.cases} cases"
    starts = f"{search.starts} starts, each " if search.starts > 1 else ""
    return f"{starts}{each}: {count} runs; about {time} in all"

"""Command that finds the smallest component, or the least pressure, that meets limits: size."""

import json
import pathlib
from typing import TYPE_CHECKING, Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import Scenario, Sets, Threads, check_counts, print_table, progress, read_sets
from afo_sim.cli.overwriting import OTHER, check_folder
from afo_sim.cli.printed_run import print_line
from afo_sim.common.errors import InputError

if TYPE_CHECKING:
    from afo_sim.study.sizing.sizes import Request

KIND = "sizing"


@app.command("size")
def size_command(
    kind: Annotated[str, typer.Argument(help="pressure, valve, tube, supply or muscle")],
    scenario: Scenario,
    sets: Sets = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(help='as "toe_clearance >= 10 mm"; of walking the toe clearance that its limits want'),
    ] = None,
    cadence: Annotated[float | None, typer.Option(help="of walking [steps/min]; its own by default")] = None,
    at: Annotated[str | None, typer.Option(help='pressure: does this one suffice, as "3 bar"')] = None,
    between: Annotated[
        tuple[str, str] | None,
        typer.Option(help='pressure: lowest and highest that are tried, as "1 bar" "4 bar"'),
    ] = None,
    chamber: Annotated[str | None, typer.Option(help="valve: of which; the first that is filled")] = None,
    side: Annotated[str | None, typer.Option(help="valve: inlet, outlet or both; both by default")] = None,
    proportional: Annotated[
        bool, typer.Option("--proportional", help="valve: try proportional ones, too")
    ] = False,
    length: Annotated[str | None, typer.Option(help='tube: needed: of each chamber, as "2 m"')] = None,
    hours: Annotated[float | None, typer.Option(help="supply: that it lasts without a pause")] = None,
    strides: Annotated[float | None, typer.Option(help="supply: that it lasts without a pause")] = None,
    group: Annotated[str | None, typer.Option(help="muscle: of which group; the first by default")] = None,
    count: Annotated[str | None, typer.Option(help='muscle: how many, as "3" or "1-4"')] = None,
    out: Annotated[pathlib.Path | None, typer.Option(help="folder to write to; none by default")] = None,
    threads: Threads = 0,
    force: Annotated[bool, typer.Option("--force", help="replace another sizing")] = False,
) -> None:
    """Smallest valve, tube, supply or muscle, or least pressure, that meets limits; does 3 bar suffice?"""
    values = read_sets(sets)
    check_counts(threads, 0)
    options = {
        "cadence": cadence,
        "at": at,
        "between": between,
        "chamber": chamber,
        "side": side,
        "proportional": proportional or None,
        "length": length,
        "hours": hours,
        "strides": strides,
        "group": group,
        "count": count,
    }
    with progress("reading, compiling the muscles") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.study.sizing.sizes import requested

        asked = requested(kind, scenario, values or None, limits=limit or (), **options)
        if out is not None:
            _check(out, asked, force=force)
            check_writable(out)
        found = asked.run(threads, report)
        if out is not None:
            from afo_sim.show.size_figure import draw_size

            found.save(out, draw=draw_size)
    if found.asked is None:
        print_table(*found.table, whole_names=True)
        for line in found.remarks:
            print_line(line)
    print_line(f"{found.answer}.")
    if out is not None:
        print(f"written to {out}: size.png, size.csv, size.json")
    if not found.holds:
        raise typer.Exit(1)


def _check(folder: pathlib.Path, asked: "Request", *, force: bool) -> None:
    """Refuse a folder that holds the answer to another question."""
    check_folder(folder, KIND)
    if force or not (folder / "size.json").is_file():
        return
    try:
        before = json.loads((folder / "size.json").read_text(encoding="utf-8"))["request"]
    except (OSError, ValueError, KeyError, TypeError):
        before = None
    if before != asked.to_json():
        problem = "holds the answer to another question"
        allowed = f"--force, which replaces it, or {OTHER}"
        raise InputError(problem, field="out", value=str(folder), allowed=allowed)

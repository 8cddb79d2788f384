"""The command that answers what is small enough: size."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from afo_sim.cli import common
from afo_sim.cli.common import print_line as print
from afo_sim.cli.overwriting import check_same


@dataclass(frozen=True)
class _Sizing:
    """Options of `size`: what is sized, by which limits."""

    kind: Annotated[str, Argument(help="pressure, valve, tube, supply or muscle")]
    scenario: common.Scenario
    sets: common.Sets = None
    limit: Annotated[
        list[str] | None,
        Option(
            help='a requirement such as "toe_clearance >= 10 mm"; by default of a walk its target clearance'
        ),
    ] = None
    cadence: Annotated[float | None, Option(help="cadence [steps/min]; the scenario's by default")] = None
    at: Annotated[str | None, Option(help='pressure: whether this one suffices, such as "3 bar"')] = None
    between: Annotated[tuple[str, str] | None, Option(help='pressure: range to try, "1 bar" "4 bar"')] = None
    chamber: Annotated[str | None, Option(help="valve: its chamber; by default the first one filled")] = None
    side: Annotated[str | None, Option(help="valve: inlet, outlet or both; both by default")] = None
    proportional: Annotated[bool, Option("--proportional", help="valve: proportional valves, too")] = False
    length: Annotated[str | None, Option(help='tube (required): length to each chamber, as "2 m"')] = None
    hours: Annotated[float | None, Option(help="supply: that it lasts without a pause")] = None
    strides: Annotated[float | None, Option(help="supply: that it lasts without a pause")] = None
    group: Annotated[str | None, Option(help="muscle: group to size; the first by default")] = None
    count: Annotated[str | None, Option(help='muscle: number in parallel, such as "3" or "1-4"')] = None
    out: Annotated[Path | None, Option(help="output folder; none by default")] = None
    threads: common.Threads = 0
    force: Annotated[bool, Option("--force", help="overwrite another sizing in that folder")] = False


@common.app.command("size")
@common.one_group
def size_command(sizing: _Sizing) -> None:
    """Find the smallest component or pressure that suffices. Or check whether 3 bar suffice."""
    values = common.read_sets(sizing.sets)
    common.check_counts(sizing.threads, 0)
    options = common.picked(
        sizing, "cadence", "at", "between", "chamber", "side", "length", "hours", "strides"
    )
    options |= common.picked(sizing, "group", "count") | {"proportional": sizing.proportional or None}
    with common.progress("reading the files, compiling the muscles") as report:
        from afo_sim.study import requested

        asked = requested(sizing.kind, sizing.scenario, values or None, limits=sizing.limit or (), **options)
        if sizing.out is not None:
            now, problem = {"request": asked.to_json()}, "holds the answer to another question"
            check_same(sizing.out, "sizing", "size.json", now, problem, force=sizing.force)
        found = asked.run(sizing.threads, report)
        if sizing.out is not None:
            from afo_sim.show import draw_size

            found.save(sizing.out, draw=draw_size)
    if found.asked is None:
        common.print_table(*found.table, whole_names=True)
        for line in found.remarks:
            print(line)
    print(f"{found.answer}.")
    if sizing.out is not None:
        print(f"written to {sizing.out}: size.png, size.csv, size.json")
    if not found.holds:
        raise typer.Exit(1)

"""Commands on descriptions: list, check."""

import pathlib
from typing import Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import print_table, progress

LISTS = (
    "muscles", "laws", "frictions", "scenarios", "legs", "orthoses", "valves", "tubes", "sources",
    "regulators", "patients", "shoes", "gaits", "sensors", "sweeps", "searches", "uncertainties",
)  # fmt: skip


@app.command("list")
def list_command(
    what: Annotated[str, typer.Argument(help="|".join(LISTS) + ", or the name of one")] = "",
) -> None:
    """List what there is, one line each; or one of them whole, with every number, its unit and source."""
    with progress("reading"):
        from afo_sim.description.catalogue import entries, product

        if what and what not in LISTS:
            tables = product(what)
        else:
            columns = ("name", "what it is")
            tables = [(kind, columns, entries(kind)) for kind in ([what] if what else LISTS)]
    for title, header, rows in tables:
        print_table(title, list(header), [list(row) for row in rows] or [["–", "none is shipped yet"]])


@app.command()
def check(
    file: Annotated[
        pathlib.Path, typer.Argument(help="a TOML description, MJCF, URDF or gait CSV; or a shipped orthosis")
    ],
) -> None:
    """Doctor for your own files: says what is wrong, or what was understood."""
    with progress("checking"):
        from afo_sim.cli.doctor.kinds import check_file

        findings = check_file(file)
    print_table(str(file), ["", "found"], [list(row) for row in findings])
    print("good")

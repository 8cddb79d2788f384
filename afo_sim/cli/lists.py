"""Commands on descriptions: list, check."""

import pathlib
from typing import Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import print_table, progress
from afo_sim.common.errors import InputError, nearest_name

LISTS = (
    "muscles", "laws", "scenarios", "legs", "orthoses", "valves", "patients", "gaits", "sweeps", "searches",
)  # fmt: skip


@app.command("list")
def list_command(
    what: Annotated[str, typer.Argument(help="|".join(LISTS))] = "",
) -> None:
    """What there is, with one line each."""
    if what and what not in LISTS:
        raise InputError(
            "cannot be listed",
            field="list",
            value=what,
            allowed=", ".join(LISTS),
            nearest=nearest_name(what, LISTS),
        )
    from afo_sim.description.catalogue import entries

    for kind in [what] if what else LISTS:
        rows = [list(row) for row in entries(kind)]
        print_table(kind, ["name", "what it is"], rows or [["–", "none is shipped yet"]])


@app.command()
def check(
    file: Annotated[pathlib.Path, typer.Argument(help="a TOML description, MJCF, URDF or gait CSV")],
) -> None:
    """Doctor for your own files: says what is wrong, or what was understood."""
    with progress("checking"):
        from afo_sim.doctor import check_file

        findings = check_file(file)
    print_table(str(file), ["", "found"], [list(row) for row in findings])
    print("good")

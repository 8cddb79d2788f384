"""Command that draws a design: draw."""

import pathlib
from typing import Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import progress, quantity
from afo_sim.common.errors import InputError


@app.command()
def draw(
    orthosis: Annotated[
        str, typer.Argument(help="a shipped orthosis or scenario, or the TOML file or folder of one")
    ],
    leg: Annotated[
        str | None, typer.Option(help="a shipped leg, or its TOML file; the scenario's own by default")
    ] = None,
    pressure: Annotated[
        str | None, typer.Option(help='of the muscles, for example "4 bar"; the supply\'s by default')
    ] = None,
    out: Annotated[
        list[pathlib.Path] | None,
        typer.Option(help="file to write, png, pdf, svg or rrd, again for more; NAME-design.pdf by default"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="replace files that are there")] = False,
) -> None:
    """The design picture: the orthosis to scale with dimensions, and what its muscles do over the angle."""
    full = None if pressure is None else quantity("--pressure", pressure, "Pa")
    if full is not None and not 0.0 < full <= 2e6:
        raise InputError(
            "is out of range", field="--pressure", value=pressure, allowed="above 0 bar, to 20 bar"
        )
    with progress("reading") as report:
        from afo_sim.model.design import design
        from afo_sim.show.drawing import check_files, write_drawing

        paths = list(out or [])
        check_files(paths, force=force)
        found = design(orthosis, leg=leg, pressure=full)
        if not paths:
            paths = [pathlib.Path(f"{found.built.scenario.orthosis.name or 'orthosis'}-design.pdf")]
            check_files(paths, force=force)
        for done, path in enumerate(paths):
            report(done, len(paths), "drawing")
            write_drawing(found, path)
    for warning in found.warnings:
        print(f"warning: {warning}")
    for path in paths:
        print(f"written to {path}")

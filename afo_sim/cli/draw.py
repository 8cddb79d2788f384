"""Command that draws a design: draw."""

import pathlib
from collections.abc import Callable
from typing import Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import progress, quantity
from afo_sim.common.errors import InputError, unknown

Paths = list[pathlib.Path]
Report = Callable[[int, int, str], None]


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
        typer.Option(
            help="file to write, png, pdf, svg or, of a design, rrd, again for more; NAME-design.pdf or "
            "NAME-air.pdf by default"
        ),
    ] = None,
    view: Annotated[
        str, typer.Option(help='"design", or "air": a schematic of the air path, from source to muscles')
    ] = "design",
    force: Annotated[bool, typer.Option("--force", help="replace files that are there")] = False,
) -> None:
    """The design picture: the orthosis to scale with dimensions, and what its muscles do over the angle.

    With --view air a schematic of its air path, with the narrowest part on the way to each muscle.
    """
    full = None if pressure is None else quantity("--pressure", pressure, "Pa")
    if full is not None and not 0.0 < full <= 2e6:
        raise InputError(
            "is out of range", field="--pressure", value=pressure, allowed="above 0 bar, to 20 bar"
        )
    paths = list(out or [])
    with progress("reading") as report:
        from afo_sim.show.drawing import AIR, VIEWS

        if view not in VIEWS:
            raise unknown(view, VIEWS, field="--view", problem="is no view")
        draw_view = _draw_air if view == AIR else _draw_design
        paths, told = draw_view(orthosis, leg, full, paths, force, report)
    for line in told:
        print(line)
    for path in paths:
        print(f"written to {path}")


def _draw_design(
    orthosis: str, leg: str | None, full: float | None, paths: Paths, force: bool, report: Report
) -> tuple[Paths, list[str]]:
    """The files that are written, and what is to be told."""
    from afo_sim.model.design import design
    from afo_sim.show.drawing import check_files, write_drawing

    check_files(paths, force=force)
    found = design(orthosis, leg=leg, pressure=full)
    if not paths:
        paths = [pathlib.Path(f"{found.built.scenario.orthosis.name or 'orthosis'}-design.pdf")]
        check_files(paths, force=force)
    for done, path in enumerate(paths):
        report(done, len(paths), "drawing")
        write_drawing(found, path)
    return paths, [f"warning: {warning}" for warning in found.warnings]


def _draw_air(
    orthosis: str, leg: str | None, full: float | None, paths: Paths, force: bool, report: Report
) -> tuple[Paths, list[str]]:
    """The files that are written, and each chamber's ways."""
    from afo_sim.show.air_drawing import scheme_of, ways, write_air
    from afo_sim.show.drawing import AIR, check_files, refuse_leg

    refuse_leg(leg, "--leg")
    check_files(paths, force=force, view=AIR)
    scheme = scheme_of(orthosis, full)
    if not paths:
        paths = [pathlib.Path(f"{scheme.name}-air.pdf")]
        check_files(paths, force=force, view=AIR)
    for done, path in enumerate(paths):
        report(done, len(paths), "drawing")
        write_air(scheme, path)
    return paths, ways(scheme)

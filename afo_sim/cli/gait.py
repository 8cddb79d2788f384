"""Commands on walking data: gait import, gait show."""

import pathlib
from typing import Annotated

import typer

from afo_sim.cli.apps import gait_app
from afo_sim.cli.common import print_table, progress
from afo_sim.common.errors import InputError


@gait_app.command("import")
def gait_import_command(
    files: Annotated[list[pathlib.Path], typer.Argument(help=".mot, .sto, .trc, .c3d of one trial")],
    out: Annotated[pathlib.Path, typer.Option(help="CSV to write; a picture of the same name goes with it")],
    mass: Annotated[str | None, typer.Option(help='of the body, for example "72 kg"')] = None,
    side: Annotated[str, typer.Option(help="right|left")] = "right",
    stride: Annotated[int | None, typer.Option(help="which stride; the first found by default")] = None,
    marker: Annotated[
        list[str] | None,
        typer.Option(metavar="ROLE=NAME[,NAME]", help="hip, knee, ankle, heel or toe; the midpoint of two"),
    ] = None,
    plate: Annotated[list[str] | None, typer.Option(help="force plate to look at; all by default")] = None,
    forward: Annotated[str | None, typer.Option(help="axis of walking: x, -x, y, …")] = None,
    up: Annotated[str | None, typer.Option(help="axis upward")] = None,
    angles: Annotated[str | None, typer.Option(help="deg|rad, where the header is silent or wrong")] = None,
    belt_speed: Annotated[str, typer.Option(help="of the treadmill")] = "0 m/s",
    cutoff: Annotated[str, typer.Option(help="of the low-pass; 0 Hz leaves the data alone")] = "6 Hz",
    thigh: Annotated[str | None, typer.Option(help="hip to knee, if no file has the ankle's place")] = None,
    shank: Annotated[str | None, typer.Option(help="knee to ankle, likewise")] = None,
    hip: Annotated[
        tuple[str, str] | None,
        typer.Option(help="from the pelvis' origin; -6.3 cm -7.2 cm by default", metavar="FORWARD UP"),
    ] = None,
    ankle_height: Annotated[str | None, typer.Option(help="above the floor, foot flat")] = None,
    ankle_zero: Annotated[str, typer.Option(help="flat (foot level where flat) or file")] = "flat",
    source: Annotated[str, typer.Option(help="where the data come from")] = "",
    licence: Annotated[str, typer.Option(help="what one may do with them")] = "not stated",
) -> None:
    """Cut one stride from a walking trial, and write it as gait CSV with a picture of what was understood."""
    given = {name: value for name, value in locals().items() if name not in ("files", "out")}
    with progress("reading the trial"):
        from afo_sim.common.writing import check_writable, together
        from afo_sim.gait.file import write
        from afo_sim.gait.readers.importing import import_gait
        from afo_sim.gait.readers.options import read_options
        from afo_sim.show.gait_figure import draw_gait

        choices = read_options(given)
        if out.suffix.lower() != ".csv":
            raise InputError("is no CSV", field="--out", value=str(out), allowed="a name ending in .csv")
        check_writable(out.parent)
        done = import_gait(files, choices)
        picture = out.with_suffix(".png")
        with together(out.parent) as scratch:
            draw_gait(done.cycle, scratch / picture.name, done)
            write(scratch / out.name, done.cycle)
    print_table(str(out), ["what", "found"], [list(row) for row in done.findings()])
    print(f"written to {out}; look at {picture} before you believe it")


@gait_app.command("show")
def gait_show_command(
    gait: Annotated[str, typer.Argument(help="a gait CSV, or a shipped name")],
    out: Annotated[pathlib.Path | None, typer.Option(help="picture to write: .png, .pdf or .svg")] = None,
) -> None:
    """The key numbers of a gait cycle, and its picture."""
    with progress("reading"):
        from afo_sim.common import assets
        from afo_sim.common.writing import check_writable
        from afo_sim.gait.checks import findings
        from afo_sim.gait.file import read
        from afo_sim.show.gait_figure import draw_gait

        cycle = read(assets.find_gait(gait))
        if out is not None:
            check_writable(out.parent)
            draw_gait(cycle, out)
    print_table(gait, ["what", "found"], [list(row) for row in findings(cycle)])
    if out is not None:
        print(f"written to {out}")

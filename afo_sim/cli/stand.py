"""The command of the muscle test stand: stand."""

import pathlib
from typing import Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import print_table, progress, read_sets
from afo_sim.cli.overwriting import check_folder


@app.command("stand")
def stand_command(
    test: Annotated[
        str, typer.Argument(help="isobaric|isotonic|isometric|step|release, or all (the first three)")
    ],
    muscles: Annotated[list[str], typer.Argument(help="shipped muscles, or TOML files")],
    law: Annotated[list[str] | None, typer.Option(help="force law; may be given several times")] = None,
    friction: Annotated[list[str] | None, typer.Option(help="friction, or none; several times")] = None,
    pressure: Annotated[
        list[str] | None, typer.Option(help='gauge, "3 bar"; several: curves, or from and to')
    ] = None,
    load: Annotated[list[str] | None, typer.Option(help='"200 N" or "20 kg"; several times')] = None,
    contraction: Annotated[list[str] | None, typer.Option(help='0.1 or "10 %"; several times')] = None,
    length: Annotated[list[str] | None, typer.Option(help="of the braid, instead of contraction")] = None,
    valve: Annotated[str | None, typer.Option(help="valve of step (mh1 by default) and release")] = None,
    supply: Annotated[str | None, typer.Option(help="pressure that there is; the muscle's limit")] = None,
    time: Annotated[str | None, typer.Option(help="of one way up or down; slow by default")] = None,
    static: Annotated[bool, typer.Option("--static", help="the formula instead of the rig")] = False,
    compare: Annotated[
        pathlib.Path | None, typer.Option(help="CSV of measured points to lay over it")
    ] = None,
    sets: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help='of the muscle: damping="1e-4 m^2*s"'),
    ] = None,
    out: Annotated[pathlib.Path, typer.Option(help="folder, .csv or .parquet")] = pathlib.Path("runs/stand"),
    rrd: Annotated[bool, typer.Option("--rrd/--no-rrd", help="write a Rerun recording")] = True,
) -> None:
    """The muscle test stand: static characteristics, steps, quick release, measured points beside them."""
    given = {"pressure": pressure, "load": load, "contraction": contraction, "length": length}
    values = {name: tuple(texts or ()) for name, texts in given.items()}
    with progress("compiling the muscles") as report:
        from afo_sim.bench import command

        laws, frictions = tuple(law or ()), tuple(friction or ())
        told = read_sets(sets, example='damping="1e-4 m^2*s"')
        asked = command.Request(
            test,
            tuple(muscles),
            laws,
            frictions,
            values,
            valve,
            supply,
            time,
            static,
            compare,
            told,
            out,
            rrd,
        )
        check_folder(out)
        answers = command.answer(asked, report)
    for answer in answers:
        for title, header, rows in command.tables(answer):
            print_table(title, header, rows)
        for line in command.remarks(answer):
            print(line)

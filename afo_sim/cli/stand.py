"""The command of the muscle test stand: stand."""

import pathlib
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import print_table, progress, read_sets
from afo_sim.cli.overwriting import check_folder

if TYPE_CHECKING:
    from afo_sim.lab.stand import Stand


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
    with progress("compiling the muscles") as report:
        from afo_sim.common.writing import check_writable
        from afo_sim.lab.stand import stand
        from afo_sim.show.stand_files import target, write_stand_files

        place = target(out, test)
        check_folder(place.folder)
        check_writable(place.folder)
        tests = stand(
            test,
            muscles,
            law=law,
            friction=friction,
            pressure=pressure,
            load=load,
            contraction=contraction,
            length=length,
            valve=valve,
            supply=supply,
            time=time,
            static=static,
            compare=compare,
            sets=read_sets(sets, example='damping="1e-4 m^2*s"'),
            report=report,
        )
        written = {}
        for kind in tests.kinds:
            report(0, 0, f"writing {kind}")
            written[kind] = write_stand_files(tests.of(kind), target(out, kind), rrd=rrd)
    for kind, files in written.items():
        _print_trials(tests.of(kind), files)


def _print_trials(tests: "Stand", files: Sequence[pathlib.Path]) -> None:
    from afo_sim.lab.stand_table import printed

    for trial in tests.trials:
        print_table(*printed(trial))
    for line in _remarks(tests):
        print(line)
    wall = sum(trial.wall_seconds for trial in tests.trials)
    print(f"{wall:.1f} s; written: {', '.join(map(str, files))}")


def _remarks(tests: "Stand") -> Iterator[str]:
    """Lines below the tables: S0's lines, limits that were left, errors against measured points."""
    from afo_sim.lab.stand_trial import static_load

    for trial in tests.trials:
        if trial.plan.kind == "isobaric" and trial.plan.muscle.law in ("reynolds_2003", "serres_2009"):
            yield f"{trial.name}: {static_load(trial).text}"
        if trial.plan.kind == "step":
            moving = max(m["still_moving"].value for m in trial.metrics)
            if moving > 1.0:
                yield f"{trial.name}: still moving ({moving:.2g} %) when vented; take a longer --time"
        yield from (f"warning: {warning}" for warning in trial.warnings)
    for trial, compared in zip(tests.trials, tests.compared, strict=False):
        factor, unit = (100.0, "%") if trial.plan.kind == "isotonic" else (1.0, "N")
        left = f"; {compared.left_out} points lie on no curve" if compared.left_out else ""
        yield (
            f"{trial.name} against {compared.name}: {factor * compared.rms:.3g} {unit} RMS, worst "
            f"{factor * compared.worst:.3g} {unit}, {len(compared.x)} points{left}"
        )

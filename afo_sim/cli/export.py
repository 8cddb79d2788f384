"""Command that writes a run for other programs: export."""

import pathlib
import sys
from typing import Annotated

import typer

from afo_sim.cli.apps import app
from afo_sim.cli.common import hertz_of, progress
from afo_sim.cli.overwriting import KINDS
from afo_sim.common.errors import InputError

STUDIES = {
    "sweep": "a run's folder: afo-sim replay DIR CASE makes one of a case; results.parquet has all",
    "search": "a run's folder: afo-sim run DIR/best.toml makes one of the best design",
}


@app.command("export")
def export_command(
    folder: Annotated[pathlib.Path, typer.Argument(help="a run's folder, or its recording.parquet")],
    to: Annotated[str | None, typer.Option(help="sto|mot|csv|mat|mjb; that of --out by default")] = None,
    out: Annotated[
        pathlib.Path | None, typer.Option(help="file to write; recording.FORMAT beside the run by default")
    ] = None,
    rate: Annotated[str | None, typer.Option(help='rows a second, "200 Hz"; all by default')] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help='a column, or several as "ankle/*" (sto, csv, mat); all by default'
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="replace files that are there")] = False,
) -> None:
    """A run for OpenSim (sto, mot), spreadsheets (csv), MATLAB and Octave (mat), or MuJoCo (mjb)."""
    hertz = None if rate is None else hertz_of(rate)
    if to is None and out is None:
        raise InputError("is needed", field="--to", allowed="sto, mot, csv, mat, mjb")
    with progress("reading the run") as report:
        from afo_sim.export.exported import export, format_of
        from afo_sim.simulation.recording import read_recording

        if out is None:
            beside = folder if folder.is_dir() else folder.parent
            out = beside / f"recording.{format_of(to or '').name}"
        _check_is_run(folder)
        exported = export(
            read_recording(folder),
            out,
            to,
            rate=hertz,
            columns=column or (),
            force=force,
            report=lambda done, total: report(done, total, "writing"),
        )
    for note in exported.notes:
        print(f"note: {note}", file=sys.stderr)
    for file in exported.files:
        print(f"written to {file}")
    print(f"open it with {exported.opens}")
    if exported.minds:
        print(f"mind: {exported.minds}")


def _check_is_run(folder: pathlib.Path) -> None:
    """Refuse the folder of a study with the way to a run of it."""
    for file, kind in KINDS.items():
        if kind in STUDIES and (folder / file).is_file():
            raise InputError(f"holds a {kind} ({file})", file=folder, allowed=STUDIES[kind])
